"""Signal to noise of a known waveform in known noise; what a file states comes first."""

import numpy as np
import pytest

from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.sorting.waveform_snr import unit_snr, waveform_snr

SHAPE = -np.exp(-0.5 * ((np.arange(40) - 12) / 2) ** 2) + 0.5 * np.exp(-0.5 * ((np.arange(40) - 20) / 4) ** 2)


@pytest.mark.parametrize(("height", "noise"), [(50e-6, 10e-6), (100e-6, 5e-6)])
def test_a_known_waveform_in_known_noise(height, noise):
    template = height * SHAPE / np.ptp(SHAPE)
    waveforms = template + np.random.default_rng(0).normal(0, noise, (4000, 40))
    found = waveform_snr(waveforms.mean(axis=0)[None], waveforms.std(axis=0)[None])
    assert found[0] == pytest.approx(height / noise, rel=0.03)


def test_samples_that_were_not_recorded_are_passed_over():
    mean, sd = np.tile(SHAPE, (3, 1)), np.full((3, 40), 0.1)
    mean[1, 30:], sd[1, 30:], sd[2] = np.nan, np.nan, 0.0
    found = waveform_snr(mean, sd)
    np.testing.assert_allclose(found, [np.ptp(SHAPE) / 0.1] * 2 + [np.nan])


def units(**about):
    return spike_table([0.1, 0.2, 0.3], [0, 1, 2], ["a", "b", "c"], attrs={"snr_source": "cluster_info.tsv"}, **about)


def test_what_the_file_states_comes_before_what_its_waveforms_give():
    waves = {"unit_waveform": np.tile(SHAPE, (3, 1)), "unit_waveform_sd": np.full((3, 40), 0.1)}
    waves["unit_waveform_sd"][2] = np.nan
    found = unit_snr(units(unit_snr=[7.0, np.nan, np.nan], **waves))
    np.testing.assert_allclose(found.snr, [7.0, np.ptp(SHAPE) / 0.1, np.nan])
    assert found.source == ["cluster_info.tsv", "mean waveform", ""]
    assert np.isnan(unit_snr(units()).snr).all()
