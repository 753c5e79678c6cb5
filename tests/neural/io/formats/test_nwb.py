"""NWB files: there and back to the last bit, accepted by the archives' inspector, faults told with their remedy."""

import warnings
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.neural.io.formats.nwb import read_nwb, read_nwb_trials
from vibrissa.neural.io.formats.nwb_writer import Session, write_nwb
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.trials import cut_into_trials, trial_table, trials_at
from vibrissa.quantities import dataset

pynwb = pytest.importorskip("pynwb")

ABOUT = {"identifier": "s1", "description": "textures replayed", "subject": "rat 7", "age": "P90D"}
ABOUT |= {"sex": "M", "species": "Rattus norvegicus"}
SESSION = Session(start=datetime(2014, 5, 7, 9, 30, tzinfo=UTC), **ABOUT)


def units(**more):
    rng = np.random.default_rng(1)
    time = np.concatenate([rng.uniform(0, 60, 40), rng.uniform(0, 60, 3)])
    return spike_table(time, np.repeat([0, 2], [40, 3]), ["1,1", "1,2", "3,1"], **more)


def known_units():
    about = {"unit_quality": np.array(["SU", "MU", "SU"]), "unit_whisker": np.array(["C2", "C2", "D1"])}
    about["unit_electrode"] = np.array([0, 0, 31])
    about["unit_waveform"] = 1e-5 * np.random.default_rng(2).normal(size=(3, 32))
    spikes = units(unit_id=np.array([3, 8, 21]), snr_smallest=np.array([4.5, np.nan, 6.7]), **about)
    return spikes.assign(
        interval_start=("interval", [0.0, 0.0, 40.0, 0.0]),
        interval_stop=("interval", [60.0, 30.0, 60.0, 60.0]),
        interval_unit=("interval", [0, 1, 1, 2]),
    )


def replay(whiskers=("C1", "C2", "C3")):
    time = np.arange(2000) / 1000
    loop = 1e-4 * np.sin(2 * np.pi * 70 * time)
    delay = 0.4 * np.arange(len(whiskers))
    command = np.stack([np.roll(loop, round(1000 * one)) for one in delay])
    return dataset(whisker=list(whiskers), time=time, command=command, delay=delay, replayed_envelope=np.abs(command))


def test_units_come_back_to_the_last_bit(tmp_path):
    path = tmp_path / SESSION.filename
    write_nwb(known_units(), path, SESSION)
    assert read_nwb(path).equals(known_units())


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=st.integers(0, 10**6), sizes=st.lists(st.integers(0, 9), min_size=1, max_size=4))
def test_spikes_come_back_to_the_last_bit(tmp_path_factory, seed, sizes):
    time = np.random.default_rng(seed).uniform(0, 5000, sum(sizes))
    names = [f"u{k}" for k in range(len(sizes))]
    spikes = spike_table(time, np.repeat(np.arange(len(sizes)), sizes), names)
    path = tmp_path_factory.mktemp("nwb") / "a.nwb"
    write_nwb(spikes, path, SESSION)
    assert read_nwb(path).drop_vars("unit_id").equals(spikes)


def test_trials_come_back_with_the_stimulus(tmp_path):
    trials = trial_table(np.array([1.0, 20.0]), np.array([11.0, 30.5]), ["T1", "T2"])
    write_nwb(units(), tmp_path / "a.nwb", SESSION, trials=trials, command=replay())
    back = read_nwb_trials(tmp_path / "a.nwb")
    assert back.equals(trials)
    only = read_nwb_trials(tmp_path / "a.nwb", only=("stimulus", "T2"))
    assert only.trial_start.values.tolist() == [20.0]
    assert only.attrs["trials_left_out"] == 1
    whole = cut_into_trials(read_nwb(tmp_path / "a.nwb"), back)
    assert whole.equals(cut_into_trials(units(unit_id=np.arange(3)), trials))


def test_layout_is_that_of_the_archives(tmp_path):
    write_nwb(known_units(), tmp_path / "a.nwb", SESSION, trials=trials_at([1, 20], 2.0), command=replay())
    with warnings.catch_warnings(), pynwb.NWBHDF5IO(tmp_path / "a.nwb", "r") as io:
        warnings.simplefilter("ignore")
        file = io.read()
        assert file.units.colnames[:2] == ("unit_name", "quality")
        assert file.units["spike_times"].target.description
        assert file.units.resolution == 2.5e-5
        electrodes = file.electrodes.to_dataframe()
        assert electrodes.group_name.tolist() == [f"shank{k // 4}" for k in range(32)]
        assert file.units["electrodes"][2].index.tolist() == [31]
        template = file.stimulus_template["command"]
        assert (template.unit, template.rate, template.data.shape) == ("meters", 1000.0, (2000, 3))
        np.testing.assert_array_equal(template.data[:].T, replay().command)
        assert file.trials["timeseries"][1][0].timeseries.name == "command"
        assert file.trials["timeseries"][1][0].count == 2000
        rows = file.processing["misc"]["whiskers"].to_dataframe()
        assert rows.whisker.tolist() == ["C1", "C2", "C3"]
        np.testing.assert_allclose(rows.delay_s, [0, 0.4, 0.8])
        assert file.processing["misc"]["replayed_envelope"].unit == "meters"
        assert (file.subject.species, file.subject.age, file.subject.sex) == ("Rattus norvegicus", "P90D", "M")


def test_inspector_finds_no_fault(tmp_path):
    inspector = pytest.importorskip("nwbinspector")
    path = tmp_path / SESSION.filename
    trials = trial_table(np.array([1.0, 20.0, 40.0]), np.array([11.0, 30.5, 50.0]), ["T1", "T2", "T1"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        write_nwb(known_units(), path, SESSION, trials=trials, command=replay())
        found = list(
            inspector.inspect_nwbfile(
                nwbfile_path=path, importance_threshold=inspector.Importance.BEST_PRACTICE_VIOLATION
            )
        )
    assert [(one.importance.name, one.check_function_name, one.message) for one in found] == []


def test_name_of_the_file_is_that_of_the_archives():
    assert SESSION.filename == "sub-rat-7_ses-s1_ecephys.nwb"


def stranger(path, *, units=True, times=True, epochs=False):
    """Write a file as others do: ids with holes, no names, nothing told of the subject."""
    file = pynwb.NWBFile(session_description="x", identifier="x", session_start_time=SESSION.start)
    if units:
        file.add_unit_column("snr", "told in words")
        for one in (4, 9, 100):
            file.add_unit(id=one, snr="good", **({"spike_times": [0.5, 0.25 * one]} if times else {}))
    if epochs:
        file.add_epoch(3.0, 4.0, ["wake"])
        file.add_epoch(1.0, 2.0, ["wake"])
    with warnings.catch_warnings(), pynwb.NWBHDF5IO(path, "w") as io:
        warnings.simplefilter("ignore")
        io.write(file)
    return path


def test_units_of_others_are_named_by_their_ids(tmp_path):
    spikes = read_nwb(stranger(tmp_path / "a.nwb"))
    assert spikes.unit_name.values.tolist() == ["4", "9", "100"]
    assert spikes.unit_id.values.tolist() == [4, 9, 100]
    assert spikes.spike_time.values.tolist() == [0.5, 1.0, 0.5, 2.25, 0.5, 25.0]
    assert set(spikes.data_vars) | set(spikes.coords) == {"spike_time", "spike_unit", "unit_name", "unit_id"}


def test_names_that_recur_are_refused_and_ids_may_be_taken(tmp_path):
    spikes = known_units().drop_vars("unit_quality")
    write_nwb(spikes.rename(unit_whisker="unit_quality"), tmp_path / "a.nwb", SESSION)
    with refusal("missing", "a.nwb, quality"):
        read_nwb(tmp_path / "a.nwb", names="quality")
    assert read_nwb(tmp_path / "a.nwb", names="id").unit_name.values.tolist() == ["3", "8", "21"]
    with refusal("missing", "a.nwb, units"):
        read_nwb(tmp_path / "a.nwb", names="depth")


def test_other_tables_of_intervals_may_hold_the_trials(tmp_path):
    trials = read_nwb_trials(stranger(tmp_path / "a.nwb", epochs=True), table="epochs")
    assert trials.trial_start.values.tolist() == [1.0, 3.0]


@pytest.mark.parametrize(
    ("make", "read", "message"),
    [
        ({"units": False}, read_nwb, ("missing", "a.nwb")),
        ({"times": False}, read_nwb, ("missing", "a.nwb")),
        ({}, read_nwb_trials, ("missing", "a.nwb")),
        (
            {"epochs": True},
            read_nwb_trials,
            ("missing", "a.nwb"),
        ),
        (
            {"epochs": True},
            lambda path: read_nwb_trials(path, table="epochs", only=("kind", "a")),
            ("missing", "a.nwb, epochs"),
        ),
    ],
)
def test_what_is_not_there_is_told(tmp_path, make, read, message):
    with refusal(*message):
        read(stranger(tmp_path / "a.nwb", **make))


def test_files_cut_short_or_of_other_kinds_are_refused(tmp_path):
    whole = stranger(tmp_path / "whole.nwb").read_bytes()
    path = tmp_path / "short.nwb"
    for size in (0, 1, 8, 100, 2048, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with refusal("format", "short.nwb") as caught:
            read_nwb(path)
        assert "\n" not in str(caught.value)
    with refusal("missing", "none.nwb"):
        read_nwb(tmp_path / "none.nwb")


def test_samples_are_no_seconds(tmp_path):
    write_nwb(spike_table(np.array([1e9]), np.array([0]), ["a"]), tmp_path / "a.nwb", SESSION)
    with refusal("format", "a.nwb, unit 0"):
        read_nwb(tmp_path / "a.nwb")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda path: write_nwb(cut_into_trials(units(), trials_at([0], 9)), path, SESSION), ("unknown", "spikes")),
        (
            lambda path: write_nwb(units(), path, SESSION, command=replay().isel(time=[0, 1, 5])),
            ("range", "command: time"),
        ),
        (lambda path: write_nwb(units(), path, SESSION, command=replay().isel(time=[0])), ("too-few", "command: time")),
        (
            lambda path: write_nwb(known_units(), path, Session(start=SESSION.start, **ABOUT, sites=1)),
            ("range", "unit_electrode"),
        ),
        (lambda _: Session(start=SESSION.start, **ABOUT, shanks=0), ("range", "Session.shanks and sites")),
        (lambda _: Session(start=datetime(2014, 5, 7), **ABOUT), ("missing", "Session.start")),
        (lambda _: Session(start=SESSION.start, **ABOUT | {"age": "3 months"}), ("format", "Session.age")),
        (lambda _: Session(start=SESSION.start, **ABOUT | {"age": "P"}), ("format", "Session.age")),
        (lambda _: Session(start=SESSION.start, **ABOUT | {"subject": " "}), ("too-few", "Session.subject")),
        (lambda _: Session(start=SESSION.start, **ABOUT | {"sex": "male"}), ("unknown", "Session.sex")),
        (lambda _: Session(start=SESSION.start, **ABOUT, resolution=0), ("range", "Session.resolution")),
    ],
)
def test_what_archives_would_not_take_is_refused(tmp_path, call, message):
    with refusal(*message):
        call(tmp_path / "a.nwb")
    assert not list(tmp_path.iterdir())


def test_without_pynwb_the_remedy_is_told(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pynwb", None)
    for call in (lambda: read_nwb(tmp_path / "a.nwb"), lambda: write_nwb(units(), tmp_path / "a.nwb", SESSION)):
        with refusal("package", "an NWB file"):
            call()
