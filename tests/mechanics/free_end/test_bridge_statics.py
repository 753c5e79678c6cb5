"""Two supports at rest: against the single contact where one of them bears nothing, and against beams."""

import numpy as np
import pytest

from vibrissa.mechanics.free_end.bridge_statics import POWERS, Resistance, bridged, on_the_floor, too_wide, two_supports
from vibrissa.mechanics.free_end.tables import tables
from vibrissa.mechanics.statics.gap import excursion_at_jump, unit_response
from vibrissa.mechanics.statics.profile import Posture


def resistance(angle: float) -> Resistance:
    return tables(0.15, Posture(contact=0.29, base_angle=angle), damping=0.11, farthest=0.0).resistance


@pytest.mark.parametrize("angle", [0.8, 1.2, 1.4])
def test_a_bridge_begins_where_the_single_contact_would_jump(angle):
    """At d₂ the near edge bears nothing yet: the turn is that of the far edge alone, θ' d₂, of a shaft that slips."""
    posture, width = Posture(contact=0.29, base_angle=angle), 0.005
    unit, jump = unit_response(posture), excursion_at_jump(posture, width)
    turn = unit.contact_angle * jump
    place = width + unit.contact * jump  # the shaft has slipped: its contact is at ε + ε' d
    found, _ = two_supports(resistance(angle), np.array([place]), np.array([width]))
    assert found[0] == pytest.approx(turn, rel=0.02)  # second order in λ/ε = 0.017


def test_the_flat_needs_no_turn_and_no_lift():
    turn, lift = two_supports(resistance(1.2), np.zeros(3), np.array([0.005, 0.01, 0.02]))
    np.testing.assert_allclose(turn, 0, atol=1e-14)
    np.testing.assert_allclose(lift, 0, atol=1e-14)


def test_a_narrow_bridge_of_a_uniform_shaft_turns_as_a_beam_on_two_supports():
    """Δθ = N/ε⁴ x (λ/3 − x/2) to leading order: a beam on two supports, less the slope of the shaft on the flat."""
    at, width = resistance(1.2), 1e-4
    place = np.linspace(0.1, 1, 7) * width
    beam = at.load / at.contact**4 * place * (width / 3 - place / 2)
    turn, _ = two_supports(at, place, np.full(7, width))
    np.testing.assert_allclose(turn, beam, rtol=0, atol=2e-3 * np.abs(beam).max())  # λ/ε = 3e-4, K_θ λ/ε⁴ = 1e-3


def test_polynomials_are_the_law_itself():
    at, width = resistance(1.2), np.array([0.002, 0.03])
    turn, lift = bridged(at, width, free_end=0.14)
    share = np.linspace(0, 1, 9)
    exact = two_supports(at, width[:, None] * (1 - share), width[:, None])
    for series, values in zip((turn, lift), exact, strict=True):
        found = series @ share ** np.arange(POWERS)[:, None]
        np.testing.assert_allclose(found, values, rtol=0, atol=1e-4 * np.abs(values).max())


def test_a_tip_on_the_floor_is_a_second_support_that_lies_lower():
    at, free_end, depth = resistance(1.2), 0.001, 8.75e-4
    width = np.array([0.002, 0.025])
    turn, lift, least = on_the_floor(at, width, free_end, depth, compliance=7.6)
    assert least * (free_end + least) == pytest.approx(depth / (2 * 7.6))
    np.testing.assert_array_equal(turn[0], 0)  # too narrow for the tip to come down so far
    place = np.linspace(least, width[1] - free_end, 5)
    exact = two_supports(at, place, free_end + place, depth)
    share = 1 - place / width[1]
    for series, values in zip((turn, lift), exact, strict=True):
        found = series[1] @ share ** np.arange(POWERS)[:, None]
        np.testing.assert_allclose(found, values, rtol=0, atol=1e-3 * np.abs(values).max())


def test_turn_grows_without_bound_where_a_gap_is_too_wide_to_be_bridged():
    """Towards the width at which it is refused the turn is inversely proportional to what is left of the width."""
    at, width = resistance(0.8), np.linspace(0.19, 0.2, 10_001)
    refused = too_wide(at, width, free_end=0.29)
    assert not refused[0]
    assert refused[-1]
    most = width[refused.argmax()]
    near = most - np.array([1e-3, 2e-3, 4e-3])
    turn, _ = two_supports(at, near, near)
    np.testing.assert_allclose(turn[:-1] / turn[1:], 2, rtol=0.05)


@pytest.mark.parametrize(("contact", "width"), [(0.12, 0.125), (0.12, 0.175), (0.15, 0.175), (0.2, 0.225)])
def test_a_gap_is_bridged_as_long_as_its_far_edge_is_on_the_shaft(contact, width):
    """Beyond the tip the balance of a shaft without an end is lost, which bears on nothing."""
    posture, free_end, widths = Posture(contact=contact, base_angle=1.2), contact - 0.05, np.array([width])
    at = tables(0.05, posture, damping=0.11, farthest=0.0).resistance
    assert not too_wide(at, widths, free_end)[0]
    share = np.linspace(0, free_end / width, 9)
    exact = two_supports(at, width * (1 - share), np.full(9, width))
    for series, values in zip(bridged(at, widths, free_end), exact, strict=True):
        found = series[0] @ share ** np.arange(POWERS)[:, None]
        np.testing.assert_allclose(found, values, rtol=0, atol=0.015 * np.abs(values).max())
