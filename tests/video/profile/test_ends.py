"""Skin and contact extrapolated: against profiles whose contact is known from the mechanics."""

from __future__ import annotations

from functools import cache

import line_movie
import numpy as np
import pytest
from refusals import refusal

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.quantities import dataset
from vibrissa.video.profile.ends import COVERAGE, ends
from vibrissa.video.profile.tangent import parabola, tapered
from vibrissa.video.tracking import Calibration, track

LENGTH, HIDDEN = 40e-3, 3e-3
PIXEL = 95e-6
POSTURES = [(contact, angle) for contact in (0.1, 0.2, 0.29, 0.4) for angle in (0.8, 1.0, 1.2, 1.4)]
TURN, PLACE = -0.6, np.array([30e-3, 25e-3])  # of the substrate in the image [rad], and of the contact [m]
TOWARDS_BASE = -np.array([np.cos(TURN), np.sin(TURN)])  # the base is on the left
UP = np.array([np.sin(TURN), -np.cos(TURN)])  # y is down
SUBSTRATE = (tuple(PLACE - 8e-3 * TOWARDS_BASE), tuple(PLACE + 12e-3 * TOWARDS_BASE))


@cache
def shape(contact: float, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arc length from the base, and place along and above the substrate from the contact [m], base first."""
    s = np.linspace(contact, 1, 3001)
    still = stationary_profile(Posture(contact=contact, base_angle=angle), s)
    return (1 - s[::-1]) * LENGTH, still.profile_x.values[::-1] * LENGTH, still.profile_y.values[::-1] * LENGTH


def nodes_of(contact: float, angle: float, spacing: float = 3e-4, hidden: float = HIDDEN):
    """Arc length, and x and y in the image, of nodes up to the hidden part [m]."""
    arc, u, v = shape(contact, angle)
    at = np.arange(0, arc[-1] - hidden, spacing)
    places = PLACE + np.interp(at, arc, u)[:, None] * TOWARDS_BASE + np.interp(at, arc, v)[:, None] * UP
    return at, places[:, 0], places[:, 1]


def tracked(contact: float, angle: float, frames: int, rng=None, sd: float = 0.0, vibration: float = 0.0):
    """A profile as the tracker writes it: noise of y, and a first mode at random that lasts some 20 frames."""
    arc, x, y = nodes_of(contact, angle)
    x, y = np.tile(x, (frames, 1)), np.tile(y, (frames, 1))
    if vibration:
        amplitude = np.convolve(rng.standard_normal(frames + 19), np.ones(20) / np.sqrt(20), "valid")
        mode = cone_modes(cone_kappa(contact, 1), contact, 1 - arc / LENGTH)[0]
        normal = np.gradient(x[0], arc), np.gradient(y[0], arc)
        moved = vibration * amplitude[:, None] * mode / np.abs(mode).max()
        x, y = x - moved * normal[1], y + moved * normal[0]
    if sd:
        y = y + sd * rng.standard_normal(y.shape)
    attrs = {"pixel_size": PIXEL}
    return dataset(attrs, time=np.arange(frames) / 2000, x=x, y=y, y_sd=np.full(y.shape, sd or 1e-9), arc_length=arc)


def misses(found, contact: float) -> dict[str, float]:
    """Errors over their standard deviations."""
    truth = {
        "contact_arc_length": (1 - contact) * LENGTH,
        "contact_x": PLACE[0],
        "contact_y": PLACE[1],
        "contact_height": 0.0,
    }
    return {name: (float(found[name]) - value) / float(found[f"{name}_sd"]) for name, value in truth.items()}


def test_vertex_of_a_parabola_is_found():
    u = np.linspace(5e-3, 2e-3, 16)
    v = 1e-5 + 12 * (u - 0.7e-3) ** 2
    t = np.linspace(u[-1], 0.7e-3, 20001)
    rest = np.sum(np.hypot(np.diff(t), np.diff(12 * (t - 0.7e-3) ** 2)))
    found = parabola(u, v, np.linspace(0.02, 0.025, 16), np.ones(16))
    np.testing.assert_allclose(found, [0.025 + rest, 0.7e-3, 1e-5], rtol=1e-6)
    assert np.isnan(parabola(u, -v, u, np.ones(16))).all()


def test_cone_that_bends_little_is_carried_on_exactly():
    """Small angles: θ' = k (s − ε)/s⁴ integrated twice by the trapezoidal rule."""
    s = np.linspace(0.3, 1, 200_001)
    angle = np.concatenate([[0], np.cumsum(np.diff(s) * (1e-3 * (s - 0.3) / s**4)[:-1])])
    height = np.concatenate([[0], np.cumsum(np.diff(s) * angle[:-1])])
    at = np.linspace(0.5, 0.38, 25)
    u, v = np.interp(at, s, s - 0.3) * LENGTH, np.interp(at, s, height) * LENGTH + 2e-6
    arc, along, above = tapered(u, v, (1 - at) * LENGTH, np.ones(25), LENGTH)
    assert arc == pytest.approx(0.7 * LENGTH, abs=2e-6)
    assert along == pytest.approx(0.0, abs=2e-6)
    assert above == pytest.approx(2e-6, abs=1e-8)


@pytest.mark.parametrize("hidden", [1.5e-3, 3e-3, 5e-3])
def test_error_of_the_curves_is_as_told_over_the_papers_postures(hidden):
    """Without noise. The cone leaves out cos(φ − θ) only; the paper's polynomial knows no taper."""
    share = {"cone": [], "paper2014": []}
    error = {"cone": [], "paper2014": []}
    for contact, angle in POSTURES:
        arc, x, y = nodes_of(contact, angle, hidden=hidden)
        still = dataset(time=[0.0], x=x[None], y=y[None], y_sd=np.full((1, x.size), 1e-9), arc_length=arc)
        for method in share:
            found = ends(still, SUBSTRATE, whisker_length=LENGTH, method=method, substrate_sd=0.0)
            share[method].append(misses(found, contact))
            error[method].append(float(found.contact_arc_length) - (1 - contact) * LENGTH)
    for method in share:
        for name in ("contact_arc_length", "contact_height"):
            ratio = np.array([one[name] for one in share[method]])
            assert np.abs(ratio).max() < 4
            assert 0.4 < np.sqrt(np.mean(ratio**2)) < 1.8
    assert np.abs(error["cone"]).max() < 0.12e-3
    assert np.sqrt(np.mean(np.square(error["paper2014"]))) > 0.7e-3


def test_intervals_cover_under_noise_and_vibration():
    """50 seeds, 15 µm of noise in a frame as in the paper, 30 µm of vibration: 95 % intervals hold 90 % at least."""
    held = {}
    for seed in range(50):
        contact, angle = POSTURES[seed % 16]
        data = tracked(contact, angle, 200, np.random.default_rng(seed), sd=15e-6, vibration=30e-6)
        found = ends(data, SUBSTRATE, whisker_length=LENGTH, substrate_sd=0.0)
        for name, ratio in misses(found, contact).items():
            held.setdefault(name, []).append(abs(ratio) < COVERAGE)
    assert all(np.mean(within) >= 0.9 for within in held.values()), {k: np.mean(w) for k, w in held.items()}


@pytest.fixture(scope="module")
def filmed():
    """Ends of 50 films of 6 frames, each with a posture and a sub-pixel place of its own, tracked; and the contacts."""
    calibration, found = Calibration(frame_rate=2000.0, pixel_size=PIXEL), []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        contact, angle = POSTURES[4 + seed % 12]
        _, x, y = nodes_of(contact, angle, spacing=2e-5)
        shift = np.array([x.min(), y.min()]) - rng.uniform(30, 31, 2) * PIXEL
        x, y = (x - shift[0]) / PIXEL, (y - shift[1]) / PIXEL
        column = np.arange(int(x.max()) + 31)
        rows = np.interp(column, x, y, left=np.nan, right=np.nan)
        row = np.arange(int(np.nanmax(rows)) + 31)[:, None]
        # as wide across the line as its slope asks for
        width = line_movie.SIGMA * np.hypot(1, np.gradient(rows))
        phases = np.array([-0.4, -0.2, 0, 0.2, 0.4])[:, None, None]
        line = np.nan_to_num(np.exp(-((row + phases - rows) ** 2) / (2 * width**2)).mean(axis=0))
        image = 184 - 90 * line + 3 * rng.standard_normal((6, *line.shape))
        frames = np.clip(np.rint(image), 0, 255).astype(np.uint8)
        middle = int(x.mean())
        data = track(
            [frames],
            seeds=[(middle, rows[middle])],
            skin=[(x[0], y[0])],
            calibration=calibration,
            node_spacing=3e-4,
        ).isel(whisker=0)
        line_there = tuple(tuple(np.array(point) - shift) for point in SUBSTRATE)
        for method in ("cone", "paper2014"):
            one = ends(data, line_there, whisker_length=LENGTH, method=method, substrate_sd=0.0)
            one["contact_x"], one["contact_y"] = one.contact_x + shift[0], one.contact_y + shift[1]
            found.append((method, contact, one))
    return found


@pytest.mark.parametrize("method", ["cone", "paper2014"])
def test_intervals_cover_on_films_with_the_last_3_mm_hidden(filmed, method):
    of_method = [(contact, one) for name, contact, one in filmed if name == method]
    ratios = [misses(one, contact) for contact, one in of_method]
    for name in ratios[0]:
        assert np.mean([abs(one[name]) < 1.96 for one in ratios]) >= 0.9, name
    error = np.array([float(one.contact_arc_length) - (1 - contact) * LENGTH for contact, one in of_method])
    if method == "cone":
        assert abs(error.mean()) < 0.1e-3
        assert np.mean([bool(one.contact_accepted) for _, one in of_method]) > 0.9
    else:
        assert abs(error.mean()) > 0.5e-3


def test_camera_turned_or_mirrored_sees_the_same_contact():
    data = tracked(0.29, 1.2, 5, np.random.default_rng(0), sd=1e-6)
    found = ends(data, SUBSTRATE, whisker_length=LENGTH)
    mirrored = dataset(data.attrs, time=data.time, x=-data.y, y=data.x, x_sd=data.y_sd, arc_length=data.arc_length)
    line = tuple((-y, x) for x, y in SUBSTRATE)[::-1]
    other = ends(mirrored, line, whisker_length=LENGTH)
    for name in ("contact_arc_length", "contact_arc_length_sd", "contact_height", "contact_height_sd"):
        assert float(other[name]) == pytest.approx(float(found[name]), rel=1e-3, abs=1e-8)
    assert float(other.contact_x) == pytest.approx(-float(found.contact_y), abs=1e-7)
    assert float(found.contact) == pytest.approx(0.29, abs=2e-3)


def test_contact_off_the_substrate_is_rejected_with_the_reason():
    data = tracked(0.29, 1.2, 60, np.random.default_rng(0), sd=10e-6)
    assert bool(ends(data, SUBSTRATE, whisker_length=LENGTH).contact_accepted)
    for shift, side in ((0.3e-3, "below"), (-0.3e-3, "above")):
        line = tuple(tuple(np.array(point) + shift * UP) for point in SUBSTRATE)
        found = ends(data, line, whisker_length=LENGTH)
        assert not found.contact_accepted
        assert f"µm {side} the substrate line" in found.attrs["rejected"]
    away = tuple(tuple(PLACE + 30e-3 * UP + t * (TOWARDS_BASE + 0.2 * UP)) for t in (0.0, 0.01))
    found = ends(data, away, whisker_length=LENGTH, method="paper2014")
    assert not found.contact_accepted
    assert "does not bend towards" in found.attrs["rejected"]
    assert np.isnan(float(found.contact_arc_length))


def test_what_is_not_well_known_widens_the_interval():
    data = tracked(0.29, 1.2, 60, np.random.default_rng(0), sd=10e-6)
    exact = ends(data, SUBSTRATE, whisker_length=LENGTH, substrate_sd=0.0)
    clicked = ends(data, SUBSTRATE, whisker_length=LENGTH)
    guessed = ends(data, SUBSTRATE, whisker_length=LENGTH, substrate_sd=0.0, whisker_length_sd=1e-3)
    assert clicked.attrs["substrate_sd"] == PIXEL / 2
    assert float(clicked.contact_height_sd) > float(exact.contact_height_sd)
    assert float(guessed.contact_arc_length_sd) > float(exact.contact_arc_length_sd)
    shifted = ends(data, SUBSTRATE, whisker_length=LENGTH + 1e-3, substrate_sd=0.0)
    off = float(shifted.contact_arc_length - exact.contact_arc_length)
    widened = float(guessed.contact_arc_length_sd) ** 2 - float(exact.contact_arc_length_sd) ** 2
    assert np.sqrt(widened) == pytest.approx(abs(off), rel=1e-3)


def test_skin_is_where_a_straight_whisker_meets_its_outline():
    arc = np.arange(2e-3, 20e-3, 2e-4)
    x, y = 1e-3 + 0.8 * arc, 2e-3 + 0.6 * arc + 2e-8 * (arc > 10e-3) * arc
    x = np.tile(x, (50, 1)) + 0.0
    y = np.tile(y, (50, 1)) + 5e-6 * np.random.default_rng(1).standard_normal(x.shape)
    bent = np.where(arc > 12e-3, 20 * (arc - 12e-3) ** 2, 0.0)
    data = dataset(time=np.arange(50) / 2e3, x=x, y=y - bent, y_sd=np.full(x.shape, 5e-6), arc_length=arc)
    line = ((0.0, 30e-3), (20e-3, 30e-3))
    outline = ((1.4e-3, 0.0), (1.4e-3, 5e-3))
    found = ends(data, line, method="paper2014", skin=outline, substrate_sd=0.0)
    for name, value in {"skin_arc_length": 0.5e-3, "skin_x": 1.4e-3, "skin_y": 2.3e-3}.items():
        assert abs(float(found[name]) - value) < COVERAGE * float(found[f"{name}_sd"]) + 1e-9
        assert float(found[f"{name}_sd"]) < 20e-6
    origin = ends(data, line, method="paper2014", substrate_sd=0.0)
    assert float(origin.skin_arc_length) == 0
    assert float(origin.skin_x) == pytest.approx(1e-3, abs=1e-6)
    assert float(origin.skin_y) == pytest.approx(2e-3, abs=10e-6)


def test_what_is_missing_is_told():
    data = tracked(0.29, 1.2, 3, np.random.default_rng(0), sd=1e-6)

    def refused(*fields, profile=data, line=SUBSTRATE, **settings):
        with refusal(*fields) as caught:
            ends(profile, line, **settings)
        return caught.value

    refused("missing", "whisker_length")
    refused("unknown", "method", "'spline'", method="spline")
    sparse = data.isel(node=slice(None, None, 4))
    few = refused("too-few", "profile", "3", profile=sparse, whisker_length=LENGTH)
    assert few.rule.startswith("must have 6 nodes in")
    several = data.expand_dims(whisker=[0, 1])
    refused("too-few", "profile", f"dimensions {several.x.dims}", profile=several, whisker_length=LENGTH)
    point = (SUBSTRATE[0], SUBSTRATE[0])
    refused("shape", "substrate", str(point), line=point, whisker_length=LENGTH, substrate_sd=0.0)
    refused("range", "substrate_sd", "-1.0", whisker_length=LENGTH, substrate_sd=-1.0)
    without = data.copy()
    without.attrs = {}
    refused("missing", "substrate_sd", profile=without, whisker_length=LENGTH)
