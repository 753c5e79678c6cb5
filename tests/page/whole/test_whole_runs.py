"""The whole whisker on the page: it touches the ground, nothing lies below it, and moves that come meanwhile count."""

import io
import shlex
import threading
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from refusals import refusal
from scipy.io import wavfile

from vibrissa.errors import MachineError, RangeError
from vibrissa.netcdf import load
from vibrissa.page.answer.answers import answer
from vibrissa.page.answer.export import exported
from vibrissa.page.panel.presets import CLEAN, PRESETS
from vibrissa.page.panel.state import read_state
from vibrissa.page.session import PageSession
from vibrissa.page.shaft_table import NODE
from vibrissa.page.whole.job import CUT
from vibrissa.page.whole.runs import WholeRuns
from vibrissa.page.whole.worker import computed

STATE = {**next(one.state for one in PRESETS if one.name == "Long free end"), "a.length": 0.01, "b.length": 0.01}


@pytest.fixture(scope="module")
def session():
    """A session whose process is ended at the end."""
    session = PageSession(lambda key: pytest.fail("no file was dropped"))
    yield session
    session.whole.end()


@pytest.fixture(scope="module")
def scans(session):
    """The whole whisker and the same one cut at its contact, with the job."""
    job = session.whole_job(read_state(STATE))
    return session.whole.wait(job), session.whole.wait(job.cut()), job


def height_above(scan, job):
    """How far every drawn point of the shaft lies above the surface [m], (P, S): the gaps read in another way."""
    shaft, facts = scan.record.shaft, scan.facts
    place = shaft["shaft_x"] + facts["distance"] + facts["speed"] * shaft["shaft_time"][:, None]
    gaps = job.surface
    before = np.searchsorted(gaps.position, place) - 1
    inside = (before >= 0) & (place < gaps.end[np.maximum(before, 0)])
    return shaft["shaft_y"] + facts["height"] + np.where(inside, gaps.depth, 0.0), inside


def test_no_point_of_either_shaft_lies_in_the_ground_and_something_touches_it(scans):
    for scan in scans[:2]:
        above, _ = height_above(scan, scans[2])
        assert above.min() > -2e-6  # a node beside an edge, on which the shaft between nodes rests
        np.testing.assert_allclose(np.abs(above).min(axis=1), 0.0, atol=4e-6)  # the contact lies between nodes


def test_the_cut_tip_drops_into_gaps_and_the_long_free_end_bridges_them(scans):
    scan, cut, job = scans
    assert (job.posture.contact - job.whisker.tip) * job.whisker.length > job.surface.width.max()
    deepest = [one.record.shaft["shaft_y"].min() + one.facts["height"] for one in (scan, cut)]
    assert deepest[0] > -3e-6
    assert deepest[1] < -0.5 * job.surface.depth
    assert cut.record.displacement.std() > 5 * scan.record.displacement.std()
    assert cut.facts["tip"] == pytest.approx(job.posture.contact - CUT)


def test_the_excursion_is_that_of_a_point_that_touches(scans):
    scan, _, job = scans
    shaft, facts, rate = scan.record.shaft, scan.facts, scan.facts["rate"]
    some = np.round(shaft["shaft_time"] * rate).astype(int)
    for x, y, d in zip(shaft["shaft_x"], shaft["shaft_y"], scan.record.excursion[some], strict=True):
        assert np.interp(-facts["distance"] - d, x, y) == pytest.approx(-facts["height"], abs=2e-6)
    assert scan.record.excursion[0] == pytest.approx(0.0, abs=0.3e-3)  # of the contact of Eq. (1), near by
    assert job.whisker.tip == 0.05


def test_data_are_those_of_scan_by_the_rod(session, tmp_path, monkeypatch, vibrissa):
    monkeypatch.chdir(tmp_path)
    for name in ("texture.csv", "command.txt", "data.nc"):
        (tmp_path / f"vibrissa-{name}").write_bytes(exported(session, read_state(STATE), "a", name))
    words = shlex.split((tmp_path / "vibrissa-command.txt").read_text())
    code, _, said = vibrissa(*words[1:])
    assert code == 0, said
    page, scan = load(tmp_path / "vibrissa-data.nc"), load(tmp_path / "vibrissa-scan.nc")
    assert page.attrs["model"] == "rod"
    for name in ("displacement", "mode_displacement", "base_moment"):
        scale = float(np.abs(scan[name]).max())
        np.testing.assert_allclose(page[name], scan[name], rtol=0, atol=1e-6 * scale)


def test_sound_and_table_are_of_the_whole_whisker(session):
    taken = {name: exported(session, read_state(STATE), "a", name) for name in ("data.nc", "sound.wav", "signals.csv")}
    data = xr.load_dataset(io.BytesIO(taken["data.nc"]), engine="h5netcdf")
    moved = data.displacement.to_numpy()[:, 0]
    _, samples = wavfile.read(io.BytesIO(taken["sound.wav"]))
    assert np.corrcoef(samples, moved)[0, 1] > 0.999
    table = np.genfromtxt(io.BytesIO(taken["signals.csv"]), delimiter=",", names=True)
    np.testing.assert_allclose(table["displacement_m"], moved, rtol=1e-6, atol=1e-15)
    assert "excursion_m" not in table.dtype.names
    assert data.arc_length.item() == NODE


def test_a_study_does_not_film_the_whole_whisker(session):
    with refusal("conflict", "study.zip") as caught:
        exported(session, read_state(STATE), "a", "study.zip")
    assert "one contact" in str(caught.value)


def test_a_whisker_that_ends_at_its_contact_is_refused_in_a_line(session):
    with pytest.raises(RangeError, match="beyond the contact"):
        session.whole_job(read_state({**CLEAN, "model": "rod"}))


def test_the_neuron_takes_no_new_scan(session, scans, monkeypatch):
    monkeypatch.setattr(session.whole, "_send", lambda job: pytest.fail("computed anew"))
    said = answer(session, f'{{"id": 1, "want": "live", "state": {words({**STATE, "threshold": 1e-7})}}}')
    assert isinstance(said, bytes)


def words(state):
    return "{" + ", ".join(f'"{name}": {value!r}' for name, value in state.items()).replace("'", '"') + "}"


def test_a_scan_that_nobody_asks_for_any_longer_makes_room(session, scans):
    slow = replace(scans[2], scan=replace(scans[2].scan, speed=0.01))
    assert isinstance(session.whole.get([slow], lambda: False), float)
    found = session.whole.wait(replace(scans[2], scan=replace(scans[2].scan, speed=0.2)))
    assert found.facts["speed"] == 0.2
    assert isinstance(session.whole.get([slow], lambda: True), float)  # it was given up


def test_a_process_that_is_killed_is_said_in_a_line_and_the_next_scan_is_made(scans):
    runs, job = WholeRuns(), replace(scans[2], scan=replace(scans[2].scan, speed=0.01))
    assert isinstance(runs.get([job], lambda: False), float)
    threading.Timer(0.3, runs._process.kill).start()
    with pytest.raises(MachineError, match="has ended"):
        runs.wait(job)
    assert runs.wait(scans[2]).facts["tip"] == 0.05
    runs.end()


def test_a_scan_in_the_process_is_the_one_in_this_process(scans):
    here = computed(scans[2])
    np.testing.assert_array_equal(here.record.displacement, scans[0].record.displacement)
