"""The head of rendered scenes, whose motion is known."""

import numpy as np
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


def test_a_movie_without_a_body_is_refused():
    with refusal("too-few", "head"):
        find_head([np.full((3, 80, 80), 150, np.uint8)])


def test_a_body_whose_nose_is_not_in_the_image_is_refused():
    """A body that fills the left side: its edge has no tip, and what was taken for one lay beyond the image."""
    row, column = np.mgrid[0:240, 0:320]
    tilts = np.deg2rad(12 * np.sin(np.linspace(0, 6, 40)))
    edge = [column < 45 + 20 * np.sin(3 * tilt) + np.tan(tilt) * (row - 120) for tilt in tilts]
    movie = np.where(np.stack(edge), 25, 190).astype(np.uint8)
    with refusal("range", "head") as caught:
        find_head([movie])
    assert "of 40 frames" in caught.value.value
