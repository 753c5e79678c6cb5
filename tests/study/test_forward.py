"""From a texture to spikes and back: what was put in comes out."""

import numpy as np
import pytest

from vibrissa.errors import InputError
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.superposition import Scan, predict
from vibrissa.neural.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.driven import draw_driven
from vibrissa.neural.inputs import read_stimulus
from vibrissa.neural.recording import recorded_spikes
from vibrissa.study.forward import Presentation, forward, remarks, spikes_of
from vibrissa.study.forward_files import write_spikes
from vibrissa.study.settings import UnitRecording
from vibrissa.study.virtual import exposed_signals
from vibrissa.texture.relief import Relief
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
    how = Presentation(n_trials=40, seed=3, mean_envelope=55e-6)
    return forward(texture, WHISKER, POSTURE, SCAN, units, how, sampling_rate=RATE)


def test_the_point_is_the_one_of_a_study_s_recording(texture):
    """The motion of a study's film, whose exposures are short here, is the motion that drives the units."""
    from vibrissa.study.settings import Film
    from vibrissa.video.camera import Camera

    prediction = predict(WHISKER, POSTURE, texture, SCAN)
    film = Film(n_frames=200, subframes=1, camera=Camera(frame_rate=RATE, exposure=1e-9))
    seen = exposed_signals(prediction, film, UnitRecording().distance).point_displacement
    spikes = spikes_of(prediction, seen.time.values, draw_driven(1, rng=np.random.default_rng(0)))
    np.testing.assert_allclose(spikes.point_displacement, seen, atol=1e-4 * np.ptp(seen.values))
    assert Presentation().distance == UnitRecording().distance


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
    relief = Relief.from_troughs(texture)
    how = Presentation(n_trials=5, mean_envelope=55e-6)
    a, b = (forward(one, WHISKER, POSTURE, SCAN, units, how, sampling_rate=RATE) for one in (texture, relief))
    n = min(a.sizes["time"], b.sizes["time"])
    assert abs(a.sizes["time"] - b.sizes["time"]) <= 40
    one, other = (x.point_displacement.values[:n] / x.attrs["motion_scale"] for x in (a, b))
    np.testing.assert_allclose(other, one, atol=1e-4 * np.ptp(one))
    rates = np.stack([a.unit_rate.values, b.unit_rate.values])
    assert abs(np.diff(rates.sum(axis=1)))[0] < 4 * np.sqrt(2 * rates[0].sum() / (5 * a.attrs["duration"]))


def test_what_cannot_be_felt_is_told(texture, units):
    spikes = forward(
        texture, WHISKER, POSTURE, SCAN, units, Presentation(n_trials=1, distance=0.5e-3), sampling_rate=RATE
    )
    assert "it is above the threshold of 16 of 16 units in less than 1 % of the time" in remarks(spikes)[0]
    assert spikes.attrs["motion_scale"] == 1


@pytest.mark.parametrize("suffix", [".csv", ".nwb"])
def test_files_of_spikes_come_back(suffix, spikes, tmp_path):
    if suffix == ".nwb":
        pytest.importorskip("pynwb")
    written = write_spikes(spikes, tmp_path / f"s{suffix}")
    assert [path.name for path in written] == [f"s{suffix}", "s-stimulus.csv", "s-units.csv"]
    found, n_trials = recorded_spikes(written[0], window=(0.0, spikes.attrs["duration"]))
    assert n_trials == 40
    np.testing.assert_array_equal(found.unit_name, spikes.unit_name)
    np.testing.assert_array_equal(np.bincount(found.spike_unit), np.bincount(spikes.spike_unit))
    np.testing.assert_allclose(np.sort(found.spike_time), np.sort(spikes.spike_time), atol=1e-9)
    np.testing.assert_array_equal(read_stimulus(written[1]).point_displacement, spikes.point_displacement)


BAD = {
    "trials": ({"n_trials": 0}, "trials must be at least 1"),
    "seed": ({"seed": -1}, "seed must be zero or positive"),
    "envelope": ({"mean_envelope": 0.0}, "mean envelope must be above 0"),
    "envelope in µm": ({"mean_envelope": 55.0}, "at most 0.01 m"),
    "no number": ({"mean_envelope": float("nan")}, "mean envelope must be above 0"),
    "beyond the tip": ({"distance": 0.06}, "must lie on the whisker"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_presentation_is_one_line(name, texture, units):
    how, message = BAD[name]
    with pytest.raises(InputError, match=message):
        forward(texture, WHISKER, POSTURE, SCAN, units, Presentation(**how), sampling_rate=RATE)


def test_a_name_of_another_kind_is_refused(spikes, tmp_path):
    with pytest.raises(InputError, match=r"must end in \.csv or \.nwb"):
        write_spikes(spikes, tmp_path / "s.mat")
    with pytest.raises(InputError, match="must be an existing folder"):
        write_spikes(spikes, tmp_path / "no" / "s.csv")
    assert not list(tmp_path.iterdir())
