"""E by collapse: put in, it comes out, in intervals that hold it; identity is seen where it is put in."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.across.collapse import collapse, modulus_in_air
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.stats import wilson_interval
from vibrissa.study.movie.geometry import measured_resonances
from vibrissa.study.sweeps.sweep_table import sweep_table
from vibrissa.whisker import YOUNGS_MODULUS, Whisker

NAMES = ("beta", "C1", "C2")
KAPPA = {contact: cone_kappa(contact, 3) for contact in np.linspace(0.12, 0.5, 60).round(3).tolist()}


def table(rng, *, mean=YOUNGS_MODULUS, animals=2, sweeps=6, spread=0.1, noise=0.003, identity=(0, 0, 0), kappa=None):
    """Sweeps whose whiskers have their own E about the mean [Pa], each frequency with an error of its own."""
    rows = []
    for animal in range(animals):
        for shift, name in zip(identity, NAMES, strict=True):
            modulus = mean * np.exp(shift + spread * rng.standard_normal())
            shape = {"length": rng.uniform(0.03, 0.05), "cone_angle": rng.uniform(1.2e-3, 2e-3)}
            for number in range(sweeps):
                contact, angle = float(rng.choice(list(KAPPA))), rng.uniform(0.8, 1.2)
                known = KAPPA[contact] if kappa is None else kappa(contact, angle)
                omega = known / Whisker(**shape, youngs_modulus=modulus).timescale
                rows.append(
                    {"animal": f"{animal}", "whisker_name": name, "texture": 0, "condition": number, "run": 0}
                    | {**shape, "timescale": Whisker(**shape).timescale, "base_height": 0.02}
                    | {"scan_speed": (0.1, 0.15, 0.2)[number % 3]}
                    | {"contact": contact, "base_angle": angle, "accepted": True, "rejected": ""}
                    | {"resonant_frequency": omega / (2 * np.pi) * np.exp(noise * rng.standard_normal(3))}
                )
    return sweep_table(rows)


def test_one_modulus_for_all_comes_back_exactly_and_the_collapse_is_whole():
    told = collapse(table(np.random.default_rng(1), mean=3.1e9, spread=0, noise=0))
    for end in ("", "_low", "_high"):
        assert float(told[f"youngs_modulus{end}"]) == pytest.approx(3.1e9, rel=1e-9)
    np.testing.assert_allclose(told.sweep_modulus, 3.1e9, rtol=1e-9)
    np.testing.assert_allclose(told.kappa, told.kappa_model, rtol=1e-9)
    np.testing.assert_allclose(told.collapse_r2, 1, rtol=1e-9)
    np.testing.assert_allclose(told.identity_modulus, 3.1e9, rtol=1e-9)
    assert told.identity.values.tolist() == sorted(NAMES)


@pytest.mark.parametrize("animals", [2, 6])
def test_intervals_hold_the_mean_over_many_laboratories(animals):
    """Whiskers are the draws, six or eighteen of them: sweeps of one whisker share its E."""
    held, wide = [], []
    for seed in range(60):
        told = collapse(table(np.random.default_rng(seed), animals=animals, sweeps=3))
        low, high = float(told.youngs_modulus_low), float(told.youngs_modulus_high)
        held.append(low <= YOUNGS_MODULUS <= high)
        wide.append(np.log(high / low) / 2)
    least, most = wilson_interval(int(np.sum(held)), len(held))
    assert least < 0.95 < most
    assert 0.10 / np.sqrt(3 * animals) < np.median(wide) < 3.2 * 0.10 / np.sqrt(3 * animals)


def test_an_identity_that_is_stiffer_is_seen_and_one_that_is_not_is_not():
    told = collapse(table(np.random.default_rng(3), animals=6, spread=0.03, identity=(0, 0, 0.3)))
    low, high = told.identity_modulus_low.sel(identity="C2"), told.identity_modulus_high.sel(identity="beta")
    assert float(low) > float(high)
    assert float(told.effect_p_clustered.sel(term="whisker_name")) < 1e-3
    p = [
        float(collapse(table(np.random.default_rng(seed), animals=6, sweeps=2)).effect_p.sel(term="whisker_name"))
        for seed in range(40)
    ]
    # every sweep taken for a draw, as the paper does, finds identity where there is none
    assert np.mean(np.array(p) < 0.05) > 0.2


def test_curved_modes_give_back_what_curved_modes_made():
    def kappa(contact, angle):
        return curved_modes(Posture(contact=contact, base_angle=angle), 3).kappa

    sweeps = table(np.random.default_rng(4), animals=1, sweeps=3, spread=0, noise=0, kappa=kappa)
    assert float(collapse(sweeps, modes="curved").youngs_modulus) == pytest.approx(YOUNGS_MODULUS, rel=1e-6)
    straight = collapse(sweeps)
    assert float(straight.youngs_modulus) < 0.95 * YOUNGS_MODULUS  # curvature lowers κ, which passes for a softer shaft
    assert float(straight.modulus_sd) > 0.005


def test_white_forcing_is_read_from_its_own_column_and_what_is_missing_is_left_out():
    sweeps = table(np.random.default_rng(5), spread=0, noise=0)
    with refusal("too-few", "sweeps"):
        collapse(sweeps, forcing="white")
    frequency = sweeps.resonant_frequency
    lost = sweeps.assign(
        resonant_frequency_white=0.95 * frequency.where((sweeps["sweep"] % 2 == 0) | (frequency.mode == 1))
    )
    told = collapse(lost, forcing="white")
    assert float(told.youngs_modulus) == pytest.approx(0.95**2 * YOUNGS_MODULUS, rel=1e-9)
    assert int(np.isfinite(told.kappa).sum()) == sweeps.sizes["sweep"] * 3 // 2
    rejected = sweeps.assign(accepted=xr.zeros_like(sweeps.accepted, dtype=bool))
    with refusal("too-few", "sweeps"):
        collapse(rejected)


def test_modulus_of_whiskers_in_air_is_held_and_that_of_hartmanns_lies_in_the_literature():
    told = measured_resonances()
    predicted = np.stack([told[f"predicted_{order}"].values for order in ("first", "second", "third")], axis=1)
    held = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        own = 1.1 * np.exp(0.15 * rng.standard_normal((len(predicted), 1)))  # E over nominal, whisker by whisker
        each, (_, low, high) = modulus_in_air(predicted * np.sqrt(own), predicted)
        np.testing.assert_allclose(each, YOUNGS_MODULUS * own[:, 0], rtol=1e-9)
        held.append(low <= 1.1 * YOUNGS_MODULUS <= high)
    least, most = wilson_interval(int(np.sum(held)), len(held))
    assert least < 0.95 < most
    low, high = told.attrs["youngs_modulus_low"], told.attrs["youngs_modulus_high"]
    assert low < 3.68e9 < high  # what the paper cites for them
    assert 0.7 * YOUNGS_MODULUS < told.attrs["youngs_modulus"] < 0.95 * YOUNGS_MODULUS  # and it comes out softer
    ratio = told.measured_first / told.predicted_first  # of a whisker with one resonance: by hand
    np.testing.assert_allclose(told.air_modulus[1:], YOUNGS_MODULUS * ratio[1:] ** 2, rtol=1e-9)
