"""Numbers that state their unit are converted to that of the argument, and refused where it is of another kind."""

import inspect
import re

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.api.shared.arguments import KINDS, LISTS, UNIT_OF
from vibrissa.quantities import dataset

OTHER = {"s": "mm", "Hz": "ms", "m": "ms", "m/s": "deg"}


def stated(value, unit):
    return xr.DataArray(value, attrs={"units": unit})


def documented():
    """Unit of each argument of numbers, as the docstrings of the functions have it, where it is one for each name."""
    found = {}
    for name in dir(vb):
        function = inspect.unwrap(getattr(vb, name))
        if not inspect.isfunction(function) or not hasattr(getattr(vb, name), "__wrapped__"):
            continue
        text = inspect.cleandoc(function.__doc__) + "\n"  # Python 3.13 takes the indent away itself
        for lines in re.findall(r"^(\w[\w, ]*) : [^\n]*\n((?:    [^\n]*\n)+)", text, re.M):
            arguments, units = lines[0].split(", "), re.findall(r"\[(s|Hz|m/s|m|pixels)\]", lines[1])
            if len(units) not in (1, len(arguments)):
                continue
            for argument, unit in zip(arguments, units * len(arguments), strict=False):
                annotation = str(inspect.signature(function).parameters[argument].annotation)
                if annotation in LISTS or "float" in KINDS.get(annotation, ((),))[0]:
                    found.setdefault(argument, set()).add(unit)
    return {name: units.pop() for name, units in found.items() if len(units) == 1}


def test_units_of_arguments_are_those_of_the_docstrings():
    found = {name: unit for name, unit in documented().items() if name != "damping"}  # of no unit, beside a speed
    assert len(found) > 30
    assert found == UNIT_OF


TIME = np.arange(3000) / 500
MOTION = xr.DataArray(
    40e-6 * (1 + 0.8 * np.sin(8 * TIME)) * np.sin(400 * TIME), {"time": TIME}, ["time"], attrs={"units": "m"}
)
SPIKES = {"u": np.random.default_rng(1).uniform(0, 80, 3000)}
TRIALS = [(8.0 * k, 8.0 * k + 6) for k in range(10)]


@pytest.mark.parametrize(
    ("given", "plain"),
    [
        ({"bin_width": stated(20.0, "ms")}, {"bin_width": 0.02}),
        ({"bin_width": np.timedelta64(20, "ms")}, {"bin_width": 0.02}),
        ({"window": stated([1000.0, 6000.0], "ms")}, {"window": (1.0, 6.0)}),
        ({"band": stated([20.0, 200.0], "Hz")}, {"band": (20.0, 200.0)}),
    ],
)
def test_arguments_in_a_multiple_of_their_unit_are_converted(given, plain):
    spikes = vb.read_spikes(SPIKES, trials=TRIALS)
    found, expected = vb.envelope_coupling(spikes, MOTION, **given), vb.envelope_coupling(spikes, MOTION, **plain)
    assert found.unit_rate.item() == expected.unit_rate.item()
    assert found.envelope_correlation.item() == expected.envelope_correlation.item()


@pytest.mark.parametrize("name", ["bin_width", "skip", "window", "band", "spontaneous", "delays"])
def test_arguments_in_a_unit_of_another_kind_are_refused(name):
    unit = OTHER[UNIT_OF[name]]
    value = stated([1.0, 2.0] if name in ("window", "band", "spontaneous", "delays") else 1.0, unit)
    with refusal("unknown", name, unit):
        vb.envelope_coupling(vb.read_spikes(SPIKES, trials=TRIALS), MOTION, **{name: value})


def test_a_refractory_period_is_no_length():
    with refusal("unknown", "refractory_period", "mm"):
        vb.unit_quality(SPIKES, refractory_period=stated(1.0, "mm"))


@pytest.mark.parametrize("several", ["list", "mixed", "array"])
def test_a_window_of_quantities_of_pint_is_one(several):
    unit = pytest.importorskip("pint").UnitRegistry()
    window = {
        "list": [-0.5 * unit.s, 6000 * unit.ms],
        "mixed": [-0.5, 6 * unit.s],
        "array": unit.Quantity([-500, 6000], "ms"),
    }[several]
    found = vb.read_spikes(SPIKES, trials=TRIALS, window=window)
    assert (found.attrs["window_start"], found.attrs["window_stop"]) == (-0.5, 6.0)
    with refusal("unknown", "window"):
        vb.envelope_coupling(found, MOTION, window=[1 * unit.mm, 2 * unit.mm])


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6), ("min", 1 / 60)])
@pytest.mark.parametrize("name", ["decompose", "kinematics", "plot_tracks", "to_movement"])
def test_tracks_that_state_their_time_in_another_unit_are_refused(name, unit, factor):
    x, y = np.broadcast_arrays(np.linspace(0, 0.02, 60), 1e-3 * np.sin(np.arange(50))[:, None])
    arc = np.linspace(0, 0.02, 60)
    profile = dataset({"pixel_size": 1e-4}, time=np.arange(50) / 1000, node=np.arange(60), arc_length=arc, x=x, y=y)
    profile = profile.assign_coords(time=("time", profile.time.values * factor, {"units": unit}))
    more = {"decompose": (vb.atlas("C2"), 0.3), "plot_tracks": (np.zeros((50, 40, 40), np.uint8),)}
    with refusal("unknown", "variable 'time'", repr(unit)):
        getattr(vb, name)(profile, *more.get(name, ()), **({"nose": "top"} if name == "kinematics" else {}))
