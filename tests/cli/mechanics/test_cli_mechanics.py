"""The verbs of one whisker on one texture: profile, gap, scan."""

import json

import numpy as np
import pytest

from vibrissa.exact import free_decay
from vibrissa.netcdf import load

POSTURE = ("--contact", "0.29", "--base-angle", "1.2")
CONE = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3")
SCAN = ("--speed", "0.1", "--damping", "0.11")


@pytest.fixture
def troughs(tmp_path):
    """Three gaps."""
    (tmp_path / "troughs.csv").write_text("position,width\n0.001,0.0006\n0.0019,0.0002\n0.003,0.0005\n")
    return tmp_path / "troughs.csv"


def test_profile_on_the_flat(vibrissa):
    code, out, err = vibrissa("profile", *POSTURE, "--friction", "0.4", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    names = ("contact_force", "base_distance", "contact_distance", "transverse_force_scaled", "axial_force_scaled")
    expected = [0.799412373, 0.461768821, 0.475665065, 0.545672, 0.584211]
    np.testing.assert_allclose([found[name] for name in names], expected, rtol=1e-6)


def test_profile_by_height_is_that_by_contact(vibrissa):
    found = json.loads(vibrissa("profile", "--base-distance", "0.461768821", "--base-angle", "1.2", "--json")[1])
    assert found["contact"] == pytest.approx(0.29, rel=1e-8)


def test_profile_on_an_edge_keeps_the_base(vibrissa):
    found = json.loads(vibrissa("profile", *POSTURE, "--contact-distance", "0.4761358412941", "--json")[1])
    assert found["base_distance"] == pytest.approx(0.461768821, rel=1e-8)
    assert found["held_excursion"] == pytest.approx(4.707761e-4, rel=1e-5)
    assert found["contact_angle"] < 0  # it sags


def test_profile_in_newtons(vibrissa):
    found = json.loads(vibrissa("profile", *POSTURE, *CONE, "--json")[1])
    unit = np.pi / 4 * 3.74e9 * 1.5e-3**4 * 0.04**2
    assert found["static_contact_force"] == pytest.approx(unit * found["contact_force"], rel=1e-12)
    assert found["static_moment"] == pytest.approx(unit * 0.04 * 0.490152, rel=1e-5)
    weight = 1140 * 9.81 * np.pi * (1.5e-3 * 0.04) ** 2 * 0.04 / 3
    assert found["weight_ratio"] == pytest.approx(weight / found["static_contact_force"], rel=1e-12)


def test_gap_prints_where_the_contact_jumps_and_how_linear_it_is(vibrissa):
    found = json.loads(vibrissa("gap", *POSTURE, "--gap-width", "0.015", "--json")[1])
    assert found["excursion_at_jump"] == pytest.approx(4.707761e-4, rel=1e-6)
    np.testing.assert_allclose(found["coupling"], [-0.10030, 0.01904, -0.00548], atol=6e-6)
    np.testing.assert_allclose(found["linearity"], [0.813, 0.607, 0.221], atol=6e-4)
    assert found["held_excursion"][2] == pytest.approx(4.707761e-4 - 0.015, rel=1e-6)


@pytest.mark.parametrize(
    ("words", "first"),
    [
        ((), "caution: the jump needs a tip beyond s = 0.275"),
        (("--whisker.tip", "0.05"), "outside the model: free end prevents 1 of 1 jumps"),
        (("--whisker.tip", "11.4mm"), "usable: free end prevents 0 of 1 jumps"),
        (("--whisker.tip", "0.285", "--gap-depth", "10um"), "outside the model: free end prevents 1 of 1 jumps"),
    ],
)
def test_gap_says_first_whether_it_is_usable(vibrissa, words, first):
    cone = CONE if words else ()
    code, out, err = vibrissa("gap", *POSTURE, "--gap-width", "0.015", *cone, *words, "--json")
    assert code == 0, err
    assert err.splitlines()[0] == f"vibrissa: {first} (docs/when-it-holds)"
    assert max(map(len, err.splitlines())) <= 80
    assert ("jumps_allowed" in json.loads(out)) == bool(words)


def test_scan_writes_vibration_and_what_the_follicle_feels(vibrissa, troughs, tmp_path):
    out = tmp_path / "r.nc"
    words = ("scan", troughs, *POSTURE, *SCAN, "--sampling-rate", "20000", "--response", "linear", *CONE, "--out", out)
    code, _, err = vibrissa(*words)
    assert code == 0
    assert err.startswith("vibrissa: outside the model: free end prevents 3 of 3 jumps;")
    assert "vibrissa: the free end is 11.6 mm long" in err.splitlines()[1]
    assert "the response is linear; mode 1 jumps 0.8" in err
    data = load(out)
    assert (data.attrs["contact"], data.attrs["whisker_length"]) == (0.29, 0.04)
    assert data.sizes["mode"] >= 3
    t, omega = data.time.values, 2 * np.pi * data.resonant_frequency.values[0]
    assert np.diff(t) == pytest.approx(1 / 20000)
    c, v = data.coupling.values[0], 0.1 / 0.04
    expected = np.zeros(len(t))  # Eqs. 12 and 13, gap by gap
    for x, width, d2 in zip([1e-3, 1.9e-3, 3e-3], [0.6e-3, 0.2e-3, 0.5e-3], excursions(vibrissa), strict=True):
        t1, t2, t3 = x / 0.1, x / 0.1 + d2 / v, (x + width) / 0.1
        for start, q0, v0 in ((t1, 0, -c * v), (t2, c * width / 0.04, 0), (t3, 0, c * v)):
            after = t >= start
            expected[after] += free_decay(t[after] - start, q0, v0, omega, 0.11)
    size = np.abs(expected).max()
    np.testing.assert_allclose(data.mode_amplitude[0], expected, atol=1e-7 * size)
    total = data.base_moment_quasi_static + data.base_moment_vibration
    np.testing.assert_allclose(data.base_moment, total, rtol=1e-12)
    assert np.isnan(data.axial_force_vibration).all()


def excursions(vibrissa):
    return [
        json.loads(vibrissa("gap", *POSTURE, "--gap-width", str(width / 0.04), "--json")[1])["excursion_at_jump"]
        for width in (0.6e-3, 0.2e-3, 0.5e-3)
    ]


def test_scan_prints_its_diagnostics_and_moves_nodes(vibrissa, troughs, tmp_path):
    out = tmp_path / "r.nc"
    words = ("scan", troughs, *POSTURE, *SCAN, *CONE, "--node", "0.005", "--node", "0.02", "--reverse", "--out", out)
    code, printed, _ = vibrissa(*words, "--json")
    assert code == 0
    found = json.loads(printed)
    assert found["lift_off"] == 0
    assert 0.7 < found["linearity"][0] < 1
    assert load(out).displacement.shape == (load(out).sizes["time"], 2)


def bad_texture(tmp, text):
    (tmp / "bad.csv").write_text(text)
    return tmp / "bad.csv"


BAD = {
    "beyond the tip": (["profile", "--contact", "0.01", "--base-angle", "1", "--atlas", "C2"], "whisker's tip"),
    "no modes": (["gap", *POSTURE, "--gap-width", "0.01", "--n-modes", "0"], "--n-modes must be"),
    "base angle": (["profile", "--contact", "0.3", "--base-angle", "-1"], "--base-angle must lie between"),
    "contact": (["profile", "--contact", "1.3", "--base-angle", "1"], "contact must lie between"),
    "neither": (["profile", "--base-angle", "1"], "--contact or --base-distance"),
    "out of reach": (["profile", "--base-distance", "0.95", "--base-angle", "1.2"], "between 0 and 0.932"),
    "edge out of reach": (["profile", *POSTURE, "--contact-distance", "0.9"], "determinant"),
    "beyond the fold": (["gap", "--contact", "0.1", "--base-angle", "1.4", "--gap-width", "0.01"], "before the fold"),
    "no gap": (["gap", *POSTURE, "--gap-width", "-0.01"], "--gap-width must lie between"),
    "wide gap": (["gap", *POSTURE, "--gap-width", "0.3"], "narrow"),
    "NaN": (["gap", *POSTURE, "--gap-width", "nan"], "--gap-width"),
}
BAD_SCAN = {
    "speed": (["--speed", "0"], "speed must be positive"),
    "damping": (["--speed", "0.1", "--damping", "1"], "damping must lie in [0, 1)"),
    "rate": (["--speed", "0.1", "--sampling-rate", "-5"], "--sampling-rate must be positive"),
    "too long": (["--speed", "1e-9"], "samples"),
    "node": (["--speed", "0.1", "--node", "0.1"], "node must lie on the whisker"),
    "jump": (["--speed", "0.1", "--jump", "soft"], "jump"),
}
BAD_TEXTURES = {
    "empty": ("position,width\n", "at least one gap"),
    "unsorted": ("position,width\n0.002,0.0001\n0.001,0.0001\n", "sort the gaps"),
    "overlapping": ("position,width\n0.001,0.0006\n0.0012,0.0006\n", "overlap"),
    "negative": ("position,width\n0.001,-0.0006\n", "positive"),
    "NaN": ("position,width\n0.001,nan\n", "finite"),
}


def refused(vibrissa, words, message):
    code, out, err = vibrissa(*words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert message in err


@pytest.mark.parametrize("case", BAD)
def test_bad_postures_and_gaps_are_one_line_and_exit_code_2(vibrissa, case):
    refused(vibrissa, *BAD[case])


@pytest.mark.parametrize("case", BAD_SCAN)
def test_bad_scans_are_one_line_and_leave_no_file(vibrissa, troughs, tmp_path, case):
    words, message = BAD_SCAN[case]
    refused(vibrissa, ["scan", troughs, *POSTURE, *CONE, "--out", tmp_path / "r.nc", *words], message)
    assert [path.name for path in tmp_path.iterdir()] == ["troughs.csv"]


@pytest.mark.parametrize("case", BAD_TEXTURES)
def test_bad_textures_are_one_line(vibrissa, tmp_path, case):
    text, message = BAD_TEXTURES[case]
    refused(vibrissa, ["scan", bad_texture(tmp_path, text), *POSTURE, *CONE, *SCAN], message)
