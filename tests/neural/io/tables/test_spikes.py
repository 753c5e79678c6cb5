"""Tables of spikes: files read strictly, spikes cut into trials, all by hand."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.neural.coupling.response import psth
from vibrissa.neural.io.tables.spike_csv import read_spikes, units_by_name, write_csv
from vibrissa.neural.io.tables.spikes import join_units, of_unit, spike_table
from vibrissa.neural.io.tables.trials import cut_into_trials, read_trials, trial_table, trials_at
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes


@pytest.fixture
def file(tmp_path):
    """Write text into a file of its own."""

    def write(text, name="spikes.csv"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


# Reading


def test_spikes_are_read_by_hand(file):
    spikes = read_spikes(file("# of May\nunit,trial,spike_time,whisker\nb,0,0.25,C2\na,1,0.5,D1\n\nb,0,0.125,C2\n"))
    assert spikes.unit_name.values.tolist() == ["a", "b"]
    assert spikes.spike_time.values.tolist() == [0.5, 0.125, 0.25]
    assert spikes.spike_unit.values.tolist() == [0, 1, 1]
    assert spikes.spike_trial.values.tolist() == [1, 0, 0]
    assert spikes.unit_whisker.values.tolist() == ["D1", "C2"]
    assert "n_trials" not in spikes.attrs  # the last trials may have been silent
    assert spikes.attrs["spikes_out_of_order"] == 1  # 0.125 after 0.25, told and not hidden
    assert spikes.spike_time.attrs["units"] == "s"


def test_order_across_units_and_trials_is_free(file):
    spikes = read_spikes(file("spike_time,trial,unit\n0.9,1,a\n0.1,0,b\n0.2,0,a\n0.2,0,a\n"))
    assert spikes.attrs["spikes_out_of_order"] == 0
    assert spikes.attrs["spikes_repeated"] == 1


def test_milliseconds_are_told_by_the_name_of_the_column(file):
    spikes = read_spikes(file("spike_time_ms,unit\n1500,a\n"))
    assert spikes.spike_time.values.tolist() == [1.5]
    assert "spike_trial" not in spikes


def test_trials_that_are_listed_count_from_0(file):
    path = file("spike_time,trial,unit\n0.9,2,a\n0.1,1,b\n,3,a\n")
    with refusal("format", "spikes.csv, line 3, trial") as caught:
        read_spikes(path)  # else a silent trial 0 would thin the rate
    assert (caught.value.quantity, caught.value.rule) == (f"{path}, line 3, trial", "must be 0 on a line")
    assert read_spikes(file("spike_time,trial,unit\n0.9,2,a\n0.1,1,b\n")).spike_trial.values.tolist() == [2, 1]


@pytest.mark.parametrize("all_trials", [False, True])
def test_a_file_without_silent_trials_tells_their_number_only_if_it_holds_all(file, all_trials):
    path = file("spike_time,trial,unit\n0.9,0,a\n0.1,4,b\n")
    assert read_spikes(path, all_trials=all_trials).attrs.get("n_trials") == (5 if all_trials else None)


def test_line_without_a_time_tells_of_silence(file):
    spikes = read_spikes(file("spike_time,trial,unit\n,7,silent\n0.1,0,a\n"))
    assert spikes.unit_name.values.tolist() == ["a", "silent"]
    assert spikes.sizes["spike"] == 1
    assert spikes.attrs["n_trials"] == 8


@given(lines=st.permutations(["u10", "u2", "u2", "SU003", "SU02", "a", "10,1", "3,1", "9" * 5000]))
def test_units_are_in_the_order_of_their_names_whatever_that_of_the_lines(lines):
    names, unit = units_by_name(lines)
    assert names == ["3,1", "10,1", "9" * 5000, "SU02", "SU003", "a", "u2", "u10"]
    assert [names[k] for k in unit] == lines


def test_columns_that_are_not_read_are_named(file):
    assert read_spikes(file("spike_time,unit,depth\n0.1,a,3\n")).attrs["columns_left_alone"] == "depth"


@pytest.mark.parametrize(
    ("text", "code", "place", "rule", "value"),
    [
        ("", "too-few", "", "must hold a header and a line for each row", "an empty file"),
        ("spike_time,trial\n0.1,0\n", "missing", ", line 1", "must have a column unit", "'spike_time,trial'"),
        ("spike_time,spike_time_ms,unit\n0.1,1,a\n", "missing", ", line 1", "must have one column spike_time", None),
        ("spike_time,unit,unit\n0.1,a,a\n", "missing", ", line 1", "must have one column unit", None),
        ("spike_time,unit,x,x\n0.1,a,1,2\n", "format", ", line 1", "must name each column once", "'x'"),
        ("spike_time;unit\n0.1;a\n", "format", ", line 1", "must separate its columns by commas", "'spike_time;unit'"),
        ("spike_time,unit\n0,1,a\n", "shape", ", line 2", "must have 2 cells, spike_time,unit", "3"),
        ("spike_time,unit\n0.1,a\nnan,a\n", "format", ", line 3, spike_time", "must be a finite number", "'nan'"),
        ("spike_time,unit\nx,a\n", "format", ", line 2, spike_time", "must be a finite number", "'x'"),
        ("spike_time,unit\n1_0,a\n", "format", ", line 2, spike_time", "must be a finite number", "'1_0'"),
        ("spike_time,unit\n1e300,a\n", "format", ", line 2, spike_time", "must be at most 1e+07 s", "'1e300'"),
        ("spike_time_ms,unit\n1e11,a\n", "format", ", line 2, spike_time_ms", "must be at most 1e+07 s", "'1e11'"),
        ("spike_time,unit\n0.1,\n", "format", ", line 2, unit", "must name a unit in printable signs", "''"),
        ("spike_time,unit\n0.1,a\0\n", "format", ", line 2, unit", "must be text in printable signs", "'a\\x00'"),
        ('spike_time,unit\n0.1,"a\n', "format", ", line 2", "must close its quotes", None),
        (
            "spike_time,unit,trial\n0.1,a,-1\n",
            "format",
            ", line 2, trial",
            "must be a whole number from 0 to 999999",
            "'-1'",
        ),
        (
            "spike_time,unit,trial\n0.1,a,0.5\n",
            "format",
            ", line 2, trial",
            "must be a whole number from 0 to 999999",
            "'0.5'",
        ),
        ("spike_time,unit,trial\n0.1,a,\n", "format", ", line 2, trial", "must be a finite number", "''"),
        (
            "spike_time,unit,trial\n0.1,a,1e9\n",
            "format",
            ", line 2, trial",
            "must be a whole number from 0 to 999999",
            "'1e9'",
        ),
        (
            "spike_time,unit,whisker\n0.1,a,C2\n0.2,a,C3\n",
            "format",
            ", line 3, whisker",
            "must be the same on all lines of a unit",
            "'C3'",
        ),
    ],
)
def test_faults_are_refused_in_one_line(file, text, code, place, rule, value):
    path = file(text)
    with refusal(code, value=value) as caught:
        read_spikes(path)
    assert (caught.value.quantity, caught.value.rule) == (f"{path}{place}", rule)


def test_what_is_no_text_is_refused(file):
    with refusal("format", "spikes.csv") as caught:
        read_spikes(file(b"spike_time,unit\n\xff\xfe,a\n"))
    assert caught.value.remedy == "save it as CSV, UTF-8"


@pytest.mark.parametrize(
    ("header", "remedy"),
    [
        ("time,unit", "rename the column 'time' to spike_time"),
        ("t,unit", "rename the column 't' to spike_time"),
        ("time_ms,trial,unit", "rename the column 'time_ms' to spike_time_ms"),
        ("Times,unit", "rename the column 'Times' to spike_time"),
        ("unit,trial,spike_times", "rename the column 'spike_times' to spike_time"),
    ],
)
def test_other_names_of_the_times_are_refused_with_the_one_that_is_read(file, header, remedy):
    with refusal("missing", "spikes.csv, line 1") as caught:
        read_spikes(file(header + "\n0.1,0,a\n"))
    assert caught.value.rule == "must have a column spike_time"
    assert caught.value.remedy == remedy


def test_missing_file_is_refused(tmp_path):
    with refusal("missing", "none.csv"):
        read_spikes(tmp_path / "none.csv")


CELLS = st.sampled_from(
    ["spike_time", "unit", "trial", "spike_time_ms", "whisker", "a", "0.1", "-1", "1e400", "", '"', "nan", "٣"]
)


@settings(deadline=None, derandomize=True, max_examples=100)
@given(text=st.lists(st.lists(CELLS, min_size=1, max_size=4).map(",".join), max_size=5).map("\n".join) | st.text())
def test_any_text_is_read_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("fuzz") / "spikes.csv"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    for read in (lambda: read_spikes(path), lambda: read_spikes(path, all_trials=True), lambda: read_trials(path)):
        with suppress(InputError):
            assert read() is not None


@settings(deadline=None, derandomize=True, max_examples=100)
@given(data=st.binary(max_size=60), head=st.sampled_from([b"", b"spike_time,unit,trial\n", b"start,stop\n"]))
def test_any_bytes_are_read_or_refused(tmp_path_factory, data, head):
    path = tmp_path_factory.mktemp("fuzz") / "spikes.csv"
    path.write_bytes(head + data)
    for read in (read_spikes, read_trials):
        with suppress(InputError):
            assert read(path) is not None


# Writing

NAMES = st.text(st.characters(codec="utf-8"), min_size=1, max_size=5).filter(
    lambda n: n == n.strip() and n.isprintable()
)


@st.composite
def tables(draw):
    names, _ = units_by_name(draw(st.lists(NAMES, min_size=1, max_size=4, unique=True)))
    n = draw(st.integers(0, 12))
    time = draw(st.lists(st.floats(-1e6, 1e6), min_size=n, max_size=n))
    unit = draw(st.lists(st.integers(0, len(names) - 1), min_size=n, max_size=n))
    trial = draw(st.none() | st.lists(st.integers(0, 9), min_size=n, max_size=n))
    n_trials = {} if trial is None else {"n_trials": draw(st.integers(1 + max(trial, default=0), 12))}
    about = draw(st.booleans())
    more = {"unit_whisker": np.array([f"C{k}" for k in range(len(names))])} if about else {}
    trial = trial if trial is None else np.array(trial, int)
    return spike_table(np.array(time), np.array(unit, int), names, trial=trial, attrs=n_trials, **more)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(table=tables())
def test_spikes_come_back_to_the_last_bit(tmp_path_factory, table):
    path = tmp_path_factory.mktemp("round") / "spikes.csv"
    write_csv(table, path)
    back = read_spikes(path)
    assert back.equals(table)
    assert back.attrs.get("n_trials") == table.attrs.get("n_trials")


@pytest.mark.parametrize(
    ("name", "code", "quantity"),
    [
        ("", "too-few", "names of units"),
        (" a", "format", "unit_name ' a'"),
        ("a\nb", "format", r"unit_name 'a\nb'"),
        ("a\tb", "format", r"unit_name 'a\tb'"),
    ],
)
def test_names_that_would_not_come_back_are_refused(tmp_path, name, code, quantity):
    with refusal(code, quantity):
        write_csv(spike_table(np.array([0.1]), np.array([0]), [name]), tmp_path / "spikes.csv")


# Units


def test_units_of_their_own_are_joined_and_taken_out_again():
    time = np.linspace(0, 1, 200)
    tables = {
        name: simulate_spikes(ThresholdLinearUnit(), time, np.full(200, 1e-4), 5, rng=np.random.default_rng(seed))
        for seed, name in enumerate(["a", "b"])
    }
    joined = join_units(tables)
    assert joined.attrs["n_trials"] == 5
    for name, table in tables.items():
        one = of_unit(joined, name)
        np.testing.assert_array_equal(one.spike_time, table.spike_time)
        np.testing.assert_array_equal(one.spike_trial, table.spike_trial)
    with refusal("unknown", "unit 'c'"):
        of_unit(joined, "c")


def test_joining_refuses_different_trials():
    few = spike_table(np.zeros(0), np.zeros(0, int), ["a"], trial=np.zeros(0, int), attrs={"n_trials": 2})
    with refusal("conflict", "n_trials"):
        join_units({"a": few, "b": few.assign_attrs(n_trials=3)})
    with refusal("range", "tables of units"):
        join_units({})


def test_names_differ():
    with refusal("conflict", "names of units"):
        spike_table(np.zeros(0), np.zeros(0, int), ["a", "a"])


# Trials


def session(times, units=None, names=("a",)):
    units = np.zeros(len(times), int) if units is None else np.array(units)
    return spike_table(np.array(times, float), units, list(names))


def test_spikes_are_cut_by_hand():
    spikes = session([0.5, 10, 10.5, 12, 19.9, 20, 21.9, 30], [0, 0, 1, 0, 0, 0, 1, 0], ["a", "b"])
    cut = cut_into_trials(spikes, trials_at([10, 20], 2.0))
    assert of_unit(cut, "a").spike_time.values.tolist() == [0, 0]  # 12 is the end, half-open
    assert of_unit(cut, "a").spike_trial.values.tolist() == [0, 1]
    np.testing.assert_allclose(of_unit(cut, "b").spike_time, [0.5, 1.9])
    assert cut.attrs["spikes_outside"] == 4
    assert cut.attrs["n_trials"] == 2
    assert cut.trial_start.values.tolist() == [10, 20]


def test_window_takes_in_the_spontaneous_spikes_between_stimuli():
    cut = cut_into_trials(session([9.5, 10.5, 12.5, 19.0]), trials_at([10, 20], 2.0), (-1.0, 3.0))
    assert cut.spike_time.values.tolist() == [-0.5, 0.5, 2.5, -1.0]
    assert cut.spike_trial.values.tolist() == [0, 0, 0, 1]
    assert (cut.attrs["window_start"], cut.attrs["window_stop"]) == (-1.0, 3.0)


def test_spikes_in_two_windows_are_kept_twice_and_told():
    cut = cut_into_trials(session([11.5]), trials_at([10, 12], 1.0), (-1.0, 2.0))
    assert cut.spike_time.values.tolist() == [1.5, -0.5]
    assert cut.attrs["spikes_shared"] == 1


@settings(deadline=None, derandomize=True, max_examples=50)
@given(seed=st.integers(0, 10**6), start=st.floats(-2, 0), length=st.floats(0.1, 4))
def test_cutting_agrees_with_a_loop(seed, start, length):
    rng = np.random.default_rng(seed)
    times, units, onsets = rng.uniform(0, 30, 60), rng.integers(0, 3, 60), np.sort(rng.uniform(0, 30, 7))
    cut = cut_into_trials(session(times, units, ["a", "b", "c"]), trials_at(onsets, 1.0), (start, start + length))
    expected = sorted(
        (unit, trial, time - onset)
        for time, unit in zip(times, units, strict=True)
        for trial, onset in enumerate(onsets)
        if onset + start <= time < onset + (start + length)
    )
    found = list(zip(cut.spike_unit.values, cut.spike_trial.values, cut.spike_time.values, strict=True))
    assert found == expected


def test_trials_in_which_a_unit_was_not_observed_do_not_dilute_its_rate():
    spikes = session([10.5, 20.5, 10.6], [0, 0, 1], ["a", "b"]).assign(
        interval_start=("interval", [0.0, 0.0]),
        interval_stop=("interval", [100.0, 15.0]),
        interval_unit=("interval", [0, 1]),
    )
    cut = cut_into_trials(spikes, trials_at([10, 20], 1.0))
    assert cut.unit_observed.values.tolist() == [[True, True], [True, False]]
    assert psth(cut, [0, 1]).firing_rate.values.tolist() == [[1.0], [1.0]]


def test_what_was_told_at_reading_stays_told(file):
    spikes = read_spikes(file("spike_time,unit\n0.5,a\n0.2,a\n"))
    assert cut_into_trials(spikes, trials_at([0], 1.0)).attrs["spikes_out_of_order"] == 1


def test_trials_are_read_and_protocols_told_apart(file):
    text = "start,stop,protocol,stimulus\n0,1,noise,x\n2,3,texture,T1\n4,5,texture,T2\n1.5,1.8,noise,x\n"
    trials = read_trials(file(text), only=("protocol", "texture"))
    assert trials.trial_start.values.tolist() == [2, 4]
    assert trials.trial_stimulus.values.tolist() == ["T1", "T2"]
    assert trials.attrs["trials_left_out"] == 2
    assert read_trials(file("start_ms,stop_ms\n500,1500\n")).trial_stop.values.tolist() == [1.5]


@pytest.mark.parametrize(
    ("text", "only", "message"),
    [
        ("start,stop\n", None, ("too-few", "spikes.csv")),
        ("begin,stop\n0,1\n", None, ("missing", "spikes.csv, line 1")),
        ("start,stop\n1,1\n", None, ("format", "spikes.csv, line 2, stop")),
        ("start,stop\n1,2\n0,1\n", None, ("format", "spikes.csv, line 3, start")),
        ("start,stop\n1,2\n", ("kind", "x"), ("missing", "spikes.csv")),
        ("start,stop,kind\n1,2,a\n", ("kind", "x"), ("format", "spikes.csv, kind")),
        ("start,stop\n1,inf\n", None, ("format", "spikes.csv, line 2, stop")),
    ],
)
def test_faulty_trials_are_refused(file, text, only, message):
    with refusal(*message):
        read_trials(file(text), only=only)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: trial_table(np.array([1.0]), np.array([0.5])), ("range", "trial 0")),
        (lambda: trial_table(np.array([0.0, np.nan]), np.array([1.0, 2])), ("range", "trial 1")),
        (lambda: trials_at([2.0, 1.0], 0.5), ("range", "trial 1")),
        (lambda: trials_at([2.0], 0.0), ("range", "duration of a trial")),
        (lambda: cut_into_trials(session([1.0]), trials_at([0], 1.0), (1.0, 1.0)), ("format", "window")),
        (
            lambda: cut_into_trials(session([]).assign(spike_trial=("spike", [])), trials_at([0], 1)),
            ("unknown", "spikes"),
        ),
    ],
)
def test_impossible_cuts_are_refused(call, message):
    with refusal(*message):
        call()


def test_a_line_without_a_time_below_spikes_of_its_unit_and_trial_is_refused(tmp_path):
    path = tmp_path / "s.csv"
    path.write_text("unit,trial,spike_time\nA,0,\nA,0,0.1\nA,1,\nB,0,\nB,1,0.2\n")
    assert read_spikes(path).attrs["n_trials"] == 2
    path.write_text("unit,trial,spike_time\nA,0,0.1\nA,0,\nA,1,0.3\n")
    with pytest.raises(InputError, match="line 3, spike_time must be a time: the unit has spikes in this trial above"):
        read_spikes(path)
