"""Where an edge holds the contact after a jump, against profiles held one by one and two programs."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.scan.contact_travel import contact_travel
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.edge_contact import hold, on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.drifting_oscillator import drift
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

TOOL = Path(__file__).parents[3] / "benchmarks/peers/held_contact.py"
SPEC = importlib.util.spec_from_file_location("held_contact", TOOL)
held_contact = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(held_contact)
held_contacts, held_frequency, held_kappa = (
    getattr(held_contact, name) for name in ("held_contacts", "held_frequency", "held_kappa")
)
WHISKER = Whisker(length=40e-3, cone_angle=1.5e-3)
WIDTHS = np.array([0.15e-3, 0.3e-3, 0.6e-3])


def predicted(base_angle, speed, widths=WIDTHS, modes="straight", damping=0.1, n_modes=3):
    texture = Gaps(position=0.3 * np.arange(len(widths)), width=np.asarray(widths))
    posture = Posture(contact=0.3, base_angle=base_angle)
    return predict(WHISKER, posture, texture, Scan(speed=speed, damping=damping, modes=modes), n_modes=n_modes)


@pytest.mark.parametrize(("base_angle", "modes"), [(0.3, "straight"), (1.2, "curved-edge")])
def test_means_are_those_of_profiles_held_one_by_one(base_angle, modes):
    prediction = predicted(base_angle, 0.02, modes=modes)
    found, flat = held_contacts(prediction), prediction.response.flat
    for j, after in enumerate(prediction.events.gaps[1].tolist()):
        z, w = np.polynomial.legendre.leggauss(6)
        held = [hold(flat, after * (1 + one) / 2) for one in z]
        assert float(found.held_contact[j]) == pytest.approx(w @ [one.contact for one in held] / 2, rel=1e-9)
        kappa = [held_kappa(flat, one.contact, one.contact_angle, 3, straight=modes == "straight") for one in held]
        np.testing.assert_allclose(found.held_shift[j], w @ kappa / 2 / prediction.kappa, rtol=1e-8)


@pytest.mark.parametrize("base_angle", [0.8, 1.2])
def test_travel_of_the_contact_is_that_between_profiles_held_before_and_after_the_jump(base_angle):
    prediction = predicted(base_angle, 0.1)
    flat, (before, after) = prediction.response.flat, prediction.events.gaps
    expected = [hold(flat, up).contact - hold(flat, down).contact for down, up in zip(before, after, strict=True)]
    found = contact_travel(prediction)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert np.all(np.diff(found) > 0)  # wider gaps carry it farther
    along = [hold(flat, d).contact for d in np.linspace(after[-1], before[-1], 9)]
    assert np.ptp(along) == pytest.approx(found[-1], rel=1e-6)  # the ends are the extremes


def test_travel_near_the_fold_is_that_between_profiles_held_too():
    gap = Gaps(position=np.array([1e-3]), width=np.array([0.4e-3]))
    posture = Posture(contact=0.1, base_angle=1.36)
    prediction = predict(WHISKER, posture, gap, Scan(speed=0.1, damping=0.11), n_modes=1)
    flat, (before, after) = prediction.response.flat, prediction.events.gaps
    expected = hold(flat, after[0]).contact - hold(flat, before[0]).contact
    np.testing.assert_allclose(contact_travel(prediction), expected, rtol=1e-6)


def test_narrow_gaps_leave_the_resonance_where_it_is_and_the_shift_grows_as_the_width():
    shift = held_contacts(predicted(0.3, 0.02, np.array([0.02e-3, 0.04e-3, 0.08e-3]))).held_shift.values[:, 0] - 1
    np.testing.assert_allclose(shift[1:] / shift[:-1], 2, rtol=0.02)
    assert 0 < shift[0] < 1e-3


def test_the_whisker_on_an_edge_is_the_one_on_the_flat_turned():
    flat = on_the_flat(Posture(contact=0.3, base_angle=1.2))
    held = hold(flat, -0.0074)
    turned = on_the_flat(Posture(contact=held.contact, base_angle=1.2 - held.contact_angle))
    assert turned.contact_force == pytest.approx(held.contact_force, rel=1e-10)
    assert turned.base_curvature == pytest.approx(held.base_curvature, rel=1e-10)
    np.testing.assert_allclose(
        held_kappa(flat, held.contact, held.contact_angle, 2, straight=False),
        curved_modes(turned, 2, condition="edge").kappa,
    )


def test_resonances_held_on_the_edge_are_those_that_two_programs_ring_at():
    """docs/validation.md: MuJoCo and Exudyn after gaps of 0.3, 0.6 mm, 0.3 rad; the modes of ε are 1.4 to 2.8 % off."""
    shift = held_contacts(predicted(0.3, 0.02)).held_shift.values[1:, 0]
    kappa = cone_kappa(0.3, 1)[0] * shift
    np.testing.assert_allclose(kappa, [23.98, 24.24], rtol=5e-3)
    np.testing.assert_allclose(kappa, [23.93, 24.26], rtol=5e-3)
    assert np.all(np.abs(np.array([23.98, 24.24]) / cone_kappa(0.3, 1)[0] - 1) > 0.014)


def test_an_edge_holds_the_longer_the_slower_the_scan_and_the_stronger_the_damping():
    def share(speed, damping):
        return held_contacts(predicted(0.3, speed, [0.3e-3], damping=damping, n_modes=12)).held_share.item()

    assert share(0.02, 0.001) < share(0.02, 0.02) < share(0.02, 0.1) < share(0.01, 0.1) == 1


def test_without_vibration_the_edge_holds_to_the_end_and_the_sag_is_its_angle():
    prediction = predicted(0.3, 1e-5, WIDTHS, damping=0.5)
    found, flat = held_contacts(prediction), prediction.response.flat
    assert np.all(found.held_share > 0.99)
    angles = [hold(flat, d).contact_angle for d in prediction.events.gaps[1].tolist()]
    np.testing.assert_allclose(found.sag_height, WIDTHS * np.sin(angles), rtol=1e-8)


@pytest.mark.parametrize(("base_angle", "modes"), [(0.3, "straight"), (1.2, "curved-edge")])
def test_frequency_drifts_as_the_held_profiles_say_and_rests_on_the_flat(base_angle, modes):
    prediction = predicted(base_angle, 0.02, modes=modes)
    frequency, flat = held_frequency(prediction), prediction.response.flat
    first, jump, back = prediction.events.time.reshape(-1, 3)[2]
    assert frequency(np.array([first - 1e-3, back + 1e-3]))[0] * WHISKER.timescale == pytest.approx(
        2 * [prediction.kappa[0]], rel=1e-9
    )
    for t in (jump + 1e-9, (jump + back) / 2, (first + jump) / 2):
        held = hold(flat, float(prediction.excursion(np.array([t]))[0]))
        kappa = held_kappa(flat, held.contact, held.contact_angle, 3, straight=modes == "straight")
        np.testing.assert_allclose(frequency(np.array([t]))[:, 0] * WHISKER.timescale, kappa, rtol=1e-8)


def test_a_drifting_ring_down_reads_as_the_mean_of_where_it_is_held():
    prediction = predicted(0.3, 0.02, [0.3e-3], n_modes=1)
    jump, back = prediction.events.time[1:3]
    t = np.linspace(jump, back, 400)
    q = drift(t, prediction.mode_drive, held_frequency(prediction), 0.0)[0][0]
    still = prediction.kappa[0] * float(held_contacts(prediction).held_shift[0, 0]) / WHISKER.timescale
    share = [
        np.linalg.lstsq(np.stack([np.cos(w * t), np.sin(w * t), t, t**0]).T, q)[1][0]
        for w in (still, prediction.omega[0], 0.99 * still, 1.01 * still)
    ]
    assert share[0] < 0.2 * min(share[1:])
