"""Drawn recordings, units by trials, and what every conversion of them must keep."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from vibrissa.neural.io.tables.trials import trial_table

TRIAL = 2.0  # [s]
PERIOD = 3.0  # [s] from onset to onset
few = settings(max_examples=25, deadline=None)


@st.composite
def recordings(draw):
    """Times of each unit in each trial [s], on a grid of 1 µs; units and trials may be silent."""
    units, trials = draw(st.integers(1, 4)), draw(st.integers(2, 5))
    time = st.lists(st.integers(0, 1_999_999), max_size=6, unique=True).map(lambda ticks: np.sort(ticks) / 1e6)
    return [[draw(time) for _ in range(trials)] for _ in range(units)]


def names_of(recording):
    return [f"u{k}" for k in range(len(recording))]


def onsets_of(recording, first=1.0):
    return first + PERIOD * np.arange(len(recording[0]))


def session_trains(recording):
    """Times of each unit on the session's clock [s]."""
    onset = onsets_of(recording)
    return [np.concatenate([time + t for t, time in zip(onset, unit, strict=True)]) for unit in recording]


def assert_same(spikes, recording, atol=2e-9):
    """Every unit has its times in every trial, none is lost and none is added."""
    assert [str(name) for name in spikes.unit_name.values] == names_of(recording)
    for k, unit in enumerate(recording):
        for trial, time in enumerate(unit):
            own = (spikes.spike_unit.values == k) & (spikes.spike_trial.values == trial)
            np.testing.assert_allclose(np.sort(spikes.spike_time.values[own]), time, rtol=0, atol=atol)
    assert spikes.sizes["spike"] == sum(time.size for unit in recording for time in unit)
    assert spikes.attrs["n_trials"] == len(recording[0])


def trials_of(recording):
    onset = onsets_of(recording)
    return trial_table(onset, onset + TRIAL)
