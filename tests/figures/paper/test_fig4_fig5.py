"""Figures 4 and 5: what their captions claim of a sweep whose truth is known, and of a table of sweeps."""

import io
import re

import numpy as np
import pytest
from refusals import refusal
from simulated_sweeps import simulated

from vibrissa.figures.paper import fig4, fig5
from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.inverse.resonance import fit_modes, line_r2
from vibrissa.mechanics.scan.free_end import free_end_facts
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.study.movie.backward import analyse
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import YOUNGS_MODULUS, Whisker

WHISKER = Whisker(length=0.045, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.25, base_angle=1.1)
TIME = np.arange(1600) / 2000
ARC = np.arange(1, 285) * 116e-6


@pytest.fixture(scope="module")
def results():
    """One sweep with the tracker's noise, analysed; its texture's line; a table of other sweeps."""
    rng = np.random.default_rng(2)
    motion = predict(WHISKER, POSTURE, random_grating(0.18, rng=rng), Scan(speed=0.2, damping=0.11))
    x, y = (WHISKER.length * one for one in motion.position(TIME, 1 - ARC / WHISKER.length))
    x, y = (one + 3e-6 * rng.standard_normal(one.shape) for one in (x, y))
    profile = dataset(time=TIME, node=np.arange(len(ARC)), arc_length=ARC, x=x, y=y)
    told = analyse(profile, WHISKER, POSTURE.contact)
    fit, spectra = fit_modes(told["modal"], motion.omega[:3] / (2 * np.pi), prediction=motion)
    return {**told, "profile": profile.expand_dims("whisker"), "resonance": fit, "spectra": spectra}


@pytest.fixture(scope="module")
def sweeps():
    """Put in: one E, that of the paper, and mode 3 not used."""
    return simulated(animals=2, conditions=2, textures=1)[0]


def test_the_modes_sum_to_the_deformation_and_mode_1_is_most_of_it(results):
    data = fig4.compute(results)
    rest = (data.deformation - data.mode_part.sum("mode")).values
    share = (rest**2).sum() / (data.deformation.values**2).sum()
    assert share < 0.02
    assert f"{100 * share:.1f} % of its square" in data.attrs["caption"]
    assert float(data.variance_explained[0]) > 0.9
    assert f"{1e6 * np.abs(data.deformation.values).max():.0f} µm" in data.attrs["caption"]


@pytest.mark.parametrize(("allowed", "says"), [(0, True), (20, False)])
def test_a_virtual_film_says_that_its_free_end_allows_no_such_dive(results, allowed, says):
    film = dataset(**free_end_facts(9.6e-3, np.arange(20) < allowed))
    caption = fig4.compute({**results, "apparatus": film}).attrs["caption"]
    assert ("a free end of 9.6 mm allows 0 of its 20 jumps" in caption) == says
    assert "free end" not in fig4.compute(results).attrs["caption"]  # a recorded movie is no model's


def test_modes_of_an_edge_sum_to_the_deformation_in_the_shapes_that_were_fitted():
    scan = Scan(speed=0.1, damping=0.11, modes="curved-edge")
    motion = predict(WHISKER, POSTURE, random_grating(0.05, rng=np.random.default_rng(3)), scan, n_modes=5)
    x, y = (WHISKER.length * one for one in motion.position(TIME[:600] + 0.02, 1 - ARC / WHISKER.length))
    profile = dataset(time=TIME[:600], node=np.arange(len(ARC)), arc_length=ARC, x=x, y=y)
    modal = decompose(profile, WHISKER, POSTURE.contact, modes="curved-edge", posture=POSTURE)
    data = fig4.compute({"modal": modal})
    left = (data.deformation - data.mode_part.sum("mode")).values
    assert np.abs(left).max() < 0.1 * np.abs(data.deformation.values).max()
    del modal.attrs["base_angle"]
    with refusal("missing", "modal"):
        fig4.compute({"modal": modal})


def test_the_cross_stands_where_the_deformation_was_taken(results):
    data = fig4.compute(results)
    q = data.mode_displacement[0].sel(time=data.attrs["instant"])
    assert float(abs(q)) == pytest.approx(float(abs(results["modal"].mode_displacement[0]).max()))


def test_the_profile_of_the_instant_is_displaced_by_the_enlarged_deformation(results):
    data = fig4.compute(results)
    away = np.hypot(data.shape_x_instant - data.shape_x, data.shape_y_instant - data.shape_y).values
    # across the shaft as B says; along it a node slips by a little more
    across = data.attrs["enlarged"] * np.abs(data.deformation.values)
    middle = slice(len(away) // 4, 3 * len(away) // 4)
    np.testing.assert_allclose(away[middle], across[middle], rtol=0.1)
    assert "shape_x" not in fig4.compute({"modal": results["modal"]})


def test_the_known_texture_explains_what_eq_5_cannot(results):
    data = fig5.compute(results)
    assert np.all(data.fit_r2.values[:2] > 0.99)
    assert np.all(data.fit_r2_white.values[:2] < 0.8)
    np.testing.assert_allclose(data.fit_r2_white, line_r2(results["spectra_white"]))
    assert f"{float(data.fit_r2_white[0]):.2f}" in data.attrs["caption"]


def test_modes_show_the_higher_resonances_where_one_node_drowns_them_in_its_noise(results):
    """With this tracker one node shows them too; with ten times its noise, as in the paper, the modes alone do."""
    data = fig5.compute(results)
    clear = data.peak_contrast
    assert np.all(np.abs(clear.sel(source="node") - clear.sel(source="mode")).values[:2] < 3)
    rng, profile = np.random.default_rng(5), results["profile"].isel(whisker=0)
    noisy = profile.assign({name: profile[name] + 3e-5 * rng.standard_normal(profile[name].shape) for name in "xy"})
    told = analyse(noisy, WHISKER, POSTURE.contact)
    spectra, f = told["spectra_white"], data.resonant_frequency.values
    node = fig5._node(told["modal"])[0]
    mode_2, node_2 = fig5._contrasts(spectra.frequency.values, spectra.power.values, node, f)["peak_contrast"][:, 1]
    assert mode_2 > node_2 + 3


def test_contrast_is_that_of_a_line_of_known_height():
    frequency = np.arange(1, 1000.0)
    power = np.where(np.abs(frequency / 200 - 1) < 0.12, 50.0, 1.0) / frequency**2
    level = fig5._contrast(frequency, power * frequency**2, 200.0)
    assert level == pytest.approx(10 * np.log10(50), abs=0.05)
    assert fig5._contrast(frequency, power, 200.0) == pytest.approx(level, abs=0.6)  # a slope is no peak
    assert np.isnan(fig5._contrast(frequency, power, np.nan))


def test_one_modulus_collapses_the_sweeps_and_curved_modes_ask_for_a_stiffer_shaft(results, sweeps):
    data = fig5.compute({**results, "sweeps": sweeps})
    assert float(data.youngs_modulus) == pytest.approx(YOUNGS_MODULUS, rel=1e-6)
    np.testing.assert_allclose(data.collapse_r2[:2], 1)
    straight, curved = (float(data.variant_modulus.sel(variant=f"texture, {one}")) for one in ("straight", "curved"))
    assert curved > 1.05 * straight
    assert "white, straight" not in data.variant.values  # no such fits in the table
    near = np.interp(data.contact, data.curve_contact, data.curve_kappa[0])
    np.testing.assert_allclose(data.kappa[:, 0], near, rtol=2e-3)
    assert f"E = {1e-9 * YOUNGS_MODULUS:.2f} GPa (95 %" in data.attrs["caption"]


def test_the_line_of_the_sweep_shown_comes_from_its_series(results, sweeps):
    own = {name: results[name] for name in ("modal", "resonance_white", "spectra_white")}
    study = {**own, "sweeps": sweeps, "posture": dataset({"sweep": 3}, contact=0.25)}
    series = {3: results["spectra"]}
    data = fig5.compute(study, series.__getitem__)
    assert data.attrs["forcing"] == "texture"
    np.testing.assert_allclose(data.resonant_frequency, sweeps.resonant_frequency.sel(sweep=3))
    assert "power_fit" in data
    assert fig5.compute(own).attrs["forcing"] == "white"


def test_resonances_that_were_not_found_are_dashes_and_take_no_panel(results):
    study = {name: results[name] for name in ("modal", "resonance_white", "spectra_white")}
    some = fig5.compute(study | {"resonance_white": _without(study["resonance_white"], [0])})
    assert ", – dB" not in some.attrs["caption"]
    assert "flanks: –, " in some.attrs["caption"]
    near = [axis.get_title(loc="left") for axis in fig5.draw(some).axes if "About" in axis.get_title(loc="left")]
    assert near == ["About mode 2", "About mode 3"]
    none = fig5.compute(study | {"resonance_white": _without(study["resonance_white"], [0, 1, 2])})
    assert not re.search(r"\bnan\b", none.attrs["caption"])
    assert len(fig5.draw(none).axes) == 3


def _without(fit, modes):
    lost = fit.copy(deep=True)
    lost.resonant_frequency[modes] = np.nan
    return lost


def test_one_sweep_alone_tells_no_number_that_is_none(results, sweeps):
    alone = sweeps.isel(sweep=[0])
    alone["resonant_frequency"][:, 1:] = np.nan
    caption = fig5.compute({**results, "sweeps": alone}).attrs["caption"]
    assert not re.search(r"\bnan\b", caption)
    assert "with one E for 1 sweep, R² of modes 1, 2: –, –" in caption


def test_figures_are_drawn(results, sweeps):
    fig4.draw(fig4.compute(results)).savefig(io.BytesIO())
    fig5.draw(fig5.compute({**results, "sweeps": sweeps})).savefig(io.BytesIO())
