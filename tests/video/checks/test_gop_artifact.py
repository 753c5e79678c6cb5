from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from real_data import real
from refusals import refusal

from vibrissa.video.checks.gop_artifact import GopArtifact, GopArtifactWatch
from vibrissa.video.io.container import key_frames
from vibrissa.video.io.movie import read_blocks, write_movie

RATE = 5000.0


def scene(count: int, rng: np.random.Generator, noise: float = 2.0) -> np.ndarray:
    """A dark line that vibrates before a bright field, with noise: what a codec has to code."""
    row, t = np.arange(64)[:, None], np.arange(count)[:, None, None]
    centre = 30 + 1.5 * np.sin(2 * np.pi * t / 23.7) + np.linspace(0, 6, 80)
    image = 180 - 0.3 * row - 70 * np.exp(-((row - centre) ** 2) / 2)
    return np.clip(np.rint(image + noise * rng.standard_normal(image.shape)), 0, 255).astype(np.uint8)


def h264(path: Path, images: np.ndarray, period: int) -> Path:
    options = {"crf": "23", "g": str(period), "keyint_min": str(period), "sc_threshold": "0"}
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25, options=options)
        stream.height, stream.width, stream.pix_fmt = *images.shape[1:], "gray"
        for image in images:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))
        container.mux(stream.encode())
    return path


def pumping(blocks, keys=(), rate: float = RATE) -> GopArtifact | None:
    watch = GopArtifactWatch(rate, keys)
    for block in blocks:
        watch.see(block)
    return watch.found()


@pytest.mark.parametrize("told", [True, False])
def test_real_movie_pumps_at_its_key_frames(told):
    path = real("whiskiwrap-movies/test_video2.mp4")
    keys = key_frames(path)
    found = pumping(read_blocks(path), keys if told else (), rate=1000)
    assert found is not None
    assert (found.period, found.at_key_frames) == (12, told)
    assert found.frequency == pytest.approx(1000 / 12)
    assert found.p_value < 1e-12
    assert 0.05 < found.amplitude < 2


def test_real_movie_beats_with_no_other_period():
    # the whisking of the animal and its stops are in there: the chance computed must hold for them too
    path = real("whiskiwrap-movies/test_video2.mp4")
    blocks = list(read_blocks(path))
    others = [period for period in range(5, 60) if np.gcd(period, 12) < 4]
    seen = [period for period in others if pumping(blocks, np.arange(0, 1800, period))]
    assert not seen


@pytest.mark.parametrize("period", [8, 10, 15])
@pytest.mark.parametrize("told", [True, False])
def test_h264_pumps_at_the_period_it_was_written_with(tmp_path, period, told):
    path = h264(tmp_path / "movie.mkv", scene(480, np.random.default_rng(5)), period)
    keys = key_frames(path)
    assert keys[1] == period
    found = pumping(read_blocks(path, 100), keys if told else ())
    assert found is not None
    assert (found.period, found.at_key_frames) == (period, told)
    assert found.frequency == RATE / period


def test_the_same_scene_without_loss_is_silent(tmp_path):
    images = scene(480, np.random.default_rng(5))
    write_movie(tmp_path / "movie.mkv", [images])
    assert pumping(read_blocks(tmp_path / "movie.mkv")) is None
    write_movie(tmp_path / "movie.mp4", [images], "h264-lossless")
    assert pumping(read_blocks(tmp_path / "movie.mp4"), np.arange(0, 480, 12)) is None


def test_noise_is_silent():
    rng = np.random.default_rng(17)
    false = 0
    for movie in range(300):
        count = (150, 300, 600)[movie % 3]
        noise = np.rint(rng.normal(120, 3, (count, 16, 16))).astype(np.uint8)
        false += pumping([noise]) is not None
    assert false <= 1  # 0.03 expected at one in ten thousand


def test_lamp_and_whisker_at_the_period_of_key_frames_are_no_pumping():
    rng, t = np.random.default_rng(2), np.arange(960)[:, None, None]
    whisker = 180 - 60 * np.exp(-((np.arange(48)[:, None] - 24 - 3 * np.sin(2 * np.pi * t / 12)) ** 2) / 2)
    lamp = 4 * np.sin(2 * np.pi * t / 12)
    for image in (whisker + np.zeros(48), lamp + 150 + np.zeros((48, 48))):
        images = np.rint(image + 2 * rng.standard_normal((960, 48, 48))).astype(np.uint8)
        assert pumping([images]) is None


@pytest.mark.parametrize("amplitude", [0.5, 2.0])
def test_amplitude_is_that_of_the_truth(amplitude):
    # a sawtooth of either sign in each pixel, reset at every key frame
    rng, period = np.random.default_rng(8), 12
    saw = np.arange(1200) % period
    saw = (saw - saw.mean()) / saw.std()
    sign = rng.choice([-1, 1], (64, 64))
    images = 128 + amplitude * saw[:, None, None] * sign + 3 * rng.standard_normal((1200, 64, 64))
    found = pumping([np.rint(images).astype(np.uint8)], np.arange(0, 1200, period))
    assert found is not None
    # a pixel's estimate varies by noise √(2·11)/(100·12·2·amplitude); the median of 64 by an eighth of it
    assert found.amplitude == pytest.approx(amplitude, rel=0.1)


def test_blocks_may_have_any_size():
    rng = np.random.default_rng(4)
    images = scene(300, rng)
    images[::10] += 3
    whole, pieces = pumping([images]), pumping([images[:7], images[7:8], images[8:]])
    assert whole is not None
    assert whole == pieces


def test_fewer_than_eight_periods_say_nothing():
    images = scene(90, np.random.default_rng(4))
    images[::12] += 5
    assert pumping([images], np.arange(0, 90, 12)) is None
    assert pumping([]) is None


def test_key_frames_that_come_unevenly_leave_every_period_to_be_tried():
    images = scene(480, np.random.default_rng(4))
    images[::12] += 3
    found = pumping([images], [0, 12, 24, 30, 42])
    assert found is not None
    assert (found.period, found.at_key_frames) == (12, False)


@pytest.mark.parametrize("shape", [(400, 5, 7), (400, 1, 1), (400, 9, 300)])
def test_image_of_any_shape_is_watched(shape):
    images = np.rint(np.random.default_rng(1).normal(120, 1, shape)).astype(np.uint16)
    images[::10] += 20
    found = pumping([images])
    assert found is not None
    assert found.period == 10


def test_remark_says_period_size_and_frequency_in_one_line():
    images = scene(480, np.random.default_rng(4))
    images[::12] += 3
    watch = GopArtifactWatch(RATE, np.arange(0, 480, 12))
    watch.see(images)
    remark = watch.remark()
    assert remark is not None
    assert "every 12 frames, with the codec's key frames" in remark
    assert "416.7 Hz" in remark
    assert "\n" not in remark
    silent = GopArtifactWatch(RATE)
    silent.see(scene(480, np.random.default_rng(4)))
    assert silent.remark() is None


@pytest.mark.parametrize("rate", [0, -1, np.nan, np.inf])
def test_frame_rate_must_be_positive(rate):
    with refusal("range", "frame_rate"):
        GopArtifactWatch(rate)
