"""A sweep whose truth is in curved modes decomposes back into them, and not into straight ones."""

import json
from functools import cache

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.modes.basis import basis
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.netcdf import load, save
from vibrissa.quantities import dataset
from vibrissa.study.movie.backward import analyse
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
ARC = np.linspace(0, 0.0283, 220)  # skin to 0.1 mm short of the contact
TIME = np.arange(800) / 2000 + 0.02


@cache
def sweep(modes, posture=POSTURE):
    """A prediction over a grating, and the nodes of its shaft as a tracker would find them in the substrate's frame."""
    grating = random_grating(0.045, rng=np.random.default_rng(7), mean_period=0.4e-3)
    prediction = predict(WHISKER, posture, grating, Scan(speed=0.1, damping=0.11, modes=modes), n_modes=8)
    x, y = prediction.position(TIME, np.concatenate([[1.0], 1 - ARC[1:] / WHISKER.length]))
    length = WHISKER.length
    return prediction, dataset(x=x * length, y=y * length, arc_length=ARC, time=TIME, node=np.arange(len(ARC)))


def missed(prediction, found):
    """Error of each amplitude, rms over its own."""
    true = prediction.mode_displacement(TIME)[: len(found)]
    true = true - true.mean(axis=1, keepdims=True)
    return np.sqrt(np.mean((found - true) ** 2, axis=1) / np.mean(true**2, axis=1))


@pytest.mark.parametrize("modes", ["curved", "curved-coulomb", "curved-edge"])
def test_what_moves_in_curved_modes_decomposes_back_into_them(modes):
    prediction, profile = sweep(modes)
    back = decompose(profile, WHISKER, 0.29, modes=modes, posture=POSTURE, extra_modes=3)
    np.testing.assert_allclose(back.kappa, prediction.kappa[:3], rtol=1e-9)
    assert back.attrs["modes"] == modes
    wrong = decompose(profile, WHISKER, 0.29, extra_modes=3)
    own, straight = (missed(prediction, one.mode_displacement.values) for one in (back, wrong))
    assert own[0] < 0.005
    assert own[1] < 0.02
    assert straight[0] > 5 * own[0]
    assert straight[1] > 3 * own[1]


@pytest.mark.parametrize("modes", ["curved", "curved-edge"])
def test_one_curved_mode_alone_is_told_from_the_others(modes):
    flat = on_the_flat(POSTURE)
    s = 1 - ARC / WHISKER.length
    (along, up), (x, y) = basis(modes, flat, 4).displacement(s), flat.position(s)
    swing = np.array([[1e-4], [0], [3e-5], [0]]) * np.sin(2 * np.pi * np.array([[91], [0], [200], [0]]) * TIME)
    swing -= swing.mean(axis=1, keepdims=True)
    rows = {"x": (x + swing.T @ along) * 0.04, "y": (y + swing.T @ up) * 0.04}
    profile = dataset(arc_length=ARC, time=TIME, node=np.arange(len(ARC)), **rows)
    back = decompose(profile, WHISKER, 0.29, modes=modes, posture=POSTURE, n_modes=4, extra_modes=0)
    np.testing.assert_allclose(back.mode_displacement, swing, atol=1e-7)  # the fitted normal: to 1e-3 rad


def test_in_a_flat_posture_curved_modes_give_what_straight_ones_give():
    shallow = Posture(contact=0.29, base_angle=0.1)
    profile = sweep("curved", shallow)[1]
    one = decompose(profile, WHISKER, 0.29, modes="curved", posture=shallow).mode_displacement.values
    other = decompose(profile, WHISKER, 0.29).mode_displacement.values
    np.testing.assert_allclose(one[0], other[0], atol=0.01 * np.abs(other[0]).max())


def test_the_analysis_looks_for_resonances_where_the_modes_have_them():
    prediction, profile = sweep("curved")
    results = analyse(profile, WHISKER, 0.29, modes="curved", posture=POSTURE)
    kappa = results["modal"].kappa.values
    np.testing.assert_allclose(kappa, prediction.kappa[:3], rtol=1e-9)
    assert "resonance_white" in results


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"modes": "curved"}, ("missing", "posture")),
        ({"modes": "curved", "posture": Posture(contact=0.3, base_angle=1.2)}, ("missing", "posture")),
        ({"modes": "curved", "posture": POSTURE, "method": "paper2014"}, ("unknown", "method")),
        ({"modes": "bent", "posture": POSTURE}, ("unknown", "modes")),
    ],
)
def test_bad_modes_are_refused(options, message):
    with refusal(*message):
        decompose(sweep("curved")[1], WHISKER, 0.29, **options)


def test_the_verb_decomposes_into_curved_modes_and_tells_their_shift(tmp_path, vibrissa):
    prediction, profile = sweep("curved-edge")
    save(profile.expand_dims(whisker=[0]), tmp_path / "tracks.nc")
    words = ("decompose", tmp_path / "tracks.nc", "--contact", "0.29", "--json", "--out", tmp_path / "modal.nc")
    cone = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3")
    code, out, err = vibrissa(*words, *cone, "--modes", "curved-edge", "--base-angle", "1.2")
    assert code == 0, err
    np.testing.assert_allclose(json.loads(out)["kappa"], prediction.kappa[:3], rtol=1e-9)
    assert "modes are about the profile (curved-edge); about the curved profile the first resonance is off" in err
    assert missed(prediction, load(tmp_path / "modal.nc").mode_displacement.values)[0] < 0.005
    code, out, err = vibrissa(*words, *cone, "--modes", "curved")
    assert (code, out) == (2, "")
    assert "--base-angle must be given with curved --modes" in err
