"""A whole whisker whose base moves: in the air, pressed slowly, over gaps, onto an object and off it again."""

from itertools import pairwise

import numpy as np
import pytest
from refusals import refusal
from rods import cone

from vibrissa.mechanics.modes.straight import resonances
from vibrissa.mechanics.rod.free_rod import free_damping
from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.scan.follicle import force_unit
from vibrissa.mechanics.scan.gap_report import held_profile
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.active_whisking import predict_slow
from vibrissa.mechanics.whisking.base_path import BasePath, read_base_path
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.mechanics.whisking.swing import swing
from vibrissa.mechanics.whisking.swing_prediction import SwingPrediction, contact_events
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps

FLAT = Gaps(np.array([10.0]), np.array([1e-4]))  # its gap is never met
TALL = 1.3  # a height at which nothing touches, over L


def raised(low, high, ramp, time):
    """From one value to another by half a cosine, beginning and ending at rest."""
    first, last = ramp
    return low + (high - low) * (0.5 - 0.5 * np.cos(np.pi * np.clip((time - first) / (last - first), 0, 1)))


def in_air(angle, time, **more):
    return BasePath(time=time, base_angle=angle, base_distance=np.full(time.size, TALL), **more)


def balance(path, step, **more):
    """Largest part of the work at the base and of the ground that is neither stored nor dissipated, over the store."""
    whisker = cone(0.25)
    how = {"speed": 0.05, "damping": 0.11, "sampling_rate": 1 / step, "settings": Rod(step=step, tolerance=1e-13)}
    record = swing(whisker, path, FLAT, **how, **more).record
    kinetic, elastic, power, ground, base, friction = record.energy
    stored = kinetic + elastic + record.contact[6]
    viscous = np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2)]) * step / whisker.timescale
    left = (ground + base - stored - friction) - (ground + base - stored - friction)[0] - viscous
    return np.abs(left).max() / np.ptp(stored)


def test_the_work_of_a_moving_base_is_kinetic_elastic_or_dissipated():
    time = np.linspace(0, 0.15, 151)
    turn = 0.9 + 0.3 * np.cos(2 * np.pi * 8 * time)
    assert balance(in_air(turn, time, travel=2e-3 * np.sin(2 * np.pi * 5 * time)), 25e-6) < 2e-6


def test_energy_is_balanced_ever_better_with_the_step_where_a_swing_strikes_the_ground():
    time = np.linspace(0, 0.12, 121)
    path = BasePath(
        time=time, base_angle=np.full(121, 1.1), base_distance=raised(0.8, 0.5, (0.01, 0.1), time)
    )  # fmt: skip
    coarse, fine = balance(path, 50e-6), balance(path, 12.5e-6)
    assert coarse < 0.15
    assert fine < 0.5 * coarse


def test_a_whisker_rings_in_the_air_as_the_free_cone_does():
    time = np.linspace(0, 0.4, 401)
    path = in_air(raised(1.0, 1.02, (0.0, 0.02), time), time)
    found = SwingPrediction(cone(0.2), path, FLAT, 0.0, 0.03, about="air").sampled(20e3)
    expected = resonances(cone(0.2), 0.2, 3, boundary="free").resonant_frequency.values
    late = found.time.values > 0.06  # the second mode is gone
    time, moment = found.time.values[late], found.base_moment.values[late]
    rises = np.flatnonzero((moment[:-1] < 0) & (moment[1:] >= 0))
    zeros = time[rises] - moment[rises] * np.diff(time)[0] / (moment[rises + 1] - moment[rises])
    assert zeros.size > 10
    assert 1 / np.diff(zeros).mean() == pytest.approx(expected[0] * np.sqrt(1 - 0.03**2), rel=1e-3)
    np.testing.assert_allclose(found.free_frequency, expected, rtol=7e-3)
    peaks = [moment[first:last].max() for first, last in pairwise(rises)]
    decay = -np.polyfit(zeros[:-1], np.log(peaks), 1)[0]
    assert decay / (2 * np.pi * expected[0]) == pytest.approx(0.03, rel=0.01)
    assert (found.contact_state == 0).all()
    assert found.contact_event.size == 0


def test_without_contact_the_follicle_bears_the_inertia_of_the_shaft():
    time = np.linspace(0, 1.0, 1001)
    turn = 2 * np.pi * time
    found = SwingPrediction(cone(0.25), in_air(0.9 + 0.2 * np.sin(turn), time), FLAT, 0.0, 0.11).sampled(1e3)
    late = found.time.values > 0.2  # what the beginning rings of is gone
    turn = 2 * np.pi * found.time.values[late]
    spin, faster = 0.4 * np.pi * np.cos(turn), -0.8 * np.pi**2 * np.sin(turn)
    s = np.linspace(0.25, 1, 20001)
    first, second = np.trapezoid(s**2 * (1 - s), s), np.trapezoid(s**2 * (1 - s) ** 2, s)
    unit, k = force_unit(cone()), cone().timescale
    for name, expected in (
        ("base_moment", unit * cone().length * k**2 * second * faster),
        ("transverse_force", unit * k**2 * first * faster),
        ("axial_force", -unit * k**2 * first * spin**2),
    ):
        assert np.abs(found[name].values[late] - expected).max() < 0.02 * np.abs(expected).max()


def test_a_slow_press_goes_through_the_postures_of_equation_1():
    time = np.linspace(0, 0.6, 121)
    height = raised(0.51, 0.45, (0.1, 0.5), time)
    path = BasePath(time=time, base_angle=np.full(121, 1.2), base_distance=height)
    whisker = cone(0.2)
    found = SwingPrediction(whisker, path, FLAT, 0.1, 0.11).sampled(1e3)
    assert found.attrs["begins"] == "at rest"
    for i in (50, 250, 300, 350, 590):
        posture = Posture.at_height(float(found.moment_base_height[i]) / whisker.length, 1.2)
        expected = held_profile(posture, whisker=whisker)
        for ours, theirs in (
            ("base_moment", expected.static_moment),
            ("transverse_force", expected.static_transverse_force),
            ("axial_force", expected.static_axial_force),
        ):
            assert float(found[ours][i]) == pytest.approx(float(theirs), rel=3e-3)
        assert 1 - float(found.first_contact[i]) / whisker.length == pytest.approx(posture.contact, abs=4e-3)
    assert (found.contact_state == 1).all()


def test_a_path_that_stays_is_the_scan_of_a_held_posture():
    posture, surface = Posture(contact=0.29, base_angle=1.2), Gaps(np.array([2e-3]), np.array([0.4e-3]))
    time = np.linspace(0, 0.06, 7)
    height = float(on_the_flat(posture).base[1])
    path = BasePath(time=time, base_angle=np.full(7, 1.2), base_distance=np.full(7, height))
    ours = SwingPrediction(cone(0.289), path, surface, 0.1, 0.11).sampled(5e3)
    theirs = RodPrediction(cone(0.289), posture, surface, Scan(speed=0.1, damping=0.11)).sampled(5e3)
    count = 250
    one, other = ours.base_moment.values[:count], theirs.base_moment.values[:count]
    assert np.abs(one - other).max() < 0.03 * np.ptp(other)  # another mesh and tolerance
    assert {"bridge", "slip"} >= set(ours.contact_event_kind.values) - {"attach", "detach", "stick"}


def test_over_gaps_the_single_contact_is_the_limit_of_a_short_free_end():
    time = np.linspace(0, 0.3, 61)
    angle, height = 0.8 + 0.004 * np.sin(2 * np.pi * 4 * time), np.full(61, 0.41)
    surface = Gaps(np.array([5e-3, 12e-3]), np.array([0.2e-3, 0.2e-3]))
    slow = PosturePath(time=time, base_angle=angle, base_distance=height)
    contacts = [slow.at(t).contact for t in time]
    whisker = cone(min(contacts) - 2.5e-3)
    single = predict_slow(whisker, slow, surface, Scan(speed=0.1, damping=0.11))
    found = SwingPrediction(whisker, BasePath.of(slow), surface, 0.1, 0.11).sampled(5e3)
    ours, theirs = found.base_curvature.values, single.base_curvature(found.time.values)
    assert np.corrcoef(ours, theirs)[0, 1] > 0.9
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)


def onto_a_ridge(**more):
    """A whisker that is lowered onto a ridge from the air, swept over it and taken off again."""
    x = np.linspace(-4e-3, 4e-3, 161)
    ridge = HeightProfile(x, 1e-3 * np.cos(np.pi * x / 8e-3) ** 2)
    time = np.linspace(0, 0.25, 126)
    height = np.where(time < 0.125, raised(1.0, 0.62, (0.0, 0.08), time), raised(0.62, 1.0, (0.17, 0.25), time))
    path = BasePath(
        time=time, base_angle=np.full(126, 1.1), base_distance=height, travel=raised(0.0, 8e-3, (0.05, 0.2), time)
    )
    return SwingPrediction(cone(0.1), path, ridge, 0.0, 0.11, **more)


def test_a_whisker_lands_on_a_ridge_sweeps_it_and_leaves():
    found = onto_a_ridge(surface_distance=0.4 * 0.04 + 4e-3).sampled(4e3)
    kinds = found.contact_event_kind.values
    assert found.attrs["begins"] == "in the air"
    assert kinds[0] == "attach"
    assert kinds[-1] == "detach"
    touching = found.contact_state.values > 0
    assert touching.any()
    assert not touching[0]
    assert not touching[-1]
    np.testing.assert_array_equal(np.isfinite(found.first_contact), touching)
    assert (found.last_contact >= found.first_contact).values[touching].all()
    assert found.contact_load.values[~touching].max() < 1e-2 * found.contact_load.values.max()
    middle = (found.time.values > 0.09) & (found.time.values < 0.16)
    assert found.base_moment.values[middle].min() > 0  # the ground bends it as a pressed one
    assert found.attrs["verdict"].startswith("usable")
    assert float(found.unconverged_share) == 0


def test_how_much_of_a_swing_misses_the_surface_is_counted():
    found = onto_a_ridge(surface_distance=0.4 * 0.04 + 4e-3).sampled(4e3)
    place, ridge = found.contact_ground.values, onto_a_ridge().texture
    touching = place[np.isfinite(place)]
    missed = (touching < ridge.position[0]).sum() + (touching > ridge.position[-1]).sum()
    assert found.attrs["beside_surface"] == pytest.approx(missed / touching.size)
    assert 0.1 < found.attrs["beside_surface"] < 1


def test_damping_holds_in_the_state_that_was_asked_for():
    contact, air = (onto_a_ridge(about=about).run(200.0).rod for about in ("contact", "air"))
    np.testing.assert_allclose(free_damping(air).ratio, 0.11, rtol=1e-3)
    assert free_damping(contact).ratio[0] > 0.15  # a free mode is slower, so that the part by mass counts more
    assert contact.damping.mass > air.damping.mass


def test_events_are_the_changes_of_the_contacts():
    found = contact_events(np.arange(8) / 10, np.array([0, 1, 1, 2, 3, 0, 0, 3]), np.arange(8.0))
    assert list(found["contact_event_kind"]) == ["attach", "stick", "bridge", "detach", "attach"]
    np.testing.assert_allclose(found["contact_event_time"], [0.1, 0.3, 0.4, 0.5, 0.7])
    np.testing.assert_array_equal(found["contact_event_moment"], [1, 3, 4, 5, 7])


def test_a_swing_begins_in_the_air_or_at_rest_on_level_ground():
    time = np.array([0.0, 0.1])
    cases = (
        (0.3, 0.31, -30.0, "must begin in the air or at an equilibrium"),  # it bends down to where no straight one is
        (1.2, 0.6, 0.0, "the tip alone"),
    )
    for angle, height, curvature, rule in cases:
        path = BasePath(time=time, base_angle=np.full(2, angle), base_distance=np.full(2, height))
        with refusal("range", "BasePath") as caught:
            swing(cone(0.28), path, FLAT, damping=0.11, sampling_rate=1e3, settings=Rod(intrinsic_curvature=curvature))
        assert rule in str(caught.value)
    held = BasePath(time=time, base_angle=np.full(2, 1.2), base_distance=np.full(2, 0.46))
    with refusal("range", "BasePath", "uneven ground"):
        gap = Gaps(np.array([1e-3]), np.array([0.4e-3]))
        swing(cone(0.28), held, gap, damping=0.11, sampling_rate=1e3, surface_distance=0.0204)


def test_paths_are_read_with_heights_or_contacts_and_travel(tmp_path):
    table = tmp_path / "path.csv"
    table.write_text("time,base_angle,base_distance,travel_mm\n0,1.1,0.9,0\n0.1,1.0,0.8,2\n")
    path = read_base_path(table)
    np.testing.assert_allclose(path.travel, [0, 2e-3])
    table.write_text("time,base_angle,contact\n0,1.2,0.29\n0.1,1.2,0.3\n")
    expected = on_the_flat(Posture(contact=0.29, base_angle=1.2)).base[1]
    assert read_base_path(table).base_distance[0] == pytest.approx(expected)
    table.write_text("time,base_angle\n0,1.2\n0.1,1.2\n")
    with refusal("missing", str(table)):
        read_base_path(table)


@pytest.mark.parametrize(
    ("name", "value"), [("base_angle", [1.0, 1.7]), ("base_distance", [0.5, -0.1]), ("travel", [0.0, np.inf])]
)
def test_a_place_of_the_base_out_of_range_is_named_with_its_time(name, value):
    given = {"base_angle": [1.0, 1.0], "base_distance": [0.5, 0.5], name: value}
    with refusal("range", f"BasePath.{name} at 0.3 s"):
        BasePath(time=[0.0, 0.3], **given)
