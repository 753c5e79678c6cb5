"""What is taken away says the same as the page: data, sound, picture, texture, and the study that makes it again."""

import io
import xml.etree.ElementTree as Xml
import zipfile

import numpy as np
import pytest
import xarray as xr
from refusals import refusal
from scipy.io import wavfile

from vibrissa.mechanics.scan.sampled import sampling_times
from vibrissa.netcdf import load
from vibrissa.page.answer.export import KINDS, RATE, exported
from vibrissa.page.panel.state import read_state
from vibrissa.page.session import PageSession, made_surface
from vibrissa.page.shaft_table import NODE
from vibrissa.study.movie.virtual import predicted_motion
from vibrissa.study.spec.settings import read_study

SHORT = {"a.length": 0.01, "b.length": 0.01}
LEVEL = {"a.length": 0.005, "a.amplitude": 5e-6, "base_angle": 0.9, "height": 0.015}
SESSION = PageSession(lambda key: pytest.fail("no file was dropped"))


def take(name, letter="a", **set_):
    return exported(SESSION, read_state({**SHORT, **set_}), letter, name)


def test_data_hold_what_scan_writes(vibrissa, tmp_path):
    (tmp_path / "texture.csv").write_bytes(take("texture.csv"))
    words = ["--base-angle", 1.2, "--speed", 0.1, "--node", NODE, "--out", tmp_path / "scan.nc"]
    cone = ["--whisker.length", 0.04, "--whisker.cone-angle", 1.5e-3, "--whisker.tip", 0.05]
    height = read_state({}).number("height") / 0.04
    code, _, said = vibrissa("scan", tmp_path / "texture.csv", "--base-distance", height, *words, *cone)
    assert code == 0, said
    page, scan = xr.load_dataset(io.BytesIO(take("data.nc")), engine="h5netcdf"), load(tmp_path / "scan.nc")
    assert set(page.data_vars) == set(scan.data_vars)
    for name in ("mode_displacement", "displacement", "base_moment", "excursion", "envelope"):
        np.testing.assert_allclose(page[name], scan[name], rtol=1e-9, atol=1e-15)


def test_a_table_of_signals_has_their_units_in_its_header():
    table = np.genfromtxt(io.BytesIO(take("signals.csv")), delimiter=",", names=True)
    data = xr.load_dataset(io.BytesIO(take("data.nc")), engine="h5netcdf")
    np.testing.assert_allclose(table["time_s"], data.time, rtol=1e-8)
    np.testing.assert_allclose(table["mode_2_m"], 0.04 * data.mode_displacement[1], rtol=1e-8)
    np.testing.assert_allclose(table["base_moment_n_m"], data.base_moment, rtol=1e-8)


def test_sound_rings_at_the_resonance_in_seconds():
    state = {"a.kind": "periodic", "a.period": 0.01, "a.duty": 0.05, "damping": 0.005}
    rate, samples = wavfile.read(io.BytesIO(take("sound.wav", **state)))
    assert rate == RATE
    assert np.abs(samples).max() == round(0.9 * 32767)
    ringing = samples[-rate // 2 :].astype(float)
    power = np.abs(np.fft.rfft(ringing * np.hanning(ringing.size), 8 * ringing.size))
    resonance = SESSION.predict(read_state({**SHORT, **state})).omega[0] / (2 * np.pi)
    assert np.argmax(power) * rate / (8 * ringing.size) == pytest.approx(resonance, abs=0.5)


def study_taken(folder, **state):
    """The study as `vibrissa run` reads it where the archive was unpacked, and the names of its files."""
    with zipfile.ZipFile(io.BytesIO(take("study.zip", **state))) as archive:
        archive.extractall(folder)
        names = sorted(archive.namelist())
    return read_study(folder / "vibrissa-study" / "study.toml"), names


@pytest.mark.parametrize("kind", ["random", "widths"])
def test_the_study_makes_the_same_motion(kind, tmp_path):
    state = {"a.kind": kind, "a.seed": 5, "whisker": "beta", "height": 0.025, "friction": 0.3, "speed": 0.12}
    study, names = study_taken(tmp_path, **state)
    assert names == ["vibrissa-study/study.toml"]  # the seed makes the texture
    again, page = predicted_motion(study), SESSION.predict(read_state({**SHORT, **state}))
    t = sampling_times(page, 5000.0)
    np.testing.assert_allclose(again.mode_displacement(t)[:3], page.mode_displacement(t), rtol=1e-7, atol=1e-12)
    assert study.recording.unit == read_state(state).unit
    assert study.recording.distance == NODE
    assert study.film.n_frames >= page.end * 2000


@pytest.mark.parametrize("kind", ["periodic", "wave"])
def test_the_study_of_another_texture_has_its_file_beside_it(kind, tmp_path):
    state = {"a.kind": kind, **LEVEL}
    study, names = study_taken(tmp_path, **state)
    assert names == ["vibrissa-study/study.toml", "vibrissa-study/texture.csv"]
    again, page = predicted_motion(study), SESSION.predict(read_state({**SHORT, **state}))
    t = sampling_times(page, 5000.0)
    np.testing.assert_allclose(again.mode_displacement(t)[:3], page.mode_displacement(t), rtol=1e-7, atol=1e-12)


def test_the_texture_is_read_again_to_the_last_bit(tmp_path):
    from vibrissa.texture.io import read_gaps, read_height_profile

    (tmp_path / "gaps.csv").write_bytes(take("texture.csv"))
    made = made_surface(read_state(SHORT).texture("a"))
    np.testing.assert_array_equal(read_gaps(tmp_path / "gaps.csv").width, made.width)
    state = {"a.kind": "wave", **LEVEL}
    (tmp_path / "wave.csv").write_bytes(take("texture.csv", **state))
    made = made_surface(read_state({**SHORT, **state}).texture("a"))
    np.testing.assert_array_equal(read_height_profile(tmp_path / "wave.csv", level="none").height, made.height)


def test_pictures_are_pictures_and_equal_states_give_equal_files():
    assert take("picture.png").startswith(b"\x89PNG\r\n\x1a\n")
    svg = take("picture.svg")
    assert Xml.fromstring(svg).tag.endswith("svg")
    assert "Spikes" in svg.decode() or len(svg) > 10_000
    assert svg == take("picture.svg")
    assert take("data.nc") == take("data.nc")
    assert take("study.zip", **{"a.kind": "wave", **LEVEL}) == take("study.zip", **{"a.kind": "wave", **LEVEL})


def test_texture_b_is_taken_away_as_b():
    assert take("texture.csv", "b") == take("texture.csv", **{"a.seed": 2})
    assert take("texture.csv", "b") != take("texture.csv")


def test_a_posture_out_of_reach_is_refused_for_every_kind_of_file():
    for name in KINDS:
        with refusal("range", "Posture, Distance H (height)"):
            take(name, height=0.09)
