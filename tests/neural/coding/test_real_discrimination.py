"""Discrimination on spikes of real neurons: a rat's thalamus, and units of an NWB file."""

import numpy as np
import pytest
from test_real_spikes import real

from vibrissa.neural.coding.discrimination import TELLS, Discrimination, discriminate
from vibrissa.neural.coupling.response import trial_counts
from vibrissa.neural.io.formats.nwb import read_nwb
from vibrissa.neural.io.tables.trials import cut_into_trials, trials_at

QUICK = {"codes": ("mean rate", "time course"), "bin_width": 0.5, "n_permutations": 39, "n_partitions": 1}


def test_thalamus_tells_a_deflected_whisker_from_a_still_one():
    """Which trial a spike belongs to is not on file: each deflection, or as much time without, is one pooled trial."""
    counts = np.loadtxt(real("rat-vpm-whisker-thaldata.csv"), delimiter=",").astype(int)
    bins = counts.reshape(24, 5, 25).sum(-1)[:, None].astype(float)  # 24 times 125 ms in bins of 25 ms
    names = ["deflected" if 4 <= k < 20 else "still" for k in range(24)]  # from 0.5 to 2.5 s
    found = discriminate(bins, names, Discrimination(n_folds=4, n_permutations=79, n_partitions=1))
    for code in ("mean rate", "rate variance", "time course"):
        assert found.accuracy.sel(code=code) > 0.9
        assert found.code_verdict.sel(code=code) == TELLS
    assert found.attrs["blocked"] == 1  # all deflections in a row: a drift would do as well


@pytest.fixture
def resting():
    """Counts of three units in 270 windows of 4 s, without any stimulus."""
    pytest.importorskip("pynwb")
    cut = cut_into_trials(read_nwb(real("A8604-211122.nwb")), trials_at(4.0 * np.arange(270), 4.0))
    return trial_counts(cut, 270, (0.0, 4.0), 0.5)[0]


def test_textures_that_were_never_there_are_not_told_apart(resting):
    said = 0
    for seed in range(12):
        names = np.array(["a", "b"])[np.random.default_rng(seed).permutation(270) % 2]
        how = Discrimination(seed=seed, **QUICK)
        said += np.any(discriminate(resting, names.tolist(), how).code_verdict == TELLS).item()
    assert said <= 3  # 5 % of 12, and two and a half standard deviations


def test_a_drift_tells_halves_of_a_session_apart_and_that_is_said(resting):
    names = ["first half"] * 135 + ["second half"] * 135
    found = discriminate(resting, names, Discrimination(**QUICK))
    assert found.code_verdict.sel(code="mean rate") == TELLS
    assert found.attrs["blocked"] == 1
