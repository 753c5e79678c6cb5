"""The posture at rest of a whisker filmed over a texture: its intervals hold the truth."""

import numpy as np
import pytest

from vibrissa.figures.paper import fig1
from vibrissa.mechanics.inverse.stationary_posture import fit_profile
from vibrissa.mechanics.scan.relief_prediction import predict_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.study.movie.resting import at_rest, posture_at_rest
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
SPACING, HIDDEN, NOISE, FRAMES, RATE = 232e-6, 1e-3, 5e-6, 500, 1000.0
SEEDS = 24
NAMES = ("contact", "base_angle", "base_height")


def swept(seed, contact=None, base_angle=None, response="exact", relief=False):
    """Nodes with noise of a whisker drawn over a grating, the truth, and what an experimenter knows."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(0.18, 0.36), rng.uniform(0.8, 1.3)
    posture = Posture(contact=contact or place[0], base_angle=base_angle or place[1])
    texture = random_grating(0.12, rng=rng)
    scan = Scan(speed=0.15, damping=0.11, response=response)
    if relief:
        texture = HeightProfile.from_gaps(texture)
        motion = predict_relief(WHISKER, posture, texture, scan, n_modes=3)
    else:
        motion = predict(WHISKER, posture, texture, scan, n_modes=3)
    arc = np.arange(0, (1 - posture.contact) * WHISKER.length - HIDDEN, SPACING)
    t = np.arange(FRAMES) / RATE
    x, y = (WHISKER.length * one for one in motion.position(t, 1 - arc / WHISKER.length))
    x, y = (one + NOISE * rng.standard_normal(one.shape) for one in (x, -y))
    profile = dataset(
        {"pixel_size": 95e-6},
        time=t,
        node=np.arange(arc.size),
        x=x,
        y=y,
        y_sd=np.full(y.shape, NOISE),
        arc_length=arc,
    )
    height = float(motion.response.flat.base[1]) * WHISKER.length
    truth = dict(zip(NAMES, (posture.contact, posture.base_angle, height), strict=True))
    return profile, truth, {"texture": texture, "scan": scan}


@pytest.fixture(scope="module")
def many():
    """Errors over half intervals of ε, θ_b and H, (seed, quantity), without the texture and with it."""
    found = {"raw": [], "rest": []}
    for seed in range(SEEDS):
        profile, truth, known = swept(seed)
        for name, fit in (("raw", fit_profile(profile, WHISKER)), ("rest", posture_at_rest(profile, WHISKER, **known))):
            found[name].append([float((fit[n] - truth[n]) / (fit[f"{n}_high"] - fit[n])) for n in NAMES])
    return {name: np.array(values) for name, values in found.items()}


def test_intervals_of_the_posture_at_rest_hold_the_truth(many):
    """Of 24 trials at 95 %, fewer than 20 within have a chance of 0.6 %; the errors are on both sides of the truth."""
    within = np.abs(many["rest"]) <= 1
    assert (within.sum(axis=0) >= 20).all()
    assert np.all(np.abs(many["rest"].mean(axis=0)) < 3 * many["rest"].std(axis=0) / np.sqrt(SEEDS))


def test_those_of_the_mean_profile_do_not(many):
    assert ((np.abs(many["raw"]) <= 1).sum(axis=0) < 12).all()
    assert (many["raw"][:, 0] > 0).all()  # the contact hangs back: ε too large
    assert (many["raw"][:, 1] < 0).all()


@pytest.mark.parametrize("how", [{"response": "linear"}, {"relief": True}])
def test_the_mean_is_that_of_the_scan_and_of_the_surface_given(how):
    profile, truth, known = swept(3, 0.29, 1.2, **how)
    raw, found = fit_profile(profile, WHISKER), posture_at_rest(profile, WHISKER, **known)
    for name in NAMES:
        assert float(found[f"{name}_low"]) < truth[name] < float(found[f"{name}_high"])
        assert abs(float(found[name]) - truth[name]) < 0.2 * abs(float(raw[name]) - truth[name])


def test_figure_1_is_drawn_of_the_profile_at_rest_and_says_so():
    profile, _, known = swept(3, 0.29, 1.2)
    found = posture_at_rest(profile, WHISKER, **known)
    off = -1e3 * float(found.mean_excursion)
    assert 0.05 < off < 0.2  # [mm]
    data = fig1.compute(at_rest(profile, found), found, WHISKER)
    assert np.abs(data.course_residual).max() < 3e-6  # [m]
    assert f"(mean excursion −{off:.2f} mm)" in data.attrs["caption"]
    plain = fit_profile(profile, WHISKER)
    assert at_rest(profile, plain) is profile
    assert "which the errors given do not include" in fig1.compute(profile, plain, WHISKER).attrs["caption"]
