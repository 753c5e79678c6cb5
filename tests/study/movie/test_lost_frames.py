"""Frames that were lost leave out envelopes and resonances, and the remark names the part that has them."""

import numpy as np

from vibrissa.quantities import dataset
from vibrissa.study.movie.backward import analyse
from vibrissa.whisker import Whisker

WHISKER, ARC = Whisker(length=0.04, cone_angle=1.5e-3), np.linspace(0.0, 0.027, 60)
FRAMES = 3000


def test_the_longest_stretch_without_a_loss_is_named_and_has_envelopes():
    time = np.arange(FRAMES) / 2000
    motion = np.random.default_rng(0).normal(size=(FRAMES, 1)) * 1e-5 * np.sin(np.pi * ARC / 0.03)
    x, y = np.tile(ARC, (FRAMES, 1)), motion + ARC**2 / 0.1
    x[1000], y[1000] = np.nan, np.nan
    profile = dataset({"frame": "substrate", "frame_rate": 2000.0}, time=time, arc_length=ARC, x=x, y=y)
    modal = analyse(profile, WHISKER, 0.29)["modal"]
    assert "envelope" not in modal
    stretch = "the longest stretch without a loss is frames 1001 to 2999: track it by itself (start 1001, stop 3000)"
    assert modal.attrs["left_out"] == f"envelopes and resonances: 1 of 3000 frames were lost; {stretch}"
    part = analyse(profile.isel(time=slice(1001, 3000)), WHISKER, 0.29)
    assert np.isfinite(part["modal"].envelope).all()
    of_part = analyse(profile.isel(time=slice(900, 1500)), WHISKER, 0.29)["modal"]
    assert "is frames 1001 to 1499:" in of_part.attrs["left_out"]
