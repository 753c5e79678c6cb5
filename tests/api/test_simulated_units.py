"""Units that a signal drives: scaled as those of a prediction, and options that do not apply are refused."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb

TIME = np.arange(4000) / 2000
SIGNAL = xr.DataArray(
    20 * np.sin(2 * np.pi * 100 * TIME), {"time": TIME}, ["time"], attrs={"units": "um"}, name="point_displacement"
)
MOTION = vb.scan(vb.atlas("C2"), vb.Posture(contact=0.29, base_angle=1.2), vb.random_grating(0.05, rng=1), speed=0.1)


def test_a_signal_is_scaled_to_its_mean_envelope():
    spikes = vb.simulate_units(SIGNAL, 2, n_trials=2, mean_envelope=55e-6)
    assert spikes.point_envelope.mean().item() == pytest.approx(55e-6)
    assert spikes.attrs["motion_scale"] == pytest.approx(55 / 20, rel=1e-3)
    np.testing.assert_allclose(spikes.point_displacement, spikes.attrs["motion_scale"] * SIGNAL * 1e-6)
    with refusal("conflict", "mean_envelope"):
        vb.simulate_units(0 * SIGNAL, 2, n_trials=2, mean_envelope=55e-6)


@pytest.mark.parametrize(
    ("motion", "option"), [(SIGNAL, {"distance": 1e-3}), (SIGNAL, {"rate": 5e3}), (MOTION, {"unit": "um"})]
)
def test_options_that_do_not_go_with_the_motion_are_refused(motion, option):
    with refusal("conflict", next(iter(option))):
        vb.simulate_units(motion, 2, n_trials=2, **option)


def test_simulated_units_can_be_selected():
    spikes = vb.simulate_units(SIGNAL, 3, n_trials=2, mean_envelope=100e-6)
    counts = np.bincount(spikes.spike_unit, minlength=3)
    back = vb.read_spikes(spikes.isel(unit=[2, 0]))
    assert np.bincount(back.spike_unit, minlength=2).tolist() == counts[[2, 0]].tolist()


def test_a_threshold_is_in_the_si_unit_of_the_stimulus():
    spikes, stimulus = vb.sample_data("spikes.csv"), vb.sample_data("spikes-stimulus.csv")
    metres = vb.envelope_coupling(spikes, stimulus)
    in_um = (1e6 * metres.point_displacement).assign_attrs(units="um")
    again = vb.envelope_coupling(spikes, in_um)
    assert again.threshold.attrs["units"] == "m"
    np.testing.assert_allclose(again.threshold, metres.threshold, rtol=1e-6)
