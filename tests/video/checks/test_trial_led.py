"""The frame in which a lamp lights: found in a disc drawn here, and refused where there is no step."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refusal

from vibrissa.quantities import dataset
from vibrissa.video.checks.trial_led import led_frame, with_led

DISC = (100, 30, 5)  # column, row, radius [px]
REGION = (95, 25, 105, 35)


def movie(lit: np.ndarray, bright: float, rng: np.random.Generator, noise: float = 3.0) -> np.ndarray:
    """Frames with a disc, lit by a share of each exposure, and a dark bar that swings over the rest."""
    column, row = np.arange(140), np.arange(90)[:, None]
    disc = np.hypot(column - DISC[0], row - DISC[1]) <= DISC[2]
    image = np.full((len(lit), 90, 140), 120.0)
    for i, share in enumerate(lit):
        image[i] += share * bright * disc
        image[i, 60 + int(8 * np.sin(i / 3)), :] -= 60
    return np.clip(np.rint(image + noise * rng.standard_normal(image.shape)), 0, 255).astype(np.uint8)


def lit_from(frame: int, first_share: float = 1.0, count: int = 60) -> np.ndarray:
    lit = (np.arange(count) >= frame).astype(float)
    lit[frame] = first_share
    return lit


@pytest.mark.parametrize("region", [None, REGION])
@pytest.mark.parametrize("seed", range(8))
def test_frame_is_that_in_which_the_lamp_lights(region, seed):
    rng = np.random.default_rng(seed)
    frame = int(rng.integers(3, 57))
    assert led_frame([movie(lit_from(frame), 60, rng)], region) == frame


@pytest.mark.parametrize(("share", "later"), [(0.75, 0), (0.25, 1)])
def test_frame_lit_in_part_counts_from_half(share, later):
    frames = movie(lit_from(31, share), 80, np.random.default_rng(0))
    assert led_frame([frames], REGION) == 31 + later
    assert led_frame([frames[:7], frames[7:]]) == 31 + later


def test_faint_lamp_of_sixteen_bits_is_found_in_its_region():
    frames = movie(lit_from(12), 6, np.random.default_rng(1)).astype(np.uint16) * 16
    assert led_frame([frames], REGION) == 12


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("region", [None, REGION])
def test_movie_without_a_lamp_is_refused(region, seed):
    frames = movie(np.zeros(60), 60, np.random.default_rng(seed))
    with refusal("format", "lamp"):
        led_frame([frames], region)


def test_light_that_drifts_is_no_lamp():
    frames = movie(np.zeros(60), 60, np.random.default_rng(0)) * np.linspace(0.8, 1.2, 60)[:, None, None]
    with refusal("format", "lamp"):
        led_frame([np.clip(frames, 0, 255).astype(np.uint8)], REGION)


def test_lamp_that_goes_out_or_was_always_lit_is_refused():
    rng = np.random.default_rng(2)
    flash = lit_from(20)
    flash[45:50] = 0
    with refusal("format", "lamp"):
        led_frame([movie(flash, 80, rng)], REGION)
    blink = lit_from(20, count=400)
    blink[300] = 0
    with refusal("range", "lamp", value="it lights in frame 20 and is dark in frame 300"):
        led_frame([movie(blink, 80, rng)], REGION)
    with refusal("format", "lamp"):
        led_frame([movie(np.ones(60), 80, rng)], REGION)
    with refusal("range", "lamp"):
        led_frame([movie(lit_from(1), 80, rng)], REGION)


def test_bad_regions_and_short_movies_are_told():
    frames = movie(lit_from(12), 60, np.random.default_rng(1))
    with refusal("range", "region of the lamp"):
        led_frame([frames], (0, 0, 140, 10))
    with refusal("too-few", "blocks"):
        led_frame([frames[:4]], REGION)
    with refusal("range", "blocks"):
        led_frame([frames[:, :5]])


def test_time_zero_is_told_and_not_shifted():
    time = np.arange(60) / 2000
    profile = dataset({"frame": "image"}, time=time, node=np.arange(3), y=np.zeros((60, 3)))
    told = with_led(profile, 12)
    assert told.attrs["led_frame"] == 12
    assert told.attrs["led_time"] == pytest.approx(0.006)
    np.testing.assert_array_equal(told.time, time)
    assert "led_frame" not in profile.attrs
    with refusal("unknown", "led_frame"):
        with_led(profile, 60)
