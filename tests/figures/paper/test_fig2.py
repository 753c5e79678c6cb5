"""Figure 2: the whisker touches both edges of the gap when it jumps, and its excursion falls by λ."""

import io

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from vibrissa.figures.paper import fig2
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)
WIDTH = 0.6e-3


@pytest.fixture(scope="module")
def data():
    return fig2.compute(POSTURE, WHISKER, WIDTH, SCAN)


def shaft(data, stage):
    """Position and height [m] of a profile from its contact to the base."""
    one = data.sel(stage=stage)
    beyond = data.s.values >= float(one.stage_contact)
    return one.stage_x.values[beyond], one.stage_height.values[beyond]


def test_every_profile_stands_on_its_edge(data):
    for stage, edge in ((1, 0.0), (2, 0.0), (3, WIDTH)):
        x, height = shaft(data, stage)
        np.testing.assert_allclose((x[0], height[0]), (edge, 0), atol=1e-15)


def test_before_the_jump_the_sagging_profile_touches_the_near_edge(data):
    height = CubicSpline(*shaft(data, 2))
    within = np.linspace(0.02, 0.98, 50) * WIDTH
    assert abs(height(WIDTH)) < 1e-10  # [m], 1e-5 of how deep it sags: the spline's error
    assert np.all(height(within) < 0)
    assert CubicSpline(*shaft(data, 1))(WIDTH) > 1e-6


def test_the_base_stays_where_it_is_through_the_jump_and_moves_by_d_before(data):
    base = [(x[-1], height[-1]) for x, height in (shaft(data, stage) for stage in (1, 2, 3))]
    np.testing.assert_allclose(base[1], base[2], atol=1e-13)
    np.testing.assert_allclose(base[1][0] - base[0][0], data.attrs["excursion_at_jump"], rtol=1e-6)


def test_excursion_rises_at_v_falls_by_the_width_and_is_back_after_width_over_v(data):
    t, d = data.time.values, data.excursion.values * WHISKER.length
    t1, t2, t3 = data.event_time.values
    np.testing.assert_allclose(t3 - t1, WIDTH / SCAN.speed, rtol=1e-12)
    for start, stop in ((t1, t2), (t2, t3)):
        on_ramp = (t >= start) & (t < stop)
        np.testing.assert_allclose(np.diff(d[on_ramp]), SCAN.speed * np.diff(t[on_ramp]), atol=1e-16)
    jump = int(np.searchsorted(t, t2))
    np.testing.assert_allclose(d[jump] - d[jump - 1], -WIDTH, rtol=1e-6)  # the sample before is 1e-9 of λ/v early
    np.testing.assert_allclose(d[(t < t1) | (t > t3)], 0, atol=1e-16)
    np.testing.assert_allclose(np.diff(data.stage_excursion[1:]), -WIDTH / WHISKER.length, rtol=1e-12)


def test_vibration_jumps_and_the_displacement_does_not(data):
    jump = int(np.searchsorted(data.time.values, float(data.event_time[1])))
    step = data.isel(time=[jump - 1, jump]).diff("time").isel(time=0)
    np.testing.assert_allclose(step.mode_amplitude, data.mode_jump, rtol=1e-5)
    assert np.all(np.abs(step.mode_displacement) < 1e-5 * np.abs(data.mode_jump))


@pytest.mark.parametrize(
    ("width", "ratio", "dip"),
    [
        (0.3e-3, (0.897, 0.784, 0.573), 16e-6),
        (0.6e-3, (0.813, 0.607, 0.221), 59e-6),
        (1.0e-3, (0.722, 0.412, -0.169), 152e-6),
    ],
)
def test_jumps_fall_short_of_the_linear_ones_and_the_free_end_dips(width, ratio, dip):
    data = fig2.compute(POSTURE, WHISKER, width, SCAN)
    found = data.mode_jump.sel(form="exact") / data.mode_jump.sel(form="linear")
    np.testing.assert_allclose(found, ratio, atol=6e-4)  # three digits were given
    turned = np.cos(np.arctan(data.attrs["dip_at_far_edge"] / width))  # the reference: a free end of length λ
    np.testing.assert_allclose(turned * data.attrs["dip_at_far_edge"], dip, atol=0.6e-6)
    assert ("more than the gap is deep" in data.attrs["caption"]) == (dip > data.attrs["gap_depth"])


def test_small_excursions_follow_the_linear_response(data):
    s = data.s.values >= 0.3
    near, far = (np.abs(data.stage_response.sel(stage=i) - data.unit_response)[s].max() for i in (2, 3))
    assert near < 0.02 * np.abs(data.unit_response[s]).max() < 0.2 * far


def test_profiles_all_along_the_gap_are_those_of_their_excursions(data):
    last = data.sizes["passage"] // 2
    np.testing.assert_allclose(data.passage_excursion[[last - 1, last]], data.stage_excursion[1:], rtol=1e-12)
    for passage, stage in ((last - 1, 2), (last, 3)):
        np.testing.assert_allclose(data.passage_response[passage], data.stage_response.sel(stage=stage), atol=1e-9)
    shaft = data.s.values >= data.attrs["contact"] + fig2.BESIDE
    off = np.abs(data.passage_response - data.unit_response)[:, shaft].max("s").values
    assert np.all(np.diff(off[:last]) > 0)  # the farther from the flat, the less linear
    assert np.all(np.diff(off[last:]) < 0)
    assert f"up to {100 * data.attrs['collapse_residual']:.0f} % of its largest" in data.attrs["caption"]


def test_the_caption_says_where_the_paper_prints_another_sign(data):
    assert "Its slope is +v; the paper's caption prints −v" in data.attrs["caption"]


@pytest.mark.parametrize(("tip", "words"), [(0.05, "does not allow the jump to U₃"), (0.285, "allows the jump to U₃.")])
def test_the_caption_says_whether_the_free_end_allows_the_profile_after_the_jump(tip, words):
    short = Whisker(length=0.04, cone_angle=1.5e-3, tip=tip)
    data = fig2.compute(POSTURE, short, WIDTH, SCAN, n_modes=3)
    assert f"this free end {words}" in data.attrs["caption"]
    assert int(data.jumps_allowed) == (tip == 0.285)


def test_drawing_labels_every_axis(data):
    figure = fig2.draw(data)
    figure.savefig(io.BytesIO())  # a warning would be an error
    assert len(figure.axes) == 6
    for axis in figure.axes:
        assert axis.get_xlabel()
        assert axis.get_ylabel()
        assert axis.get_title(loc="left")
