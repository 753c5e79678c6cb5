"""Tables of spikes: files read strictly, spikes cut into trials, all by hand."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibrissa.errors import InputError
from vibrissa.neural.response import psth
from vibrissa.neural.spikes import join_units, of_unit, read_csv, spike_table, write_csv
from vibrissa.neural.trials import cut_into_trials, read_trials, trial_table, trials_at
from vibrissa.neural.virtual import HingeUnit, simulate_spikes


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
    spikes = read_csv(file("# of May\nunit,trial,time,whisker\nb,0,0.25,C2\na,1,0.5,D1\n\nb,0,0.125,C2\n"))
    assert spikes.unit_name.values.tolist() == ["b", "a"]
    assert spikes.spike_time.values.tolist() == [0.125, 0.25, 0.5]
    assert spikes.spike_unit.values.tolist() == [0, 0, 1]
    assert spikes.spike_trial.values.tolist() == [0, 0, 1]
    assert spikes.unit_whisker.values.tolist() == ["C2", "D1"]
    assert spikes.attrs["n_trials"] == 2
    assert spikes.attrs["spikes_out_of_order"] == 1  # 0.125 after 0.25, told and not hidden
    assert spikes.spike_time.attrs["units"] == "s"


def test_order_across_units_and_trials_is_free(file):
    spikes = read_csv(file("time,trial,unit\n0.9,1,a\n0.1,0,b\n0.2,0,a\n0.2,0,a\n"))
    assert spikes.attrs["spikes_out_of_order"] == 0
    assert spikes.attrs["spikes_repeated"] == 1


def test_milliseconds_are_told_by_the_name_of_the_column(file):
    spikes = read_csv(file("time_ms,unit\n1500,a\n"), duration=10)
    assert spikes.spike_time.values.tolist() == [1.5]
    assert "spike_trial" not in spikes


def test_milliseconds_under_the_wrong_name_are_refused_with_the_hint(file):
    path = file("time,unit\n0.5,a\n1500,a\n9000,a\n")
    with pytest.raises(InputError, match=r"line 3, time .* 10 s .*milliseconds.*time_ms"):
        read_csv(path, duration=10)
    assert read_csv(path).spike_time.max() == 9000  # a long session is no fault


def test_samples_are_no_seconds(file):
    with pytest.raises(InputError, match="give times in seconds"):
        read_csv(file("time,unit\n40000,a\n80000,a\n"), duration=10)


def test_few_spikes_outside_the_record_are_kept_and_told(file):
    spikes = read_csv(file("time,unit\n-0.1,a\n0.1,a\n0.2,a\n10,a\n"), duration=10)
    assert spikes.sizes["spike"] == 4
    assert spikes.attrs["spikes_outside"] == 2


def test_trials_may_count_from_one(file):
    path = file("time,trial,unit\n0.9,2,a\n0.1,1,b\n")
    with pytest.raises(InputError, match="line 3, trial must be 0 on a line, got '1'; say first_trial=1"):
        read_csv(path)  # else a silent trial 0 would thin the rate
    spikes = read_csv(path, first_trial=1)
    assert spikes.spike_trial.values.tolist() == [1, 0]
    assert spikes.attrs["n_trials"] == 2
    with pytest.raises(InputError, match="whole number from 2"):
        read_csv(path, first_trial=2)


def test_line_without_a_time_tells_of_silence(file):
    spikes = read_csv(file("time,trial,unit\n,7,silent\n0.1,0,a\n"))
    assert spikes.unit_name.values.tolist() == ["silent", "a"]
    assert spikes.sizes["spike"] == 1
    assert spikes.attrs["n_trials"] == 8


def test_columns_that_are_not_read_are_named(file):
    assert read_csv(file("time,unit,depth\n0.1,a,3\n")).attrs["columns_left_alone"] == "depth"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must hold a header and a line for each row, got an empty file"),
        ("time,trial\n0.1,0\n", "line 1 must have a column unit"),
        ("Times,unit\n0.1,a\n", r"line 1 must have a column time or time_ms.*is it 'Times'\?"),
        ("time,time_ms,unit\n0.1,1,a\n", "line 1 must have only one of time and time_ms"),
        ("time,unit,unit\n0.1,a,a\n", "line 1 must name each column once"),
        ("time;unit\n0.1;a\n", "separated by commas"),
        ("time,unit\n0,1,a\n", "line 2 must have 2 cells.*decimals written with a point"),
        ("time,unit\n0.1,a\nnan,a\n", "line 3, time must be a finite number, got 'nan'"),
        ("time,unit\nx,a\n", "line 2, time must be a finite number, got 'x'"),
        ("time,unit\n1_0,a\n", "line 2, time must be a finite number"),
        ("time,unit\n1e300,a\n", "line 2, time must be at most"),
        ("time,unit\n0.1,\n", "line 2, unit must name a unit"),
        ("time,unit\n0.1,a\0\n", "line 2, unit must name a unit"),
        ("time,unit,trial\n0.1,a,-1\n", "line 2, trial must be a whole number from 0.*got '-1'"),
        ("time,unit,trial\n0.1,a,0.5\n", "line 2, trial must be a whole number"),
        ("time,unit,trial\n0.1,a,\n", "line 2, trial must be a finite number"),
        ("time,unit,trial\n0.1,a,1e9\n", "line 2, trial must be a whole number"),
        ("time,unit,whisker\n0.1,a,C2\n0.2,a,C3\n", "line 3, whisker must be the same on all lines of a unit"),
        (b"time,unit\n\xff\xfe,a\n", "must be text.*UTF-8"),
    ],
)
def test_faults_are_refused_in_one_line(file, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read_csv(file(text))
    assert "spikes.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"none\.csv must be an existing file"):
        read_csv(tmp_path / "none.csv")


CELLS = st.sampled_from(["time", "unit", "trial", "time_ms", "whisker", "a", "0.1", "-1", "1e400", "", '"', "nan", "٣"])


@settings(deadline=None, derandomize=True, max_examples=100)
@given(text=st.lists(st.lists(CELLS, min_size=1, max_size=4).map(",".join), max_size=5).map("\n".join) | st.text())
def test_any_text_is_read_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("fuzz") / "spikes.csv"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    for read in (lambda: read_csv(path), lambda: read_csv(path, duration=1.0), lambda: read_trials(path)):
        with suppress(InputError):
            assert read() is not None


@settings(deadline=None, derandomize=True, max_examples=100)
@given(data=st.binary(max_size=60), head=st.sampled_from([b"", b"time,unit,trial\n", b"start,stop\n"]))
def test_any_bytes_are_read_or_refused(tmp_path_factory, data, head):
    path = tmp_path_factory.mktemp("fuzz") / "spikes.csv"
    path.write_bytes(head + data)
    for read in (read_csv, read_trials):
        with suppress(InputError):
            assert read(path) is not None


# Writing

NAMES = st.text(st.characters(codec="utf-8"), min_size=1, max_size=5).filter(
    lambda n: n == n.strip() and n.isprintable()
)


@st.composite
def tables(draw):
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
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
    back = read_csv(path)
    assert back.equals(table)
    assert back.attrs.get("n_trials") == table.attrs.get("n_trials")


@pytest.mark.parametrize("name", ["", " a", "a\nb", "a\tb"])
def test_names_that_would_not_come_back_are_refused(tmp_path, name):
    with pytest.raises(InputError, match="must"):
        write_csv(spike_table(np.array([0.1]), np.array([0]), [name]), tmp_path / "spikes.csv")


# Units


def test_units_of_their_own_are_joined_and_taken_out_again():
    time = np.linspace(0, 1, 200)
    tables = {
        name: simulate_spikes(HingeUnit(), time, np.full(200, 1e-4), 5, rng=np.random.default_rng(seed))
        for seed, name in enumerate(["a", "b"])
    }
    joined = join_units(tables)
    assert joined.attrs["n_trials"] == 5
    for name, table in tables.items():
        one = of_unit(joined, name)
        np.testing.assert_array_equal(one.spike_time, table.spike_time)
        np.testing.assert_array_equal(one.spike_trial, table.spike_trial)
    with pytest.raises(InputError, match="they are a, b"):
        of_unit(joined, "c")


def test_joining_refuses_different_trials():
    few = spike_table(np.zeros(0), np.zeros(0, int), ["a"], trial=np.zeros(0, int), attrs={"n_trials": 2})
    with pytest.raises(InputError, match="n_trials"):
        join_units({"a": few, "b": few.assign_attrs(n_trials=3)})
    with pytest.raises(InputError, match="at least one"):
        join_units({})


def test_names_differ():
    with pytest.raises(InputError, match="must differ"):
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
    spikes = read_csv(file("time,unit\n0.5,a\n0.2,a\n"))
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
        ("start,stop\n", None, "must have a line for each trial"),
        ("begin,stop\n0,1\n", None, "must have a column start or start_ms"),
        ("start,stop\n1,1\n", None, "line 2, stop must be after the start"),
        ("start,stop\n1,2\n0,1\n", None, "line 3, start must be after the trial before it"),
        ("start,stop\n1,2\n", ("kind", "x"), "must have a column kind; it has start, stop"),
        ("start,stop,kind\n1,2,a\n", ("kind", "x"), "must be 'x' on a line; it is a"),
        ("start,stop\n1,inf\n", None, "line 2, stop must be a finite number"),
    ],
)
def test_faulty_trials_are_refused(file, text, only, message):
    with pytest.raises(InputError, match=message):
        read_trials(file(text), only=only)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: trial_table(np.array([1.0]), np.array([0.5])), "trial 0 must stop after"),
        (lambda: trial_table(np.array([0.0, np.nan]), np.array([1.0, 2])), "trial 1 must start and stop at finite"),
        (lambda: trials_at([2.0, 1.0], 0.5), "trial 1 must start after the one before"),
        (lambda: trials_at([2.0], 0.0), "duration"),
        (lambda: cut_into_trials(session([1.0]), trials_at([0], 1.0), (1.0, 1.0)), "window"),
        (lambda: cut_into_trials(session([]).assign(spike_trial=("spike", [])), trials_at([0], 1)), "cut already"),
    ],
)
def test_impossible_cuts_are_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()
