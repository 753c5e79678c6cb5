"""A prediction at sampled times: grids, envelope, points of the shaft."""

from functools import cache

import numpy as np
import pytest
from refusals import refusal

from vibrissa.api.motion import scan as api_scan
from vibrissa.errors import RangeError
from vibrissa.mechanics.quasi_static.response import quasi_static
from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.sampled import predicted_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
TEXTURE = Gaps(position=np.array([1e-3, 1.9e-3, 2.6e-3]), width=np.array([0.6e-3, 0.2e-3, 0.5e-3]))
TIME = np.arange(500) / 1e4


@cache
def prediction(form="exact"):
    response = quasi_static(POSTURE, (-0.0152, 6e-4), form=form, n_modes=3)
    scan = Scan(speed=0.12, damping=0.11, response=form)
    return predict(WHISKER, POSTURE, TEXTURE, scan, n_modes=3, response=response)


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_uneven_times_give_what_the_even_grid_gives(form):
    rng = np.random.default_rng(2)
    some = np.sort(rng.choice(500, 120, replace=False))
    even, uneven = predicted_signals(prediction(form), TIME), predicted_signals(prediction(form), TIME[some])
    assert "envelope" in even
    assert "envelope" not in uneven  # the analytic signal needs an even grid
    names = [name for name in uneven.data_vars if "time" in uneven[name].dims]
    assert len(names) > 20
    for name in names:
        expected = even[name].isel(time=some).values
        size = 0.0 if np.isnan(expected).any() else np.abs(expected).max()
        np.testing.assert_allclose(uneven[name].values, expected, rtol=0, atol=1e-9 * size, equal_nan=True)


def test_envelope_is_the_analytic_signals_of_what_a_movie_shows():
    signals = predicted_signals(prediction(), TIME)
    expected = signals.attrs["whisker_length"] * analytic_envelope(signals.mode_displacement.values)[0]
    np.testing.assert_array_equal(signals.envelope, expected)
    assert signals.envelope.dims == ("mode", "time")
    assert signals.envelope.attrs["units"] == "m"


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_the_shortest_records_have_signals_too(count):
    signals = predicted_signals(prediction(), TIME[:count])
    assert signals.sizes["time"] == count
    assert ("envelope" in signals) == (count > 3)  # what the analytic signal needs


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_displacement_at_nodes_is_the_predictions_in_metres(form):
    nodes = np.array([0.0, 4e-3, 0.015, 0.028, 0.032])  # from the base; the last on the free end
    signals = predicted_signals(prediction(form), TIME, nodes=nodes)
    expected = 0.04 * prediction(form).displacement(TIME, 1 - nodes / 0.04)
    np.testing.assert_array_equal(signals.displacement.transpose("time", "node"), expected)
    np.testing.assert_array_equal(signals.arc_length, nodes)
    assert signals.displacement.attrs["units"] == "m"
    np.testing.assert_allclose(signals.displacement.isel(node=0), 0, atol=1e-12)  # the base stays


@pytest.mark.parametrize("form", ["exact", "linear"])
def test_the_free_end_goes_on_straight_in_space(form):
    s = np.linspace(0.1, 0.289, 40)  # on the flat the free end lies along the substrate
    x, y = prediction(form).position(TIME[::5], s)
    for values in (x, y):
        size = np.abs(np.diff(values, axis=1)).max()
        assert np.abs(np.diff(values, 2, axis=1)).max() < 1e-6 * size


def test_movie_amplitude_is_vibration_plus_the_quasi_static_amplitude():
    signals, one = predicted_signals(prediction(), TIME), prediction()
    steady = one.response(signals.excursion.values)[:3]
    shown = signals.mode_amplitude.values + steady
    np.testing.assert_allclose(signals.mode_displacement, shown, rtol=0, atol=1e-9 * np.abs(shown).max())


def test_signals_say_how_they_were_made():
    signals = predicted_signals(prediction("linear"), TIME)
    told = {name: signals.attrs[name] for name in ("response", "jump", "damping", "scan_speed")}
    assert told == {"response": "linear", "jump": "continuous", "damping": 0.11, "scan_speed": 0.12}
    for name in follicle_signals(prediction("linear"), TIME):
        assert signals[name].attrs["units"].startswith(("1/m", "1/(m s)", "N m", "N")), name


def test_times_must_ascend():
    with refusal("range", "times of samples and events"):
        predicted_signals(prediction(), TIME[::-1])
    with refusal("range", "times of samples and events"):
        predicted_signals(prediction(), np.array([0.0, np.nan, 1.0]))


@pytest.mark.parametrize("model", ["modes", "free-end", "rod"])
def test_a_surface_that_has_passed_before_time_0_is_refused(model):
    gap = Gaps(np.array([-0.5]), np.array([3e-4]))
    whisker = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.285)
    with pytest.raises(RangeError, match="surface must not have passed before time 0"):
        api_scan(whisker, POSTURE, gap, speed=0.1, model=model).sample(2000)


@pytest.mark.parametrize("time", [np.arange(5, 20) / 2000, np.array([0.0, 1e-3, 1.7e-3, 3e-3])])
def test_the_rod_refuses_times_that_are_not_even_from_0(time):
    rod = RodPrediction(
        Whisker(length=0.04, cone_angle=1.5e-3, tip=0.285), POSTURE, TEXTURE, Scan(speed=0.1, damping=0.11)
    )
    with pytest.raises(RangeError, match="times must be even and begin at 0"):
        rod.displacement(time, np.array([0.9]))
    assert rod.times(2500).size == round(2500 * rod.duration) + 1
