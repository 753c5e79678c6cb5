"""The head of rendered scenes, whose motion is known."""

import numpy as np
import pytest
from moved_heads import head_error, scene
from refusals import refusal

from vibrissa.video.camera.pad.filming import film
from vibrissa.video.find.head_finding import find_head


def test_the_head_is_found_where_it_is():
    """The outline's points are good to about half a pixel by hairs; hundreds of them fix the head to a part of that."""
    one = scene(1)
    known, place, turn = head_error(find_head(film(one, 24)), one, 24)
    assert known == 24
    assert place < 0.5
    assert turn < 0.5


@pytest.fixture(scope="module")
def filmed():
    """A head that moves by more than registration reaches."""
    one = scene(1, shift=4e-3, turn=10.0)
    return one, np.concatenate(list(film(one, 40)))


FOREIGN = {
    "black": np.zeros_like,
    "white": lambda frame: np.full_like(frame, 255),
    "bright": lambda frame: np.minimum(frame + 120.0, 255),
    "upside down": lambda frame: frame[::-1],
    "shifted": lambda frame: np.roll(frame, 70, axis=1),
}


@pytest.mark.parametrize("kind", FOREIGN)
def test_the_head_is_found_though_the_first_frame_does_not_show_it(filmed, kind):
    one, frames = filmed
    spoilt = np.concatenate([FOREIGN[kind](frames[:1].squeeze())[None].astype(np.uint8), frames[1:]])
    found = find_head([spoilt[:10], spoilt[10:]])
    assert found.known.tolist() == [False] + [True] * 39
    _, place, turn = head_error(found, one, 40)
    assert place < 0.5
    assert turn < 0.5


def test_frames_before_the_light_goes_on_have_no_head(filmed):
    frames = filmed[1]
    dark = np.random.default_rng(1).integers(0, 4, (20, *frames.shape[1:]), np.uint8)
    found = find_head([np.concatenate([dark, frames])])
    assert found.known.tolist() == [False] * 20 + [True] * 40


def test_a_movie_without_a_body_is_refused():
    for level in (0, 150, 255):
        with refusal("too-few", "head") as caught:
            find_head([np.full((3, 80, 80), level, np.uint8)])
    assert "`start`" in caught.value.remedy


def test_a_head_that_fits_in_no_frame_is_refused():
    """Scenes that have nothing to do with one another: each frame is another wave."""
    row, column = np.mgrid[:240, :320]
    waves = [row < 120 + 60 * np.sin(column / k) for k in (7, 9, 12, 16, 21, 28, 38)]
    movie = np.where(np.stack(waves), 25, 190).astype(np.uint8)
    with refusal("too-few", "head", "none in 7 frames") as caught:
        find_head([movie])
    assert "`start`" in caught.value.remedy


def test_a_body_that_leaves_the_image_where_its_tip_would_be_is_refused():
    """A head whose nose points to the right, cut off behind the nose."""
    row, column = np.mgrid[:240, :100]
    shift = 10 * np.sin(np.linspace(0, 6, 30))
    head = [np.hypot((column - 60 - s) / 150, (row - 120) / 60) < 1 for s in shift]
    movie = np.where(np.stack(head), 25, 190).astype(np.uint8)
    with refusal("range", "head"):
        find_head([movie])


def test_a_body_whose_nose_is_not_in_the_image_is_refused():
    """A body that fills the left side: its edge has no tip, and what was taken for one lay beyond the image."""
    row, column = np.mgrid[0:240, 0:320]
    tilts = np.deg2rad(12 * np.sin(np.linspace(0, 6, 40)))
    edge = [column < 45 + 20 * np.sin(3 * tilt) + np.tan(tilt) * (row - 120) for tilt in tilts]
    movie = np.where(np.stack(edge), 25, 190).astype(np.uint8)
    with refusal("range", "head") as caught:
        find_head([movie])
    assert "of 40 frames" in caught.value.value
