"""Where the background is from: named in the output, and refused where the whisker stands in it."""

from __future__ import annotations

from pathlib import Path

import line_movie
import numpy as np
import pytest
from refusals import refusal

from vibrissa.study.movie.track_file import track_file
from vibrissa.study.spec.settings import MovieFile
from vibrissa.video.follow.background import SURVIVES, reference, refuse_still
from vibrissa.video.io.movie import write_movie
from vibrissa.video.tracking import Calibration, track

CALIBRATION = Calibration(frame_rate=5000.0, pixel_size=95e-6)
SEED = (250, 226)
HIGH, WIDE = line_movie.HEIGHT, line_movie.WIDTH


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    """A whisker that sweeps over 120 rows, base and all, up to 3 px from frame to frame."""
    t = np.arange(60)
    return line_movie.truth(60) + (60 * np.sin(2 * np.pi * t / 130))[:, None]


@pytest.fixture(scope="module")
def frames(truth) -> np.ndarray:
    return line_movie.movie(truth, np.random.default_rng(4))


@pytest.fixture(scope="module")
def empty() -> np.ndarray:
    return line_movie.movie(np.full((12, WIDE), -50.0), np.random.default_rng(5))


def error(data, truth: np.ndarray) -> np.ndarray:
    x, y = (data[name].values[0][:, 3:-3] / CALIBRATION.pixel_size for name in "xy")
    return y - np.array([np.interp(x[t], np.arange(WIDE), truth[t]) for t in range(len(x))])


def test_mean_of_the_movie_serves_where_no_whisker_stays(frames, truth):
    data = track([frames], seeds=[SEED], calibration=CALIBRATION, background="mean")
    assert data.attrs["background"] == "mean"
    off = error(data, truth)
    assert np.isfinite(off).mean() > 0.95
    assert abs(np.nanmean(off)) < 0.02
    assert np.nanmedian(np.nanstd(off, axis=0)) < 0.1


def test_mean_of_the_movie_is_refused_where_the_whisker_survives_in_it():
    still = line_movie.movie(line_movie.truth(20), np.random.default_rng(6))
    with refusal("too-few", "background"):
        track([still], seeds=[SEED], calibration=CALIBRATION, background="mean")


def test_mean_is_refused_too_where_the_whisker_rests_later():
    """In the first frame it stands elsewhere, so that its seed tells nothing."""
    offset = np.concatenate([np.linspace(40, 2.5, 16), np.zeros(16)])
    rests = line_movie.movie(line_movie.truth(32, amplitude=0.1) + offset[:, None], np.random.default_rng(6))
    with refusal("too-few", "background 'mean'"):
        track([rests], seeds=[(250, 266)], calibration=CALIBRATION, background="mean", threshold=3.0)


def test_share_of_contrast_left_in_a_mean_is_the_share_of_frames_in_one_place():
    """What ``SURVIVES`` stands for: a line there in a share of frames is that share of its contrast in their mean."""
    rng = np.random.default_rng(0)
    row = np.where(rng.random(4000) < 0.4, 50.0, rng.uniform(60, 400, 4000))
    pixel = np.arange(450)
    mean = np.exp(-((pixel - row[:, None]) ** 2) / (2 * line_movie.SIGMA**2)).mean(axis=0)
    assert mean.max() == pytest.approx(np.mean(row == 50), abs=0.01)
    places = row[None, :, None]
    with refusal("too-few", "background 'mean'"):
        refuse_still(np.zeros_like(places), places, np.zeros((1, 1)))
    swept = rng.uniform(60, 400, (1, 4000, 1))
    refuse_still(np.zeros_like(swept), swept, np.zeros((1, 1)))
    assert SURVIVES < 0.4


def test_image_and_movie_without_the_whisker_are_read_and_named(tmp_path, frames, truth, empty):
    for stem, blocks in (("one.tif", empty[:1]), ("many.mkv", empty)):
        path = tmp_path / stem
        write_movie(path, [blocks])
        data = track([frames[:6]], seeds=[SEED], calibration=CALIBRATION, background=path)
        assert data.attrs["background"] == f"{'image' if len(blocks) == 1 else 'movie'}: {stem}"
        off = error(data, truth[:6])
        assert abs(np.nanmean(off)) < 0.02
        assert np.nanstd(off) < 0.2
    image, _ = reference(tmp_path / "many.mkv", list)
    np.testing.assert_allclose(image, empty.mean(axis=0), rtol=1e-6)


def test_wide_reference_serves_a_wide_movie(tmp_path, frames, empty):
    path = tmp_path / "empty.tif"
    write_movie(path, [empty.astype(np.uint16) * 16])
    narrow = track([frames[:3]], seeds=[SEED], calibration=CALIBRATION, background=empty.mean(axis=0))
    wide = track([frames[:3].astype(np.uint16) * 16], seeds=[SEED], calibration=CALIBRATION, background=path)
    np.testing.assert_allclose(wide.y, narrow.y, atol=2e-3 * CALIBRATION.pixel_size)


def test_unknown_backgrounds_are_told(tmp_path, frames):
    def refused(fields, background, blocks=None):
        with refusal(*fields):
            track(blocks or [frames[:1]], seeds=[SEED], calibration=CALIBRATION, background=background)

    refused(("unknown", "background", "'median'"), "median")
    refused(("format", "blocks"), "mean", iter([frames[:1]]))
    refused(("shape", "background", "(4, 5)"), np.zeros((4, 5)))
    (tmp_path / "no.mkv").write_bytes(b"no movie")
    refused(("format", "no.mkv"), tmp_path / "no.mkv")


def test_study_reads_the_background_beside_it_and_the_region(tmp_path, frames, empty):
    write_movie(tmp_path / "movie.mkv", [frames[:4].swapaxes(1, 2)])
    write_movie(tmp_path / "empty.tif", [empty[:1].swapaxes(1, 2)])
    movie = MovieFile(
        path="movie.mkv",
        frame_rate=5000.0,
        pixel_size=95e-6,
        seeds=(SEED[::-1],),
        base="top",
        background="empty.tif",
        region=(100, 60, HIGH - 1, WIDE - 1),
    )
    told = []
    data = track_file(movie, Path(tmp_path), lambda *args: told.append(args))
    assert data.attrs["background"] == "image: empty.tif"
    assert np.isfinite(data.x_sd.values).mean() > 0.8
    assert told[-1] == ("tracking", 4, 4)
