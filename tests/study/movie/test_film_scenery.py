from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal
from scipy.ndimage import map_coordinates

from vibrissa.study.movie.virtual import film_motion, lay_out, predicted_motion, stage
from vibrissa.study.spec.settings import Film, read_study
from vibrissa.video.camera.field import empty_field
from vibrissa.video.camera.rendering import Camera
from vibrissa.video.camera.scenery import Light, Scenery

CAMERA = Camera(width=440, height=160, noise=0)


@pytest.fixture(scope="module")
def prediction():
    return predicted_motion(read_study())


def seen_at(film, prediction, s):
    """Share of the light at points of the resting shaft, beside the whisker itself."""
    scene = lay_out(prediction, film)
    field = empty_field(film.camera, stage(prediction, film, scene)) / film.camera.background
    along, up = prediction.response.flat.position(np.atleast_1d(s))
    x, y = scene.place(along, up)
    return map_coordinates(field, [y / film.camera.pixel_size, x / film.camera.pixel_size], order=1)


def test_a_film_shows_the_whisker_alone_unless_told(prediction):
    film = Film(n_frames=1, camera=CAMERA)
    assert stage(prediction, film, lay_out(prediction, film)) == Scenery()


def test_the_shadow_hides_the_length_of_shaft_asked(prediction):
    film = Film(n_frames=1, camera=CAMERA, shadow=3e-3)
    s = prediction.posture.contact + np.linspace(-5e-3, 8e-3, 14) / prediction.whisker.length
    seen = seen_at(film, prediction, s)
    assert seen[:7].max() < 0.15  # the free end, the contact, a millimetre before it
    assert seen[8] == pytest.approx(1 - 0.95 / 2, abs=0.02)  # three millimetres before it, half of the darkness
    assert seen[10:].min() > 0.85
    assert np.all(np.diff(seen[5:11]) > 0)


def test_the_whisker_leaves_the_skin_where_the_head_ends(prediction):
    film = Film(n_frames=1, camera=CAMERA, fur=True)
    scene = lay_out(prediction, film)
    bare = replace(stage(prediction, film, scene).fur, density=0)
    dark = 1 - empty_field(CAMERA, Scenery(fur=bare)) / CAMERA.background
    np.testing.assert_allclose((dark.sum(axis=1) - 0.5) * CAMERA.pixel_size, scene.skin[0], atol=1e-8)


def test_the_film_carries_its_scenery(prediction):
    plain = Film(n_frames=2, subframes=1, camera=CAMERA)
    full = replace(plain, fur=True, shadow=3e-3, light=Light(vignette=0.2))
    scene = lay_out(prediction, plain)
    before, after = (next(film_motion(prediction, film, scene)).astype(float) for film in (plain, full))
    field = empty_field(CAMERA, stage(prediction, full, scene)) / CAMERA.background
    assert np.abs(after - before * field).max() < 1.01  # both rounded


def test_a_shadow_out_of_range_is_refused():
    with refusal("range", "Film.shadow", value="-1"):
        Film(n_frames=1, shadow=-1)


def test_a_study_file_switches_the_scenery_on(tmp_path):
    text = """
    name = "film"
    [whisker]
    length = 0.04
    cone_angle = 1.5e-3
    [posture]
    contact = 0.29
    base_angle = 1.2
    [scan]
    speed = 0.1
    damping = 0.11
    [texture]
    length = 0.1
    [film]
    n_frames = 10
    fur = true
    shadow = 3e-3
    [film.light]
    vignette = 0.2
    drift = 0.01
    """
    path = tmp_path / "study.toml"
    path.write_text(text)
    film = read_study(path).film
    assert (film.fur, film.shadow, film.light) == (True, 3e-3, Light(vignette=0.2, drift=0.01))
