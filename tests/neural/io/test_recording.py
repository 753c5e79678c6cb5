"""Spikes of recordings in their trials, by every way in."""

import json
from datetime import UTC, datetime

import numpy as np
import pytest
from plexon_files import write_nex, write_plx
from refusals import refusal

from vibrissa.neural.io.recording import recorded_spikes
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.trials import trial_table


def example(session_of):
    return session_of(
        identifier="s",
        description="test",
        start=datetime(2014, 5, 7, 9, 30, tzinfo=UTC),
        subject="rat",
        age="P90D",
        sex="F",
        species="Rattus norvegicus",
    )


@pytest.fixture
def session():
    """Two units whose spikes stand 0.1 s and 0.3 s after each of four onsets."""
    onset = np.array([10.0, 20.0, 30.0, 40.0])
    time = np.concatenate([onset + 0.1, onset + 0.3])
    return onset, spike_table(time, np.repeat([0, 1], 4), ["a", "b"])


def test_an_nwb_file_gives_its_trials_and_one_protocol_of_them(session, tmp_path):
    pytest.importorskip("pynwb")
    from vibrissa.neural.io.formats.nwb_writer import Session, write_nwb

    onset, spikes = session
    trials = trial_table(onset, onset + 1, np.array(["A", "B", "A", "B"]))
    write_nwb(spikes, tmp_path / "s.nwb", example(Session), trials=trials)
    found, count = recorded_spikes(tmp_path / "s.nwb", window=(0.0, 1.0))
    assert count == 4
    np.testing.assert_allclose(np.sort(found.spike_time.values), [0.1] * 4 + [0.3] * 4, atol=1e-9)
    found, count = recorded_spikes(tmp_path / "s.nwb", window=(0.0, 1.0), only=("stimulus", "B"))
    assert (count, found.sizes["spike"]) == (2, 4)


def test_a_table_of_trials_may_stand_beside(session, tmp_path):
    pytest.importorskip("pynwb")
    from vibrissa.neural.io.formats.nwb_writer import Session, write_nwb

    spikes = session[1]
    write_nwb(spikes, tmp_path / "s.nwb", example(Session))
    (tmp_path / "trials.csv").write_text("start,stop\n10,11\n30,31\n")
    found, count = recorded_spikes(tmp_path / "s.nwb", window=(-0.5, 1.0), trials=tmp_path / "trials.csv")
    assert (count, found.sizes["spike"]) == (2, 4)


def test_a_csv_is_in_trials_already(tmp_path):
    (tmp_path / "s.csv").write_text("unit,trial,spike_time\na,0,0.5\n")
    found, count = recorded_spikes(tmp_path / "s.csv", window=(0.0, 1.0))
    assert (count, found.sizes["spike"]) == (None, 1)
    with refusal("conflict", "event"):
        recorded_spikes(tmp_path / "s.csv", window=(0.0, 1.0), event="EVT01")


def test_a_plexon_file_needs_an_event(tmp_path):
    (tmp_path / "s.plx").write_bytes(b"PLEX")
    with refusal("missing", "s.plx"):
        recorded_spikes(tmp_path / "s.plx", window=(0.0, 1.0))


@pytest.mark.parametrize("kind", ["plx", "nex"])
def test_unsorted_spikes_alone_are_refused_in_one_line(vibrissa, tmp_path, kind):
    pytest.importorskip("neo")
    ticks, onsets = list(range(41_000, 800_000, 500)), [40_000 * k for k in range(1, 9)]
    path = tmp_path / f"s.{kind}"
    if kind == "plx":
        write_plx(path, {(1, 0): ticks}, {"Start": [(tick, 0) for tick in onsets]})
    else:
        write_nex(path, {"sig001U": ticks}, {"Start": onsets})
    with refusal("too-few"):
        recorded_spikes(path, window=(0.0, 1.0), event="Start")
    code, _, err = vibrissa("information", "--spikes", path, "--event", "Start", "--window", 0, 1)
    assert code == 2
    assert err.count("\n") == 1


def test_a_csv_without_the_number_of_trials_is_refused(vibrissa, tmp_path):
    (tmp_path / "s.csv").write_text("unit,trial,spike_time\na,0,0.5\n")
    time = np.arange(2000) / 1000
    rows = "\n".join(f"{t},{x}" for t, x in zip(time, 1e-5 * np.sin(400 * time) * np.sin(3 * time), strict=True))
    (tmp_path / "x.csv").write_text("time,displacement\n" + rows + "\n")
    files = ("--spikes", tmp_path / "s.csv", "--stimulus", tmp_path / "x.csv", "--skip", "0")
    code, _, err = vibrissa("neural", *files, "--json")
    assert code == 2
    assert "--trials must be given" in err
    code, out, _ = vibrissa("neural", *files, "--trials", 1, "--json")
    assert code == 0
    assert json.loads(out)["units"][0]["significant"] is False


def test_a_command_of_the_stimulator_is_a_stimulus(vibrissa, tmp_path):
    from vibrissa.quantities import dataset
    from vibrissa.stimulus.export import write_command

    time = np.arange(4000) / 2000
    motion = 1e-5 * np.sin(400 * time) * (1 + 0.5 * np.sin(9 * time))
    command = dataset({}, whisker=np.array(["C1", "C2"]), time=time, command=np.stack([motion, -motion]))
    write_command(command, tmp_path / "c.wav")
    (tmp_path / "s.csv").write_text("unit,trial,spike_time\na,1,0.5\n")
    words = ("neural", "--spikes", tmp_path / "s.csv", "--stimulus", tmp_path / "c.wav", "--skip", "0", "--trials", "4")
    code, out, err = vibrissa(*words, "--whisker", "C2", "--json")
    assert code == 0
    assert len(json.loads(out)["units"]) == 1
    assert "the last 2 of 4 trials hold no spike" in err
    assert "trials count from 0" in err
    code, _, err = vibrissa(*words, "--whisker", "E9")
    assert code == 2
    assert "must be one of C1, C2" in err
