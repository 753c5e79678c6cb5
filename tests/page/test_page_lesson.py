"""What the page teaches with: presets that say what they are, a word for every control, snippets that make the same."""

import io
import shlex

import numpy as np
import pytest
import xarray as xr

from vibrissa.netcdf import load
from vibrissa.page.answer.answers import notes
from vibrissa.page.answer.export import exported
from vibrissa.page.panel.controls import CONTROLS
from vibrissa.page.panel.glossary import ABOUT, about
from vibrissa.page.panel.presets import PRESETS
from vibrissa.page.panel.state import read_state
from vibrissa.page.session import PageSession

SHORT = {"a.length": 0.01, "b.length": 0.01}
SESSION = PageSession(lambda key: pytest.fail("no file was dropped"))
KINDS = [{"a.kind": kind} for kind in ("random", "widths", "periodic", "rough", "wave")]


def predicted(name, letter="a"):
    return SESSION.predict(read_state(next(one.state for one in PRESETS if one.name == name)), letter)


@pytest.mark.parametrize("preset", PRESETS, ids=lambda preset: preset.name)
def test_every_preset_can_be_scanned_with_either_texture(preset):
    state = read_state(preset.state)
    for letter in "ab":
        assert SESSION.predict(state, letter).end > 0.05


def test_the_first_preset_needs_no_caveat_and_the_long_free_end_is_outside_the_model():
    assert notes(SESSION.predict(read_state(PRESETS[0].state)))[0].startswith("usable")
    assert notes(predicted("Long free end"))[0].startswith("outside the model")


def test_presets_do_what_their_sentences_say():
    long, short = predicted("Long whisker"), predicted("Short whisker")
    assert short.omega[0] / long.omega[0] == pytest.approx(2.5)  # of one shape, ω ∝ α/L
    smooth, rough = (predicted("Smooth against rough", letter).relief.height.std() for letter in "ab")
    assert rough / smooth == pytest.approx(10, rel=0.5)  # the rms holds for the ensemble
    whisker = predicted("Long free end").whisker
    assert 1e3 * whisker.length * (0.29 - whisker.tip) == pytest.approx(9.6)
    gaps = predicted("Paper: one gap").texture
    np.testing.assert_allclose(gaps.width, 0.6e-3)


def test_every_control_has_its_sentence_and_no_sentence_lacks_a_control():
    assert all(about(name).endswith(".") for name in CONTROLS)
    assert set(ABOUT) <= {*CONTROLS, *(name.rpartition(".")[2] for name in CONTROLS)}


def taken(state, name):
    return exported(SESSION, read_state({**SHORT, **state}), "a", name)


def agree(first, second):
    for name in ("displacement", "mode_displacement", "base_moment"):
        scale = np.abs(first[name]).max()
        np.testing.assert_allclose(second[name], first[name], rtol=0, atol=1e-7 * float(scale))


@pytest.mark.parametrize("state", KINDS, ids=lambda state: state["a.kind"])
def test_the_python_that_is_copied_makes_the_same_numbers(state, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    state = {**PRESETS[0].state, **state, "a.seed": 7, "friction": 0.3}
    (tmp_path / "vibrissa-texture.csv").write_bytes(taken(state, "texture.csv"))
    names = {}
    exec(taken(state, "script.py").decode(), names)
    agree(xr.load_dataset(io.BytesIO(taken(state, "data.nc")), engine="h5netcdf"), names["data"])
    assert "displacement" in capsys.readouterr().out


@pytest.mark.parametrize("state", [KINDS[1], KINDS[3]], ids=lambda state: state["a.kind"])
def test_the_command_that_is_copied_makes_the_same_numbers(state, tmp_path, monkeypatch, vibrissa):
    monkeypatch.chdir(tmp_path)
    state = {**PRESETS[0].state, **state}
    (tmp_path / "vibrissa-texture.csv").write_bytes(taken(state, "texture.csv"))
    words = shlex.split(taken(state, "command.txt").decode())
    code, _, said = vibrissa(*words[1:])
    assert code == 0, said
    agree(xr.load_dataset(io.BytesIO(taken(state, "data.nc")), engine="h5netcdf"), load(tmp_path / "vibrissa-scan.nc"))
