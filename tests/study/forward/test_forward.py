"""From a texture to spikes and back: what was put in comes out."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.io.recording import recorded_spikes
from vibrissa.neural.io.tables.stimulus_csv import read_stimulus_csv
from vibrissa.neural.simulated.driven import draw_driven
from vibrissa.study.forward.forward import TrialSettings, forward, remarks, spikes_of
from vibrissa.study.forward.forward_files import write_spikes
from vibrissa.study.movie.virtual import exposed_signals
from vibrissa.study.spec.settings import UnitRecording
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.055, cone_angle=1.2e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)
RATE = 4000.0


@pytest.fixture(scope="module")
def texture():
    return random_grating(0.3, rng=np.random.default_rng(1))


@pytest.fixture(scope="module")
def units():
    return draw_driven(16, rng=np.random.default_rng(4))


@pytest.fixture(scope="module")
def spikes(texture, units):
    how = TrialSettings(n_trials=40, seed=3, mean_envelope=55e-6)
    return forward(texture, WHISKER, POSTURE, SCAN, units, how, sampling_rate=RATE)


def test_the_point_is_the_one_of_a_study_s_recording(texture):
    """The motion of a study's film, whose exposures are short here, is the motion that drives the units."""
    from vibrissa.study.spec.settings import Film
    from vibrissa.video.camera.camera import Camera

    prediction = predict(WHISKER, POSTURE, texture, SCAN)
    film = Film(n_frames=200, subframes=1, camera=Camera(frame_rate=RATE, exposure=1e-9))
    seen = exposed_signals(prediction, film, UnitRecording().distance).point_displacement
    spikes = spikes_of(prediction, seen.time.values, draw_driven(1, rng=np.random.default_rng(0)))
    np.testing.assert_allclose(spikes.point_displacement, seen, atol=1e-4 * np.ptp(seen.values))
    assert TrialSettings().distance == UnitRecording().distance


def test_the_mean_envelope_is_the_one_asked_for(spikes):
    assert float(spikes.point_envelope.mean()) == pytest.approx(55e-6, rel=1e-9)
    assert spikes.attrs["motion_scale"] > 1


def test_the_analysis_gives_back_what_was_put_in(spikes, units):
    """Coverage over many populations: benchmarks/forward.py."""
    found = analyse_units(spikes, spikes, spikes.attrs["n_trials"], EnvelopeAnalysis(skip=0.1))
    sure = found.identified.values & found.significant.values
    assert sure.sum() >= 6
    inside = []
    for name in ("threshold", "slope", "latency", "baseline"):
        true, low, high = (
            one.values[sure] for one in (units[f"true_{name}"], found[f"{name}_low"], found[f"{name}_high"])
        )
        inside += [(low <= true) & (true <= high)]
        assert np.abs(found[name].values[sure] - true).max() < 2 * (high - low).max(), name
    assert np.mean(inside) > 0.8


def test_a_relief_of_the_gaps_gives_the_gaps_spikes(units):
    texture = random_grating(0.03, rng=np.random.default_rng(4))
    relief = HeightProfile.from_gaps(texture)
    how = TrialSettings(n_trials=5, mean_envelope=55e-6)
    a, b = (forward(one, WHISKER, POSTURE, SCAN, units, how, sampling_rate=RATE) for one in (texture, relief))
    n = min(a.sizes["time"], b.sizes["time"])
    assert abs(a.sizes["time"] - b.sizes["time"]) <= 40
    one, other = (x.point_displacement.values[:n] / x.attrs["motion_scale"] for x in (a, b))
    np.testing.assert_allclose(other, one, atol=1e-4 * np.ptp(one))
    rates = np.stack([a.unit_rate.values, b.unit_rate.values])
    assert abs(np.diff(rates.sum(axis=1)))[0] < 4 * np.sqrt(2 * rates[0].sum() / (5 * a.attrs["duration"]))


def test_what_cannot_be_felt_is_told(texture, units):
    spikes = forward(
        texture, WHISKER, POSTURE, SCAN, units, TrialSettings(n_trials=1, distance=0.5e-3), sampling_rate=RATE
    )
    assert "the thresholds of 16 of 16 units are exceeded in less than 1 % of the time" in remarks(spikes)[0]
    assert spikes.attrs["motion_scale"] == 1


@pytest.mark.parametrize("suffix", [".csv", ".nwb"])
def test_files_of_spikes_come_back(suffix, spikes, tmp_path):
    if suffix == ".nwb":
        pytest.importorskip("pynwb")
    written = write_spikes(spikes, tmp_path / f"s{suffix}")
    assert [path.name for path in written] == [f"s{suffix}", "s-stimulus.csv", "s-units.csv"]
    found, n_trials = recorded_spikes(written[0], window=(0.0, spikes.attrs["duration"]))
    assert n_trials == 40
    order = [found.unit_name.values.tolist().index(name) for name in spikes.unit_name.values]  # a CSV has them sorted
    assert sorted(order) == list(range(found.sizes["unit"]))
    np.testing.assert_array_equal(np.bincount(found.spike_unit)[order], np.bincount(spikes.spike_unit))
    np.testing.assert_allclose(np.sort(found.spike_time), np.sort(spikes.spike_time), atol=1e-9)
    np.testing.assert_array_equal(read_stimulus_csv(written[1]).point_displacement, spikes.point_displacement)


BAD = {
    "trials": ({"n_trials": 0}, ("range", "trials", "0")),
    "seed": ({"seed": -1}, ("range", "seed", "-1")),
    "envelope": ({"mean_envelope": 0.0}, ("range", "mean envelope", "0.0")),
    "envelope in µm": ({"mean_envelope": 55.0}, ("range", "mean envelope", "55.0")),
    "no number": ({"mean_envelope": float("nan")}, ("range", "mean envelope", "nan")),
    "beyond the tip": ({"distance": 0.06}, ("range", "node", "[0.06]")),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_presentation_is_one_line(name, texture, units):
    how, fields = BAD[name]
    with refusal(*fields):
        forward(texture, WHISKER, POSTURE, SCAN, units, TrialSettings(**how), sampling_rate=RATE)


def test_a_name_of_another_kind_is_refused(spikes, tmp_path):
    with refusal("format", "file of spikes"):
        write_spikes(spikes, tmp_path / "s.mat")
    with refusal("missing", "no"):
        write_spikes(spikes, tmp_path / "no" / "s.csv")
    assert not list(tmp_path.iterdir())
