"""A stimulus recorded on the session's clock: cut into trials, on which all doors agree."""

from datetime import UTC, datetime

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.api.remarks import Remark

pynwb = pytest.importorskip("pynwb")

RATE, LENGTH, TRIALS = 1000.0, 3.0, 12
TIME = np.arange(int(LENGTH * RATE)) / RATE
SLOW = 1 + 0.9 * np.sin(2 * np.pi * 1.3 * TIME)
MOTION = 40e-6 * SLOW * np.sin(2 * np.pi * 65 * TIME)  # [m]
ONSETS = 3.0 + 4.0 * np.arange(TRIALS)


def spike_times(seed=1):
    """Times of a unit in each trial, driven by the envelope [s]."""
    rng = np.random.default_rng(seed)
    return [TIME[rng.uniform(size=TIME.size) < 25 * SLOW / RATE] for _ in range(TRIALS)]


def whole_session():
    """The motion on the session's clock, still between the trials [m]."""
    whole = np.zeros(round((ONSETS[-1] + LENGTH + 2) * RATE))
    for onset in ONSETS:
        whole[round(onset * RATE) :][: MOTION.size] = MOTION
    return whole


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """An archive file of one unit, its trials and what was recorded of its stimulus."""
    file = pynwb.NWBFile("s", "i", datetime(2020, 1, 1, tzinfo=UTC))
    file.add_unit(spike_times=np.concatenate([onset + own for onset, own in zip(ONSETS, spike_times(), strict=True)]))
    for onset in ONSETS:
        file.add_trial(start_time=onset, stop_time=onset + LENGTH)
    motion = {"data": 1e6 * whole_session(), "unit": "um", "rate": RATE, "starting_time": 0.0}
    file.add_stimulus(pynwb.TimeSeries(name="motion", **motion))
    path = tmp_path_factory.mktemp("session") / "session.nwb"
    with pynwb.NWBHDF5IO(str(path), "w") as io:
        io.write(file)
    return path


def test_python_cuts_a_stimulus_on_the_clock_of_the_session_into_trials(session):
    shown = xr.DataArray(MOTION, {"time": TIME}, ["time"], attrs={"units": "m"})
    by_hand = vb.envelope_coupling(vb.read_spikes(session), shown, skip=0.5)
    with pytest.warns(Remark, match="the same in all 12 trials"):
        found = vb.envelope_coupling(session, session, skip=0.5)
    for name in ("envelope_correlation", "p_value", "threshold", "slope", "latency", "unit_rate"):
        np.testing.assert_allclose(found[name], by_hand[name], rtol=1e-6, err_msg=name)
    assert found.envelope_correlation.item() > 0.5


def test_a_stimulus_on_the_clock_of_the_session_needs_the_times_of_the_trials(session, tmp_path):
    rows = [f"u,{k},{t:.4f}" for k, own in enumerate(spike_times()) for t in own]
    (tmp_path / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *rows]))
    with refusal("missing", "spikes", "a stimulus on the session's clock"):
        vb.envelope_coupling(tmp_path / "spikes.csv", session, n_trials=TRIALS)
