"""Groups, intervals and trials of pynapple: there and back, and against its own alignment."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from recorded_trains import TRIAL, assert_same, few, names_of, onsets_of, recordings, session_trains, trials_of
from refusals import refusal

import vibrissa as vb
from vibrissa.api.objects.back import to_pynapple
from vibrissa.api.objects.spikes import as_spikes
from vibrissa.api.objects.trials import as_trials
from vibrissa.neural.io.tables.spikes import spike_table

DATA = Path(__file__).parents[3] / ".." / "shared" / "data" / "spikes"


@few
@given(recordings())
def test_pynapple_groups_there_and_back(recording):
    nap = pytest.importorskip("pynapple")
    trials = trials_of(recording)
    spikes = as_spikes(dict(zip(names_of(recording), session_trains(recording), strict=True)), trials=trials)
    group, intervals = to_pynapple(spikes), to_pynapple(spikes[["trial_start", "trial_stop"]])
    assert isinstance(group, nap.TsGroup)
    assert isinstance(intervals, nap.IntervalSet)
    for k, train in enumerate(session_trains(recording)):
        np.testing.assert_allclose(group[k].t, train, atol=1e-9)
    assert_same(as_spikes(group, trials=intervals), recording)
    assert_same(as_spikes(group, trials=nap.Ts(onsets_of(recording)), window=(0.0, TRIAL)), recording)


def test_a_group_of_pynapple_keeps_its_keys_names_and_time_support():
    nap = pytest.importorskip("pynapple")
    support = nap.IntervalSet([0.0, 4.0], [3.0, 9.0])
    trains = {7: nap.Ts([0.5, 1.5, 4.5]), 3: nap.Ts([])}
    spikes = as_spikes(nap.TsGroup(trains, time_support=support, metadata={"quality": ["MU", "SU"]}))
    assert spikes.unit_name.values.tolist() == ["3", "7"]
    assert spikes.unit_quality.values.tolist() == ["SU", "MU"]
    assert np.bincount(spikes.spike_unit, minlength=2).tolist() == [0, 3]
    cut = as_spikes(spikes, trials=[(0.0, 1.0), (2.5, 4.5)])
    assert cut.unit_observed.values.tolist() == [[True, False]] * 2
    again = to_pynapple(spikes)
    assert list(again.keys()) == [3, 7]
    np.testing.assert_allclose(again.time_support.values, support.values)
    assert as_spikes(again).identical(spikes)


@pytest.mark.parametrize(
    ("names", "expected"), [(["left", "right"], ["left", "right"]), (["good", "good"], ["3", "7"])]
)
def test_units_are_called_by_their_name_where_each_has_its_own(names, expected):
    nap = pytest.importorskip("pynapple")
    group = nap.TsGroup({3: nap.Ts([0.1, 0.5]), 7: nap.Ts([0.2, 0.7])}, metadata={"name": names})
    spikes = as_spikes(group)
    assert spikes.unit_name.values.tolist() == expected
    assert spikes.unit_id.values.tolist() == [3, 7]


def test_a_default_time_support_says_nothing_of_observation():
    nap = pytest.importorskip("pynapple")
    assert "interval_start" not in as_spikes(nap.Ts([0.5, 1.5]))
    assert "interval_start" not in as_spikes(nap.TsGroup({0: nap.Ts([0.5, 1.5]), 1: nap.Ts([1.0, 2.0])}))
    assert "interval_start" in as_spikes(nap.Ts([0.5, 1.5], time_support=nap.IntervalSet(0, 2)))


def test_trials_that_touch_are_not_joined_and_those_that_overlap_are_refused():
    pytest.importorskip("pynapple")
    touching = as_spikes({"a": [0.5, 1.0, 1.5]}, trials=[(0.0, 1.0), (1.0, 2.0)])
    group, intervals = to_pynapple(touching), to_pynapple(touching[["trial_start", "trial_stop"]])
    assert len(intervals) == 2
    again = as_spikes(group, trials=intervals)
    assert again.spike_trial.values.tolist() == [0, 1, 1]
    np.testing.assert_allclose(again.spike_time, touching.spike_time, atol=1e-9)
    nobody = touching.isel(unit=[], spike=[])
    assert len(to_pynapple(nobody)) == 0
    overlapping = as_spikes({"a": [0.5, 1.2]}, trials=[(0.0, 1.0), (1.0, 2.0)], window=(-0.5, 1.0))
    with refusal("conflict", "trials"):
        to_pynapple(overlapping)


def test_spikes_whose_onsets_are_not_known_need_them():
    pytest.importorskip("pynapple")
    spikes = spike_table([0.1, 0.2], [0, 0], ["a"], trial=[0, 1], attrs={"n_trials": 2})
    with refusal("missing", "trials"):
        to_pynapple(spikes)
    group = to_pynapple(spikes, trials=[(10.0, 11.0), (20.0, 21.0)])
    np.testing.assert_allclose(group[0].t, [10.1, 20.2])
    with refusal("shape", "trials"):
        to_pynapple(spikes, trials=[(10.0, 11.0)])
    with refusal("range", "spikes"):
        to_pynapple(as_spikes({"a": [1.0]}))


def test_windows_about_onsets_are_the_time_support():
    pytest.importorskip("pynapple")
    spikes = as_spikes({"a": [9.8, 10.5, 19.7]}, trials=[10.0, 20.0], window=(-0.5, 1.0))
    group = to_pynapple(spikes)
    np.testing.assert_allclose(group.time_support.values, [[9.5, 11.0], [19.5, 21.0]])
    again = as_spikes(group, trials=to_pynapple(spikes[["trial_start", "trial_stop"]]), window=(-0.5, 1.0))
    np.testing.assert_allclose(again.spike_time, [-0.2, 0.5, -0.3], atol=1e-9)
    assert again.unit_observed.values.all()


@pytest.mark.filterwarnings("ignore::UserWarning", "ignore::DeprecationWarning")  # pynwb's, of a field of this file
def test_a_real_file_is_the_same_through_pynapple_and_pynwb():
    nap, pynwb = pytest.importorskip("pynapple"), pytest.importorskip("pynwb")
    path = DATA / "A8604-211122.nwb"
    if not path.is_file():
        pytest.skip("real data A8604-211122.nwb is not here")
    direct = as_spikes(path)
    with pynwb.NWBHDF5IO(str(path), "r") as io:
        file = io.read()
        opened, trials = as_spikes(file), as_trials(file.intervals["epochs"])
    assert opened.drop_attrs().identical(direct.drop_attrs())
    assert trials.trial_stop.values.tolist() == [1087.5289]
    loaded = as_spikes(nap.load_file(str(path))["units"])
    assert loaded.sizes["unit"] == 3
    assert np.bincount(loaded.spike_unit).tolist() == [11020, 4690, 5644]
    np.testing.assert_allclose(loaded.spike_time, direct.spike_time, atol=1e-9)
    np.testing.assert_array_equal(loaded.spike_unit, direct.spike_unit)
    with refusal("format", "NWBFile") as caught:  # the file is closed
        as_spikes(file)
    assert "NWBHDF5IO(path, 'r').read()" in str(caught.value)


def test_trials_are_those_that_pynapple_aligns():
    nap = pytest.importorskip("pynapple")
    rng = np.random.default_rng(5)
    trains = {k: nap.Ts(np.sort(rng.integers(0, 100_000_000, 500)) / 1e6) for k in range(3)}
    group, events = nap.TsGroup(trains, time_support=nap.IntervalSet(0, 100)), nap.Ts(np.arange(5.0, 95.0, 10.0) + 1e-7)
    spikes = as_spikes(group, trials=events, window=(-1.0, 3.0))
    aligned = nap.compute_perievent(group, events, (-1.0, 3.0))
    assert spikes.sizes["spike"] == sum(len(one) for unit in aligned.values() for one in unit.values()) > 500
    for k, unit in aligned.items():
        for trial, one in unit.items():
            own = (spikes.spike_unit.values == k) & (spikes.spike_trial.values == trial)
            np.testing.assert_allclose(spikes.spike_time[own], one.t, atol=2e-9)
    for trials_of_a_unit in (aligned[0], aligned):  # whose elements are trials, not units
        with refusal("unknown", "pynapple TsGroup", "trials about events"):
            as_spikes(trials_of_a_unit)


def test_trials_in_which_units_were_not_observed_are_no_part_of_the_time_support():
    pytest.importorskip("pynapple")
    seen = np.array([[True, False], [True, False]])
    table = spike_table([0.5, 0.5, 1.5], [0, 1, 1], ["a", "b"], trial=[0, 0, 0], unit_observed=seen)
    table = table.assign(trial_start=("trial", [0.0, 5.0]), trial_stop=("trial", [5.0, 10.0]))
    group = to_pynapple(table)
    assert group.time_support.values.tolist() == [[0.0, 5.0]]
    assert [float(len(group[k])) for k in (0, 1)] == [1.0, 2.0]
    with refusal("conflict", "units"):
        to_pynapple(table.assign(unit_observed=(("unit", "trial"), [[True, True], [True, False]])))


@pytest.mark.parametrize(
    ("time", "attrs"),
    [
        ([0.0, 500.0, 1000.0], {"units": "ms"}),
        (np.array([0, 500, 1000], "timedelta64[ms]").astype("timedelta64[ns]"), {}),
        ([0.0, 0.5, 1.0], {"units": "s"}),
        ([0.0, 0.5, 1.0], {}),
    ],
)
def test_times_of_a_signal_are_taken_in_the_unit_they_state(time, attrs):
    signal = xr.DataArray([1.0, 2.0, 3.0], {"time": ("time", time, attrs)}, ["time"])
    np.testing.assert_allclose(to_pynapple(signal).t, [0.0, 0.5, 1.0])


def test_trials_in_another_order_give_the_same_group_and_intervals_in_time():
    pytest.importorskip("pynapple")
    times = {"a": [1.5, 3.5, 8.5], "b": [1.2]}
    whole = vb.read_spikes(times, trials=[(1.0, 2.0), (3.0, 4.0), (8.0, 9.0)])
    mixed = whole.isel(trial=[2, 0, 1])
    group, ordered = vb.to_pynapple(mixed), vb.to_pynapple(whole)
    assert [group[k].t.tolist() for k in group] == [ordered[k].t.tolist() for k in ordered] == list(times.values())
    np.testing.assert_array_equal(group.time_support.values, ordered.time_support.values)
    table = mixed[["trial_start", "trial_stop"]].assign(trial_stimulus=("trial", ["c", "a", "b"]))
    intervals = vb.to_pynapple(table)
    assert intervals.start.tolist() == [1.0, 3.0, 8.0]
    assert list(intervals["stimulus"]) == ["a", "b", "c"]
