from __future__ import annotations

import json

import line_movie
import numpy as np
import pytest
from real_data import real, whisk_segments
from refusals import refusal

from vibrissa.quantities import require
from vibrissa.video.follow.following import centrelines
from vibrissa.video.follow.search import Search
from vibrissa.video.io.movie import read_blocks
from vibrissa.video.kernel.local_quadratic import SMOOTH, local_quadratic
from vibrissa.video.tracking import Calibration, track

SEED = (250, 226)
CALIBRATION = Calibration(frame_rate=5000.0, pixel_size=95e-6)
INNER = slice(line_movie.FIRST + 3, line_movie.LAST - 2)  # the two end pixels of the drawn line are half windows


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return line_movie.truth(104)  # six periods of the vibration


@pytest.fixture(scope="module")
def frames(truth) -> np.ndarray:
    return line_movie.movie(truth, np.random.default_rng(20))


@pytest.fixture(scope="module")
def error(truth, frames) -> np.ndarray:
    lines = next(centrelines([frames], seeds=[SEED]))
    return (lines.row[0] - truth)[:, INNER]


def test_every_column_is_measured(error):
    assert not np.isnan(error).any()


def scatter_over_bound(frames: np.ndarray, truth: np.ndarray, estimator: str) -> tuple[float, float]:
    """Median over columns of the SD in time over the Cramér–Rao bound, and SD of the error over the SD told."""
    lines = next(centrelines([frames], seeds=[SEED], search=Search(estimator=estimator)))
    error = (lines.row[0] - truth)[:, INNER]
    bound = line_movie.bound(truth)[:, INNER].mean(axis=0)
    return np.median(error.std(axis=0) / bound), np.std(error / lines.sd[0][:, INNER])


def test_scatter_in_time_is_near_the_bound_and_as_told(frames, truth):
    ratio, told = scatter_over_bound(frames, truth, "matched")
    assert ratio < 1.2  # 1.12 in theory, for this line
    # 40,000 values: the standard deviation of the quotient is known to 0.4 %, the background's noise adds a little
    assert told == pytest.approx(1, abs=0.05)
    ratio, told = scatter_over_bound(frames, truth, "barycentre")
    assert ratio == pytest.approx(1.83, abs=0.06)  # five equal weights: σ √10/Σw, 0.068 px at contrast 75 and σ = 3
    assert told == pytest.approx(1, abs=0.05)


def test_the_bound_is_the_scatter_of_a_fit_by_maximum_likelihood(truth):
    rng = np.random.default_rng(7)
    pixel, c, contrast = np.arange(-8, 9), 0.3, 60.0
    profile = contrast * np.exp(-((pixel - c) ** 2) / (2 * line_movie.SIGMA**2))
    trial = np.linspace(-0.3, 0.9, 2401)
    template = np.exp(-((pixel[:, None] - trial) ** 2) / (2 * line_movie.SIGMA**2))
    noisy = profile + 3.0 * rng.standard_normal((4000, pixel.size))
    found = trial[np.argmax(noisy @ (template / np.linalg.norm(template, axis=0)), axis=1)]
    assert found.std() == pytest.approx(line_movie.bound_of(contrast), rel=0.04)


def test_bias_is_below_a_hundredth_of_a_pixel(error, truth):
    assert abs(error.mean()) < 0.01
    # nor does the pixel grid draw the line to the middle of its pixels
    phase = truth[:, INNER] % 1
    for low in np.arange(0, 1, 0.125):
        assert abs(error[(phase >= low) & (phase < low + 0.125)].mean()) < 0.015


def test_vibration_of_a_third_of_a_pixel_keeps_its_amplitude(error, truth):
    vibration = (truth - truth.mean(axis=0))[:, INNER]
    assert np.sum(error * vibration) / np.sum(vibration**2) == pytest.approx(0, abs=0.02)


def test_temporal_mean_as_background_would_lose_the_line(frames, truth):
    """Why it is refused: the difference to it is a derivative, with two flanks and no line."""
    left = frames.mean(axis=0) - frames
    columns = np.arange(INNER.start, INNER.stop)
    near = np.rint(truth[0, columns]).astype(int)
    window = np.clip(np.stack([left[:, near + d, columns] for d in range(-2, 3)], axis=1), 1e-6, None)
    row = near + (window * np.arange(-2, 3)[:, None]).sum(axis=1) / window.sum(axis=1)
    assert np.median((row - truth[:, columns]).std(axis=0)) > 0.3


def test_temporal_mean_is_refused(frames):
    with refusal("unknown", "background"):
        Search(background="mean")
    with refusal("too-few", "background"):
        track([frames[:3]], seeds=[SEED], calibration=CALIBRATION, background=frames.mean(axis=0) + 30)


def test_image_without_the_whisker_serves_as_background(frames, truth):
    flat = line_movie.movie(np.full((1, line_movie.WIDTH), -50.0), np.random.default_rng(0), noise=0.0)[0]
    lines = next(centrelines([frames[:20]], seeds=[SEED], search=Search(background=flat)))
    off = (lines.row[0] - truth[:20])[:, INNER]
    assert np.median(off.std(axis=0)) < 0.07
    assert abs(off.mean()) < 0.01


def test_bright_whisker_is_the_dark_one_turned_over(frames):
    dark = next(centrelines([frames[:3]], seeds=[SEED])).row
    bright = next(centrelines([255 - frames[:3]], seeds=[SEED], search=Search(polarity="bright"))).row
    np.testing.assert_allclose(bright, dark, atol=1e-4)  # single precision of grey levels


def test_sixteen_bits_are_eight_bits_scaled(frames):
    eight = next(centrelines([frames[:3]], seeds=[SEED])).row[..., INNER]
    wide = next(centrelines([frames[:3].astype(np.uint16) * 16], seeds=[SEED])).row[..., INNER]
    np.testing.assert_allclose(wide, eight, atol=0.02)  # a window on the brink between two pixels
    assert np.median(np.abs(wide - eight)) < 1e-5


def test_blocks_do_not_show_in_the_result(frames):
    whole = track([frames[:12]], seeds=[SEED], calibration=CALIBRATION)
    parts = track(iter([frames[:5], frames[5:12]]), seeds=[SEED], calibration=CALIBRATION)
    assert whole.identical(parts)


def test_base_on_the_right_mirrors_the_base_on_the_left(frames):
    last = line_movie.WIDTH - 1
    left = track([frames[:3]], seeds=[SEED], calibration=CALIBRATION, skin=[(50, 198)])
    right = track(
        [frames[:3, :, ::-1]],
        seeds=[(last - SEED[0], SEED[1])],
        calibration=CALIBRATION,
        skin=[(last - 50, 198)],
        base="right",
    )
    nodes = slice(0, min(left.sizes["node"], right.sizes["node"]) - 1)
    # the background is closed, and the noise sampled, in every few columns from the left, which the mirror moves; with
    # them it moves by a column or two where the line is first seen, and by 0.1 px of that the nodes along the line
    mirrored = last * CALIBRATION.pixel_size - right.x
    assert np.nanmedian(np.abs(mirrored - left.x)[..., nodes]) < 0.15 * CALIBRATION.pixel_size
    assert np.nanmedian(np.abs(right.y - left.y)[..., nodes]) < 0.03 * CALIBRATION.pixel_size


def test_nodes_stand_at_their_arc_length(frames, truth):
    skin = (40.0, float(truth[0, line_movie.FIRST]) - 20 * (truth[0, 61] - truth[0, 60]))
    data = track([frames], seeds=[SEED], calibration=CALIBRATION, skin=[skin], node_spacing=4 * 95e-6)
    require(data, "x", "y", "y_sd", "arc_length", "time")
    size = CALIBRATION.pixel_size
    columns = np.arange(line_movie.FIRST, line_movie.LAST)
    rows = truth[0, columns]
    arc = np.hypot(columns[0] - skin[0], rows[0] - skin[1]) + np.concatenate(
        [[0], np.cumsum(np.hypot(1, np.diff(rows)))]
    )
    expected = np.interp(data.arc_length.values[0], arc * size, columns * size)
    # the smooth course errs by less than 0.01 px per px of slope; a sum over raw steps would be 1 % = 4 px too long
    seen = slice(6, -1)
    np.testing.assert_allclose(np.nanmean(data.x.values[0], axis=0)[seen], expected[seen], atol=0.3 * size)
    assert data.time.values[1] == pytest.approx(1 / 5000)
    assert data.attrs["frame"] == "image"
    assert data.attrs["arc_length_from"] == "skin"
    assert np.isnan(data.y_sd.values[0, :, :3]).all()  # between the skin and what is seen: positions, no measurement
    assert not np.isnan(data.y.values[0, :, :3]).any()
    assert float(data.x[0, 0, 0]) == pytest.approx(40 * size)
    assert float(data.y[0, 0, 0]) == pytest.approx(skin[1] * size)


def test_without_skin_arc_length_starts_at_what_is_seen_and_says_so(frames, truth):
    data = track([frames[:5]], seeds=[SEED], calibration=CALIBRATION)
    assert "base end" in data.attrs["arc_length_from"]
    assert float(data.x[0, 0, 0]) == pytest.approx(line_movie.FIRST * CALIBRATION.pixel_size, abs=3 * 95e-6)


def test_hidden_whisker_is_lost_while_hidden_and_found_again(frames):
    hidden = frames[:30].copy()
    hidden[10:14] = 184
    hidden[20:23, :, 300:] = 20  # an arm over the far half
    data = track([hidden], seeds=[SEED], calibration=CALIBRATION)
    seen = ~np.isnan(data.y.values[0])
    assert not seen[10:14].any()
    assert json.loads(data.attrs["lost"]) == [[[10, 13, "too faint or hidden"]]]
    columns = data.x.values[0, 0] / CALIBRATION.pixel_size
    drawn = columns > line_movie.FIRST  # the line of the first frame may begin with a column or two of noise
    assert seen[20:23, drawn & (columns < 285)].all()
    assert not seen[20:23, columns > 315].any()
    assert seen[29, drawn & (columns < 450)].all()


def test_whisker_that_is_back_for_20_frames_may_move_as_before(truth):
    """By 1.5 px from frame to frame, too far for one of which it is not sure."""
    step = np.clip(np.arange(36) - 27, 0, None)
    moved = truth[:36] + 1.5 * step[:, None]
    movie = line_movie.movie(moved, np.random.default_rng(21))
    movie[3:5] = 184
    lines = next(centrelines([movie], seeds=[SEED]))
    assert lines.reason[0].astype(bool).tolist() == [t in (3, 4) for t in range(36)]
    assert abs(np.nanmedian(lines.row[0, 35] - moved[35])) < 0.05


def test_each_seed_follows_its_own_whisker(truth, frames):
    two = np.minimum(frames[:10], np.roll(frames[:10], 40, axis=1))
    row = next(centrelines([two], seeds=[SEED, (250, 266)])).row
    assert np.nanmedian(row[1] - row[0]) == pytest.approx(40, abs=0.01)


@pytest.mark.parametrize("seed", [(-1, 200), (500, 200), (250, 450)])
def test_seed_outside_the_image_is_refused(frames, seed):
    with refusal("range", "seed"):
        track([frames[:1]], seeds=[seed], calibration=CALIBRATION)


def test_seed_without_whisker_is_refused(frames):
    with refusal("range", "seed"):
        track([frames[:1]], seeds=[(250, 100)], calibration=CALIBRATION)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("name", ["frame_rate", "pixel_size"])
def test_calibration_must_be_positive(name, value):
    with refusal("range", f"Calibration.{name}", str(value)) as caught:
        Calibration(**{"frame_rate": 5000.0, "pixel_size": 95e-6, name: value})
    assert caught.value.rule == "must be positive and finite"


def test_bad_settings_are_told(frames):
    def refused(*fields, **settings):
        with refusal(*fields):
            track([frames[:1]], **{"seeds": [SEED], "calibration": CALIBRATION, **settings})

    refused("shape", "background", "(4, 5)", background=np.zeros((4, 5)))
    refused("unknown", "polarity", "'grey'", polarity="grey")
    refused("unknown", "base", "'middle'", base="middle")
    refused("range", "node_spacing", "-0.0001", node_spacing=-1e-4)
    refused("shape", "skin", "0", skin=[])
    refused("range", "search", "0", search=0)
    refused("range", "threshold", "0.0", threshold=0.0)
    with refusal("too-few", "blocks"):
        track([], seeds=[SEED], calibration=CALIBRATION)


def test_local_quadratic_is_exact_on_a_quadratic_with_gaps():
    u = np.arange(80.0)
    row = 3 + 0.2 * u - 0.004 * u**2
    row[30:38] = np.nan
    value, slope = local_quadratic(row, SMOOTH)
    np.testing.assert_allclose(value, 3 + 0.2 * u - 0.004 * u**2, rtol=1e-9)
    np.testing.assert_allclose(slope, 0.2 - 0.008 * u, atol=1e-9)


@pytest.mark.parametrize(
    ("still", "seed", "well_lit", "faint"),
    [
        ("one-whisker.jpg", (250, 135), (284, 333), (114, 163)),
        ("three-whiskers.png", (180, 107), (152, 233), None),
        ("three-whiskers.png", (200, 178), (128, 299), None),
        ("three-whiskers.png", (200, 242), (118, 154), (192, 299)),
    ],
)
def test_scatter_on_a_still_is_that_of_the_paper(still, seed, well_lit, faint):
    """Residual to a 31-column local quadratic; the paper gives 0.15 px for its images, which were darker."""
    residual, _ = still_residual(still, seed)
    assert of_columns(residual, well_lit).std() < 0.04
    if faint is not None:
        assert of_columns(residual, faint).std() < 0.2


def still_residual(still, seed):
    """Distance from a local quadratic, and the standard deviation told, by column."""
    (image,) = read_blocks(real(f"stills/{still}"))
    lines = next(centrelines([image], seeds=[seed]))
    return lines.row[0, 0] - local_quadratic(lines.row[0, 0], 15)[0], lines.sd[0, 0]


def of_columns(values, columns):
    found = values[columns[0] : columns[1] + 1]
    assert not np.isnan(found).any()
    return found


@pytest.mark.parametrize("columns", [(86, 113), (114, 163), (164, 213), (214, 263)])
def test_what_is_told_of_the_faint_end_of_a_still_is_what_is_seen(columns):
    """At the very end the contrast is 14 grey levels: the line scatters by 0.4 px, and says so."""
    residual, told = still_residual("one-whisker.jpg", (250, 135))
    expected = np.sqrt(np.mean(of_columns(told, columns) ** 2))
    assert of_columns(residual, columns).std() == pytest.approx(expected, rel=0.5)


MOUSE_SEEDS = [(120, 187), (120, 197), (120, 218), (120, 229)]
MOUSE_BASES = [193.0, 197.5, 211.0, 217.0]  # rows at column 60 in the first frames
CALM = 165  # frames before the mouse begins to whisk


@pytest.fixture(scope="module")
def mouse():
    return next(read_blocks(real("whiskiwrap-movies/test_video2.mp4"), 260))


def test_four_whiskers_of_a_mouse_agree_with_whisk(mouse):
    """A dense field at a contrast of 12 grey levels, MPEG-4: two of the whiskers are 4 px apart at the base."""
    segments = [
        s
        for s in whisk_segments(real("whiskiwrap-movies/test_video2.whiskers"))
        if s.frame < CALM and s.x[0] < 60 and np.hypot(np.diff(s.x), np.diff(s.y)).sum() > 80
    ]
    (lines,) = centrelines([mouse[:CALM]], seeds=MOUSE_SEEDS, search=Search(columns=(60, 180), search=2, threshold=3.0))
    for row, base in zip(lines.row, MOUSE_BASES, strict=True):
        # half the distance to the next whisker, which WHISK has too
        own = [s for s in segments if abs(np.interp(60, s.x, s.y) - base) < 2.2]
        assert len({s.frame for s in own}) > 90
        distance = []
        for s in own:
            columns = np.flatnonzero(~np.isnan(row[s.frame]))
            columns = columns[(columns >= s.x[0]) & (columns <= s.x[-1])]
            if columns.size > 40:
                distance.append(np.median(np.abs(row[s.frame, columns] - np.interp(columns, s.x, s.y))))
        assert len(distance) >= 0.95 * len(own)
        # WHISK's own scatter is 0.14 px and more at a ten times higher contrast
        assert np.median(distance) < 0.4
        # 1 px: another whisker is 4 px away; a few of WHISK's segments change over to the neighbour themselves
        assert np.mean(np.array(distance) < 1) > 0.95


def test_dense_field_does_not_hop(mouse):
    """Scatter about a local quadratic of 21 columns, where WHISK traces the line too; a hop to a neighbour is 4 px."""
    (lines,) = centrelines([mouse[:CALM]], seeds=MOUSE_SEEDS, search=Search(columns=(60, 180), search=2, threshold=3.0))
    scatter = []
    for s in whisk_segments(real("whiskiwrap-movies/test_video2.whiskers")):
        if s.frame >= CALM or s.x[0] >= 60 or np.hypot(np.diff(s.x), np.diff(s.y)).sum() <= 80:
            continue
        columns = np.arange(int(s.x[0]) + 1, int(s.x[-1]))
        for row in lines.row[:, s.frame]:
            off = row[columns] - np.interp(columns, s.x, s.y)
            if np.count_nonzero(~np.isnan(off)) > 40 and np.nanmedian(np.abs(off)) < 1.5:
                scatter.append(np.nanstd((row - local_quadratic(row, 10)[0])[columns]))
    assert len(scatter) > 400
    assert np.median(scatter) < 0.5
    assert np.mean(np.array(scatter) < 1) > 0.95


def test_lost_whisker_is_not_taken_up_again_from_a_neighbour(mouse):
    """Without marks whiskers are lost as the mouse begins to whisk; others then pass where they were."""
    lines = list(centrelines([mouse], seeds=MOUSE_SEEDS, search=Search(columns=(60, 180), search=2, threshold=3.0)))
    lost = lines[0].reason[:, 200:] > 0
    # 240 chances for a passing whisker to lie along half the course within 1 px: one does six times, for up to 7 frames
    assert lost.mean() > 0.9
