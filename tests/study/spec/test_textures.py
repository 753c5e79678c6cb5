"""The texture of a study may be a file, of gaps or of any surface."""

import dataclasses

import numpy as np
import pytest
from refusals import refusal

from vibrissa.cli.shared.words.refusals import as_typed
from vibrissa.errors import InputError
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.study.movie.apparatus import apparatus, true_profile
from vibrissa.study.movie.one_movie import fit_movie
from vibrissa.study.movie.virtual import exposed_signals, film_motion, lay_out, predicted_motion
from vibrissa.study.spec.settings import Grating, read_study, validated_study
from vibrissa.study.store.run_state import Run
from vibrissa.texture.io import write_gaps, write_height_profile
from vibrissa.texture.relief import HeightProfile

BUILT_IN = read_study()
GRATING = Grating(length=0.03, seed=3).made(BUILT_IN.folder)
STUDY = """
name = "file"
[whisker]
length = 0.04
cone_angle = 1.5e-3
[posture]
contact = 0.29
base_angle = 1.2
[scan]
speed = 0.1
damping = 0.11
[film]
n_frames = 60
"""


@pytest.fixture
def folder(tmp_path):
    write_gaps(GRATING, tmp_path / "gaps.csv")
    write_height_profile(HeightProfile.from_gaps(GRATING), tmp_path / "relief.csv")
    return tmp_path


def study(folder, texture):
    path = folder / "study.toml"
    path.write_text(f"{STUDY}\n[texture]\n{texture}\n")
    return read_study(path)


def test_a_study_moves_over_gaps_of_a_file_as_over_the_same_relief(folder):
    gaps = predicted_motion(study(folder, 'file = "gaps.csv"'))
    ground = predicted_motion(study(folder, 'file = "relief.csv"\nlevel = "none"'))
    assert isinstance(gaps, Prediction)
    assert isinstance(ground, ReliefPrediction)
    film = dataclasses.replace(BUILT_IN.film, n_frames=300)
    one, other = (exposed_signals(motion, film, 5e-3) for motion in (gaps, ground))
    scale = np.abs(one.point_displacement).max()
    np.testing.assert_allclose(other.point_displacement, one.point_displacement, atol=1e-6 * float(scale))
    np.testing.assert_allclose(other.excursion, one.excursion, atol=1e-8)


def test_a_relief_is_filmed_and_its_low_stretches_are_drawn(folder):
    ground = predicted_motion(study(folder, 'file = "relief.csv"\nlevel = "none"'))
    film = dataclasses.replace(BUILT_IN.film, n_frames=3)
    scene = lay_out(ground, film)
    assert sum(len(block) for block in film_motion(ground, film, scene)) == 3
    shown = apparatus(ground, film, scene)
    np.testing.assert_allclose(shown.trough_start, GRATING.position)
    np.testing.assert_allclose(shown.trough_width, GRATING.width)
    assert shown.attrs["depth"] == pytest.approx(GRATING.depth)


def test_a_study_is_decomposed_into_the_modes_of_its_scan(folder):
    plain = study(folder, 'file = "gaps.csv"')
    film = dataclasses.replace(BUILT_IN.film, n_frames=600)
    asked = dataclasses.replace(plain, scan=dataclasses.replace(plain.scan, modes="curved-edge"), film=film)
    motion = predicted_motion(asked)
    profile = true_profile(motion.position, film, lay_out(motion, film), np.linspace(0, 0.0283, 60))
    results = {"profile": profile.expand_dims("whisker")}
    found = fit_movie(Run(asked, folder, folder, results=results, motion=motion))
    assert found["modal"].attrs["modes"] == "curved-edge"
    np.testing.assert_allclose(found["modal"].kappa, motion.kappa[:3], rtol=1e-9)
    np.testing.assert_allclose(found["resonance"].resonant_frequency[0], motion.omega[0] / (2 * np.pi), rtol=5e-3)


def test_what_was_decided_of_the_file_is_told(folder):
    said = []
    study(folder, 'file = "relief.csv"\nlevel = "line"').texture.made(folder, said.append)
    assert any("a tilt of" in line for line in said)


@pytest.mark.parametrize(
    ("texture", "message"),
    [
        ('file = "none.csv"', ("missing", "none.csv")),
        ('file = "gaps.csv"\nfill = true', ("conflict", "fill")),
    ],
)
def test_bad_files_are_refused_when_they_are_read(folder, texture, message):
    with refusal(*message):
        predicted_motion(study(folder, texture))


@pytest.mark.parametrize(
    ("table", "key", "remedy"),
    [
        (
            "0,0\n1,1\n2,2.1\n",
            'x_unit = "mm"\nz_unit = "mm"',
            "in [texture] level = 'line' subtracts the line, level = 'none' ",
        ),
        ("2,0\n1,1\n0,0\n", 'x_unit = "mm"\nz_unit = "um"', "in [texture] flip = true lets the last point of the file"),
        ("0,0\n1,nan\n2,0\n3,0\n", 'x_unit = "mm"\nz_unit = "um"', "in [texture] fill = true draws straight lines"),
        ("0,0\n1,1\n2,0\n", 'z_unit = "um"', "in [texture] give x_unit, one of m, mm, um, nm"),
    ],
)
def test_a_refused_surface_names_the_keys_of_the_study(folder, table, key, remedy):
    (folder / "bare.txt").write_text(table)
    with pytest.raises(InputError) as caught:
        study(folder, f'file = "bare.txt"\n{key}').texture.made(folder)
    assert remedy in caught.value.remedy
    assert "--" not in str(as_typed(caught.value, (), ()))  # at the command line too


def test_a_key_that_must_be_given_is_said_to_be_missing(tmp_path):
    table = {"name": "x", "scan": {"speed": 0.1}, "texture": {"length": 0.02}}
    with refusal("format", "s.toml: scan.damping") as caught:
        validated_study(table, "s.toml", tmp_path)
    assert str(caught.value).endswith("s.toml: scan.damping must be given; `vibrissa scan` takes 0.11")


@pytest.mark.parametrize(
    ("texture", "message"),
    [
        ({"file": "a.csv", "levle": "line"}, ("unknown", "s.toml: [texture]: key 'levle'")),
        ({"file": "a.csv", "level": "flat"}, ("format", "s.toml: texture.level")),
        ({"file": 5}, ("format", "s.toml: texture.file")),
        ({"seed": 5}, ("format", "s.toml: texture.length")),
        ({"lenght": 5}, ("unknown", "s.toml: [texture]: key 'lenght'")),
        (5, ("format", "s.toml: texture")),
    ],
)
def test_settings_of_either_kind_are_checked_by_their_own_names(tmp_path, texture, message):
    with refusal(*message):
        validated_study({"name": "x", "film": {"n_frames": 10}, "texture": texture}, "s.toml", tmp_path)
