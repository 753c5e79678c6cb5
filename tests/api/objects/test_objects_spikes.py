"""Spikes of other packages' objects: units, trials and times survive, or the object is refused in one line."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from plexon_files import write_nex, write_plx
from recorded_trains import TRIAL, assert_same, few, names_of, onsets_of, recordings, session_trains, trials_of
from refusals import refusal

from vibrissa.api.objects.dataframes import to_dataframe
from vibrissa.api.objects.spikes import as_spikes
from vibrissa.errors import InputError
from vibrissa.neural.io.recording import recorded_spikes
from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.spike_csv import write_csv
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.quantities import dataset

# Plain objects and pandas


@few
@given(recordings())
def test_trains_by_name_are_cut_into_trials(recording):
    trains = dict(zip(names_of(recording), session_trains(recording), strict=True))
    pairs = np.stack([onsets_of(recording), onsets_of(recording) + TRIAL], 1)
    assert_same(as_spikes(trains, trials=pairs), recording)
    assert_same(as_spikes(trains, trials=onsets_of(recording), window=(0.0, TRIAL)), recording)
    assert_same(as_spikes(as_spikes(trains), trials=trials_of(recording)), recording)


@few
@given(recordings())
def test_a_data_frame_goes_there_and_back(recording):
    spikes = as_spikes(
        dict(zip(names_of(recording), session_trains(recording), strict=True)), trials=trials_of(recording)
    )
    frame = to_dataframe(spikes)
    assert list(frame.columns) == ["spike_time_s", "trial", "unit"]
    again = as_spikes(frame)
    assert_same(again, recording)
    for name in ("spike_time", "spike_trial", "spike_unit", "unit_name"):
        assert again[name].identical(spikes[name])


def test_a_data_frame_is_read_as_its_csv_is(tmp_path):
    table = spike_table([0.25, 0.5, 0.125], [1, 0, 1], ["b", "a"], trial=[0, 1, 1], unit_quality=["SU", "MU"])
    write_csv(table, tmp_path / "s.csv")
    frame = to_dataframe(table)
    read = as_spikes(tmp_path / "s.csv")
    assert as_spikes(frame).drop_attrs().identical(read.drop_attrs())
    assert as_spikes(pd.read_csv(tmp_path / "s.csv")).drop_attrs().identical(read.drop_attrs())


def test_columns_in_another_unit_or_of_another_spelling():
    right = as_spikes(pd.DataFrame({"spike_time": [0.1, 0.2], "unit": ["3", "10"], "trial": [0, 1]}))
    others = (
        pd.DataFrame({"spike_time_ms": [100.0, 200.0], "unit": [3, 10], "trial": [0, 1]}),
        pd.DataFrame({"time": [0.1, 0.2], "cluster_id": [3.0, 10.0], "trial_index": [0.0, 1.0]}),
        pd.DataFrame({"times": [0.1, 0.2], "trial": [0, 1]}, index=pd.Index([3, 10], name="unit_id")),
        pd.DataFrame({"spike_time": [0.1, 0.2], "time": [7, 8], "unit": pd.Categorical([3, 10]), "trial": [0, 1]}),
    )
    for frame in others:
        assert as_spikes(frame).drop_attrs().identical(right.drop_attrs())


def test_data_frames_that_may_mean_two_things_are_refused():
    with refusal("conflict", "DataFrame", "unit_id, cluster") as caught:
        as_spikes(pd.DataFrame({"spike_time": [0.1], "unit_id": [1], "cluster": [2]}))
    assert "rename(columns={'unit_id': 'unit'})" in str(caught.value)
    with refusal("missing", "DataFrame") as caught:
        as_spikes(pd.DataFrame({"spiketime": [0.1], "unit": [1]}))
    assert "rename(columns={'spiketime': 'spike_time'})" in str(caught.value)
    with refusal("format", "DataFrame, row 1, spike_time"):
        as_spikes(pd.DataFrame({"spike_time": [0.1, np.inf], "unit": [1, 1]}))
    with refusal("format", "DataFrame, row 0, unit"):
        as_spikes(pd.DataFrame({"spike_time": [0.1, 0.2], "unit": [None, "a"]}))
    with refusal("format", "DataFrame, row 0, trial"):
        as_spikes(pd.DataFrame({"spike_time": [0.1], "unit": [1], "trial": [0.5]}))
    with refusal("shape", "DataFrame, spike_times") as caught:
        as_spikes(pd.DataFrame({"unit": ["a"], "spike_times": [np.array([0.1, 0.2])]}))
    assert "explode('spike_times')" in str(caught.value)


def test_what_holds_no_spikes_is_refused_with_the_right_form():
    with refusal("unknown", "spikes", "list") as caught:
        as_spikes([0.1, 0.2])
    assert "dict of arrays" in str(caught.value)
    with refusal("missing", "variable 'spike_time'"):
        as_spikes(xr.Dataset({"x": 3}))
    with refusal("format", "unit a"):
        as_spikes({"a": ["x"]})
    with refusal("format", "unit a", "nan"):
        as_spikes({"a": [0.1, np.nan]})
    with refusal("missing", "window"):
        as_spikes({"a": [0.1]}, trials=[0.0, 1.0])
    with refusal("conflict", "window"):
        as_spikes({"a": [0.1]}, window=(0.0, 1.0))
    with refusal("conflict", "trials, window"):
        as_spikes(spike_table([0.1], [0], ["a"], trial=[0]), window=(0.0, 1.0))
    with refusal("conflict", "event"):
        as_spikes({"a": [0.1]}, event="Start")
    with refusal("range", "trial 1"):
        as_spikes({"a": [0.1]}, trials=[(0.0, 1.0), (0.0, 2.0)])


def test_an_analysis_in_trials_asks_for_the_trials_of_a_session():
    stimulus = dataset(time=np.arange(100) / 1e3, point_displacement=np.zeros(100))
    with refusal("missing", "spikes", "times on the session's clock"):
        refuse_misplaced(as_spikes({"a": [0.01]}), stimulus, 1)
    refuse_misplaced(as_spikes({"a": [0.01]}, trials=[(0.0, 0.1)]), stimulus, 1)


LIGHT = """
import sys
from vibrissa.api.objects.spikes import as_spikes
from vibrissa.api.objects.signals import as_signal
from vibrissa.api.objects.tracks import as_tracks
as_spikes({"a": [0.1]}, trials=[(0, 1)])
as_signal([0.0] * 9, sampling_rate=10.0)
others = {"pynapple", "neo", "spikeinterface", "pynwb", "movement"}
print(sorted(others & {name.partition(".")[0] for name in sys.modules}))
"""


def test_no_package_is_imported_before_its_object_is_here():
    done = subprocess.run([sys.executable, "-c", LIGHT], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# Files


def test_files_are_cut_as_the_command_line_cuts_them(tmp_path):
    pytest.importorskip("neo")
    units, events = {(1, 1): [41_000, 80_400, 120_004]}, {"Start": [(40_000, 0), (80_000, 0)]}
    path = write_plx(tmp_path / "s.plx", units, events)
    session = as_spikes(path)
    assert "spike_trial" not in session
    assert session.sizes["spike"] == 3
    expected, count = recorded_spikes(path, window=(-0.5, 1.0), event="Start")
    found = as_spikes(path, event="Start", window=(-0.5, 1.0))
    assert found.attrs["n_trials"] == count
    for name in ("spike_time", "spike_trial", "spike_unit", "unit_name"):
        assert found[name].identical(expected[name])
    (tmp_path / "t.csv").write_text("start,stop\n1,2\n2,3\n")
    nex = write_nex(tmp_path / "s.nex", {"sig001a": [41_000, 80_400]})
    assert as_spikes(str(nex), trials=tmp_path / "t.csv").spike_trial.values.tolist() == [0, 1]
    with refusal("missing", "window"):
        as_spikes(path, event="Start")


@pytest.mark.parametrize("name", ["a.pl2", "a.nex5", "a.pl3"])
def test_closed_formats_are_refused_with_a_way_out(tmp_path, name):
    (tmp_path / name).write_bytes(b"NEX5")
    with refusal("format", name) as caught:
        as_spikes(tmp_path / name)
    assert "export" in str(caught.value)


@pytest.mark.parametrize("n_trials", [2, 5])
@pytest.mark.parametrize(
    "order", [lambda frame: frame.sort_values("spike_time_s"), lambda frame: frame.sample(frac=1, random_state=3)]
)
def test_a_data_frame_that_was_sorted_or_shuffled_gives_the_same_spikes_back(n_trials, order):
    rng = np.random.default_rng(0)
    about = {"trial": rng.integers(0, 2, 30), "attrs": {"n_trials": n_trials}}
    spikes = spike_table(rng.uniform(0, 1, 30), rng.integers(0, 3, 30), ["u1", "u2", "u10"], **about)
    back = as_spikes(order(to_dataframe(spikes)))
    assert back.equals(spikes)
    assert back.attrs["n_trials"] == n_trials


@pytest.mark.parametrize(
    ("units", "trials", "times"),
    [
        ("aab", [0, 0, 0], [0.1, np.nan, 0.2]),  # not all units have such a row
        ("aaa", [0, 0, 0], [0.1, np.nan, 0.3]),  # every unit has one
        ("aabb", [0, 0, 0, 0], [0.1, np.nan, 0.2, np.nan]),
        ("aabab", [0, 0, 0, 0, 0], [0.1, np.nan, np.nan, np.nan, 0.2]),  # one has two
        ("abaa", [0, 0, 1, 1], [np.nan, np.nan, 0.3, np.nan]),  # of a later trial
    ],
)
def test_a_row_of_a_data_frame_whose_time_is_missing_is_refused(units, trials, times):
    with pytest.raises(InputError, match="spike_time must be a time: the unit has spikes in this trial above"):
        as_spikes(pd.DataFrame({"unit": list(units), "trial": trials, "spike_time": times}))
