"""Whiskers from any side of the image, and in a part of it: the same whisker, wherever the camera stood."""

from __future__ import annotations

import json

import line_movie
import numpy as np
import pytest
import whisker_pad
from refusals import refusal

from vibrissa.quantities import measured_sd
from vibrissa.video.identity.whisker_fan import Fan
from vibrissa.video.identity.whisking import Whisking
from vibrissa.video.profile.turning import View
from vibrissa.video.tracking import Calibration, track

CALIBRATION = Calibration(frame_rate=5000.0, pixel_size=95e-6)
SEED, SKIN = (250, 226), (50, 198)
LAST_COLUMN, LAST_ROW = line_movie.WIDTH - 1, line_movie.HEIGHT - 1


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return line_movie.truth(20)


@pytest.fixture(scope="module")
def frames(truth) -> np.ndarray:
    return line_movie.movie(truth, np.random.default_rng(20))


def quarter_turned(base: str, frames: np.ndarray):
    """The movie and a rule for its points, for a camera that was turned so that the base is on that side."""
    if base == "left":
        return frames, lambda c, r: (c, r)
    if base == "right":
        return frames[:, ::-1, ::-1], lambda c, r: (LAST_COLUMN - c, LAST_ROW - r)
    if base == "top":  # a quarter clockwise
        return np.rot90(frames, -1, axes=(1, 2)), lambda c, r: (LAST_ROW - r, c)
    return np.rot90(frames, 1, axes=(1, 2)), lambda c, r: (r, LAST_COLUMN - c)


@pytest.mark.parametrize("base", ["left", "right", "top", "bottom"])
def test_line_is_where_it_is_from_whichever_side_it_comes(base, frames, truth):
    turned, at = quarter_turned(base, frames)
    data = track([turned], seeds=[at(*SEED)], skin=[at(*SKIN)], calibration=CALIBRATION, base=base)
    assert data.attrs["base"] == base
    assert ("x_sd" in data) == (base in ("top", "bottom"))
    assert ("y_sd" in data) == (base in ("left", "right"))
    seen = np.isfinite(measured_sd(data).values[0])
    assert seen.mean() > 0.9
    size = CALIBRATION.pixel_size
    column, row = np.arange(line_movie.FIRST, line_movie.LAST + 1), truth[:, line_movie.FIRST : line_movie.LAST + 1]
    for t in range(len(frames)):
        x, y = at(column, row[t])
        along, across = (data.x, data.y) if base in ("left", "right") else (data.y, data.x)
        if base in ("top", "bottom"):
            x, y = y, x
        order = np.argsort(x)
        here = seen[t]
        off = across.values[0, t, here] / size - np.interp(along.values[0, t, here] / size, x[order], y[order])
        # the Cramér-Rao bound is 0.02 to 0.06 px along this line, and the end nodes lie on half windows
        assert abs(np.median(off)) < 0.02
        assert np.std(off[2:-2]) < 0.09
    assert float(data.x[0, 0, 0]) / size == pytest.approx(at(*SKIN)[0])
    assert float(data.y[0, 0, 0]) / size == pytest.approx(at(*SKIN)[1])


def test_exchange_of_columns_and_rows_exchanges_x_and_y(frames):
    upright = track([frames[:4]], seeds=[SEED], skin=[SKIN], calibration=CALIBRATION)
    turned = track(
        [frames[:4].swapaxes(1, 2)], seeds=[SEED[::-1]], skin=[SKIN[::-1]], calibration=CALIBRATION, base="top"
    )
    np.testing.assert_array_equal(turned.x, upright.y)
    np.testing.assert_array_equal(turned.y, upright.x)
    np.testing.assert_array_equal(turned.x_sd, upright.y_sd)


@pytest.mark.parametrize("base", ["left", "top"])
def test_region_leaves_the_line_in_place_and_what_is_outside_unread(base, frames):
    region = (100, 180, 400, 290)
    movie, seed = (frames[:4], SEED) if base == "left" else (frames[:4].swapaxes(1, 2), SEED[::-1])
    inside = region if base == "left" else (region[1], region[0], region[3], region[2])
    lit = movie.copy()
    lit[:, : inside[1]], lit[:, inside[3] + 1 :] = 0, 255  # whatever is outside
    lit[:, :, : inside[0]], lit[:, :, inside[2] + 1 :] = 255, 0
    data = track([movie], seeds=[seed], calibration=CALIBRATION, region=inside, base=base)
    assert data.identical(track([lit], seeds=[seed], calibration=CALIBRATION, region=inside, base=base))
    assert json.loads(data.attrs["region"]) == list(inside)
    along = (data.x if base == "left" else data.y).values[0] / CALIBRATION.pixel_size
    assert np.nanmin(along) >= 100 - 1e-9
    assert np.nanmax(along) <= 400 + 1e-9
    whole = track([movie], seeds=[seed], calibration=CALIBRATION, base=base)
    at = (whole.x if base == "left" else whole.y).values[0, 0] / CALIBRATION.pixel_size
    row, part = ((d.y if base == "left" else d.x).values[0, 0] / CALIBRATION.pixel_size for d in (whole, data))
    known = ~np.isnan(at) & (at > 110) & (at < 390)
    # nodes stand elsewhere along the line, noise of two neighbouring columns is in between
    assert np.std(row[known] - np.interp(at[known], along[0][~np.isnan(part)], part[~np.isnan(part)])) < 0.1


def test_bad_regions_are_told(frames):
    def refused(*fields, **settings):
        with refusal(*fields) as caught:
            track([frames[:1]], seeds=[SEED], calibration=CALIBRATION, **settings)
        return caught.value

    refused("range", "region", "(100, 180, 90, 290)", region=(100, 180, 90, 290))
    refused("range", "region", "(100, 90)", region=(100, 90))
    outside = refused("range", "region", "(0, 0, 500, 449)", region=(0, 0, 500, 449))
    assert outside.rule == "must lie in the image of 500 × 450 pixels"
    cut = refused("range", "seed", region=(300, 100, 400, 300))
    assert cut.remedy.endswith("(counted from column 300, row 100 of the image)")
    turned = refused("range", "seed", base="bottom")
    assert "columns and rows exchanged" in turned.remedy


def test_view_and_image_tell_the_same_point():
    for base in ("left", "right", "top", "bottom"):
        view = View(base=base, region=(10, 20, 110, 220))
        x, y = view.back(*(np.array([value]) for value in view.point((30.5, 40.25))))
        assert (x[0], y[0]) == (30.5, 40.25)
        image = np.arange(300 * 200).reshape(300, 200)
        column, row = view.point((30, 40))
        assert view.of(image)[int(row), int(column)] == image[40, 30]


@pytest.fixture(scope="module")
def pad():
    angles = whisker_pad.angles_of_pad()[:, :40]
    return angles, whisker_pad.movie_of_pad(angles, np.random.default_rng(5))


def test_whisking_whiskers_of_a_turned_image_are_those_of_the_upright_one(pad):
    angles, movie = pad
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    settings = {"calibration": calibration, "search": 2, "threshold": 3.0}
    marks = tuple((whisker_pad.mark(angles, w, 0),) for w in (0, 3))
    upright = track([movie], whisking=Whisking(fan=whisker_pad.FAN, marks=marks), **settings)
    fan = Fan(pivot=whisker_pad.FAN.pivot[::-1], radii=whisker_pad.FAN.radii, angles=(40.0, 140.0))
    exchanged = tuple(tuple((t, r, c) for t, c, r in one) for one in marks)
    turned = track([movie.swapaxes(1, 2)], whisking=Whisking(fan=fan, marks=exchanged), base="top", **settings)
    np.testing.assert_array_equal(turned.x, upright.y)
    np.testing.assert_array_equal(turned.y, upright.x)


@pytest.mark.parametrize("base", ["right", "bottom"])
def test_fan_opens_to_the_left_or_upwards_too(pad, base):
    angles, movie = pad
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    settings = {"calibration": calibration, "search": 2, "threshold": 3.0}
    last, pivot = whisker_pad.WIDTH - 1, whisker_pad.FAN.pivot
    mirrored = movie[:, :, ::-1] if base == "right" else movie[:, :, ::-1].swapaxes(1, 2)
    place = (last - pivot[0], pivot[1]) if base == "right" else (pivot[1], last - pivot[0])
    sector = (130.0, 230.0) if base == "right" else (-140.0, -40.0)
    fan = Fan(pivot=place, radii=whisker_pad.FAN.radii, angles=sector)
    t, column, row = whisker_pad.mark(angles, 3, 0)
    mark = (t, last - column, row) if base == "right" else (t, row, last - column)
    data = track([mirrored], whisking=Whisking(fan=fan, marks=((mark,),)), base=base, **settings)
    along, across = (data.x, data.y) if base == "right" else (data.y, data.x)
    along, across = last - along.values[0] / 1e-4, across.values[0] / 1e-4
    truth = whisker_pad.rows_of_pad(angles)[3]
    seen = np.isfinite(measured_sd(data).values[0])
    off = np.array([np.interp(along[i], np.arange(last + 1), truth[i]) - across[i] for i in range(len(truth))])
    assert seen.any(axis=1).mean() > 0.5
    assert np.mean(np.abs(off[seen]) > 1.5) < 0.02
    assert np.median(np.abs(off[seen])) < 0.15


def test_region_of_whisking_whiskers_bounds_them_and_not_the_fan(pad):
    angles, movie = pad
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    whisking = Whisking(fan=whisker_pad.FAN, marks=((whisker_pad.mark(angles, 0, 0),),))
    settings = {"calibration": calibration, "search": 2, "threshold": 3.0, "whisking": whisking}
    whole = track([movie], **settings)
    data = track([movie], region=(80, 50, 200, 219), **settings)
    column, row = data.x.values / 1e-4, data.y.values / 1e-4
    seen = np.isfinite(data.y_sd.values)
    assert seen.any()
    assert column[seen].min() >= 79.5
    assert row[seen].min() >= 50 - 1e-9
    beyond = np.isfinite(whole.y_sd.values) & (whole.y.values / 1e-4 < 48)
    assert beyond.any()
    with refusal("range", "region"):
        track([movie], region=(0, 0, 300, 100), **settings)
