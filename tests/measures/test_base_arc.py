"""Direction and curvature at the base: exact on circles, second order on others, with the deviation that they state."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from real_data import real
from refusals import refusal
from simulated_whiskers import RATE, circle_profile, profile_of

from vibrissa.measures.base_arc import fit_base_arc
from vibrissa.measures.face import Face
from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
from vibrissa.video.foreign.whisk_files import read_measurements, read_whiskers


def fitted(profile, nodes=21, **sds):
    sd = {"x_sd": None, "y_sd": None} | sds
    x, y = profile.x.values[0, :, :nodes], profile.y.values[0, :, :nodes]
    return fit_base_arc(profile.arc_length.values[0, :nodes], x, y, **sd)


@settings(deadline=None)
@given(direction=st.floats(-3.1, 3.1), curvature=st.floats(-150, 150))
def test_circles_are_recovered_exactly(direction, curvature):
    # 5 mm at 150/m turn by 43°
    found = fitted(circle_profile([direction], curvature))
    assert np.angle(np.exp(1j * (found.direction[0] - direction))) == pytest.approx(0, abs=1e-8)
    assert found.curvature[0] == pytest.approx(curvature, abs=1e-5)


def test_hidden_first_nodes_do_not_move_the_base():
    profile = circle_profile([0.3, 0.3], 60.0)
    profile.x.values[0, 1, :8] = np.nan
    found = fitted(profile, y_sd=np.full((2, 21), 1e-5))
    assert found.direction[1] == pytest.approx(0.3, abs=1e-8)
    assert found.direction_sd[1] > 2 * found.direction_sd[0]


def test_too_little_of_the_part_is_not_measured():
    profile = circle_profile([0.3], 60.0)
    profile.x.values[0, 0, :11] = np.nan
    assert all(np.isnan(one).all() for one in fitted(profile))


def test_standard_deviations_are_those_of_repeated_noise():
    noise = 1e-5 * np.random.default_rng(1).standard_normal((3000, 41))
    profile = circle_profile(np.full(3000, 0.4), 30.0)
    profile.y.values[0] += noise
    found = fitted(profile, y_sd=np.full((3000, 21), 1e-5))
    # of 3000 draws a standard deviation is known to 1.3 %
    assert found.direction.std() == pytest.approx(found.direction_sd.mean(), rel=0.05)
    assert found.curvature.std() == pytest.approx(found.curvature_sd.mean(), rel=0.05)
    # across the shaft, less the three parameters
    assert found.misfit.mean() == pytest.approx(1e-5 * np.cos(0.45) * np.sqrt(18 / 21), rel=0.05)
    assert found.direction.mean() == pytest.approx(0.4, abs=5 * found.direction_sd[0] / np.sqrt(3000))
    # nodes that scatter by chance are taken for more than their error in one frame of a thousand; of 3,000, in 3 ± 1.7
    assert (found.excess > 1).sum() <= 9


def along_a_hair(frames, bent=0.5e-3, sd=1e-5):
    """A straight shaft whose first 2 mm were followed along a hair that leaves it by ``bent``, and noise of ``sd``."""
    profile = circle_profile(np.full(frames, 0.4), 0.0)
    off = bent * np.clip(1 - profile.arc_length.values / 2e-3, 0, None)
    off = off + sd * np.random.default_rng(4).standard_normal((frames, 41))
    profile.x.values[0] -= off * np.sin(0.4)
    profile.y.values[0] += off * np.cos(0.4)
    return profile


def test_a_hair_at_the_base_enlarges_the_standard_deviations():
    profile = along_a_hair(300)
    sds = {name: np.full((300, 21), 1e-5) for name in ("x_sd", "y_sd")}
    found = fitted(profile, **sds)
    clean = fitted(circle_profile(np.full(300, 0.4), 0.0), **sds)
    factor = found.misfit / 1e-5 * np.sqrt(21 / 18)
    np.testing.assert_allclose(found.excess, factor, rtol=1e-3)
    np.testing.assert_allclose(found.direction_sd, factor * clean.direction_sd, rtol=0.03)
    np.testing.assert_allclose(found.curvature_sd, factor * clean.curvature_sd, rtol=0.03)
    np.testing.assert_array_equal(fitted(profile).excess, 1)  # nothing is known of the nodes' error


def test_whiskers_whose_base_part_is_no_arc_are_named_with_another_part():
    hair, clean = along_a_hair(100), circle_profile(np.full(100, 0.4), 20.0, base=(0.0, 2e-3))
    x, y = (np.concatenate([one[name].values for one in (hair, clean)]) for name in ("x", "y"))
    profile = profile_of(hair.arc_length.values[0], x, y, sd=1e-5)
    down = Face(caudal=(0.0, 1.0), rostral=(0.0, 0.0))
    lines = json.loads(kinematics_of(profile, KinematicsSettings(face=down)).attrs["remarks"])
    said = [line for line in lines if "base part" in line]
    assert len(said) == 1
    assert "of the whisker labelled 2 is no arc within the error of its nodes in 98 % of the frames or more" in said[0]
    assert said[0].endswith("measure farther out, for example from 0.83 to 3.3 mm (`base_part`)")
    farther = json.loads(kinematics_of(profile, KinematicsSettings(face=down, base_part=(2e-3, 8e-3))).attrs["remarks"])
    assert not any("base part" in line for line in farther)


def test_nodes_without_a_standard_deviation_do_not_count_where_others_have_one():
    noise = 1e-5 * np.random.default_rng(2).standard_normal((2000, 41))
    profile = circle_profile(np.full(2000, 0.4), 30.0)
    profile.y.values[0] += noise
    profile.y.values[0, :, 5] += 1e-3  # far off, and nothing is known of its error
    sd = np.full((2000, 21), 1e-5)
    sd[:, 5] = np.nan
    found = fitted(profile, y_sd=sd)
    assert found.direction.std() == pytest.approx(found.direction_sd.mean(), rel=0.06)
    assert found.direction.mean() == pytest.approx(0.4, abs=5 * found.direction_sd[0] / np.sqrt(2000))
    sd[7, 2:] = np.nan  # two are left: its error is not known, where that of others is
    assert np.flatnonzero(np.isnan(fitted(profile, y_sd=sd).direction)).tolist() == [7]
    assert np.isfinite(fitted(profile).direction).all()


def test_a_direction_that_nodes_do_not_determine_is_not_measured():
    profile = circle_profile([0.4, 0.4], 30.0)
    sd = np.full((2, 21), 1e-5)
    sd[1] = 5e-3  # as large as the part
    found = fitted(profile, y_sd=sd)
    assert np.isfinite(found.direction).tolist() == [True, False]
    assert np.isnan([one[1] for one in found]).all()


def test_a_shaft_of_changing_curvature_costs_an_error_of_second_order():
    """An Euler spiral κ = κ0 + κ1 s: the arc's direction at the base is off by κ1 h²/12 of a part of length h."""
    kappa, growth = 20.0, 4000.0

    def error(length):
        arc = np.linspace(0, length, 41)
        fine = np.linspace(0, length, 8001)
        phi = kappa * fine + growth * fine**2 / 2
        x, y = (np.concatenate([[0], np.cumsum((f[1:] + f[:-1]) / 2) * fine[1]]) for f in (np.cos(phi), np.sin(phi)))
        nodes = (np.interp(arc, fine, one)[None] for one in (x, y))
        return fit_base_arc(arc, *nodes, None, None).direction[0]

    coarse, half = error(4e-3), error(2e-3)
    assert coarse / half == pytest.approx(4, rel=0.1)
    assert abs(coarse) == pytest.approx(growth * 4e-3**2 / 12, rel=0.25)


def whisk_rows(stem):
    """Give the long segments of a file of WHISK from the follicle, with WHISK's own angle [°], curvature and length."""
    table = {(row["frame"], row["wid"]): row["data"] for row in read_measurements(real(f"{stem}.measurements"))}
    for one in read_whiskers(real(f"{stem}.whiskers"))[::7]:
        length, _, angle, curvature, fx, fy, *_ = table[one.frame, one.wid]
        x, y = one.x, one.y
        if np.hypot(x[-1] - fx, y[-1] - fy) < np.hypot(x[0] - fx, y[0] - fy):
            x, y = x[::-1], y[::-1]
        arc = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        if length > 80 and np.diff(arc).max() < 2:
            yield arc, x, y, angle, curvature


@pytest.mark.parametrize("stem", ["tracks/test", "whiskiwrap-movies/test_video2"])
def test_angles_of_whisk_are_the_angles_to_a_face_along_the_columns(stem):
    """WHISK gives the tangent at the follicle of a cubic through the whole segment: the same curve, its first part."""
    # WHISK's convention is that of a face whose nose is at the top of the image, whiskers to the right
    face = Face(caudal=(0.0, 1.0), rostral=(0.0, 0.0))
    off = []
    for arc, x, y, angle, _ in whisk_rows(stem):
        t = arc / arc[-1]
        cubic = [np.polyfit(t, one, 3) for one in (x, y)]
        part = np.linspace(0, 0.04, 9)
        nodes = [np.polyval(one, part)[None] for one in cubic]
        along = np.concatenate([[0], np.cumsum(np.hypot(*(np.diff(one[0]) for one in nodes)))])
        found = face.angle(fit_base_arc(along, *nodes, None, None).direction, -1)
        off.append((np.degrees(found[0]) - angle + 90) % 180 - 90)
    assert len(off) > 200
    assert np.abs(off).max() < 1.0
    assert np.median(np.abs(off)) < 0.05


def test_curvatures_of_whisk_are_those_of_the_whole_segment():
    found, theirs = [], []
    for arc, x, y, _, curvature in whisk_rows("tracks/test"):
        found.append(fit_base_arc(arc, x[None], y[None], None, None).curvature[0])
        theirs.append(curvature)
    assert np.corrcoef(np.abs(found), np.abs(theirs))[0, 1] > 0.98
    assert np.median(np.abs(np.abs(found) - np.abs(theirs))) < 0.02 * np.median(np.abs(theirs))


def test_one_frame_of_a_longer_line_does_not_change_the_base_part_of_others():
    arc, time = np.linspace(0, 30e-3, 121), np.arange(200) / RATE
    direction = 0.1 - 0.3 * np.cos(2 * np.pi * 8 * time)
    x, y = np.cos(direction)[:, None] * arc, np.sin(direction)[:, None] * arc
    x[:, arc > 10e-3] = np.nan
    longer = x.copy()
    longer[50] = np.cos(direction[50]) * arc  # goes on as something else
    down = KinematicsSettings(face=Face(caudal=(0.0, 0.0), rostral=(0.0, 1.0)))
    usual, once = (kinematics_of(profile_of(arc, [one], [y]), down) for one in (x, longer))
    assert usual.attrs["base_part"] == pytest.approx([0.0, 2.5e-3])
    assert once.attrs["base_part"] == usual.attrs["base_part"]
    np.testing.assert_allclose(once.whisker_angle, usual.whisker_angle, atol=1e-9)


def test_few_keypoints_are_measured_over_three_of_them():
    """Five points on each whisker; a quarter of the length would hold two."""
    time, direction = np.arange(50) / RATE, 0.1 - 0.3 * np.cos(2 * np.pi * 8 * np.arange(50) / RATE)
    arc = np.linspace(0, 16e-3, 5)
    x, y = np.cos(direction)[:, None] * arc, np.sin(direction)[:, None] * arc
    profile = profile_of(arc, [x], [y])
    found = kinematics_of(profile, KinematicsSettings(face=Face(caudal=(0.0, 0.0), rostral=(0.0, 1.0))))
    assert found.sizes["time"] == time.size
    assert found.attrs["base_part"] == pytest.approx([0.0, 8e-3])
    np.testing.assert_allclose(found.whisker_angle[0], np.pi / 2 + direction, atol=1e-9)


@pytest.mark.parametrize("part", [(2e-3, 0.0), (0.0, 90e-3), (-1e-3, 2e-3), (2e-3, 2e-3)])
def test_a_base_part_that_is_none_or_ends_beyond_the_nodes_is_refused(part):
    arc = np.linspace(0, 16e-3, 33)
    profile = profile_of(arc, [np.tile(arc, (9, 1))], [np.zeros((9, arc.size))])
    with refusal("range", "base_part"):
        kinematics_of(profile, KinematicsSettings(face=Face(caudal=(0.0, 0.0), rostral=(0.0, 1.0)), base_part=part))
