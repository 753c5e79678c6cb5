"""The whole whisker at the command line: ``gap`` and ``scan`` with ``--model rod``."""

import json

import av
import numpy as np
import pytest

from vibrissa.netcdf import load

CONE = ["--whisker.length", "40mm", "--whisker.cone-angle", "1.5e-3"]
HELD = ["--contact", "0.29", "--base-angle", "1.2"]
GAP = ["gap", *HELD, *CONE, "--gap-width", "0.4mm", "--gap-depth", "35um"]
ROD = ["--model", "rod"]


@pytest.fixture
def grating(tmp_path):
    path = tmp_path / "grating.csv"
    path.write_text("position_mm,width_mm\n1,0.4\n2,0.3\n")
    return path


def test_a_gap_under_the_rod_gives_the_largest_amplitudes(vibrissa):
    words = ["--whisker.tip", "0.289", "--scan-speed", "100mm/s", "--damping", "0.11", "--json"]
    code, out, err = vibrissa(*GAP, *ROD, *words)
    found = json.loads(out)
    assert code == 0
    assert len(found["largest_mode_displacement"]) == 3
    assert 4e-4 < found["largest_mode_displacement"][0] < 2e-3
    assert 0 <= found["free_end_length"] <= 0.04e-3
    assert err.splitlines()[0].startswith("vibrissa: usable: whole whisker")


def test_speed_has_one_value_by_either_name(vibrissa):
    tip = ["--whisker.tip", "0.28", "--json"]
    first = vibrissa(*GAP, *ROD, *tip, "--speed", "0.1")[1]
    assert vibrissa(*GAP, *ROD, *tip, "--scan-speed", "100mm/s")[1] == first
    assert vibrissa(*GAP, *ROD, *tip)[1] == first


def test_a_gap_without_a_tip_is_told_so_in_the_first_line(vibrissa):
    _, _, err = vibrissa(*GAP, *ROD)
    assert err.startswith("vibrissa: caution: no physical tip was given")


def test_curvature_and_a_follicle_change_the_answer(vibrissa):
    tip = ["--whisker.tip", "0.25", "--json"]
    answers = [
        [],
        ["--intrinsic-curvature", "15"],
        ["--follicle-rotation", "3"],
        ["--thick"],
        ["--edge-radius", "20um"],
    ]
    found = [json.loads(vibrissa(*GAP, *ROD, *tip, *words)[1])["largest_mode_displacement"][0] for words in answers]
    assert len(set(found)) == len(found)


def test_curvature_comes_from_a_table_or_from_the_atlas(vibrissa, tmp_path):
    path = tmp_path / "curvature.csv"
    path.write_text("distance_mm,curvature_per_m\n0,25.568\n")
    gap = ["gap", *HELD, "--atlas", "C2", "--gap-width", "0.4mm", *ROD, "--json", "--hold-contact"]
    answers = {
        name: json.loads(vibrissa(*gap, *words)[1])["largest_mode_displacement"][0]
        for name, words in {
            "atlas": ["--intrinsic-curvature", "atlas"],
            "table": ["--intrinsic-curvature", str(path)],
            "number": ["--intrinsic-curvature", "25.568"],
            "flipped": ["--intrinsic-curvature", "-25.568", "--flip-curvature"],
            "other": ["--intrinsic-curvature", "-25.568"],
        }.items()
    }
    assert answers["table"] == answers["flipped"] == pytest.approx(answers["number"], rel=1e-9)
    assert answers["atlas"] == pytest.approx(answers["number"], rel=0.5)
    assert answers["atlas"] != pytest.approx(answers["number"], rel=0.01)
    assert answers["other"] != pytest.approx(answers["number"], rel=0.1)


def test_the_atlas_gives_a_curvature_only_to_its_own_whiskers(vibrissa):
    code, _, err = vibrissa(*GAP, *ROD, "--intrinsic-curvature", "atlas")
    assert code == 2
    assert "--intrinsic-curvature" in err


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["--thick"], "--thick"),
        (["--intrinsic-curvature", "5"], "--intrinsic-curvature"),
        (["--model", "free-end", "--thick"], "--thick"),
    ],
)
def test_options_of_the_rod_are_refused_without_it(vibrissa, words, option):
    code, out, err = vibrissa(*GAP, *words)
    assert code == 2
    assert out == ""
    assert err.splitlines()[-1].startswith(f"vibrissa: {option} must go with --model rod")


@pytest.mark.parametrize("option", ["--damping", "--speed"])
def test_a_gap_that_does_not_move_has_no_speed(vibrissa, option):
    code, _, err = vibrissa(*GAP, option, "0.1")
    assert code == 2
    assert err.splitlines()[-1].startswith(f"vibrissa: {option} must go with --model free-end or rod")


def test_a_gap_by_the_fast_model_moves_the_whisker_as_the_rod_does(vibrissa):
    largest = {}
    for model in ("free-end", "auto", "rod"):
        code, out, err = vibrissa(*GAP, "--model", model, "--json")
        assert code == 0
        assert "free end" in err.splitlines()[-1] or "whole whisker" in err.splitlines()[-1]
        largest[model] = np.array(json.loads(out)["largest_mode_displacement"])
    np.testing.assert_array_equal(largest["auto"], largest["free-end"])
    np.testing.assert_allclose(largest["free-end"][:2], largest["rod"][:2], rtol=0.1)


def test_the_rod_needs_a_whisker(vibrissa):
    code, _, err = vibrissa("gap", *HELD, "--gap-width", "0.01", *ROD)
    assert code == 2
    assert "whisker must be given" in err


def test_a_scan_by_the_rod_is_written_with_its_states(vibrissa, grating, tmp_path):
    out = tmp_path / "scan.nc"
    words = [*HELD, *CONE, "--whisker.tip", "0.28", "--speed", "0.1", "--sampling-rate", "5kHz", "--node", "5mm"]
    code, _, err = vibrissa("scan", grating, *words, *ROD, "--out", out)
    assert code == 0, err
    with load(out) as data:
        assert data.attrs["model"] == "rod"
        assert set(np.unique(data.contact_state)) <= {0, 1, 2, 3}
        shares = [float(data[f"{name}_share"]) for name in ("detached", "slip", "stick", "bridge")]
        assert sum(shares) == pytest.approx(1)
        assert shares[3] > 0
        assert data.displacement.dims == ("time", "node")
        assert data.envelope.attrs["units"] == "m"
        assert np.isfinite(data.axial_force).all()
    picture = tmp_path / "scan.png"
    code, shown, _ = vibrissa("show", out, "--plot", "--out", picture)
    assert code == 0
    assert shown.splitlines()[0] == "scan.nc: predicted scan of a whole whisker"
    assert picture.stat().st_size > 10_000


def test_spikes_follow_the_motion_of_the_rod(vibrissa, grating):
    words = [*HELD, *CONE, "--whisker.tip", "0.289", "--speed", "0.1", "--simulate-units", "2", "--trials", "2"]
    code, out, err = vibrissa("scan", grating, *words, *ROD, "--json")
    assert code == 0, err
    assert len(json.loads(out)["true_threshold"]) == 2


def test_forms_of_the_modes_are_refused_with_the_rod(vibrissa, grating):
    words = [*HELD, *CONE, "--whisker.tip", "0.28", "--speed", "0.1"]
    for option, value in (("--response", "linear"), ("--jump", "ramp-limit"), ("--modes", "curved")):
        code, _, err = vibrissa("scan", grating, *words, *ROD, option, value)
        assert code == 2
        assert err.splitlines()[-1].startswith(f"vibrissa: {option} must be left out with --model rod")


def test_a_gap_as_a_share_that_is_too_wide_is_refused(vibrissa):
    code, _, err = vibrissa("gap", *HELD, *CONE, *ROD, "--gap-width", "0.5")
    assert code == 2
    assert "must be at most 8 mm" in err


@pytest.fixture
def sweep(tmp_path):
    """A path of a base that lowers the whisker onto the ground and lifts it again."""
    path, time = tmp_path / "sweep.csv", np.linspace(0, 0.03, 31)
    height = 0.56 + 0.1 * np.cos(2 * np.pi * time / 0.03)
    lines = [f"{t:.4f},1.1,{h:.6f},{1e3 * 0.1 * t:.4f}" for t, h in zip(time, height, strict=True)]
    path.write_text("\n".join(["time,base_angle,base_distance,travel_mm", *lines]))
    return path


def test_a_whisker_swings_onto_a_grating_and_off_again(vibrissa, grating, sweep, tmp_path):
    out, movie = tmp_path / "swing.nc", tmp_path / "swing.mp4"
    words = [*CONE, "--whisker.tip", "0.28", "--speed", "0", "--sampling-rate", "5kHz", "--damping-about", "air"]
    code, shown, err = vibrissa("whisking", grating, sweep, *words, *ROD, "--out", out, "--movie", movie)
    assert code == 0, err
    assert "the whisker begins in the air, first touches at" in err
    assert "100 % of the time in contact is on the level ground before or behind the surface" in err
    assert "frames, slowed 200 times" in err
    assert "free_damping" in shown
    with load(out) as data:
        assert list(data.contact_event_kind.values[[0, -1]]) == ["attach", "detach"]
        assert data.attrs["damping_about"] == "air"
        np.testing.assert_allclose(data.free_damping, 0.11, rtol=1e-3)
    with av.open(str(movie)) as file:
        frames = [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]
    assert len(frames) == 150
    assert np.abs(np.diff(np.array(frames[::30], float), axis=0)).max(axis=(1, 2, 3)).min() > 100


@pytest.mark.parametrize(
    ("words", "option"),
    [(["--damping-about", "air"], "--damping-about"), (["--surface-distance", "1mm"], "--surface-distance")],
)
def test_options_of_a_moving_base_are_refused_without_the_rod(vibrissa, grating, sweep, words, option):
    code, _, err = vibrissa("whisking", grating, sweep, *CONE, "--speed", "0.1", *words)
    assert code == 2
    assert err.splitlines()[-1].startswith(f"vibrissa: {option} must go with --model rod")


def test_a_movie_that_cannot_be_written_is_refused_before_any_work(vibrissa, tmp_path):
    for words, rule in (
        ([*ROD, "--movie", tmp_path / "gap.gif"], "--movie must end in .mp4 or .mkv"),
        (["--movie", tmp_path / "gap.mp4"], "--movie must go with --model rod"),
        ([*ROD, "--movie", tmp_path / "no" / "gap.mp4"], "--movie must lie in an existing folder"),
    ):
        code, _, err = vibrissa(*GAP, *words)
        assert code == 2
        assert err.splitlines()[-1].startswith(f"vibrissa: {rule}")


def test_a_curvature_may_have_its_unit(vibrissa):
    tip = ["--whisker.tip", "0.28", "--json"]
    bare, unit = (vibrissa(*GAP, *ROD, *tip, "--intrinsic-curvature", word)[1] for word in ("15", "15/m"))
    assert bare == unit


def test_a_share_of_the_length_says_so_and_the_modes_point_to_the_rod(vibrissa):
    _, out, err = vibrissa(*GAP, "--whisker.tip", "0.28")
    assert "jump_exact [L]" in " ".join(out.split())
    assert "--model rod" in err
    assert "largest_mode_displacement [L]" in " ".join(vibrissa(*GAP, *ROD, "--whisker.tip", "0.28")[1].split())
