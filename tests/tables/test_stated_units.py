"""Numbers whose object states a unit are converted; what cannot be is refused in one line."""

from functools import partial

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.api.objects.signals import as_signal
from vibrissa.tables.stated import bare, number, numbers
from vibrissa.texture.generators import wave

MS = [100, 200, 1500]
SECONDS = [0.1, 0.2, 1.5]
IN_MS = {
    "xarray": lambda values: xr.DataArray(values, attrs={"units": "ms"}),
    "timedelta64": lambda values: np.array(values, "timedelta64[ms]"),
    "a series of times": lambda values: pd.Series(pd.to_timedelta(values, unit="ms")),
    "an index of times": lambda values: pd.to_timedelta(values, unit="ms"),
    "times of xarray": lambda values: xr.DataArray(np.array(values, "timedelta64[ns]") * 1_000_000),
    "pint": lambda values: pytest.importorskip("pint").UnitRegistry().Quantity(np.array(values, float), "ms"),
    "quantities": lambda values: values * pytest.importorskip("quantities").ms,
    "a list of quantities": lambda values: [one * pytest.importorskip("quantities").ms for one in values],
}


@pytest.mark.parametrize("kind", IN_MS)
def test_spikes_and_trials_in_milliseconds_are_those_in_seconds(kind):
    held = IN_MS[kind]
    np.testing.assert_array_equal(vb.read_spikes({"a": held(MS)}).spike_time, SECONDS)
    cut = vb.read_spikes({"a": SECONDS}, trials=held([0, 1000]), window=(0, 1))
    np.testing.assert_array_equal(cut.trial_start, [0, 1])
    np.testing.assert_allclose(cut.spike_time, [0.1, 0.2, 0.5])


def test_pairs_of_start_and_stop_have_their_unit():
    pairs = [[0, 1000], [1000, 2000]]
    for held in (np.array(pairs, "timedelta64[ms]"), xr.DataArray(pairs, attrs={"units": "ms"})):
        assert vb.read_spikes({"a": SECONDS}, trials=held).trial_stop.values.tolist() == [1, 2]


WRONG = {
    "a length as a time": ([0.1], lambda values: xr.DataArray(values, attrs={"units": "m"}), "unknown"),
    "an unknown unit": ([0.1], lambda values: xr.DataArray(values, attrs={"units": "fortnight"}), "unknown"),
    "dates": (["2020-01-01"], lambda values: np.array(values, "datetime64[s]"), "unknown"),
    "masked times": (SECONDS, lambda values: np.ma.masked_array(values, [0, 1, 0]), "format"),
}


@pytest.mark.parametrize("case", WRONG)
def test_times_that_cannot_be_converted_are_refused_by_their_unit(case):
    values, held, code = WRONG[case]
    with refusal(code, "unit a"):
        vb.read_spikes({"a": held(values)})
    with refusal(code, "trials"):
        vb.read_spikes({"a": SECONDS}, trials=held(values), window=(0, 1))


ONE_IN_MS = {
    "xarray": lambda value: xr.DataArray(float(value), attrs={"units": "ms"}),
    "timedelta64": lambda value: np.timedelta64(value, "ms"),
    "an array of timedelta64": lambda value: np.array(value, "timedelta64[ms]"),
    "quantities": lambda value: value * pytest.importorskip("quantities").ms,
}


@pytest.mark.parametrize("kind", ONE_IN_MS)
def test_every_entry_of_a_list_has_its_unit(kind):
    late = ONE_IN_MS[kind](500)
    assert vb.read_spikes({"a": [0.0, late]}).spike_time.values.tolist() == [0, 0.5]
    assert vb.read_spikes({"a": [0.1]}, trials=[(0, late)]).trial_stop.values.tolist() == [0.5]
    assert vb.read_spikes({"a": [0.1]}, trials=[late], window=(0, 1)).trial_start.values.tolist() == [0.5]
    assert vb.read_spikes({"a": [0.1]}, trials=[0.0], window=(0, late)).trial_stop.values.tolist() == [0.5]
    path = vb.PosturePath(time=[0, late], base_angle=[1.2, 1.2], contact=[0.3, 0.3])
    assert path.time.tolist() == [0, 0.5]


def test_dates_in_a_list_are_no_times():
    with refusal("unknown", "unit a"):
        vb.read_spikes({"a": [np.datetime64("2020-01-01")]})


def test_an_array_with_an_empty_mask_is_taken_whole():
    assert numbers("x", np.ma.masked_array(SECONDS, [0, 0, 0]), "s").tolist() == SECONDS


def in_mm(values):
    return xr.DataArray(values, attrs={"units": "mm"})


def test_surfaces_and_paths_have_the_units_of_their_arrays():
    gaps = vb.Gaps(in_mm([1.0, 2.0]), in_mm([0.25, 0.5]), depth=in_mm(0.05))
    assert gaps == vb.Gaps([1e-3, 2e-3], [0.25e-3, 0.5e-3], depth=50e-6)
    assert vb.HeightProfile(in_mm([1.0, 2.0]), in_mm([0.0, 0.02])) == vb.HeightProfile([1e-3, 2e-3], [0, 20e-6])
    angle = xr.DataArray([60.0, 70.0], attrs={"units": "deg"})
    path = vb.PosturePath(time=IN_MS["xarray"]([0, 2000]), base_angle=angle, contact=xr.DataArray([0.3, 0.3]))
    assert path.time.tolist() == [0, 2]
    np.testing.assert_allclose(path.base_angle, np.deg2rad([60, 70]))
    base = vb.BasePath(time=[0, 1], base_angle=angle, base_distance=[0.4, 0.4], travel=in_mm([0.0, 3.0]))
    assert base.travel.tolist() == [0, 3e-3]
    with refusal("unknown", "position"):
        vb.Gaps(xr.DataArray([1.0], attrs={"units": "s"}), [1e-3])


ONE_LENGTH = {  # of one number in metres, as an object of another package in micrometres
    "xarray": lambda metres: xr.DataArray(metres * 1e6, attrs={"units": "um"}),
    "pint": lambda metres: pytest.importorskip("pint").UnitRegistry().Quantity(metres * 1e6, "um"),
    "quantities": lambda metres: metres * 1e6 * pytest.importorskip("quantities").um,
}
MADE = {  # by its lengths [m]
    "periodic": (vb.periodic_grating, {"length": 0.02, "period": 2e-3, "width": 0.5e-3, "depth": 20e-6}),
    "random": (
        partial(vb.random_grating, rng=1), {"length": 0.02, "mean_period": 1e-3, "smallest": 0.1e-3, "depth": 20e-6}
    ),
    "self-affine": (
        partial(vb.self_affine, rng=1),
        {"length": 0.01, "rms": 5e-6, "spacing": 2e-6, "longest": 0.5e-3, "shortest": 20e-6},
    ),
    "wave": (wave, {"length": 0.02, "amplitude": 1e-4, "period": 5e-3, "spacing": 1e-4}),
}  # fmt: skip


@pytest.mark.parametrize("kind", ONE_LENGTH)
@pytest.mark.parametrize("surface", MADE)
def test_made_surfaces_have_the_units_of_their_lengths(surface, kind):
    make, lengths = MADE[surface]
    plain = make(**lengths)
    for name, metres in lengths.items():
        made = make(**{**lengths, name: ONE_LENGTH[kind](metres)})
        for part in vars(plain):
            np.testing.assert_allclose(getattr(made, part), getattr(plain, part), rtol=1e-9, atol=1e-15, err_msg=name)
        with refusal("unknown", name):
            make(**{**lengths, name: xr.DataArray(metres, attrs={"units": "s"})})


def test_a_place_on_a_surface_has_its_unit():
    gaps, shape = vb.Gaps([1e-3], [1e-3], depth=20e-6), vb.HeightProfile([0, 1e-2], [0, 1e-4])
    assert gaps.height(in_mm([0.5, 1.5])).tolist() == [0, -20e-6]
    np.testing.assert_allclose(shape.at(in_mm([5.0])), 5e-5)
    np.testing.assert_allclose(gaps.reversed(in_mm(10.0)).position, 8e-3)


def test_surfaces_and_paths_do_not_change_with_the_arrays_given():
    position, height, time = np.array([1e-3, 2e-3]), np.array([0.0, 2e-5]), np.array([0.0, 2.0])
    gaps, relief = vb.Gaps(position, np.array([1e-4, 1e-4])), vb.HeightProfile(position, height)
    path = vb.PosturePath(time=time, base_angle=[1.2, 1.2], contact=[0.3, 0.3])
    position[0] = height[0] = time[0] = 9.0
    assert gaps.position[0] == relief.position[0] == 1e-3
    assert relief.height[0] == path.time[0] == 0


CIRCLE = np.linspace(0, 0.6, 40)


def test_a_circle_in_millimetres_has_its_curvature():
    x, y = 50 * np.sin(CIRCLE), 50 * (1 - np.cos(CIRCLE))
    drawn = xr.Dataset({"x": ("i", x, {"units": "mm"}), "y": ("i", y, {"units": "mm"})})
    for shape in (drawn, pd.DataFrame({"x_mm": x, "y_mm": y})):
        assert float(vb.curvature(shape).at(0.01)) == pytest.approx(20, rel=1e-6)
    bent = {"distance": ("i", [0, 30.0], {"units": "mm"}), "curvature": ("i", [0.02, 0.02], {"units": "1/mm"})}
    assert float(vb.curvature(xr.Dataset(bent)).at(0.01)) == pytest.approx(20)


def test_diameters_in_millimetres_and_micrometres_are_of_the_same_cone():
    distance, diameter = [0, 10.0, 20.0, 30.0], [121.0, 89.0, 61.0, 30.0]
    frame = pd.DataFrame({"distance_mm": distance, "diameter_um": diameter})
    stated = {"distance": ("i", distance, {"units": "mm"}), "diameter": ("i", diameter, {"units": "um"})}
    slope, offset = np.polyfit(distance, diameter, 1)
    for table in (frame, frame.set_index("distance_mm"), xr.Dataset(stated)):
        whisker = vb.fit_cone(table).whisker
        assert 1e3 * whisker.length == pytest.approx(-offset / slope)
        assert 1e3 * whisker.cone_angle == pytest.approx(-slope / 2)
    with refusal("missing", "diameters"):
        vb.fit_cone(xr.Dataset(stated)[["distance"]])
    with refusal("format", "diameters"):
        vb.fit_cone(xr.Dataset(stated).distance)
    with refusal("format", "source"):
        vb.curvature(3)


def test_a_dict_of_lists_has_the_curvature_of_a_dataset():
    bent = {"distance": [0, 0.03], "curvature": [20.0, 10.0]}
    assert float(vb.curvature(bent).at(0.015)) == pytest.approx(15)
    assert float(
        vb.curvature({"x": 0.05 * np.sin(CIRCLE), "y": 0.05 * (1 - np.cos(CIRCLE))}).at(0.01)
    ) == pytest.approx(20)
    with refusal("missing", "source", "curvature"):
        vb.curvature({"curvature": [20.0, 10.0]})


def test_the_column_without_a_unit_comes_before_those_with_one():
    frame = pd.DataFrame({"distance": [0, 0.01, 0.02, 0.03], "diameter": [121e-6, 89e-6, 61e-6, 30e-6]})
    assert vb.fit_cone(frame.assign(distance_mm=[0, 1, 2, 3])) == vb.fit_cone(frame)
    with refusal("conflict", "DataFrame", "distance, distance") as caught:
        vb.fit_cone(pd.concat([frame, frame[["distance"]]], axis=1))
    assert caught.value.remedy == "drop the others"
    two = frame.rename(columns={"distance": "distance_m"}).assign(distance_mm=[0, 10, 20, 30])
    with refusal("conflict", "DataFrame", "distance_m, distance_mm") as caught:
        vb.fit_cone(two)
    assert "{'distance_m': 'distance'}" in caught.value.remedy


def test_whiskers_and_postures_take_numbers_with_their_unit():
    pint, pq = pytest.importorskip("pint").UnitRegistry(), pytest.importorskip("quantities")
    for length in (in_mm(0.9), pint.Quantity(0.9, "mm"), 0.9 * pq.mm):
        whisker = vb.Whisker(length=length, cone_angle=1.5e-3)
        assert whisker.length == pytest.approx(0.9e-3)
        assert type(whisker.length) is float
    angle = xr.DataArray(70.0, attrs={"units": "deg"})
    for given in (angle, pint.Quantity(70, "deg"), 70 * pq.deg):
        posture = vb.Posture(contact=pint.Quantity(0.3, ""), base_angle=given)
        assert posture.base_angle == pytest.approx(np.deg2rad(70))
    heavy = vb.Whisker(length=0.04, cone_angle=1.5e-3, density=1.2 * pq.g / pq.cm**3)
    assert heavy.density == pytest.approx(1200)
    assert vb.Posture(contact=0.3 * pq.dimensionless, base_angle=1.2).contact == 0.3
    with refusal("unknown", "Whisker.length"):
        vb.Whisker(length=0.9 * pq.s, cone_angle=1.5e-3)
    with refusal("format", "Whisker.length", "a ndarray"):
        vb.Whisker(length=np.array([0.04]), cone_angle=1.5e-3)


@pytest.mark.parametrize("density", ["kg/m³", "kg/m3", "kg/m^3", "kg/m**3", "kg m-3", "kilogram / meter ** 3"])
@pytest.mark.parametrize(("modulus", "unit"), [(3.3e9, "Pa"), (3.3e6, "kPa"), (3.3e3, "MPa"), (3.3, "GPa")])
def test_moduli_and_densities_may_state_their_unit(density, modulus, unit):
    given = {"youngs_modulus": (modulus, unit), "density": (1300.0, density)}
    stated = {name: xr.DataArray(value, attrs={"units": one}) for name, (value, one) in given.items()}
    found = vb.Whisker(length=0.04, cone_angle=1.5e-3, **stated)
    assert (found.youngs_modulus, found.density) == (pytest.approx(3.3e9), 1300)


@pytest.mark.parametrize("unit", ["1/{}", "1 / {}", "{}-1", "{}^-1", "{}**-1", "{} ** -1"])
def test_curvatures_may_state_their_unit_in_any_spelling(unit):
    for metre, value in (("m", 20.0), ("mm", 0.02)):
        bent = {"distance": ("i", [0, 0.03]), "curvature": ("i", [value, value], {"units": unit.format(metre)})}
        assert vb.curvature(xr.Dataset(bent)).curvature == pytest.approx((20, 20))


def test_a_signal_that_wraps_quantities_has_their_unit():
    pint = pytest.importorskip("pint").UnitRegistry()
    time, moved = np.arange(100) / 2000, np.sin(np.arange(100.0))
    wrapped = xr.DataArray(pint.Quantity(moved, "um"), {"time": time}, ("time",))
    np.testing.assert_allclose(as_signal(wrapped), 1e-6 * moved, rtol=1e-12)
    masked = np.ma.masked_array(moved, moved > 0.9)
    for held in (masked, pint.Quantity(masked, "um")):
        with refusal("format", "signal") as caught:
            as_signal(held, sampling_rate=2000.0)
        assert "interpolate over it" in caught.value.remedy


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.int8, np.uint8, np.array, xr.DataArray])
def test_a_number_of_any_kind_is_a_float(kind):
    found = number("x", kind(3), "m")
    assert found == 3
    assert type(found) is float
    assert bare([1.0, 2.0], "s") == [1.0, 2.0]
    for none in (True, np.bool_(True), "3", np.array("3"), 3j, None):
        with refusal("format", "x"):
            number("x", none, "m")
