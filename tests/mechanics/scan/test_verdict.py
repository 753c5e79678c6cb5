"""The verdict on a prediction: by hand from its diagnostics, and in every dataset that predicts a motion."""

import numpy as np
import pytest
import xarray as xr

from vibrissa.mechanics.scan.gap_report import crossing
from vibrissa.mechanics.scan.relief_prediction import predict_relief
from vibrissa.mechanics.scan.sampled import scanned, scanned_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.scan.verdict import findings, map_verdict, verdict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

GOOD = {"jump_count": 20, "jumps_allowed": 20, "fold_determinant": -1.0, "lift_off": 0.0, "slip_reversed": 0.0}


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({}, "usable: free end prevents 0 of 20 jumps"),
        ({"jump_count": 0, "jumps_allowed": 0}, "usable: contact never jumps"),
        ({"jumps_allowed": 19}, "caution: free end prevents 1 of 20 jumps"),
        ({"jumps_allowed": 10}, "caution: free end prevents 10 of 20 jumps"),
        ({"jumps_allowed": 9}, "outside the model: free end prevents 11 of 20 jumps"),
        ({"fold_determinant": 0.0}, "outside the model: beyond the fold"),
        ({"fold_determinant": np.nan}, "outside the model: beyond the fold"),
        ({"lift_off": 0.04}, "caution: contact lifts off in 4 % of the time"),
        ({"slip_reversed": 0.5}, "outside the model: contact sticks in 50 % of the time"),
        ({"weight_ratio": 0.3}, "caution: own weight is 0.3 of the contact force"),
        ({"weight_ratio": 2.0}, "outside the model: own weight is 2 of the contact force"),
        ({"valley_steps": 11}, "outside the model: 11 of 20 jumps are steps through valleys"),
        (
            {"lift_off": 0.04, "jumps_allowed": 0},
            "outside the model: free end prevents 20 of 20 jumps; contact lifts off in 4 % of the time",
        ),
        (
            {"jumps_allowed": 19, "slip_reversed": 0.2},
            "outside the model: contact sticks in 20 % of the time; free end prevents 1 of 20 jumps",
        ),
    ],
)
def test_the_verdict_names_what_limits_a_prediction_the_worst_first(changed, line):
    assert verdict(GOOD | changed) == f"{line} (docs/when-it-holds)"


def judged(response="exact", modes="straight", ratio=1.0, growth=0.0):
    laws = ["edge", "constant", "coulomb", "flat", "stuck"]
    ratios = {"resonance_ratio": (("contact_law", "mode"), [[ratio]] * 3 + [[1.02], [2.3]])}
    growths = {"growth_rate": (("contact_law", "mode"), [[growth]] * 3 + [[0.0], [0.0]])}
    facts = GOOD | {"linearity": ("mode", [0.7])} | ratios | growths
    return xr.Dataset(facts, {"contact_law": laws, "mode": [1]}, {"response": response, "modes": modes})


def test_modes_and_response_ask_for_caution_where_they_are_not_the_exact_ones():
    assert verdict(judged()).startswith("usable")
    assert verdict(judged(response="linear")).startswith("caution: mode 1 jumps 0.70 times the linear response (")
    assert verdict(judged(ratio=0.8)).startswith("caution: first resonance −20 % about the profile (")
    assert verdict(judged(growth=1e-3)).startswith("caution: mode 1 about the profile is unstable (")
    assert not list(findings(judged(modes="curved", ratio=0.8, growth=1.0)))


def whisker(tip):
    return Whisker(length=0.04, cone_angle=1.5e-3, tip=tip)


GAPS = Gaps(position=np.array([1e-3, 2e-3]), width=np.array([0.6e-3, 0.5e-3]))


@pytest.mark.parametrize(("tip", "start"), [(0.0, "outside the model: free end prevents "), (0.2899, "usable: ")])
def test_a_scan_and_a_gap_carry_their_verdict(tip, start):
    gentle = Posture(contact=0.29, base_angle=0.6)
    scan = Scan(speed=0.05, damping=0.11)
    ends = predict(whisker(tip), gentle, GAPS, scan)
    ground = predict_relief(whisker(tip), gentle, HeightProfile.from_gaps(GAPS), scan)
    found = [scanned(ends, 4000.0), scanned_relief(ground, 4000.0), crossing(gentle, 0.015, whisker=whisker(tip))]
    for data in found:
        assert data.attrs["verdict"] == verdict(data)
        assert data.attrs["verdict"].startswith(start), data.attrs["verdict"]


def test_a_gap_without_a_whisker_names_the_tip_that_it_needs():
    line = crossing(Posture(contact=0.29, base_angle=0.3), 0.015).attrs["verdict"]
    assert line == "caution: the jump needs a tip beyond s = 0.275 (docs/when-it-holds)"


def test_a_map_is_judged_by_the_free_ends_that_could_jump():
    contact = np.array([0.1, 0.2, 0.3])
    assert map_verdict(contact, 0.0, 0.04, 1e-3).endswith("at all contacts (docs/when-it-holds)")
    assert map_verdict(contact, 0.19, 0.04, 1e-3).startswith("caution: free end is longer than every gap at 1 of 3")
    assert map_verdict(contact, 0.0, 0.04, 5e-3).startswith("outside the model: free end is longer than every gap at 2")
    assert map_verdict(contact, 0.0, 0.04, 0.05).startswith("caution: free end is shorter")
