"""Figure 3: motion across and along the shaft against closed forms and a known film; runs against their closed form."""

import dataclasses
import json

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa.figures.paper import fig3
from vibrissa.figures.paper.parts.fig3_motion import node_motion, pooled_share_along, run_correlations, share_along
from vibrissa.quantities import dataset
from vibrissa.study.movie.apparatus import apparatus, true_profile
from vibrissa.study.movie.virtual import film_motion, lay_out, predicted_motion
from vibrissa.study.spec.settings import read_study
from vibrissa.video.tracking import Calibration, track

RNG = np.random.default_rng
ARC = np.linspace(0, 0.03, 151)
TIME = np.arange(400) / 2000
CURVATURE, SWING = 40.0, 0.05  # [1/m]


def turned(x, y, angle, mirror=1):
    return np.cos(angle) * x - np.sin(angle) * mirror * y, np.sin(angle) * x + np.cos(angle) * mirror * y


def profile_of(x, y, sd="y_sd", **extra):
    columns = {"x": x, "y": y, sd: np.full(x.shape, 2e-6), "arc_length": ARC} | extra
    return dataset(time=TIME, **columns)


def bending_arc(angle=0.3, mirror=1):
    """An arc of circle, clamped at the skin, that does not stretch while its curvature swings."""
    k = CURVATURE + SWING * np.sin(2 * np.pi * 50 * TIME)[:, None]
    return turned(np.sin(k * ARC) / k, (1 - np.cos(k * ARC)) / k, angle, mirror)


def share_of_arc():
    """Share along the arc by hand: the derivative of the position by the curvature, on tangent and normal."""
    k, phi = CURVATURE, CURVATURE * ARC
    dx = ARC * np.cos(phi) / k - np.sin(phi) / k**2
    dy = ARC * np.sin(phi) / k - (1 - np.cos(phi)) / k**2
    u, w = np.cos(phi) * dy - np.sin(phi) * dx, np.cos(phi) * dx + np.sin(phi) * dy
    return w[1:] ** 2 / (u[1:] ** 2 + w[1:] ** 2), (w**2).sum() / (u**2 + w**2).sum()


@pytest.mark.parametrize(("angle", "mirror"), [(0.0, 1), (0.3, 1), (-1.2, -1), (2.9, 1)])
def test_an_arc_that_bends_moves_along_itself_as_its_length_demands(angle, mirror):
    motion = node_motion(profile_of(*bending_arc(angle, mirror)))
    by_node, pooled = share_of_arc()
    free = motion.along_unstretched
    # the nodes next to the skin move by nanometres, along by picometres: round-off of the tangent
    np.testing.assert_allclose(share_along(motion.across, free)[20:], by_node[19:], rtol=2e-2)
    np.testing.assert_allclose(share_along(motion.across, motion.along)[20:], by_node[19:], rtol=2e-2)
    assert pooled_share_along(motion.across, free) == pytest.approx(pooled, rel=2e-3)
    assert pooled > 0.03  # the arc does move along itself


def test_noise_across_the_columns_does_not_pass_for_motion_along_the_shaft():
    x, y = bending_arc()
    noisy = node_motion(profile_of(x, y + 3e-6 * RNG(1).standard_normal(y.shape)))
    by_node, _ = share_of_arc()
    raw = share_along(noisy.across, noisy.along)[40]
    freed = share_along(noisy.across, noisy.along_unstretched)[40]
    assert raw > by_node[39] + 0.05  # a node that jumps up and down on a slanting shaft seems to slide
    assert freed < by_node[39] + 0.01


def test_a_shaft_carried_along_itself_has_all_its_power_along():
    x, y = ARC * np.ones((len(TIME), 1)), np.zeros((len(TIME), len(ARC)))
    motion = node_motion(profile_of(x + 1e-5 * np.sin(300 * TIME)[:, None], y))
    np.testing.assert_allclose(share_along(motion.across, motion.along), 1)


def test_a_whisker_measured_in_x_has_the_same_share():
    x, y = bending_arc()
    upright = node_motion(profile_of(y, x, sd="x_sd"))
    lying = node_motion(profile_of(x, y))
    np.testing.assert_allclose(
        share_along(upright.across, upright.along)[1:], share_along(lying.across, lying.along)[1:], rtol=1e-6
    )


@pytest.mark.parametrize("alike", [0.0, 0.5, 0.902, 1.0])
@pytest.mark.parametrize("n", [2, 5])
def test_runs_alike_by_construction_correlate_as_the_closed_form_says(n, alike):
    parts = np.linalg.qr(np.c_[np.ones(300), RNG(2).standard_normal((300, n + 1))])[0].T[1:]  # orthonormal, of mean 0
    runs = np.sqrt(alike) * parts[0] + np.sqrt(1 - alike) * parts[1:]
    with_mean, with_others = run_correlations(runs)
    np.testing.assert_allclose(with_mean, np.sqrt((1 + (n - 1) * alike) / n), rtol=1e-12)
    expected = alike / np.sqrt((1 + (n - 2) * alike) / (n - 1))
    np.testing.assert_allclose(with_others, expected, rtol=1e-12, atol=1e-12)


def test_one_run_is_refused():
    with refusal("range", "runs"):
        run_correlations(np.ones((1, 9)))


# A film whose motion is known, under the exact response: its shaft bends by no small-motion rule.


@pytest.fixture(scope="module")
def filmed():
    study = read_study()
    study = dataclasses.replace(study, scan=dataclasses.replace(study.scan, response="exact"))
    film = dataclasses.replace(study.film, n_frames=600)
    prediction = predicted_motion(study)
    scene, pixel = lay_out(prediction, film), film.camera.pixel_size
    frames = list(film_motion(prediction, film, scene))
    middle = len(scene.s) // 3
    profile = track(
        frames,
        seeds=[(scene.x[middle] / pixel, scene.y[middle] / pixel)],
        skin=[(scene.skin[0] / pixel, scene.skin[1] / pixel)],
        calibration=Calibration(frame_rate=film.camera.frame_rate, pixel_size=pixel),
    )
    image = frames[0][0]
    return {
        "still": dataset(image_row=np.arange(image.shape[0]), image_column=np.arange(image.shape[1]), image=image),
        "profile": profile,
        "modal": dataset({"whisker_length": 0.04}, contact=0.29),
        "apparatus": apparatus(prediction, film, scene),
        "true_profile": true_profile(prediction.position, film, scene, profile.arc_length.values[0, ::3]),
    }


@pytest.fixture(scope="module")
def data(filmed):
    return fig3.compute(filmed)


def test_share_found_in_a_film_is_that_of_the_film(data):
    assert data.attrs["share_across"] == pytest.approx(data.attrs["share_across_true"], abs=0.01)
    moving = data.field_arc.values > 8e-3
    moving[-1] = False  # at the contact hardly anything moves across, and the noise of the rows counts
    np.testing.assert_allclose(
        data.along_share_unstretched.values[moving], data.along_share_true.values[moving], atol=0.025
    )
    # across at its middle, along at the contact, which the edge carries along the substrate
    assert data.along_share_unstretched.values[len(moving) // 2] < 0.05
    assert data.along_share_unstretched.values[-1] > 0.8


def test_traces_follow_the_truth_to_the_noise(data, filmed):
    error = data.node_motion.values - data.node_motion_true.values
    assert np.sqrt((error**2).mean()) < 1.5 * float(np.nanmedian(filmed["profile"].y_sd))


def test_the_node_at_the_right_is_the_one_that_moves_most_along_its_path(data, filmed):
    motion = node_motion(filmed["profile"].isel(whisker=0))
    most = int(np.nanargmax(np.where(motion.arc <= 0.71 * 0.04, np.nanstd(motion.across, axis=0), 0)))
    assert data.attrs["path_arc"] == pytest.approx(float(motion.arc[most]))
    y = filmed["profile"].y.values[0, :, motion.nodes[most]]
    np.testing.assert_allclose(data.path_y, (y - np.nanmean(y))[: data.sizes["path_time"]], atol=1e-12)


def test_set_up_has_the_height_of_the_reference_and_the_whisker_in_its_field(data):
    assert data.attrs["base_height"] == pytest.approx(0.04 * 0.461768821, rel=1e-6)
    corners = np.stack([data.field_x, data.field_y], axis=1)
    side = corners - np.roll(corners, 1, axis=0)
    sizes = np.sort(np.hypot(*side.T))
    np.testing.assert_allclose(sizes, 95e-6 * np.array([140, 140, 440, 440]), rtol=1e-9)
    points = np.stack([data.shaft_x, data.shaft_y], axis=1)[:, None] - corners
    inward = side[:, 0] * points[..., 1] - side[:, 1] * points[..., 0]
    assert np.all(inward > 0) or np.all(inward < 0)


def test_true_shaft_neither_stretches_nor_leaves_the_skin(filmed):
    true = filmed["true_profile"]
    assert np.ptp(true.x.values[:, 0]) < 1e-9
    held = true.arc_length.values < 0.71 * 0.04  # beyond the contact an exposure blurs the jumps of the free end
    piece = np.hypot(np.diff(true.x.values[:, held]), np.diff(true.y.values[:, held]))
    spacing = np.diff(true.arc_length.values[held])
    np.testing.assert_allclose(piece, np.broadcast_to(spacing, piece.shape), rtol=6e-3)  # second order in the vibration


def texts(figure):
    return " ".join(" ".join(text.get_text() for axis in figure.axes for text in axis.texts).split())


def test_panels_without_data_take_no_place_and_the_caption_says_so(filmed):
    bare = fig3.compute({name: filmed[name] for name in ("still", "profile")})
    titles = [axis.get_title(loc="left")[:1] for axis in fig3.draw(bare).axes]
    assert titles == ["B", "C", "C", "F", "G"]
    assert "A, the set-up: not given." in bare.attrs["caption"]
    assert "D and E, repeated runs: not measured." in bare.attrs["caption"]
    assert "truth" not in bare.attrs["caption"]


def test_without_a_skin_point_no_share_is_told(filmed):
    profile = filmed["profile"].assign_attrs(arc_length_from="base end of the line in the first frame")
    data = fig3.compute(filmed | {"profile": profile})
    assert "along_share" not in data
    assert "share_across" not in data.attrs
    assert "not known: without a skin point" in texts(fig3.draw(data))
    assert "% of the power" not in data.attrs["caption"]


def test_a_whisker_that_was_lost_leaves_its_motion_out_and_says_why(filmed):
    lost = filmed["profile"].copy()
    for name in ("x", "y", "y_sd"):
        lost[name] = xr.full_like(lost[name], np.nan)
    data = fig3.compute({"still": filmed["still"], "profile": lost})
    assert "field_arc" not in data
    assert "nodes seen in half of the frames" in texts(fig3.draw(data))


def test_no_title_is_cut_off(filmed):
    figure = fig3.draw(fig3.compute(filmed))
    figure.draw_without_rendering()
    words = [axis.title for axis in figure.axes] + [axis._left_title for axis in figure.axes]
    for text in words:
        if text.get_text():
            ends = text.get_window_extent()
            assert ends.x0 >= 0, text.get_text()
            assert ends.y0 >= 0, text.get_text()
            assert ends.x1 <= figure.bbox.x1, text.get_text()
            assert ends.y1 <= figure.bbox.y1, text.get_text()


def test_whole_figure_tells_its_numbers(filmed):
    common, own = RNG(3).standard_normal((2, 1, 1, 300)), RNG(4).standard_normal((2, 4, 5, 300))
    runs = 1e-5 * (common[0] + 0.3 * own[0])
    jitter = {"jitter_clock": 0.5, "jitter_ripple": 0.01, "jitter_ripple_frequency": 20.0, "jitter_contact": 0.002}
    repeats = dataset(jitter | {"run_arc": 0.015}, run_time=np.arange(300) / 2000, run_motion=runs)
    repeats = repeats.assign_attrs(run_speed=0.1).assign(
        run_trough_start=("run_trough", [0.0]), run_trough_width=("run_trough", [1e-3])
    )
    data = fig3.compute(filmed | {"repeats": repeats})
    np.testing.assert_allclose(data.run_mean, runs[0].mean(axis=0))
    assert data.attrs["run_correlation_mean"] == pytest.approx(np.sqrt((1 + 4 / 1.09) / 5), abs=0.01)
    assert "0.94 with the others" in data.attrs["caption"]
    assert "ripple of 1 % at 20 Hz" in data.attrs["caption"]
    assert json.loads(data.attrs["names"]) == ["whisker 0"]
    [panel] = [axis for axis in fig3.draw(data).axes if axis.get_title(loc="left").startswith("E")]
    assert "paper" in " ".join(label.get_text() for label in panel.get_xticklabels())
