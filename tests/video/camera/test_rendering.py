import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.video.camera.rendering import Camera, expose, exposure_times, illumination, render, render_background

PLAIN = Camera(width=96, height=64, contrast=(110, 110), noise=0)
FWHM = 2 * math.sqrt(2 * math.log(2))


def curve(x, y, camera=PLAIN):
    """One whisker from node positions in pixels, (node) or (instant, node)."""
    x, y = np.broadcast_arrays(np.atleast_2d(x), np.atleast_2d(y))
    return x[None] * camera.pixel_size, y[None] * camera.pixel_size


def straight(slope, offset=0.0, camera=PLAIN):
    """A line through the middle of the image that leaves it on both sides, nodes a pixel apart."""
    angle = math.atan(slope)
    along = np.linspace(-100, 100, 201)
    return curve(47.5 + along * math.cos(angle), 31.5 + offset + along * math.sin(angle), camera)


def darkening(x, y, camera=PLAIN, **options):
    return illumination(camera) - expose(x, y, camera, **options)


def spread(profile):
    """Variance across the rows of one column's darkening."""
    rows = np.arange(profile.size)
    mean = (rows * profile).sum() / profile.sum()
    return ((rows - mean) ** 2 * profile).sum() / profile.sum()


# exact solutions


@pytest.mark.parametrize("slope", [0, 0.02, 0.3, -0.7, 1, 2.5])
@pytest.mark.parametrize("offset", [0, 0.25, 0.5])
def test_a_straight_line_has_its_centroid_on_the_truth_in_every_column(slope, offset):
    image = darkening(*straight(slope, offset))[0]
    columns, rows = np.arange(96), np.arange(64)
    truth = 31.5 + offset + slope * (columns - 47.5)
    reach = 5 * PLAIN.blur / FWHM * math.hypot(1, slope)
    inside = (truth > reach) & (truth < 63 - reach)
    image, truth = image[:, inside], truth[inside]
    assert truth.size > 10
    # a cut through a Gaussian line is symmetric about the line; sampling it leaves 2·exp(−2π²σ²) ≈ 2e-5 of a pixel
    np.testing.assert_allclose((rows[:, None] * image).sum(0) / image.sum(0), truth, atol=1e-3)


@pytest.mark.parametrize("blur", [1.0, 1.5, 2.3])
@pytest.mark.parametrize("slope", [0.02, math.sqrt(0.4), math.e])  # irrational: samples at all distances
def test_the_width_seen_is_the_width_asked(blur, slope):
    image = darkening(*straight(slope), camera := replace(PLAIN, blur=blur))[0]
    row, column = np.mgrid[: camera.height, : camera.width]
    across = ((row - 31.5) - slope * (column - 47.5)) / math.hypot(1, slope)
    inner = (np.abs(row - 31.5) < 20) & (np.abs(across) < 4)
    order = np.argsort(across[inner])
    side, dark = across[inner][order], image[inner][order]
    left = np.interp(55, dark[side < 0], side[side < 0])
    right = -np.interp(55, dark[side > 0][::-1], -side[side > 0][::-1])
    assert right - left == pytest.approx(blur, abs=2e-3)  # linear interpolation between samples of the flank


def test_the_shaft_widens_the_line_by_the_variance_of_a_band():
    diameter = np.linspace(3, 0, 201) * PLAIN.pixel_size
    image = darkening(*straight(0), diameter=diameter)[0]
    width = 3 * (1 - (np.arange(96) + 52.5) / 200)  # the first node stands at column −52.5
    expected = (PLAIN.blur / FWHM) ** 2 + width**2 / 12
    np.testing.assert_allclose([spread(column) for column in image.T], expected, rtol=1e-3)  # reach of 5 σ, sampling


@pytest.mark.parametrize("subframes", [1, 2, 3, 10])
def test_a_moving_line_is_blurred_by_its_path_during_the_exposure(subframes):
    speed = 9000.0  # pixels per second: 3 pixels in one exposure
    times = exposure_times(PLAIN, 1, subframes)
    x, y = curve(np.linspace(-20, 120, 141), 31.5 + speed * times[:, None])
    image = darkening(x, y, subframes=subframes)
    path = (speed * PLAIN.exposure) ** 2 / 12
    expected = (PLAIN.blur / FWHM) ** 2 + path * (1 - 1 / subframes**2)
    assert spread(image[0, :, 40]) == pytest.approx(expected, rel=1e-3)
    assert (np.arange(64) * image[0, :, 40]).sum() / image[0, :, 40].sum() == pytest.approx(31.5, abs=1e-3)


def test_contrast_falls_evenly_from_base_to_tip():
    camera = replace(PLAIN, contrast=(110, 24))
    x, y = curve(np.arange(10, 81), np.full(71, 30.0))
    np.testing.assert_allclose(darkening(x, y, camera)[0, 30, 10:81], np.linspace(110, 24, 71), rtol=1e-12)
    given_ = 50 + 30 * np.sin(np.arange(71))
    np.testing.assert_allclose(darkening(x, y, camera, contrast=given_)[0, 30, 10:81], given_, rtol=1e-12)
    np.testing.assert_allclose(darkening(x, y, camera, contrast=[given_])[0, 30, 10:81], given_, rtol=1e-12)


def test_beyond_the_tip_the_image_fades_with_the_distance_to_it():
    x, y = curve([-10, 40.0], [30, 30.0])
    expected = 110 * np.exp(-(np.hypot(2, 1) ** 2) / (2 * (PLAIN.blur / FWHM) ** 2))
    assert darkening(x, y)[0, 31, 42] == pytest.approx(expected)


def test_frames_are_centred_on_their_times():
    camera = Camera(frame_rate=1000, exposure=6e-4)
    np.testing.assert_allclose(exposure_times(camera, 2), [0, 1e-3], atol=1e-18)
    np.testing.assert_allclose(exposure_times(camera, 2, 3), [-2e-4, 0, 2e-4, 8e-4, 1e-3, 1.2e-3], atol=1e-18)


# laws that hold for any input

COORDINATES = st.lists(st.tuples(st.floats(-20, 110), st.floats(-20, 80)), min_size=2, max_size=6)


@settings(deadline=None)  # the first call compiles
@given(COORDINATES, st.floats(0, 110), st.floats(0, 110))
def test_rows_and_columns_are_alike(nodes, base, tip):
    x, y = np.array(nodes).T
    camera = replace(PLAIN, contrast=(base, tip))
    turned = replace(camera, width=camera.height, height=camera.width)
    image = expose(*curve(x, y), camera)[0]
    np.testing.assert_allclose(expose(*curve(y, x), turned)[0].T, image, atol=1e-9)


CORNERS = st.lists(st.tuples(st.integers(0, 24), st.integers(0, 16)), min_size=2, max_size=8)


@settings(deadline=None)
@given(CORNERS, st.sampled_from([0.25, 1, 4]))
def test_a_pixel_darkens_with_its_distance_from_the_nearest_point(nodes, spacing):
    nodes = 1j * spacing + spacing * np.array([column + 1j * row for column, row in nodes])  # hairpins and rests too
    row, column = np.mgrid[:64, :96]
    pixel, distance = (column + 1j * row)[..., None], np.inf
    for start, end in pairwise(nodes):
        points = start + np.linspace(0, 1, 1 + 16 * math.ceil(abs(end - start))) * (end - start)
        distance = np.minimum(distance, np.abs(pixel - points).min(axis=-1))  # of points 1/16 pixel apart
    expected = 110 * np.exp(-(distance**2) / (2 * (PLAIN.blur / FWHM) ** 2))
    np.testing.assert_allclose(darkening(*curve(nodes.real, nodes.imag))[0], expected, atol=0.1)


@settings(deadline=None)
@given(COORDINATES, st.integers(-9, 9), st.integers(-9, 9))
def test_a_move_by_whole_pixels_moves_the_image(nodes, right, down):
    x, y = np.round(np.array(nodes) * 64).T / 64  # exact in binary, so that ties between segments stay ties
    camera = replace(PLAIN, pixel_size=2.0**-13)
    still = darkening(*curve(x, y, camera), camera)[0, 10:-10, 10:-10]
    moved = darkening(*curve(x + right, y + down, camera), camera)[0]
    np.testing.assert_allclose(moved[10 + down : 54 + down, 10 + right : 86 + right], still, atol=1e-9)


@settings(deadline=None)
@given(COORDINATES, COORDINATES)
def test_crossing_whiskers_multiply_what_they_transmit(first, second):
    first, second = (np.array((nodes * 3)[:6]).T for nodes in (first, second))
    x, y = (np.stack([first[i], second[i]])[:, None] * PLAIN.pixel_size for i in (0, 1))
    both, *alone = (expose(x[w], y[w], PLAIN) / 184 for w in ([0, 1], [0], [1]))
    np.testing.assert_allclose(both, alone[0] * alone[1], rtol=1e-12)
    np.testing.assert_allclose(expose(x[::-1], y[::-1], PLAIN) / 184, both, rtol=1e-12)


def test_more_nodes_on_the_same_line_change_nothing():
    coarse = darkening(*curve([5, 90.0], [10, 50.0]), replace(PLAIN, contrast=(110, 24)))
    fine = darkening(*curve(np.linspace(5, 90, 400), np.linspace(10, 50, 400)), replace(PLAIN, contrast=(110, 24)))
    np.testing.assert_allclose(fine, coarse, atol=1e-3)  # the coarse box holds pixels beyond five σ too


def test_contrast_follows_the_light_of_an_uneven_field():
    camera = replace(PLAIN, gradient=(40, -20))
    np.testing.assert_allclose(
        expose(*straight(0.3), camera) / illumination(camera), expose(*straight(0.3), PLAIN) / 184
    )


def test_the_empty_field_is_the_plane_asked():
    field = render_background(replace(PLAIN, gradient=(40, -20)))
    assert field.dtype == np.uint8
    assert (field[0, 0], field[0, -1], field[-1, 0], field[-1, -1]) == (174, 214, 154, 194)
    assert np.all(render_background(PLAIN) == 184)


# noise and bytes


def away(n_frames):
    """A whisker outside the image."""
    return curve([-50, -40.0], np.full((n_frames, 2), -50.0))


@pytest.mark.parametrize("noise", [1.5, 3.3])
def test_noise_has_the_standard_deviation_asked(noise):
    camera = Camera(noise=noise)
    movie = np.concatenate(list(render(*away(20), camera, seed=3))).astype(float) - 184
    # 1.28 million pixels: standard error noise/1600; rounding to whole grey levels adds 1/12
    assert movie.std() == pytest.approx(math.sqrt(noise**2 + 1 / 12), rel=4e-3)
    assert abs(movie.mean()) < 4 * noise / 1131
    assert abs((movie[:-1] * movie[1:]).mean()) < 4 * noise**2 / 1100  # frames are independent
    assert abs((movie[:, 1:] * movie[:, :-1]).mean()) < 4 * noise**2 / 1100  # and so are neighbours


def moving(n_frames=11, subframes=2):
    times = exposure_times(PLAIN, n_frames, subframes)[:, None]
    s = np.linspace(0, 1, 90)
    return curve(3 + 88 * s, 20 + 25 * s**2 + 2 * s * np.sin(2 * np.pi * 90 * times))


@pytest.mark.parametrize("block", [1, 4, 11, 256])
def test_equal_seeds_give_equal_bytes_whatever_the_block(block):
    camera = replace(PLAIN, noise=3)
    whole = next(render(*moving(), camera, seed=2**64 - 1, subframes=2, block=11))
    blocks = list(render(*moving(), camera, seed=2**64 - 1, subframes=2, block=block))
    assert [len(frames) for frames in blocks[:-1]] == [block] * (len(blocks) - 1)
    assert np.concatenate(blocks).tobytes() == whole.tobytes()


def test_a_movie_made_in_pieces_is_the_movie_made_at_once():
    camera = replace(PLAIN, noise=3)
    x, y = moving()
    whole = next(render(x, y, camera, seed=7, subframes=2))
    rest = next(render(x[:, 8:], y[:, 8:], camera, seed=7, subframes=2, first_frame=4))
    assert rest.tobytes() == whole[4:].tobytes()
    assert next(render(x, y, camera, seed=8, subframes=2)).tobytes() != whole.tobytes()


def test_grey_levels_are_rounded_and_clipped():
    clean = next(render(*moving(), PLAIN, seed=0, subframes=2))
    np.testing.assert_array_equal(clean, np.rint(expose(*moving(), PLAIN, subframes=2)))
    harsh = next(render(*away(1), replace(PLAIN, noise=300), seed=0))
    assert (harsh == 0).mean() == pytest.approx(0.27, abs=0.03)  # Φ(−184/300)
    assert (harsh == 255).mean() == pytest.approx(0.406, abs=0.03)  # Φ(−71/300)


# what is refused


@pytest.mark.parametrize(
    ("name", "bad", "quantity", "value", "remedy"),
    [
        ("frame_rate", 0, "Camera.frame_rate", "0", "give it in Hz"),
        ("pixel_size", math.nan, "Camera.pixel_size", "nan", "give it in m"),
        ("width", 0, "Camera.width", "0", ""),
        ("height", 10.5, "Camera.height", "10.5", ""),
        ("height", math.inf, "Camera.height", "inf", ""),
        ("exposure", 1e-3, "Camera.exposure", "0.001", "give it in s"),
        ("exposure", 0, "Camera.exposure", "0", "give it in s"),
        ("blur", 0.5, "Camera.blur", "0.5", "give it in pixels (FWHM)"),
        ("noise", -1, "Camera.noise", "-1", "give it in grey levels"),
        ("shot", 1.5, "Camera.shot", "1.5", ""),
        ("background", 300, "Camera.background", "300", ""),
        ("gradient", (200, 0), "Camera.background", "184.0", ""),
        ("contrast", (200, 10), "Camera.contrast", "(200, 10)", ""),
        ("contrast", (110, -1), "Camera.contrast", "(110, -1)", ""),
        ("contrast", (110,), "Camera.contrast", "(110,)", ""),
    ],
)
def test_a_camera_out_of_range_is_refused(name, bad, quantity, value, remedy):
    with refusal("range", quantity, value) as caught:
        Camera(**{name: bad})
    assert caught.value.remedy == remedy


def test_the_rule_names_the_longest_exposure_and_the_greatest_contrast():
    with refusal("range", "Camera.exposure") as caught:
        Camera(exposure=1e-3)
    assert caught.value.rule == "must lie between 0 and one frame, 0.0005 s"
    with refusal("range", "Camera.contrast") as caught:
        Camera(contrast=(200, 10))
    assert caught.value.rule == "must be two values (base, tip) from 0 to the background 184"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": np.zeros((1, 4))}, ("conflict", "x and y")),
        ({"y": np.zeros((1, 4, 8))}, ("conflict", "x and y")),
        ({"x": np.zeros((1, 4, 1)), "y": np.zeros((1, 4, 1))}, ("conflict", "x and y")),
        ({"x": np.full((1, 4, 9), np.nan)}, ("range", "x")),
        ({"subframes": 3}, ("format", "x and y")),
        ({"x": np.zeros((1, 0, 9)), "y": np.zeros((1, 0, 9))}, ("format", "x and y")),
        ({"seed": 2**64}, ("format", "seed")),
        ({"subframes": 0}, ("format", "subframes")),
        ({"contrast": np.zeros(5)}, ("shape", "contrast")),
        ({"contrast": 200}, ("conflict", "contrast")),
        ({"diameter": -1e-6}, ("conflict", "diameter")),
        ({"seed": -1}, ("format", "seed")),
        ({"first_frame": 0.5}, ("format", "first_frame")),
        ({"block": 0}, ("format", "block")),
    ],
)
def test_bad_input_is_refused_before_the_first_block(change, message):
    arguments = {"x": np.zeros((1, 4, 9)), "y": np.zeros((1, 4, 9)), "seed": 0} | change
    with refusal(*message):
        render(arguments.pop("x"), arguments.pop("y"), PLAIN, **arguments)


@pytest.mark.parametrize(("frames", "subframes"), [(0, 1), (3, 0), (1.5, 1)])
def test_times_need_whole_numbers(frames, subframes):
    with refusal("format"):
        exposure_times(PLAIN, frames, subframes)
