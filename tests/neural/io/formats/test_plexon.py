"""Plexon and NeuroExplorer files: sorted spikes by hand, traps of the formats, and damage told in one line."""

from contextlib import suppress

import numpy as np
import pytest
from plexon_files import write_nex, write_plx
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.neural.io.formats.plexon import read_plexon
from vibrissa.neural.io.tables.spikes import of_unit
from vibrissa.neural.io.tables.trials import cut_into_trials, trials_at

pytest.importorskip("neo")

UNITS = {(1, 0): [10, 50], (1, 1): [40, 80_000, 120_004], (1, 2): [90], (3, 1): [41, 42]}
EVENTS = {"Start": [(40_000, 0), (80_000, 0)], "Strobed": [(5, 17), (7, 300)]}


@pytest.fixture
def plx(tmp_path):
    return write_plx(tmp_path / "session.plx", UNITS, EVENTS)


def test_sorted_spikes_of_a_plx_file(plx):
    spikes = read_plexon(plx)
    assert spikes.unit_name.values.tolist() == ["1,1", "1,2", "3,1"]
    np.testing.assert_array_equal(of_unit(spikes, "1,1").spike_time, [0.001, 2.0, 3.0001])
    np.testing.assert_array_equal(of_unit(spikes, "3,1").spike_time, [41 / 40_000, 42 / 40_000])
    assert spikes.attrs["spikes_unsorted"] == 2
    assert spikes.attrs["event_channels"] == "Start,Strobed"


def test_times_beyond_32_bits_are_whole(tmp_path):
    late = 2**32 + 40_000
    spikes = read_plexon(write_plx(tmp_path / "long.plx", {(1, 1): [1, late]}))
    np.testing.assert_array_equal(spikes.spike_time, [1 / 40_000, late / 40_000])


def test_spikes_written_after_a_later_block_are_kept(tmp_path):
    path = write_plx(tmp_path / "a.plx", {(1, 1): [400, 800]})
    data = bytearray(path.read_bytes())
    first, second = data[-64:-32], data[-32:]
    path.write_bytes(bytes(data[:-64] + second + first))  # acquisition writes channels in turn, not by time
    spikes = read_plexon(path)
    assert spikes.spike_time.values.tolist() == [0.01, 0.02]
    assert spikes.attrs["spikes_out_of_order"] == 1


def test_events_start_trials(plx):
    spikes = read_plexon(plx, event="Start")
    assert spikes.marker_time.values.tolist() == [1.0, 2.0]
    cut = cut_into_trials(spikes, trials_at(spikes.marker_time, 1.0), (-0.5, 1.0))
    np.testing.assert_allclose(of_unit(cut, "1,1").spike_time, [0.0])
    assert of_unit(cut, "1,1").spike_trial.values.tolist() == [1]


def test_codes_of_strobed_events_are_kept(plx):
    spikes = read_plexon(plx, event="Strobed")
    assert spikes.marker_label.values.tolist() == ["17", "300"]


def test_unknown_and_absent_events_are_refused(plx, tmp_path):
    with refusal("unknown", "event 'start'"):
        read_plexon(plx, event="start")
    path = write_plx(tmp_path / "b.plx", {(1, 1): [4]}, {"Start": []})
    with refusal("unknown", "event 'Start'"):
        read_plexon(path, event="Start")


def test_nothing_is_said_on_the_way(plx, capfd):
    read_plexon(plx)
    assert capfd.readouterr() == ("", "")


def test_sorted_spikes_of_a_nex_file(tmp_path):
    units = {"sig001a": [40, 80], "sig001a_wf": [40, 80], "sig001U": [1, 2, 3], "Neuron_U": [7], "sig002b_wf": [9]}
    spikes = read_plexon(write_nex(tmp_path / "session.nex", units, {"Start": [40_000, 20_000]}), event="Start")
    assert spikes.unit_name.values.tolist() == ["sig001a", "Neuron_U", "sig002b_wf"]
    np.testing.assert_array_equal(of_unit(spikes, "sig001a").spike_time, [0.001, 0.002])
    assert spikes.attrs["spikes_unsorted"] == 3
    assert spikes.marker_time.values.tolist() == [0.5, 1.0]


@pytest.mark.parametrize("kind", ["plx", "nex"])
def test_files_cut_short_anywhere_are_refused(tmp_path, kind):
    if kind == "plx":
        whole = write_plx(tmp_path / "whole.plx", UNITS, EVENTS).read_bytes()
        starts = [0, 3, 4, 100, 7503, 7504, 8000, len(whole) - 1]
    else:
        whole = write_nex(tmp_path / "whole.nex", {"a": [1, 2, 3], "a_wf": [1, 2, 3], "b": []}).read_bytes()
        starts = [0, 3, 4, 100, 543, 544, 700]
    last = range(len(whole) - 24, len(whole)) if kind == "nex" else range(len(whole) - 300, len(whole), 7)
    path = tmp_path / f"short.{kind}"
    for size in sorted({*starts, *last}):
        path.write_bytes(whole[:size])
        with refusal("format", f"short.{kind}"):
            read_plexon(path)


def test_file_cut_between_blocks_is_refused_by_its_own_counts(plx):
    data = plx.read_bytes()
    plx.write_bytes(data[:-32])
    with refusal("format", "session.plx", value="7"):
        read_plexon(plx)


def test_header_that_tells_of_billions_of_channels_is_refused_at_once(plx):
    data = bytearray(plx.read_bytes())
    for at in (140, 144, 148):
        data[at : at + 4] = b"\xff\xff\xff\x7f"
    plx.write_bytes(data)
    with refusal("format", "session.plx"):
        read_plexon(plx)


@pytest.mark.parametrize("kind", ["plx", "nex"])
def test_damaged_files_are_read_or_refused(tmp_path, kind):
    rng = np.random.default_rng(1)
    write = (lambda p: write_plx(p, UNITS, EVENTS)) if kind == "plx" else (lambda p: write_nex(p, {"a": [1, 2, 3]}))
    whole = np.frombuffer(write(tmp_path / f"whole.{kind}").read_bytes(), "u1")
    path = tmp_path / f"damaged.{kind}"
    for _ in range(60):
        data = whole.copy()
        where = rng.integers(4, 300 if rng.random() < 0.5 else data.size, 6)
        data[where] = rng.integers(0, 256, 6)
        path.write_bytes(data.tobytes())
        with suppress(InputError):
            read_plexon(path)


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("a.pl2", "open it in Offline Sorter and export .plx, or convert it to NWB"),
        ("a.pl3", "open it in Offline Sorter and export .plx, or convert it to NWB"),
        ("a.nex5", "export .nex from NeuroExplorer, or convert it to NWB"),
        ("a.dat", "other files: CSV or NWB"),
    ],
)
def test_other_formats_are_refused_with_a_way_out(tmp_path, name, remedy):
    (tmp_path / name).write_bytes(b"PLEX")
    with refusal("format", name) as caught:
        read_plexon(tmp_path / name)
    assert (caught.value.rule, caught.value.remedy) == ("must be a .plx or .nex file", remedy)


def test_missing_and_mistaken_files_are_refused(tmp_path):
    with refusal("missing", "none.plx"):
        read_plexon(tmp_path / "none.plx")
    (tmp_path / "text.plx").write_text("spike_time,unit\n")
    with refusal("format", "text.plx"):
        read_plexon(tmp_path / "text.plx")


def test_without_neo_the_remedy_is_told(plx, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "neo.rawio.plexonrawio", None)
    with refusal("package", "session.plx"):
        read_plexon(plx)
