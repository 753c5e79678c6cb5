"""Whiskers that lag behind one another: the lead along the pad, and what is left of their deviations."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_segments import Pad, score, simulate

from vibrissa.video.link.pad.phase import along_of, gains_at, quartered
from vibrissa.video.link.whisker_linking import link_segments


def test_growth_and_lead_are_read_from_the_swing():
    """Whiskers at m swing as (1 + β m) sin(ω t + λ m), to first order in λ m."""
    omega, growth, lead = 0.2, 0.003, -0.006
    t = np.arange(1000) + 0.5
    swing = 20 * omega * np.stack([np.cos(omega * t), growth * np.cos(omega * t) - lead * np.sin(omega * t)], axis=1)
    along = along_of(swing)
    assert along.quarter == pytest.approx(1 / omega, rel=0.05)
    assert along.growth == pytest.approx(growth, rel=0.05)
    assert along.lead == pytest.approx(lead, rel=0.1)


def test_a_quarter_is_ahead_of_the_phase():
    t = 0.2 * np.arange(300)
    along = along_of(4 * np.stack([np.cos(t), 0 * t], axis=1))
    phase, quarter = quartered(20 * np.sin(t), along).T
    np.testing.assert_array_equal(phase, 20 * np.sin(t))
    np.testing.assert_allclose(quarter[20:-20], 20 * np.cos(t)[20:-20], atol=2.5)


def test_movies_of_few_frames_have_no_lead():
    for frames in range(4):
        along = along_of(np.zeros((max(frames - 1, 0), 2)))
        assert np.isfinite(quartered(np.zeros(frames), along)).all()
        np.testing.assert_allclose(gains_at(np.array([-40.0, 40.0]), along), [[1, 0], [1, 0]])


def test_whiskers_that_lag_stray_no_further_than_those_that_swing_together():
    spread = {}
    for lag in (0.0, 0.6):
        segments, truth = simulate([Pad(whiskers=8, frames=250, lag=lag, spread=110.0)], 4)
        linking = link_segments(segments)
        found = score(segments, truth, linking.identity().segment_whisker.values)
        assert found.found == 8
        assert found.followed > 0.95
        spread[lag] = np.mean([np.trace(one.model.spread) for one in linking.solutions[0].labels])
        lead = [one.model.gain[1, 1] for one in linking.solutions[0].labels]
        assert abs(np.ptp(lead)) == pytest.approx(2 * lag, abs=0.35)
    # without the lead it was 2.3 times as much
    assert spread[0.6] < 1.6 * spread[0.0]
