"""Figure 1: Eq. 1 lies on the profile and finds the contact; the paper's polynomial, without taper, misses it."""

import io

import numpy as np
import pytest

from vibrissa.figures.paper import fig1
from vibrissa.mechanics.inverse.stationary_posture import fit_profile
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.quantities import dataset
from vibrissa.study.sweeps.sweep_table import sweep_table
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
CONTACT, ANGLE, TURN = 0.29, 1.2, 0.5


@pytest.fixture(scope="module")
def profile():
    rng = np.random.default_rng(0)
    arc = np.arange(0, (1 - CONTACT) * WHISKER.length - 3e-3, 116e-6)
    still = stationary_profile(Posture(contact=CONTACT, base_angle=ANGLE), 1 - arc / WHISKER.length)
    z = (still.profile_x.values + 1j * still.profile_y.values) * WHISKER.length * np.exp(1j * TURN)
    y = -z.imag + 5e-6 * rng.standard_normal((200, arc.size))
    x = np.tile(z.real, (200, 1))
    return dataset(time=np.arange(200) / 2000, x=x, y=y, y_sd=np.full(y.shape, 5e-6), arc_length=arc)


@pytest.fixture(scope="module")
def data(profile):
    return fig1.compute(profile, fit_profile(profile, WHISKER), WHISKER, contact_true=CONTACT)


def test_the_curve_lies_on_the_mean_profile(data):
    assert np.sqrt(np.mean(data.course_residual.values**2)) < 2e-6  # [m], 5 µm over √200 and chords of the curve
    assert data.attrs["contact"] == pytest.approx(CONTACT, abs=3e-3)
    assert data.attrs["profile_r2"] > 0.99


def test_angles_of_profile_and_curve_agree_and_vanish_at_the_contact(data):
    known = np.isfinite(data.course_angle.values)
    curve = np.interp(data.course_s.values[known], data.s, data.angle)
    np.testing.assert_allclose(data.course_angle.values[known], curve, atol=0.02)
    assert float(data.angle[0]) == pytest.approx(0, abs=2e-3)
    assert float(data.angle[-1]) == pytest.approx(ANGLE, abs=0.03)


def test_the_polynomial_leaves_the_visible_end_along_it_and_misses_the_contact(data):
    start = np.interp(data.parabola_s.values[0], data.s, data.angle)
    assert float(data.parabola_angle[0]) == pytest.approx(float(start), abs=0.03)
    assert float(data.parabola_angle[-1]) == pytest.approx(0, abs=1e-9)
    assert data.attrs["contact_parabola"] - CONTACT > 0.01
    assert "nearer the base" in data.attrs["caption"]


def test_cones_of_one_rat_go_through_the_diameters_measured_and_vanish_at_their_length(data):
    assert list(data.cone.values) == ["beta", "C1", "C2"]
    assert data.cone_diameter.values[1].tolist() == [220e-6, 6e-6]  # C1 of Hartmann et al. 2003, their Table 1
    fallen = data.cone_base.values[:, None] * (1 - data.cone_distance.values / data.cone_length.values[:, None])
    np.testing.assert_allclose(data.cone_diameter.values, fallen, rtol=1e-4)  # L has six digits there


def test_diameters_of_a_user_are_drawn_with_their_own_lines(profile):
    x = np.linspace(0, 0.03, 7)
    mine = dataset(distance=x, diameter=120e-6 * (1 - x / 0.045))
    short = dataset(distance=x[:4], diameter=100e-6 * (1 - x[:4] / 0.035))
    data = fig1.compute(profile, fit_profile(profile, WHISKER), WHISKER, diameters={"mine": mine, "short": short})
    np.testing.assert_allclose(data.cone_length, [0.045, 0.035])
    assert np.isnan(data.cone_diameter.values[1, 4:]).all()


def test_it_is_drawn(data, profile):
    picture = io.BytesIO()
    fig1.draw(data).savefig(picture)
    assert picture.tell() > 10_000


def test_one_sweep_of_each_whisker_is_shown_with_its_curve(profile, data):
    def series(number):
        place = stationary_profile(Posture(contact=0.2 + number / 100, base_angle=1.0), np.linspace(0.3, 1, 50))
        x, y = (0.05 * place[f"profile_{way}"].values for way in "xy")
        at = stationary_profile(Posture(contact=0.2 + number / 100, base_angle=1.0), np.array([0.2 + number / 100]))
        return dataset(course_along=x - 0.05 * float(at.profile_x[0]), course_height=y - 0.05 * float(at.profile_y[0]))

    rows = [
        {"animal": "a", "whisker_name": name, "texture": 0, "condition": 0, "run": 0, "length": 0.05,
         "contact": 0.2 + k / 100, "base_angle": 1.0, "profile_r2": 0.9, "accepted": k != 1, "rejected": ""}
        for k, name in enumerate(["C1", "beta", "beta", "C1"])
    ]  # fmt: skip
    more = fig1.compute(profile, fit_profile(profile, WHISKER), WHISKER, sweeps=sweep_table(rows), series=series)
    assert more.other.values.tolist() == ["C1", "beta"]
    np.testing.assert_allclose(more.other_contact, [0.2, 0.22])
    for k in range(2):  # the nodes lie on the curve of their own posture
        height = np.interp(more.other_course_x[k], more.other_fitted_x[k], more.other_fitted_y[k])
        np.testing.assert_allclose(height, more.other_course_y[k], atol=5e-6)
    assert "one sweep of each whisker (C1 ε = 0.200, R² = 0.90; β" in more.attrs["caption"]
    assert "One whisker is followed" in data.attrs["caption"]
    assert len(fig1.draw(more).axes) == 5
