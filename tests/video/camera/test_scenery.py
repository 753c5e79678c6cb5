import math
from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal
from scipy import stats

from vibrissa.video.camera.field import drift, hairs, led_glow
from vibrissa.video.camera.noise import gaussian_levels, sensor_noise
from vibrissa.video.camera.rendering import (
    Camera,
    expose,
    exposure_times,
    illumination,
    render,
    render_background,
)
from vibrissa.video.camera.scenery import Fur, Led, Light, Scenery, Shadow

CAMERA = Camera(width=120, height=90, noise=0)
PIXEL = CAMERA.pixel_size
FAR = np.full((1, 1, 2), -1.0)  # a whisker outside the image


def empty(scenery, camera=CAMERA, n_frames=1, first_frame=0):
    """Grey levels of a field without whiskers."""
    away = np.repeat(FAR, n_frames, axis=1)
    return expose(away, away, camera, scenery=scenery, first_frame=first_frame)


def whisker(n_frames, subframes=1, camera=CAMERA):
    """A whisker that moves across the rows, (1, instant, node) [m]."""
    t = exposure_times(camera, n_frames, subframes)[:, None]
    s = np.linspace(0, 1, 100)
    x, y = np.broadcast_arrays(5 + 100 * s, 30 + 20 * s**2 + 3 * s * np.sin(2 * np.pi * 80 * t))
    return x[None] * camera.pixel_size, y[None] * camera.pixel_size


# the noise, as a Gaussian of variance 1 that forgets


def test_levels_have_the_moments_of_a_gaussian():
    levels = gaussian_levels().astype(float)
    moments = [np.mean(levels**n) for n in range(1, 7)]
    # sixteen bits end at 4.39 standard deviations: the sixth moment, 15, lacks what lies beyond
    np.testing.assert_allclose(moments, [0, 1, 0, 3, 0, 15], atol=1e-9, rtol=1e-3)
    assert np.all(np.diff(levels) > 0)


@pytest.mark.parametrize(("seed", "frame"), [(0, 0), (5, 123456), (2**64 - 1, 2**64 - 1)])
def test_noise_is_gaussian(seed, frame):
    noise = sensor_noise(seed, frame, 500_000)
    assert stats.kstest(noise, "norm").pvalue > 1e-3
    assert abs(noise.mean()) < 4 / math.sqrt(noise.size)
    assert noise.var() == pytest.approx(1, abs=4 * math.sqrt(2 / noise.size))
    assert stats.kurtosis(noise) == pytest.approx(0, abs=4 * math.sqrt(24 / noise.size))


def test_noise_is_white_over_rows_columns_and_frames():
    n = 64
    movie = np.stack([sensor_noise(11, frame, n * n).reshape(n, n) for frame in range(n)]).astype(float)
    power = np.abs(np.fft.rfftn(movie)) ** 2 / movie.size
    power = power[..., 1 : n // 2].ravel()  # each of them an exponential of mean 1
    assert stats.kstest(power, "expon").pvalue > 1e-3
    assert power.max() < math.log(power.size) + 8  # no line stands out: chance e⁻⁸


def test_seeds_and_frames_are_independent():
    streams = [sensor_noise(*key, 40_000) for key in [(0, 0), (0, 1), (1, 0), (1, 1), (2**32, 0), (0, 2**32)]]
    off = np.corrcoef(streams)[np.triu_indices(len(streams), 1)]
    assert np.abs(off).max() < 4 / math.sqrt(40_000)
    squares = np.corrcoef(np.square(streams))[np.triu_indices(len(streams), 1)]
    assert np.abs(squares).max() < 4 / math.sqrt(40_000)


def test_the_movie_carries_this_noise():
    camera = replace(CAMERA, noise=3)
    x, y = whisker(3)
    light = expose(x, y, camera)
    noise = np.stack([sensor_noise(9, frame, 120 * 90).reshape(90, 120) for frame in range(4, 7)])
    movie = next(render(x, y, camera, seed=9, first_frame=4))
    np.testing.assert_array_equal(movie, np.clip(np.rint(light + np.float32(3) * noise), 0, 255))


@pytest.mark.parametrize("shot", [0, 0.5, 0.95, 1])
def test_the_variance_of_the_noise_grows_with_the_light(shot):
    camera = Camera(width=300, height=200, noise=8, shot=shot, background=120, gradient=(160, 0))  # 40 to 200
    away = np.repeat(FAR, 20, axis=1)
    movie = np.concatenate(list(render(away, away, camera, seed=2))).astype(float)
    variance = (movie - illumination(camera)).reshape(20, 200, 6, 50).var(axis=(0, 1, 3))
    light = illumination(camera)[0].reshape(6, 50).mean(axis=1)
    expected = 64 * (1 - shot + shot * light / 120) + 1 / 12
    np.testing.assert_allclose(variance, expected, rtol=4 * math.sqrt(2 / 200_000))


def test_an_odd_number_of_pixels_gets_the_same_noise():
    np.testing.assert_array_equal(sensor_noise(3, 1, 1001), sensor_noise(3, 1, 1004)[:1001])


# what is off changes nothing


def test_by_default_nothing_stands_in_the_field():
    x, y = whisker(2)
    np.testing.assert_array_equal(expose(x, y, CAMERA, scenery=Scenery()), expose(x, y, CAMERA))
    np.testing.assert_array_equal(empty(None)[0], illumination(CAMERA))
    np.testing.assert_array_equal(render_background(CAMERA), render_background(CAMERA, Scenery()))


# light


def test_the_vignette_takes_its_share_in_the_corners_and_nothing_in_the_middle():
    camera = replace(CAMERA, width=121, height=91)
    share = empty(Scenery(light=Light(vignette=0.3)), camera)[0] / illumination(camera)
    np.testing.assert_allclose(share[[0, 0, -1, -1], [0, -1, 0, -1]], 0.7)
    assert share[45, 60] == 1
    half = 1 - 0.3 * 30**2 / (60**2 + 45**2)  # as the square of the distance
    np.testing.assert_allclose([share[45, 90], share[75, 60], share[45, 30]], half)


def test_the_drift_has_the_deviation_asked_and_no_fast_part():
    light = Light(drift=0.02, drift_time=0.5, seed=3)
    time = np.arange(200_000) * 0.01
    change = drift(light, time)
    np.testing.assert_allclose(change.std(axis=1), 0.02, rtol=0.02)
    assert np.abs(np.corrcoef(change)[np.triu_indices(3, 1)]).max() < 0.02
    spectrum = np.abs(np.fft.rfft(change * np.hanning(time.size))) ** 2
    fast = np.fft.rfftfreq(time.size, 0.01) > 1 / light.drift_time + 0.01
    assert spectrum[:, fast].sum() < 1e-6 * spectrum.sum()
    assert np.abs(drift(replace(light, drift=0.08), time).sum(0)).max() < 1  # at its worst the light is still on


def test_the_light_drifts_in_level_and_across_the_image():
    light = Light(drift=0.05, drift_time=0.02, seed=1)
    movie = empty(Scenery(light=light), n_frames=30, first_frame=7)
    change = drift(light, np.arange(7, 37) / CAMERA.frame_rate)
    ratio = movie / illumination(CAMERA)
    g0, g1, g2 = change
    np.testing.assert_allclose(ratio.mean(axis=(1, 2)), 1 + g0)
    np.testing.assert_allclose(ratio[:, 0, -1], 1 + g0 + g1 - g2)
    np.testing.assert_allclose(ratio[:, -1, 0], 1 + g0 - g1 + g2)
    other = empty(Scenery(light=replace(light, seed=2)), n_frames=30, first_frame=7)
    assert np.abs(other - movie).max() > 1


# head and fur


def test_the_head_is_dark_up_to_the_skin():
    fur = Fur(skin=20 * PIXEL, density=0)
    row = empty(Scenery(fur=fur))[0, 45] / 184
    # a straight border, blurred: half the light at the skin, and as much darkness as before the blur
    assert row[20] == pytest.approx(0.5)
    assert (1 - row).sum() == pytest.approx(20.5)  # pixels from −1/2 to 20
    assert row[10] < 1e-6 < 1 - 1e-6 < row[30]
    mirrored = empty(Scenery(fur=replace(fur, side="right")))[0, 45] / 184
    np.testing.assert_allclose(mirrored[::-1], row)


def test_the_skin_bulges_as_a_parabola():
    camera = replace(CAMERA, height=91)
    dark = 1 - empty(Scenery(fur=Fur(skin=20 * PIXEL, bulge=8 * PIXEL, density=0)), camera)[0] / 184
    rows = np.arange(91)
    np.testing.assert_allclose(dark.sum(axis=1), 20.5 - 8 * ((rows - 45) / 45) ** 2, atol=1e-5)  # sampled edge


def test_hairs_that_reach_a_distance_fall_off_exponentially():
    fur = Fur(skin=0.0, density=2e6, length=1e-3, spread=0, curvature=0, seed=4)
    x, y = hairs(CAMERA, fur)
    skin = 90 * PIXEL + 10 * fur.length  # roots stand beyond the image too, lest its corners be bald
    for distance in (0.5e-3, 1e-3, 3e-3):
        expected = 2e6 * skin * math.exp(-distance / fur.length)
        assert (x[:, -1] > distance).sum() == pytest.approx(expected, rel=5 / math.sqrt(expected))
    assert np.ptp(y, axis=1).max() == 0  # straight out


def test_hairs_are_arcs_of_their_length():
    x, y = hairs(CAMERA, Fur(skin=2e-3, density=2e4, spread=0.5, curvature=300, seed=2))
    steps = np.hypot(np.diff(x), np.diff(y))
    np.testing.assert_allclose(steps, steps[:, :1] * np.ones(steps.shape[1]))
    turn = np.diff(np.unwrap(np.arctan2(np.diff(y), np.diff(x))))
    curvature = turn / steps[:, 1:]
    np.testing.assert_allclose(curvature, curvature[:, :1] * np.ones(turn.shape[1]), rtol=1e-6, atol=1e-4)
    assert curvature[:, 0].std() == pytest.approx(300, rel=5 / math.sqrt(2 * len(x)))


def test_fur_darkens_near_the_skin_alone_and_follows_its_seed():
    fur = Fur(skin=10 * PIXEL, length=5 * PIXEL, head=0)
    dark = 1 - empty(Scenery(fur=fur))[0].mean(axis=0) / 184
    assert dark[10:14].mean() > 0.2 > 10 * dark[60:].mean()
    assert np.all(dark[12:36:6] > dark[18:42:6])
    again, other = (empty(Scenery(fur=replace(fur, seed=seed)))[0] for seed in (0, 1))
    np.testing.assert_array_equal(again, empty(Scenery(fur=fur))[0])
    assert np.abs(again - other).max() > 20


# shadow


@pytest.mark.parametrize("facing", [math.pi, -2.6, 0.4, math.pi / 2])
def test_the_shadow_hides_what_is_nearer_to_the_substrate_than_its_depth(facing):
    point = (60 * PIXEL, 45 * PIXEL)
    shadow = Shadow(substrate=point, facing=facing, depth=20 * PIXEL, penumbra=4 * PIXEL, opacity=0.9)
    share = empty(Scenery(shadow=shadow))[0] / 184
    row, column = np.mgrid[:90, :120]
    away = (column - 60) * math.cos(facing) + (row - 45) * math.sin(facing)
    np.testing.assert_allclose(share[away < 20 - 16], 0.1, atol=1e-4)
    np.testing.assert_allclose(share[away > 20 + 16], 1, atol=1e-4)
    at = 20 + np.array([-4, 0, 4])  # a Gaussian edge: 84, 50 and 16 % of the darkness at −1, 0 and 1 SD
    order = np.argsort(away, axis=None)
    seen = np.interp(at, away.ravel()[order], share.ravel()[order])
    np.testing.assert_allclose((1 - seen) / 0.9, stats.norm.sf([-1, 0, 1]), atol=3e-3)  # linear between pixels


def test_a_whisker_in_the_shadow_is_dimmed_with_the_light():
    shadow = Shadow(substrate=(110 * PIXEL, 45 * PIXEL), facing=math.pi, depth=2e-3)
    scenery = Scenery(shadow=shadow, fur=Fur(skin=10 * PIXEL))
    x, y = whisker(1)
    seen = expose(x, y, CAMERA, scenery=scenery)
    np.testing.assert_allclose(seen, empty(scenery) * expose(x, y, CAMERA) / 184)


# LED


def test_the_led_is_seen_from_the_exposure_in_which_it_lights():
    start = 4 / CAMERA.frame_rate - CAMERA.exposure / 4  # three quarters of the exposure of frame 4 are left
    led = Led(position=(80 * PIXEL, 20 * PIXEL), start=start, radius=6 * PIXEL, brightness=50)
    movie = empty(Scenery(led=led), n_frames=6, first_frame=1) - 184
    np.testing.assert_allclose(movie[:, 20, 80], [0, 0, 0, 37.5, 50, 50], atol=1e-9)  # frames 1 to 6
    # what the disc gives does not change by blur; blurring a disc radially moves its edge outwards by σ²/2R
    sigma = CAMERA.blur / 2.3548
    assert movie[-1].sum() / 50 == pytest.approx(math.pi * (6**2 + sigma**2), rel=2e-3)
    assert np.abs(movie[-1, :, :60]).max() < 1e-9
    np.testing.assert_allclose(led_glow(CAMERA, led), movie[-1], atol=1e-9)


# all of it, in any order


EVERYTHING = Scenery(
    light=Light(vignette=0.2, drift=0.02, drift_time=0.01),
    fur=Fur(skin=8 * PIXEL),
    shadow=Shadow(substrate=(115 * PIXEL, 45 * PIXEL), facing=3.0, depth=10 * PIXEL),
    led=Led(position=(100 * PIXEL, 10 * PIXEL), start=2e-3),
)


@pytest.mark.parametrize("block", [1, 3, 256])
def test_everything_on_a_movie_is_the_same_in_any_pieces(block):
    camera = replace(CAMERA, noise=3)
    x, y = whisker(10, 2)
    options = {"seed": 5, "subframes": 2, "scenery": EVERYTHING}
    whole = next(render(x, y, camera, **options))
    late = list(render(x[:, 8:], y[:, 8:], camera, first_frame=4, block=block, **options))
    early = list(render(x[:, :8], y[:, :8], camera, block=block, **options))
    assert np.concatenate(early + late).tobytes() == whole.tobytes()


def test_each_whisker_has_its_contrast():
    x, y = (np.concatenate([v, v]) for v in whisker(1))
    y = y + np.array([0, 30 * PIXEL])[:, None, None]
    dark = 184 - expose(x, y, CAMERA, contrast=[[80], [40]])[0]
    np.testing.assert_allclose(dark[20:50, :60], 2 * dark[50:80, :60], atol=1e-9)


# what is refused


@pytest.mark.parametrize(
    ("part", "wrong", "message"),
    [
        (Light, {"vignette": 1}, ("range", "Light.vignette")),
        (Light, {"drift": 0.1}, ("range", "Light.drift")),
        (Light, {"drift_time": 0}, ("range", "Light.drift_time")),
        (Light, {"seed": -1}, ("format", "Light.seed")),
        (Fur, {"skin": math.nan}, ("range", "Fur.skin")),
        (Fur, {"skin": 0, "side": "top"}, ("range", "Fur.side")),
        (Fur, {"skin": 0, "density": -1}, ("range", "Fur.density")),
        (Fur, {"skin": 0, "opacity": 2}, ("range", "Fur.opacity")),
        (Fur, {"skin": 0, "seed": 0.5}, ("format", "Fur.seed")),
        (Shadow, {"substrate": (0, 0, 0), "facing": 0, "depth": 0}, ("range", "Shadow.substrate")),
        (Shadow, {"substrate": (0, 0), "facing": math.inf, "depth": 0}, ("range", "Shadow.facing")),
        (Shadow, {"substrate": (0, 0), "facing": 0, "depth": -1}, ("range", "Shadow.depth")),
        (Shadow, {"substrate": (0, 0), "facing": 0, "depth": 0, "penumbra": 0}, ("range", "Shadow.penumbra")),
        (Shadow, {"substrate": (0, 0), "facing": 0, "depth": 0, "opacity": 1.1}, ("range", "Shadow.opacity")),
        (Led, {"position": (0, math.nan), "start": 0}, ("range", "Led.position")),
        (Led, {"position": (0, 0), "start": math.nan}, ("range", "Led.start")),
        (Led, {"position": (0, 0), "start": 0, "radius": 0}, ("range", "Led.radius")),
        (Led, {"position": (0, 0), "start": 0, "brightness": -1}, ("range", "Led.brightness")),
    ],
)
def test_scenery_out_of_range_is_refused(part, wrong, message):
    with refusal(*message):
        part(**wrong)
