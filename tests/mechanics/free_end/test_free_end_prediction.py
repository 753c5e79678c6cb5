"""The fast model with the free end: against a whole rod, in its limits, and by its own laws."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
from vibrissa.mechanics.free_end.phases import BRIDGE, FAR, FLOOR, LAND, NEAR
from vibrissa.mechanics.free_end.validity import chosen, limits
from vibrissa.mechanics.rod.rod_scan import drag
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker

POSTURE, HOW = Posture(contact=0.29, base_angle=1.2), Scan(speed=0.1, damping=0.11)
GAP = Gaps(np.array([0.0]), np.array([0.6e-3]), 35e-6)
TIME = np.arange(1000) / 2e4
NARROW = Gaps(np.array([0.0]), np.array([0.3e-3]), 35e-6)  # the mean gap of the map
HEIGHTS = HeightProfile(np.array([0.0, 1e-3]), np.zeros(2))


def cone(tip: float) -> Whisker:
    return Whisker(length=0.04, cone_angle=1.5e-3, tip=tip)


def moved(tip: float, texture: Gaps = GAP, posture: Posture = POSTURE, how: Scan = HOW) -> FreeEndPrediction:
    return FreeEndPrediction(cone(tip), posture, texture, how)


@pytest.mark.parametrize(
    ("tip", "rod"), [(0.289, 1.28), (0.285, 0.82), (0.28, 0.28), (0.27, 0.036), (0.25, 0.036), (0.15, 0.034)]
)
def test_one_gap_as_another_rod_of_equal_elements_has_it(tip, rod):
    """Largest |q₁ + Q₁| in 10⁻³ L; around s = 0.28 a fraction of that rod's cells of 0.009 L is a tenth of it."""
    largest = 1e3 * np.abs(moved(tip).mode_displacement(TIME)[0]).max()
    assert largest == pytest.approx(rod, rel=0.2 if tip == 0.28 else 0.15 if tip > 0.28 else 0.03)


def test_one_gap_as_the_rod_has_it():
    """Largest |q₁ + Q₁| of docs/validation.md, cells and steps halved."""
    for tip, rod in ((0.289, 1.24), (0.285, 0.765), (0.28, 0.236), (0.27, 0.0355), (0.25, 0.0354), (0.15, 0.0341)):
        assert 1e3 * np.abs(moved(tip).mode_displacement(TIME)[0]).max() == pytest.approx(rod, rel=0.07)


def test_a_free_end_longer_than_the_gap_bridges_it_and_a_shorter_one_drops_when_it_ends():
    bridging, dropping = moved(0.27), moved(0.28)
    assert set(bridging.phases.support) == {LAND, FAR, BRIDGE}
    first = int(np.flatnonzero(dropping.phases.support == NEAR)[0])
    assert dropping.phases.start[first] * cone(0.28).timescale == pytest.approx(0.4e-3 / 0.1)  # f/v
    assert not bridging.jumps.any()
    assert dropping.jumps.all()


def test_the_longer_the_free_end_the_less_moves_and_the_single_contact_moves_most():
    largest = [np.abs(moved(tip).mode_displacement(TIME)[0]).max() for tip in (0.289, 0.285, 0.28, 0.27)]
    single = np.abs(predict(cone(0.289), POSTURE, GAP, HOW).mode_displacement(TIME)[0]).max()
    assert all(np.diff([single, *largest]) < 0)


def test_motion_is_continuous_from_support_to_support():
    """What the modes keep of it: on each support they are cut off at the tenth."""
    prediction = moved(0.285, random_grating(0.02, rng=3))
    borders = prediction.phases.start[1:] * cone(0.285).timescale
    before, after = (
        np.stack([prediction.mode_displacement(np.array([t + e]))[:, 0] for t in borders]) for e in (-1e-9, 1e-9)
    )
    size = prediction.mode_displacement(np.arange(0, 0.2, 1e-4)).std(axis=1)
    assert np.all(np.abs(after - before)[:, :2] < 0.02 * size[:2])


def test_it_is_the_same_at_any_times():
    prediction = moved(0.28)
    few = np.sort(np.random.default_rng(0).choice(len(TIME), 40, replace=False))
    whole = prediction.mode_displacement(TIME)
    np.testing.assert_allclose(prediction.mode_displacement(TIME[few]), whole[:, few], atol=1e-12)


def test_a_whisker_of_twice_the_size_does_the_same_in_twice_the_time():
    """Lengths over L and times over k ~ L (of one cone angle), at the same speed; the march steps in seconds."""
    large = Whisker(length=0.08, cone_angle=1.5e-3, tip=0.28)
    gap = Gaps(2 * GAP.position, 2 * GAP.width, 2 * GAP.depth)
    found = FreeEndPrediction(large, POSTURE, gap, HOW).mode_displacement(2 * TIME)
    usual = moved(0.28).mode_displacement(TIME)
    np.testing.assert_allclose(found, usual, rtol=0, atol=0.01 * np.abs(usual).max())


def test_a_deep_gap_has_no_floor():
    wide = Gaps(np.array([0.0]), np.array([1.2e-3]), 35e-6)
    deep = Gaps(wide.position, wide.width, 5e-3)
    assert FLOOR in moved(0.285, wide).phases.support
    assert FLOOR not in moved(0.285, deep).phases.support


def test_sampled_says_what_the_free_end_allows():
    texture = Gaps(np.array([1e-3, 3e-3, 5e-3]), np.array([0.05e-3, 0.2e-3, 0.65e-3]), 35e-6)
    data = moved(0.275, texture).sampled(5e3, nodes=[5e-3, 20e-3])
    assert (int(data.jump_count), int(data.jumps_allowed)) == (3, 1)
    assert data.attrs["verdict"].startswith(
        "usable: fast model of a straight whisker with its free end, which allows 1 of 3 jumps"
    )
    assert np.all(np.isfinite(data.envelope))
    assert 0 < float(data.bridge_share) < 1
    assert (
        np.ptp(data.displacement.values[:, 1]) > np.ptp(data.displacement.values[:, 0]) > 0
    )  # 5 mm from the base moves less


def test_a_whisker_without_a_tip_is_asked_for_one():
    verdict = moved(0.0, GAP).sampled(5e3).attrs["verdict"]
    assert "no tip was given" in verdict


def test_outside_its_region_it_names_the_rod():
    steep = Posture(contact=0.29, base_angle=1.4)
    verdict = moved(0.289, GAP, steep).sampled(5e3).attrs["verdict"]
    assert verdict.startswith("outside the model: ")
    assert "the model needed is the rod" in verdict.partition(";")[0]


def test_auto_takes_the_free_end_for_gaps_and_the_single_contact_for_heights():
    assert chosen(POSTURE, GAP) == "free-end"
    assert chosen(POSTURE, HEIGHTS) == "modes"
    assert chosen(Posture(contact=0.29, base_angle=1.2, adhesion=0.1), GAP) == "modes"


def test_deep_and_wide_gaps_are_outside_unless_they_are_bridged():
    deep, wide = Gaps(NARROW.position, NARROW.width, 1e-3), Gaps(NARROW.position, 2 * NARROW.width, 35e-6)
    assert limits(cone(0.28), POSTURE, deep, HOW) == ["gaps are deeper than 50 µm"]
    assert limits(cone(0.15), POSTURE, deep, HOW) == []
    assert limits(cone(0.15), POSTURE, wide, HOW) == ["mean gap 0.015 L is above 0.009 L"]


@pytest.mark.parametrize(
    ("tip", "angle", "reason"),
    [(0.27, 1.2, ""), (0.15, 1.5, ""), (0.289, 1.2, "base angle"), (0.28, 1.4, "base angle")],
)
def test_the_longer_the_free_end_the_steeper_it_may_be(tip, angle, reason):
    found = limits(cone(tip), Posture(contact=0.29, base_angle=angle), NARROW, HOW)
    assert [reason in one for one in found] == [True] * bool(reason)


@pytest.mark.parametrize("length", [0.008, 0.04])
def test_a_denser_whisker_scanned_as_much_more_slowly_moves_alike(length):
    """ρ four times larger doubles k: at half the speed it is the same problem, step by step."""
    texture = random_grating(0.01, rng=np.random.default_rng(1), mean_period=0.18e-3, smallest=2e-5)
    light, dense = (
        Whisker(length=length, cone_angle=3e-3, tip=0.285, density=density) for density in (1140.0 / 16, 1140.0 / 4)
    )
    posture = Posture(contact=0.29, base_angle=0.8)
    fast = FreeEndPrediction(light, posture, texture, Scan(speed=0.2, damping=0.11)).mode_displacement(TIME)
    slow = FreeEndPrediction(dense, posture, texture, Scan(speed=0.1, damping=0.11)).mode_displacement(2 * TIME)
    np.testing.assert_allclose(fast, slow, rtol=0, atol=1e-9 * np.abs(slow).max())


def test_steps_of_an_ordinary_whisker_are_those_of_its_validation():
    course, k = moved(0.285)._course(), cone(0.285).timescale
    assert (course.step * k, course.wait * k, course.look * k) == pytest.approx((4e-4, 1e-4, 1e-3), rel=1e-12)


def small(length: float, angle: float, tip: float, base_angle: float) -> FreeEndPrediction:
    texture = random_grating(0.03, rng=np.random.default_rng(1))
    whisker = Whisker(length=length, cone_angle=angle, tip=tip)
    return FreeEndPrediction(whisker, Posture(contact=0.29, base_angle=base_angle), texture, HOW)


def test_gaps_too_wide_to_be_bridged_are_refused():
    """Whiskers C6 and E6 of the atlas over gaps of a fifth to a third of their length."""
    with refusal("range", "gap at 0.01424 m", value="0.00103 m, 0.22 of the whisker's length"):
        _ = small(0.0046375, 0.00571429, 0.0943396, 0.8).phases
    with refusal("range", "scan", value="one beyond the whisker's length; the widest gap is 0.00154 m"):
        _ = small(0.00661573, 0.00695312, 0.28, 1.2).phases


def test_a_gap_that_the_tip_drops_into_before_its_bridge_loses_balance_is_computed():
    """An eighth of L, at a contact where beyond the tip there would be no balance; as the whole rod has it."""
    whisker, posture = Whisker(length=0.04, cone_angle=1.2e-3, tip=0.05), Posture(contact=0.12, base_angle=1.2)
    gap = Gaps(np.array([5e-3]), np.array([5e-3]), 3e-3)
    found = FreeEndPrediction(whisker, posture, gap, HOW).sampled(4e3)
    rod = drag(whisker, posture, gap, speed=0.1, damping=0.11, duration=0.2, sampling_rate=4e3)
    curvature = rod.record.moment / whisker.length
    assert np.ptp(found.base_curvature.values) == pytest.approx(np.ptp(curvature), rel=0.4)  # the turn is 2 rad


def test_other_surfaces_and_laws_are_refused():
    with pytest.raises(InputError, match="must be gaps"):
        moved(0.28, HEIGHTS)
    with pytest.raises(InputError, match="Coulomb's friction"):
        moved(0.28, GAP, Posture(contact=0.29, base_angle=1.2, adhesion=0.1))
    with pytest.raises(InputError, match="beyond the whisker's tip"):
        moved(0.3)


@pytest.mark.parametrize(("tip", "least"), [(0.15, 0.99), (0.28, 0.97)])
def test_a_random_grating_as_the_rod_feels_it(tip, least):
    texture = random_grating(0.03, rng=1)
    run = drag(cone(tip), POSTURE, texture, speed=0.1, damping=0.11, duration=0.3, sampling_rate=5e3)
    found = moved(tip, texture).mode_displacement(run.time)
    for k in (0, 1):
        one, other = (analytic_envelope(q[None])[0][0] for q in (run.mode_displacement[k], found[k]))
        assert np.corrcoef(one, other)[0, 1] > least
        assert found[k].std() == pytest.approx(run.mode_displacement[k].std(), rel=0.1)


@pytest.mark.parametrize("tip", [0.285, 0.28, 0.26])
def test_an_edge_that_bears_carries_the_contact_at_the_speed_of_the_surface(tip):
    found = moved(tip, random_grating(0.03, rng=1))
    starts = np.append(found.phases.start * found.whisker.timescale, np.inf)
    time, free_end, widest = found.times(2e4), found.free_end, found.texture.width.max() / found.whisker.length
    excursion, phase = found.excursion(time), np.searchsorted(starts, time, "right") - 1
    bears = np.isin(found.phases.support[phase], (FAR, BRIDGE, NEAR, FLOOR))
    same = bears[1:] & (np.diff(phase) == 0)
    speed = found.scan.speed / found.whisker.length
    np.testing.assert_allclose(np.diff(excursion)[same], np.diff(time)[same] * speed, rtol=1e-6)
    on_far = found.phases.support[phase] == FAR
    assert np.abs(excursion[on_far]).max() <= 1.01 * free_end
    assert -1.01 * widest <= excursion.min() < excursion.max() <= 1.01 * free_end
