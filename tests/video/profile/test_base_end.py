"""Next to the skin the line is the whisker's, whatever hairs it crosses, or it is not measured."""

import numpy as np
import pytest

from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.study.movie.apparatus import true_profile
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.sweeps.laboratory import plan
from vibrissa.study.sweeps.virtual_sweep import filmed_sweep
from vibrissa.video.follow.following import Centrelines
from vibrissa.video.profile.base_end import FRAMES, MARGIN, NEXT, first_frames, whisker_from

LENGTH, HAIR = 0.04, 60


def shaft(contact, angle, pixel):
    """Rows of a whisker of Eq. 1 at the columns of an image whose columns run along its chord."""
    x, y = on_the_flat(Posture(contact=contact, base_angle=angle)).position(np.linspace(1, contact, 4000))
    z = (x - x[0] + 1j * (y - y[0])) * LENGTH / pixel
    z *= np.exp(-1j * np.angle(z[-1]))
    return np.interp(np.arange(int(z.real.max())), z.real, z.imag)


@pytest.mark.parametrize("pixel", [50e-6, 95e-6, 200e-6])
@pytest.mark.parametrize("noise", [0.0, 0.003, 0.03])
@pytest.mark.parametrize(("contact", "angle"), [(0.1, 0.8), (0.29, 1.2), (0.5, 1.4)])
def test_a_smooth_shaft_is_taken_whole(contact, angle, noise, pixel):
    rows = shaft(contact, angle, pixel)
    assert whisker_from(rows + noise * np.random.default_rng(0).standard_normal(rows.size)) == 0


@pytest.mark.parametrize("slope", [0.02, 0.1, -0.5])
def test_the_line_is_left_where_it_follows_a_hair(slope):
    rows = shaft(0.29, 1.2, 95e-6)
    rows += slope * np.maximum(HAIR - np.arange(rows.size), 0)
    rows += 0.003 * np.random.default_rng(0).standard_normal(rows.size)
    assert HAIR <= whisker_from(rows) <= HAIR + NEXT + MARGIN


def test_blocks_do_not_count():
    rng = np.random.default_rng(0)
    row, reason = rng.standard_normal((1, 450, 30)), rng.integers(0, 2, (1, 450)).astype(np.int8)
    whole = Centrelines(row, row + 1, row + 2, reason)
    for size in (1, 70, 450):
        blocks = [Centrelines(*(one[:, i : i + size] for one in whole)) for i in range(0, 450, size)]
        first, again = first_frames(iter(blocks))
        for found, kept, given in zip(first, zip(*again, strict=True), whole, strict=True):
            np.testing.assert_array_equal(found, given[:, :FRAMES])
            np.testing.assert_array_equal(np.concatenate(kept, axis=1), given)


@pytest.mark.parametrize("number", [0, 1, 3])
def test_nodes_of_a_whisker_in_fur_lie_on_its_shaft_at_their_arc_length(number):
    laboratory = Laboratory(truth="modes", animals=1, conditions=2, textures=1, n_frames=FRAMES, fur=True, seed=1)
    filmed = filmed_sweep(laboratory, plan(laboratory)[0][number])
    profile, pixel = filmed.profile, filmed.film.camera.pixel_size
    true = true_profile(filmed.motion.position, filmed.film, filmed.scene, profile.arc_length.values)
    seen = np.isfinite(profile.y_sd.values).mean(axis=0) > 0.5
    z, place = ((one.x.values + 1j * one.y.values).mean(axis=0) for one in (profile, true))
    way = np.gradient(place)
    off = ((z - place) * np.abs(way) / way / pixel)[seen]
    next_to_fur = profile.arc_length.values[seen] < 8e-3
    assert next_to_fur.any()
    assert np.abs(off.imag[next_to_fur]).max() < 0.1  # [px]
    assert np.abs(off.real[next_to_fur]).max() < 0.1
