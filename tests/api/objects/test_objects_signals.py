"""Signals of other packages' objects: values in SI, even times, or one line that says what to do."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

import vibrissa as vb
from vibrissa.api.objects.back import to_pynapple
from vibrissa.api.objects.dataframes import to_dataframe
from vibrissa.api.objects.signals import as_signal
from vibrissa.neural.io.tables.stimulus_csv import write_stimulus
from vibrissa.quantities import dataset, require
from vibrissa.stimulus.export import write_command

RATE = 2000.0
few = settings(max_examples=25, deadline=None)
microns = st.lists(st.integers(-100, 100), min_size=4, max_size=40).map(lambda v: np.array(v, float))


def times(count, start=0.0):
    return start + np.arange(count) / RATE


@few
@given(microns, st.integers(0, 50))
def test_one_displacement_is_the_same_whatever_holds_it(um, start):
    nap, neo, pq = (pytest.importorskip(name) for name in ("pynapple", "neo", "quantities"))
    time = times(um.size, start)
    neo_signal = neo.AnalogSignal(um[:, None], units="um", sampling_rate=2 * pq.kHz, t_start=1e3 * start * pq.ms)
    held = [
        xr.DataArray(um, {"time": time}, ("time",), attrs={"units": "µm"}),
        xr.DataArray(um, {"time": ("time", 1e3 * time, {"units": "ms"})}, ("time",), attrs={"units": "micrometers"}),
        xr.DataArray(um / 1e6, {"time": time}, ("time",), attrs={"units": "m"}),
        dataset(time=time, point_displacement=um / 1e6),
        nap.Tsd(time, um / 1e6),
        neo_signal,
    ]
    for thing in held:
        found = as_signal(thing)
        np.testing.assert_allclose(found, um / 1e6, rtol=1e-15)
        np.testing.assert_allclose(found.time, time, atol=1e-9)
        assert found.attrs["units"] == "m"
        assert found.attrs["sampling_rate"] == pytest.approx(RATE)
        require(found.to_dataset(), "time", "point_displacement")
    np.testing.assert_allclose(as_signal(um, sampling_rate=RATE, unit="um"), um / 1e6, rtol=1e-15)


@few
@given(microns)
def test_signals_go_to_pynapple_and_back(um):
    pytest.importorskip("pynapple")
    one = as_signal(um, sampling_rate=RATE, unit="um")
    assert np.array_equal(as_signal(to_pynapple(one)), one)
    assert np.array_equal(as_signal(to_pynapple(one.to_dataset())), one)
    several = dataset(whisker=["C1", "C2"], time=times(um.size), command=np.stack([um, -um]) / 1e6)
    frame = to_pynapple(several.command)
    assert list(frame.columns) == ["C1", "C2"]
    again = as_signal(frame, quantity="command")
    assert again.dims == ("whisker", "time")
    assert again.whisker.values.tolist() == ["C1", "C2"]
    assert np.array_equal(again, several.command)


def test_an_envelope_is_held_as_its_signal_is():
    nap, neo, pq = (pytest.importorskip(name) for name in ("pynapple", "neo", "quantities"))
    ringing = np.random.default_rng(1).standard_normal((2, 300))
    plain, time = vb.envelope(ringing), times(300, 2.0)
    one, two = vb.envelope(nap.Tsd(time, ringing[0])), vb.envelope(nap.TsdFrame(time, ringing.T, columns=["a", "b"]))
    assert (type(one), type(two)) == (nap.Tsd, nap.TsdFrame)
    assert two.columns.tolist() == ["a", "b"]
    np.testing.assert_allclose(one.t, time)
    np.testing.assert_allclose(one.values, plain[0], rtol=1e-12)
    np.testing.assert_allclose(two.values, plain.T, rtol=1e-12)
    for channels in (1, 2):
        signal = neo.AnalogSignal(ringing[:channels].T, units="um", sampling_rate=2 * pq.kHz, t_start=2 * pq.s)
        found = vb.envelope(signal)
        assert isinstance(found, neo.AnalogSignal)
        assert (found.t_start, found.units) == (signal.t_start, signal.units)
        np.testing.assert_allclose(found.magnitude, plain[:channels].T, rtol=1e-12)
    epochs = nap.IntervalSet([0.0, 1.0], [0.5, 1.5])
    with refusal("range"):
        vb.envelope(nap.Tsd(np.arange(0, 1.5, 0.01), np.zeros(150)).restrict(epochs))


def test_channels_of_neo_are_kept_in_the_unit_it_states():
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    values = np.arange(12.0).reshape(6, 2)
    signal = neo.AnalogSignal(
        values, units="mV", sampling_rate=1 * pq.kHz, array_annotations={"channel_names": ["a", "b"]}
    )
    found = as_signal(signal, quantity=None)
    assert found.dims == ("channel", "time")
    assert found.channel.values.tolist() == ["a", "b"]
    assert found.attrs["units"] == "V"
    np.testing.assert_allclose(found, 1e-3 * values.T)
    with refusal("unknown", "neo AnalogSignal", "mV") as caught:
        as_signal(signal)
    assert "m per V" in str(caught.value)
    scaled = as_signal(signal[:, 0] * (40 * pq.um / pq.mV))
    np.testing.assert_allclose(scaled, 40e-6 * values[:, 0])


def test_arrays_with_a_unit_keep_it():
    pq = pytest.importorskip("quantities")
    np.testing.assert_allclose(as_signal(GOOD * 1e6 * pq.um, sampling_rate=RATE), GOOD, rtol=1e-14)
    assert as_signal(GOOD * pq.mV, sampling_rate=RATE, quantity=None).attrs["units"] == "V"
    with refusal("unknown", "quantities Quantity"):
        as_signal(GOOD * pq.mV, sampling_rate=RATE)


def test_a_signal_that_neo_itself_makes():
    neo = pytest.importorskip("neo")
    signal = neo.io.ExampleIO("fake").read_block().segments[0].analogsignals[0]
    found = as_signal(signal, quantity=None)
    np.testing.assert_allclose(found, signal.rescale("V").magnitude.T, rtol=1e-12)
    np.testing.assert_allclose(found.time, signal.times.rescale("s").magnitude)


def test_a_real_tone_is_the_same_through_pynapple_and_neo():
    """The amplitude that a locust heard, of the package nitime."""
    nitime, nap, neo = (pytest.importorskip(name) for name in ("nitime", "pynapple", "neo"))
    ticks, amplitude = np.loadtxt(Path(nitime.__file__).parent / "data" / "grasshopper_stimulus1.txt").T
    through_pynapple = as_signal(nap.Tsd(ticks, amplitude, time_units="us"), quantity=None)
    irregular = neo.IrregularlySampledSignal(ticks, amplitude, units="dimensionless", time_units="us")
    through_neo = as_signal(irregular, quantity=None)
    for found in (through_pynapple, through_neo):
        assert found.attrs["sampling_rate"] == pytest.approx(20_000, rel=1e-6)
        np.testing.assert_array_equal(found, amplitude)


def test_files_of_stimuli_and_commands(tmp_path):
    time = times(400)
    motion = 1e-5 * np.sin(400 * time)
    stimulus = dataset(time=time, point_displacement=motion)
    write_stimulus(stimulus, tmp_path / "s.csv")
    stimulus.to_netcdf(tmp_path / "s.nc", engine="h5netcdf")
    for name in ("s.csv", "s.nc"):
        np.testing.assert_array_equal(as_signal(tmp_path / name), motion)
    command = dataset(whisker=["C1", "C2"], time=time, command=np.stack([motion, -motion]))
    for name in ("c.wav", "c.npy", "c.csv"):
        write_command(command, tmp_path / name)
        found = as_signal(str(tmp_path / name), quantity="command")
        np.testing.assert_allclose(found.sel(whisker="C2"), -motion, atol=1e-11)
    assert as_signal(tmp_path / "c.wav").sel(whisker="C1").attrs["units"] == "m"


GOOD = np.sin(np.arange(50.0)) * 1e-5


def holed(time):
    return np.delete(time, slice(20, 30))


@pytest.mark.parametrize(
    ("time", "words"),
    [
        (holed(times(60)), "a hole of 0.0055 s after 0.0095 s"),
        (times(50) + 2e-4 * (np.arange(50) == 7), "a step of 0.0007 s after 0.003 s"),
        (times(50)[::-1], "0.0245 s to 0 s"),
        (np.cumsum(1 + 0.009 * np.linspace(-1, 1, 50)) / RATE, "out of step"),
    ],
)
def test_uneven_times_and_holes_are_refused_with_a_remedy(time, words):
    with refusal("range") as caught:
        as_signal(xr.DataArray(GOOD, {"time": time}, ("time",), attrs={"units": "m"}))
    assert words in str(caught.value)
    assert "np.interp(" in str(caught.value)


@pytest.mark.parametrize(("rate", "digits"), [(30000, 6), (2048, 4)])
def test_times_rounded_by_a_clock_are_even_as_in_files(rate, digits):
    time = np.round(np.arange(2000) / rate, digits)
    found = as_signal(xr.DataArray(np.sin(time), {"time": time}, ("time",), attrs={"units": "m"}))
    assert float(1 / np.diff(found.time).mean()) == pytest.approx(rate, rel=1e-3)


def test_a_hole_between_two_epochs_of_pynapple_is_refused():
    nap = pytest.importorskip("pynapple")
    signal = nap.Tsd(times(50), GOOD).restrict(nap.IntervalSet([0.0, 0.015], [0.01, 0.02]))
    with refusal("range", "pynapple Tsd: time") as caught:
        as_signal(signal)
    assert "a hole of" in str(caught.value)


def test_samples_that_were_not_measured_are_refused_with_a_remedy():
    bad = np.where(np.arange(50) == 4, np.nan, GOOD)
    with refusal("range", "numpy ndarray", "1 samples that are not, the first at 0.002 s") as caught:
        as_signal(bad, sampling_rate=RATE)
    assert "np.interp(t, t[seen], values[seen])" in str(caught.value)


def test_what_does_not_say_its_unit_time_or_meaning_is_refused():
    array = xr.DataArray(GOOD, {"time": times(50)}, ("time",), attrs={"units": "m"})
    with refusal("missing", "signal") as caught:
        as_signal(GOOD)
    timed = eval(caught.value.remedy, {"xr": xr, "np": np, "values": GOOD, "rate": RATE})
    assert as_signal(timed).attrs["sampling_rate"] == pytest.approx(RATE)
    with refusal("range", "sampling_rate"):
        as_signal(GOOD, sampling_rate=-1.0)
    with refusal("conflict", "sampling_rate"):
        as_signal(array, sampling_rate=RATE)
    with refusal("conflict", "unit", "um"):
        as_signal(array, unit="um")
    with refusal("range", "numpy ndarray") as caught:
        as_signal(GOOD * 1e6, sampling_rate=RATE)
    assert "unit='um'" in str(caught.value)
    with refusal("unknown", "xarray DataArray", "degC"):
        as_signal(array.assign_attrs(units="degC"))
    with refusal("missing", "signal"):
        as_signal(array.drop_vars("time"))
    with refusal("format", "time"):
        as_signal(array.assign_coords(time=np.datetime64("2014-05-07") + np.arange(50)))
    with refusal("format", "time", "m"):
        as_signal(array.assign_coords(time=("time", times(50), {"units": "m"})))
    with refusal("shape", "signal"):
        as_signal(np.zeros((3, 50)), sampling_rate=RATE)
    with refusal("missing", "signal", "x, y"):
        as_signal(xr.Dataset({"x": array, "y": array}))
    with refusal("unknown", "signal", "dict"):
        as_signal({})
    with refusal("unknown", "quantity"):
        as_signal(array, quantity="displacment")
    with refusal("too-few"):
        as_signal(GOOD[:3], sampling_rate=RATE)


def test_timedeltas_count_in_seconds():
    step = np.arange(50) * np.timedelta64(500, "us")
    found = as_signal(xr.DataArray(GOOD, {"time": step}, ("time",)))
    np.testing.assert_allclose(found.time, times(50))


# Data frames


def test_units_are_in_the_names_of_columns():
    rng = np.random.default_rng(1)
    data = dataset(
        lead=("unit",), unit_name=["a", "b"], bin=[0.0, 0.1], firing_rate=rng.random((2, 2)), bin_envelope=[1e-6, 2e-6]
    )
    frame = to_dataframe(data)
    assert list(frame.columns) == ["unit", "bin_s", "unit_name", "firing_rate_Hz", "bin_envelope_m"]
    assert frame.unit_name.tolist() == ["a", "a", "b", "b"]
    assert frame.bin_envelope_m.tolist() == [1e-6, 2e-6] * 2
    np.testing.assert_array_equal(frame.firing_rate_Hz, data.firing_rate.values.ravel())
    units = to_dataframe(dataset(unit_name=["a"], slope=[2e6]))
    assert list(units.columns) == ["unit", "unit_name", "slope_per_s_m"]


def test_variables_that_no_one_table_holds_are_refused_by_name():
    data = dataset(time=[0.0, 1.0], point_displacement=[0.0, 1.0], frequency=[1.0], band_gain=[1.0])
    with refusal("shape", "data") as caught:
        to_dataframe(data)
    assert "data.drop_dims(['frequency'])" in str(caught.value)
    assert list(to_dataframe(data.drop_dims(["frequency"])).columns) == ["time_s", "point_displacement_m"]
    with refusal("too-few", "data"):
        to_dataframe(xr.Dataset())


def test_an_envelope_of_uneven_times_is_refused_whoever_has_them():
    ringing = np.sin(np.arange(400.0))
    uneven = np.cumsum(np.random.default_rng(1).random(400))
    for time in (uneven, np.arange(400.0)[::-1], uneven * 1e9 * np.timedelta64(1, "ns")):
        with refusal("range", "signal: time"):
            vb.envelope(xr.DataArray(ringing, {"time": time}, ("time",)))
    for time in (np.arange(400.0), np.arange(400) * np.timedelta64(1, "ms")):
        found = vb.envelope(xr.DataArray(ringing, {"time": time}, ("time",), attrs={"long_name": "displacement"}))
        np.testing.assert_array_equal(found, vb.envelope(ringing))
        assert found.attrs["long_name"] == "envelope of displacement"


def test_dates_of_an_envelope_must_be_even():
    ringing = np.sin(np.arange(400.0))
    dates = np.datetime64("2014-05-07T12:00", "ns") + np.arange(400) * np.timedelta64(1, "ms")
    found = vb.envelope(xr.DataArray(ringing, {"time": dates}, ("time",)))
    np.testing.assert_array_equal(found, vb.envelope(ringing))
    np.testing.assert_array_equal(found.time, dates)
    for wrong in (dates[::-1], np.delete(np.append(dates, dates[-1:] + np.timedelta64(1, "ms")), 200)):
        with refusal("range", "signal: time"):
            vb.envelope(xr.DataArray(ringing, {"time": wrong}, ("time",)))
    with refusal("format", "time") as caught:
        vb.envelope(xr.DataArray(ringing, {"time": dates.astype(str)}, ("time",)))
    assert "np.arange" in caught.value.remedy


def test_an_envelope_has_the_unit_of_its_array():
    pint, pq = pytest.importorskip("pint").UnitRegistry(), pytest.importorskip("quantities")
    ringing = np.sin(np.arange(400.0))
    plain = vb.envelope(ringing)
    of_pint, of_pq = vb.envelope(pint.Quantity(ringing, "um")), vb.envelope(ringing * pq.um)
    np.testing.assert_allclose(of_pint.m_as("m"), 1e-6 * plain, rtol=1e-12)
    np.testing.assert_allclose(of_pq.rescale("m").magnitude, 1e-6 * plain, rtol=1e-12)
    wrapped = vb.envelope(xr.DataArray(pint.Quantity(ringing, "um"), {"time": np.arange(400.0)}, ("time",)))
    np.testing.assert_allclose(wrapped.data.m_as("m"), 1e-6 * plain, rtol=1e-12)


def test_what_would_lose_its_times_or_mask_has_no_envelope():
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    time, ringing = np.arange(400.0), np.sin(np.arange(400.0))
    array = xr.DataArray(ringing, {"time": time}, ("time",))
    held = [pd.Series(ringing, index=time), array.to_dataset(name="x"), neo.SpikeTrain(time * pq.s, t_stop=400)]
    held.append(neo.IrregularlySampledSignal(time * pq.s, ringing, units="um", time_units="s"))
    for signal in (*held, "abc"):
        with refusal("format", "signal"):
            vb.envelope(signal)
    with refusal("format", "signal") as caught:
        vb.envelope(np.ma.masked_array(ringing, ringing > 0.9))
    assert "interpolate over it" in caught.value.remedy
