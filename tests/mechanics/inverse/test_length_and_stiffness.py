"""A whisker told by its own tracks: what can be told is found, what cannot is named."""

import json

import numpy as np
import pytest
from refusals import refusal

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.inverse.length_and_stiffness import fit_whisker
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.netcdf import save
from vibrissa.quantities import dataset
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
DAMPING, FREQUENCY_SE, DAMPING_SE = 0.11, 0.01, 0.06
TRUTH = {
    "length": WHISKER.length,
    "timescale": WHISKER.timescale,
    "youngs_modulus": WHISKER.youngs_modulus,
    "damping_all": DAMPING,
}


def tracked(contact, angle, rng, sd=15e-6, vibration=50e-6, frames=800):
    """Profile with 3 mm hidden, noise, and the first mode at random."""
    arc = np.arange(0, (1 - contact) * WHISKER.length - 3e-3, 150e-6)
    s = 1 - arc / WHISKER.length
    still = stationary_profile(Posture(contact=contact, base_angle=angle), s)
    mode = cone_modes(cone_kappa(contact, 1), contact, s)[0]
    amplitude = np.convolve(rng.standard_normal(frames + 19), np.ones(20) / np.sqrt(20), "valid")
    off = vibration * amplitude[:, None] * mode / np.abs(mode).max()
    x = still.profile_x.values * WHISKER.length - np.sin(still.angle.values) * off
    y = still.profile_y.values * WHISKER.length + np.cos(still.angle.values) * off
    y = y + sd * rng.standard_normal(y.shape)
    return dataset(time=np.arange(frames) / 2000, x=x, y=y, y_sd=np.full(y.shape, max(sd, 1e-9)), arc_length=arc)


def resonances(contact, rng, n_modes=3, scatter=1.0):
    """Frequencies and damping as fitted, off by their standard errors at random."""
    f = cone_kappa(contact, n_modes) / (2 * np.pi * WHISKER.timescale)
    f = f * np.exp(scatter * FREQUENCY_SE * rng.standard_normal(n_modes))
    zeta = DAMPING * np.exp(scatter * DAMPING_SE * rng.standard_normal(n_modes))
    columns = {}
    for name, value, se in (("resonant_frequency", f, FREQUENCY_SE), ("damping", zeta, DAMPING_SE)):
        columns |= {name: value, f"{name}_low": value * np.exp(-1.96 * se), f"{name}_high": value * np.exp(1.96 * se)}
    return dataset(mode=np.arange(1, n_modes + 1), **columns)


@pytest.fixture(scope="module")
def exact():
    rng = np.random.default_rng(0)
    profile, found = tracked(0.25, 1.2, rng, sd=0, vibration=0, frames=2), resonances(0.25, rng, scatter=0)
    return profile, found


def test_tracks_without_noise_give_the_whisker(exact):
    found = fit_whisker(*exact, cone_angle=(WHISKER.cone_angle, 0.0))
    for name, value in TRUTH.items():
        assert float(found[name]) == pytest.approx(value, rel=3e-3), name
    assert float(found.contact) == pytest.approx(0.25, abs=5e-4)
    assert float(found.base_angle) == pytest.approx(1.2, abs=2e-3)
    assert found.attrs["not_identified"] == ""


def test_the_verb_whisker_takes_tracks_and_resonances(exact, vibrissa, tmp_path):
    files = tmp_path / "tracked.nc", tmp_path / "resonances.nc"
    for data, path in zip(exact, files, strict=True):
        save(data, path)
    code, out, err = vibrissa("whisker", "--tracked", files[0], "--resonance-file", files[1], "--json")
    assert code == 0
    assert json.loads(out)["length"] == pytest.approx(WHISKER.length, rel=3e-3)
    assert "not identified: youngs_modulus" in err or "E, ρ and α" in err
    assert vibrissa("whisker", "--tracked", files[0])[0] == 2


def test_stiffness_without_the_cone_is_not_identified(exact):
    found = fit_whisker(*exact)
    assert np.isnan(found.youngs_modulus)
    assert "E, ρ and α enter as k" in found.attrs["not_identified"]
    assert float(found.timescale) == pytest.approx(WHISKER.timescale, rel=3e-3)


def test_stiffness_scales_with_what_is_given_of_the_cone(exact):
    one = fit_whisker(*exact, cone_angle=(1.5e-3, 0.0))
    two = fit_whisker(*exact, cone_angle=(3e-3, 0.0), density=(2 * 1140.0, 0.0))
    assert float(two.youngs_modulus / one.youngs_modulus) == pytest.approx(2 / 4)


def test_intervals_hold_the_truth():
    """Of 6 trials with 4 intervals each, fewer than 19 of 24 within have a chance below 1 % at 95 %."""
    within = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        contact, angle = rng.uniform(0.15, 0.4), rng.uniform(0.9, 1.4)
        alpha = WHISKER.cone_angle * (1 + 0.02 * rng.standard_normal())
        found = fit_whisker(tracked(contact, angle, rng), resonances(contact, rng), cone_angle=(alpha, 3e-5))
        within += [float(found[f"{n}_low"]) <= v <= float(found[f"{n}_high"]) for n, v in TRUTH.items()]
    assert sum(within) >= 19


def test_a_poor_short_record_does_not_tell_the_length():
    rng = np.random.default_rng(1)
    profile = tracked(0.4, 0.8, rng, sd=300e-6, vibration=0, frames=2)
    found = fit_whisker(profile, resonances(0.4, rng, n_modes=1), cone_angle=(1.5e-3, 3e-5))
    assert np.isnan(found.length)
    assert np.isnan(found.youngs_modulus)
    assert "L: the interval reaches what was tried" in found.attrs["not_identified"]


def test_without_any_resonance_it_refuses(exact):
    profile, found = exact
    with refusal("too-few", "resonant_frequency"):
        fit_whisker(profile, found.assign(resonant_frequency_low=found.resonant_frequency_low * np.nan))
