"""`vibrissa modes --about profile`."""

import json

import numpy as np
import pytest

from vibrissa.netcdf import load
from vibrissa.whisker import atlas_whisker

PROFILE = ("modes", "--contact", "0.3", "--about", "profile")
AT = (*PROFILE, "--base-angle", "1.2")


def test_modes_about_the_profile_slide_under_constant_friction_unless_told(vibrissa):
    code, out, err = vibrissa(*AT, "--contact-condition", "slide", "--n-modes", "1", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["kappa"] == [pytest.approx(19.935, rel=3e-4)]
    assert found["kappa_straight"] == [pytest.approx(23.585537548, rel=1e-9)]
    assert found["resonance_ratio"] == [pytest.approx(0.845, abs=5e-4)]
    assert found["growth_rate"] == [0]
    assert json.loads(vibrissa(*AT, "--n-modes", "1", "--json")[1]) == found


@pytest.mark.parametrize(
    ("options", "kappa"),
    [
        (("--friction-law", "coulomb"), 21.067),
        (("--contact-condition", "stick"), 55.6),
        (("--contact-condition", "edge"), 17.569),  # of a chain of links over an edge, extrapolated
        (("--contact-condition", "flat", "--friction-law", "coulomb"), 24.144),  # by shooting
        (("--friction", "0"), 19.143),  # of a chain of 120 links
    ],
)
def test_modes_about_the_profile_take_law_condition_and_friction(vibrissa, options, kappa):
    found = json.loads(vibrissa(*AT, *options, "--json")[1])
    assert len(found["kappa"]) == 3
    assert found["kappa"][0] == pytest.approx(kappa, rel=1e-3)


def test_modes_about_the_profile_in_hertz_and_in_a_file(vibrissa, tmp_path):
    found = json.loads(vibrissa(*AT, "--atlas", "C2", "--out", tmp_path / "m.nc", "--json")[1])
    scale = 2 * np.pi * atlas_whisker("C2").timescale
    np.testing.assert_allclose(np.array(found["resonant_frequency"]) * scale, found["kappa"], rtol=1e-12)
    data = load(tmp_path / "m.nc")
    assert data.mode_along.dims == ("mode", "s")
    assert data.attrs["friction"] == 0.4


def test_scan_rings_in_the_modes_it_is_told(vibrissa, tmp_path):
    (tmp_path / "one.csv").write_text("position,width\n0.001,0.0006\n")
    cone = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3", "--speed", "0.1", "--n-modes", "2")
    words = ("scan", tmp_path / "one.csv", "--contact", "0.3", "--base-angle", "1.2", *cone)
    _, printed, told = vibrissa(*words, "--modes", "curved-coulomb", "--out", tmp_path / "r.nc", "--json")
    np.testing.assert_allclose(json.loads(printed)["kappa"][0], 21.067, atol=6e-4)
    assert np.isfinite(load(tmp_path / "r.nc").axial_force).all()
    assert "modes are about the profile (curved-coulomb); about the curved profile" in told
    assert "modes are the straight shaft's; about the curved profile" in vibrissa(*words, "--json")[2]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (PROFILE, "--base-angle must be given about a profile"),
        (("modes", "--contact", "0.3", "--friction", "0.4"), "--friction must go with --about profile"),
        (("modes", "--contact", "0.3", "--base-angle", "1.2"), "--base-angle must go with --about profile"),
        ((*AT, "--boundary", "free"), "--boundary must be 'pinned' about a profile"),
        ((*AT, "--contact-condition", "glue"), "--contact-condition"),
        ((*AT, "--contact-condition", "stick", "--friction-law", "coulomb"), "of a stuck contact must be 'constant'"),
        ((*AT, "--contact-condition", "edge", "--friction-law", "constant"), "on an edge must be 'coulomb'"),
        ((*PROFILE, "--base-angle", "1.7"), "--base-angle must lie between 0 and π/2"),
    ],
)
def test_bad_requests_are_one_line(vibrissa, words, message):
    code, out, err = vibrissa(*words)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
