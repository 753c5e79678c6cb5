"""Modal amplitudes of synthetic centrelines, in whatever frame the camera sees them."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.inverse.decomposition import decompose, normal_displacement
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.quantities import dataset
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
CONTACT = 0.29
ARC = np.linspace(0.0, 0.0283, 220)  # skin to 0.1 mm short of the contact
TIME = np.arange(240) / 1500
PIXEL = 95e-6


def amplitudes(n_modes=3, size=1e-3):
    """(M, T) over L, mean 0: of tens of µm, falling with the mode as the whisker's do."""
    phase = np.arange(1, n_modes + 1)[:, None] * (2 * np.pi * 100 * TIME + 0.7)
    q = size * np.sin(phase) / np.array([1, 4, 15, 40, 80])[:n_modes, None]
    return q - q.mean(axis=1, keepdims=True)


def centreline(q, arc=ARC, frame=None):
    """x, y (T, N) of nodes that move along the normals n = (−sin θ, cos θ) of the stationary profile."""
    s = 1 - arc / WHISKER.length
    flat = stationary_profile(Posture(contact=CONTACT, base_angle=1.2), s)
    u = q.T @ cone_modes(cone_kappa(CONTACT, len(q)), CONTACT, s)
    x = flat.profile_x.values - u * np.sin(flat.angle.values)
    y = flat.profile_y.values + u * np.cos(flat.angle.values)
    return labelled(x * WHISKER.length, y * WHISKER.length, arc, frame)


def labelled(x, y, arc=ARC, frame=None):
    if frame is not None:
        x, y = frame[0, 0] * x + frame[0, 1] * y + 0.013, frame[1, 0] * x + frame[1, 1] * y - 0.002
    return dataset(x=x, y=y, arc_length=arc, time=TIME[: len(x)], node=np.arange(len(arc)))


def turned(angle, mirrored):
    frame = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return frame @ np.diag([1, -1 if mirrored else 1])


def noisy(profile, sd, rng):
    noise = rng.normal(size=(2, *profile.x.shape)) * sd
    return labelled(profile.x.values + noise[0], profile.y.values + noise[1], profile.arc_length.values)


def hidden(profile, where):
    return xr.where(where, np.nan, profile[["x", "y"]], keep_attrs=True).assign(arc_length=profile.arc_length)


def found(profile, **options):
    return decompose(profile, WHISKER, CONTACT, **options).mode_displacement.values


@pytest.mark.parametrize("method", ["least-squares", "paper2014"])
def test_known_amplitudes_are_recovered(method):
    q = amplitudes()
    error = np.abs(found(centreline(q), method=method) - q).max(axis=1) / np.abs(q).max(axis=1)
    # the tangent of the mean profile is known to 1e-3; the trapezoid and the last 0.1 mm cost the paper's form more
    assert np.all(error < (2e-4 if method == "least-squares" else 1e-2))


@settings(deadline=None, derandomize=True, max_examples=5)
@given(angle=st.floats(-np.pi, np.pi), mirrored=st.booleans())
def test_amplitudes_do_not_depend_on_how_the_camera_is_held(angle, mirrored):
    q = amplitudes()
    one, other = found(centreline(q)), found(centreline(q, frame=turned(angle, mirrored)))
    np.testing.assert_allclose(other, one, atol=1e-6 * np.abs(q).max())


def test_the_border_of_a_shadow_does_not_draw_the_modes():
    """The last nodes are drawn as on film, by up to 0.4 pixel, and seen in the fewer frames the further they lie."""
    rng = np.random.default_rng(2)
    clean = centreline(amplitudes())
    drawn = np.array([0.007, 0.013, 0.05, 0.17, 0.44]) * PIXEL * rng.choice([-1, 1], size=(len(TIME), 1))
    y, lost = clean.y.values.copy(), np.zeros(clean.y.shape, bool)
    y[:, -5:] += drawn  # to and fro, as the whisker carries the line across the border
    lost[:, -4:] = rng.uniform(size=(len(TIME), 4)) > [0.97, 0.9, 0.8, 0.7]
    bordered = labelled(np.where(lost, np.nan, clean.x), np.where(lost, np.nan, y))
    np.testing.assert_array_equal(found(bordered), found(clean.isel(node=slice(None, -8))))


def test_displacement_away_from_the_substrate_is_positive():
    q = amplitudes(1)
    displacement, visible = normal_displacement(centreline(q))
    expected = q.T @ cone_modes(cone_kappa(CONTACT, 1), CONTACT, 1 - ARC / 0.04) * 0.04
    np.testing.assert_allclose(displacement, expected, atol=2e-3 * np.abs(expected).max())
    assert visible.all()


def unstretched(q, arc):
    """Like ``centreline``, slipping along the profile by w = −∫ u dθ from the base, so that no part is stretched."""
    s = 1 - arc / WHISKER.length
    angle = stationary_profile(Posture(contact=CONTACT, base_angle=1.2), s).angle.values
    u = q.T @ cone_modes(cone_kappa(CONTACT, len(q)), CONTACT, s)
    slip = np.concatenate(
        [np.zeros((len(u), 1)), np.cumsum((u[:, 1:] + u[:, :-1]) / 2 * np.diff(angle), axis=1)], axis=1
    )
    curve = centreline(q, arc)
    along = slip * WHISKER.length
    return labelled(curve.x.values + along * np.cos(angle), curve.y.values + along * np.sin(angle), arc)


def at_fixed_arc_length(curve):
    """Nodes as a tracker reads them: at fixed arc length, measured along each frame's own curve."""
    x, y = np.empty((2, len(TIME), len(ARC)))
    for k in range(len(TIME)):
        step = np.hypot(np.diff(curve.x.values[k]), np.diff(curve.y.values[k]))
        along = np.concatenate([[0], np.cumsum(step)])
        x[k], y[k] = (np.interp(ARC, along, curve[name].values[k]) for name in "xy")
    return labelled(x, y)


def test_a_node_at_fixed_arc_length_is_one_point_of_a_shaft_that_does_not_stretch():
    fine = np.linspace(0, 0.0284 - 1e-9, 3000)
    error = []
    for size in (2e-3, 1e-3):
        q = amplitudes(size=size)
        error.append(np.abs(found(at_fixed_arc_length(unstretched(q, fine))) - q).max() / np.abs(q).max())
    assert error[1] < 2e-3
    assert error[1] < 0.7 * error[0]  # what is left is of second order
    stretched = found(at_fixed_arc_length(centreline(q, fine)))
    assert np.abs(stretched - q).max() / np.abs(q).max() > 2 * error[1]


def test_motion_of_higher_modes_does_not_leak():
    q = amplitudes(5)
    assert np.abs(found(centreline(q)) - q[:3]).max() < 2e-4 * np.abs(q[0]).max()


def test_modes_that_follow_the_contact_leak_less_than_by_plain_least_squares():
    arc = np.linspace(0.0, 0.0269, 220)  # the last 1.5 mm are hidden
    rng = np.random.default_rng(1)
    excursion = rng.standard_normal(len(TIME))
    excursion -= excursion.mean()
    q = 1e-3 * excursion / np.arange(1, 13)[:, None] ** 3  # in step, as a slow excursion has it
    noise = 2e-6 * rng.standard_normal((len(TIME), len(arc)))
    shapes = cone_modes(cone_kappa(CONTACT, 5), CONTACT, 1 - arc / WHISKER.length)

    def leak(amplitude):
        """Share of mode 5's size by which mode 2 is off in step with the excursion."""
        return abs(excursion @ (amplitude - q[1]) / (excursion @ q[4]))

    curve = centreline(q, arc)
    curve["y"] = curve.y + noise
    displacement, _ = normal_displacement(curve)
    plain = np.linalg.lstsq(shapes.T, displacement.T / WHISKER.length, rcond=None)[0]
    assert leak(found(curve)[1]) < 0.5 * leak(plain[1])


@pytest.mark.parametrize("seed", [1, 2])
def test_nodes_lost_here_and_there_do_no_harm(seed):
    q = amplitudes()
    lost = np.random.default_rng(seed).random((len(TIME), len(ARC))) < 0.15
    error = np.abs(found(hidden(centreline(q), xr.DataArray(lost, dims=("time", "node")))) - q)
    assert error.max() < 0.02 * np.abs(q).max()  # the mean of the frames that are left differs from node to node


def test_frames_with_most_nodes_lost_are_not_measured():
    lost = np.zeros((len(TIME), len(ARC)), bool)
    lost[7, 40:] = True
    result = decompose(hidden(centreline(amplitudes()), xr.DataArray(lost, dims=("time", "node"))), WHISKER, CONTACT)
    missing = np.isnan(result.mode_displacement.values)
    assert missing[:, 7].all()
    assert missing.sum() == 3


def test_least_squares_sees_through_a_hidden_base_where_extrapolation_does_not():
    q = amplitudes()
    behind_fur = xr.DataArray(ARC < 3e-3, dims="node") & xr.DataArray(np.ones(len(TIME), bool), dims="time")
    end_hidden = xr.DataArray(ARC[-1] - 3e-3 < ARC, dims="node") & xr.DataArray(np.ones(len(TIME), bool), dims="time")
    for where in (behind_fur, end_hidden):
        profile = hidden(centreline(q), where.transpose("time", "node"))
        error = {
            method: np.abs(found(profile, method=method) - q).max(axis=1) / np.abs(q).max(axis=1)
            for method in ("least-squares", "paper2014")
        }
        assert error["least-squares"].max() < 1e-3
        assert error["paper2014"].max() > 1e-2


@pytest.mark.parametrize("seed", [1, 2])
def test_standard_deviations_are_honest(seed):
    q, rng = amplitudes(), np.random.default_rng(seed)
    sd = np.linspace(5e-6, 15e-6, len(ARC))  # 0.05 px at the base, 0.15 px at the tip, of 95 µm
    result = decompose(noisy(centreline(q), sd, rng), WHISKER, CONTACT)
    score = (result.mode_displacement.values - q) / result.mode_displacement_sd.values
    np.testing.assert_allclose(score.std(axis=1), 1, atol=0.15)  # 240 frames: ± 0.05 by chance
    assert np.all(np.abs(np.mean(np.abs(score) < 1.96, axis=1) - 0.95) < 0.05)
    assert np.isnan(decompose(centreline(q), WHISKER, CONTACT, method="paper2014").mode_displacement_sd).all()


def test_noisy_nodes_weigh_less():
    q, rng = amplitudes(), np.random.default_rng(5)
    sd = np.full(len(ARC), 3e-6)
    sd[100:140] = 60e-6  # something in the background
    profile = noisy(centreline(q), sd, rng)
    weighted = decompose(profile, WHISKER, CONTACT)
    s = 1 - ARC / WHISKER.length
    shapes = cone_modes(cone_kappa(CONTACT, 5), CONTACT, s)
    even = np.linalg.lstsq(shapes.T, (weighted.displacement.values / WHISKER.length).T, rcond=None)[0][:3]
    error = [np.sqrt(np.mean((values - q) ** 2, axis=1)) for values in (weighted.mode_displacement.values, even)]
    assert np.all(error[0] < 0.5 * error[1])


@settings(deadline=None, derandomize=True, max_examples=5)
@given(seed=st.integers(0, 10**6), noise=st.floats(0, 3e-5))
def test_shares_of_the_variance_add_up_to_no_more_than_all(seed, noise):
    profile = noisy(centreline(amplitudes()), noise, np.random.default_rng(seed))
    share = decompose(profile, WHISKER, CONTACT).variance_explained.values
    assert np.all(share >= 0)
    assert share.sum() <= 1 + 1e-12


def test_without_noise_the_modes_explain_everything():
    assert float(decompose(centreline(amplitudes()), WHISKER, CONTACT).variance_explained.sum()) > 1 - 1e-6


def test_result_does_not_depend_on_where_the_frame_is():
    q = amplitudes()
    here = centreline(q)
    there = labelled(here.x.values + 1.0, here.y.values - 2.0)
    np.testing.assert_allclose(found(there), found(here), atol=1e-9)


def straight():
    x = np.tile(ARC, (len(TIME), 1))
    return labelled(x, 1e-5 * np.sin(2 * np.pi * 90 * TIME)[:, None] * np.ones(len(ARC)))


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: found(straight()), ("range", "mean profile")),
        (lambda: found(centreline(amplitudes()).isel(node=slice(0, 20))), ("too-few", "profile")),
        (lambda: found(centreline(amplitudes()), method="guess"), ("unknown", "method")),
        (lambda: decompose(centreline(amplitudes()), WHISKER, 0.95), ("range", "contact")),
        (lambda: found(centreline(amplitudes()).drop_vars("y")), ("missing", "variable 'y'")),
        (
            lambda: found(centreline(amplitudes()).expand_dims(whisker=2).assign(arc_length=("node", ARC))),
            ("too-few", "profile"),
        ),
    ],
)
def test_profiles_that_cannot_be_decomposed_are_refused(call, rule):
    with refusal(*rule):
        call()
