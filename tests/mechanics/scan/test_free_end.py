"""Which jumps a free end allows, with a rod on the ground with its whole length as the witness; of any surface."""

import numpy as np
import pytest

from vibrissa.mechanics.scan.diagnostics import diagnostics, relief_diagnostics, relief_remarks, remarks
from vibrissa.mechanics.scan.free_end import free_end_facts, free_end_lines, relief_allows
from vibrissa.mechanics.scan.gap_report import crossing
from vibrissa.mechanics.scan.relief_prediction import predict_relief
from vibrissa.mechanics.scan.sampled import scanned_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.active_whisking import predict_slow
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker

POSTURE, SCAN = Posture(contact=0.29, base_angle=1.2), Scan(speed=0.1, damping=0.11)
GAP = Gaps(position=np.array([5e-3]), width=np.array([0.6e-3]))
TIME = np.arange(4000) / 20000
ROD = {  # a planar nonlinear rod in unilateral contact along its whole length: free end [mm], largest q₁ + Q₁ over L
    0.04: 1.28e-3,
    0.2: 0.82e-3,
    0.4: 0.28e-3,
    0.8: 0.036e-3,
    1.6: 0.036e-3,
    5.6: 0.034e-3,
}


def whisker(free_end):
    return Whisker(length=0.04, cone_angle=1.5e-3, tip=0.29 - free_end / 0.04)


@pytest.mark.parametrize(("free_end", "rod"), [(1e-3 * free, largest) for free, largest in ROD.items()])
def test_a_free_end_allows_the_jumps_that_a_whole_rod_makes(free_end, rod):
    """Allowed where the rod answers the gap with more than half of the model's jump, not where with less."""
    motion = predict(whisker(free_end), POSTURE, GAP, SCAN)
    before, after = motion.events.gaps
    jump = float(motion.response(before)[0, 0] - motion.response(after)[0, 0])
    assert jump == pytest.approx(-1.22e-3, rel=0.01)
    assert motion.allowed_jumps.tolist() == [rod > 0.5 * abs(jump)]


@pytest.mark.parametrize("response", ["exact", "linear"])
def test_both_conditions_of_the_free_end_count(response):
    """λ sin θ_ε = 59 µm behind a gap of 0.6 mm: 0.3 mm of free end hang 29 µm deep, and 0.5 mm 49 µm."""
    scan = Scan(speed=0.1, damping=0.11, response=response)
    for free_end, depth, allowed in [(0.3e-3, 35e-6, True), (0.5e-3, 35e-6, False), (0.5e-3, 60e-6, True)]:
        deep = Gaps(position=GAP.position, width=GAP.width, depth=depth)
        assert predict(whisker(free_end), POSTURE, deep, scan).allowed_jumps.tolist() == [allowed]


@pytest.mark.parametrize("free_end", [0.05e-3, 0.15e-3, 0.3e-3, 2e-3])
def test_a_relief_of_gaps_allows_the_jumps_that_the_gaps_do(free_end):
    texture = random_grating(0.05, rng=np.random.default_rng(2))
    gaps = predict(whisker(free_end), POSTURE, texture, SCAN, n_modes=2)
    ground = predict_relief(whisker(free_end), POSTURE, HeightProfile.from_gaps(texture), SCAN, n_modes=2)
    assert ground.allowed_jumps.tolist() == gaps.allowed_jumps.tolist()
    share = gaps.allowed_jumps.mean()
    assert (share == 0) == (free_end == 2e-3)
    for data in (diagnostics(gaps, TIME), relief_diagnostics(ground, TIME)):
        assert int(data.jump_count) == len(texture.width)
        assert float(data.jumps_allowed_share) == pytest.approx(share)
        assert float(data.free_end_length) == pytest.approx(free_end)


def test_a_free_end_touches_a_peak_however_narrow_and_only_as_far_as_it_reaches():
    needle = HeightProfile(
        position=np.array([0.0, 1.000e-3, 1.001e-3, 1.002e-3, 5e-3]), height=np.array([0, 0, 2e-5, 0, 0])
    )
    here = np.array([3e-3]), np.array([1e-5]), np.array([0.0])  # a contact 10 µm above the ground, a level free end
    assert relief_allows(1.9e-3, *here, needle).tolist() == [True]
    assert relief_allows(2.1e-3, *here, needle).tolist() == [False]
    lifted = (here[0], here[1], np.array([-0.01]))
    assert relief_allows(2.1e-3, *lifted, needle).tolist() == [True]  # 20 µm higher at the peak


def test_after_its_verdict_a_scan_says_the_share_of_jumps_that_the_free_end_allows():
    gaps = remarks(diagnostics(predict(whisker(9.6e-3), POSTURE, GAP, SCAN), TIME))
    assert gaps[1] == "the free end is 9.6 mm long and prevents 1 of 1 jumps"
    assert "up to 30 times too large" in gaps[2]
    assert "docs/validation.md" in gaps[3]
    assert "dip by up to 59 µm" in gaps[3]
    relief = predict_relief(whisker(0.1e-3), POSTURE, HeightProfile.from_gaps(GAP), SCAN)
    ground = relief_remarks(scanned_relief(relief, 5000))
    assert ground[1] == "the free end is 0.1 mm long and prevents 0 of 1 jumps"
    assert not any("bridges" in line for line in ground)
    assert max(len(line) for line in gaps[1:4]) <= 70


def test_without_a_jump_there_is_no_share():
    facts = free_end_facts(1e-3, np.zeros(0, bool))
    assert np.isnan(facts["jumps_allowed_share"])
    assert free_end_lines(facts) == ["the free end is 1 mm long; the contact never jumps"]


def test_a_slow_posture_at_rest_allows_the_jumps_of_the_posture():
    still = PosturePath(time=np.linspace(0, 0.12, 5), contact=np.full(5, 0.29), base_angle=np.full(5, 1.2))
    texture = random_grating(0.01, rng=np.random.default_rng(5))
    for free_end in (0.15e-3, 2e-3):
        slow = predict_slow(whisker(free_end), still, texture, SCAN, n_modes=1)
        known = predict(whisker(free_end), POSTURE, texture, SCAN, n_modes=1)
        assert slow.free_end["jump_count"] == len(texture.width)
        assert slow.free_end["jumps_allowed"] == known.allowed_jumps.sum()
        assert slow.free_end["free_end_length"] == pytest.approx(free_end)


@pytest.mark.parametrize(("free_end", "allowed"), [(0.3e-3, 1), (2e-3, 0)])
def test_one_gap_crossed_says_the_same(free_end, allowed):
    data = crossing(POSTURE, 0.015, whisker=whisker(free_end))
    assert (int(data.jump_count), int(data.jumps_allowed)) == (1, allowed)
    shallow = crossing(POSTURE, 0.015, whisker=whisker(free_end), depth=20e-6)
    assert int(shallow.jumps_allowed) == 0


def test_level_ground_has_nothing_below_it():
    """The free end of a straight whisker lies along it, and rounding is no depth."""
    level = HeightProfile(position=np.linspace(0, 0.02, 101), height=np.zeros(101))
    said = relief_remarks(scanned_relief(predict_relief(whisker(9.6e-3), POSTURE, level, SCAN), 5000))
    assert not any("below ground" in line for line in said)
