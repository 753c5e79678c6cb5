"""What a prediction is made of: straight or curved modes, and what of the quasi-static response they hold."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal

from vibrissa.exact import shaft_quadrature
from vibrissa.mechanics.modes.basis import basis, couplings
from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.sampled import predicted_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict, predict_all
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.gap import unit_response
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

ALL = ("straight", "curved", "curved-coulomb", "curved-edge")
CURVED = ALL[1:]
WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURES = (Posture(contact=0.29, base_angle=1.2), Posture(contact=0.2, base_angle=1.0))
TEXTURE = Gaps(position=np.array([1e-3, 1.9e-3, 2.6e-3]), width=np.array([0.6e-3, 0.2e-3, 0.5e-3]))
SCAN = Scan(speed=0.12, damping=0.11)


@pytest.mark.parametrize("modes", ALL)
@pytest.mark.parametrize("posture", POSTURES)
def test_the_modes_sum_to_the_response_to_an_edge(posture, modes):
    """Σ c_i r_i → Ū as a vector: what is left falls faster than the square of the number of modes."""
    unit, flat = unit_response(posture), on_the_flat(posture)
    s, weights = shaft_quadrature(posture.contact, 200)
    whole = np.stack(unit.shift(s))

    def left_out(count):
        found = basis(modes, flat, count)
        rest = whole - np.einsum("i,xis->xs", couplings(found, unit), found.displacement(s))
        return np.sqrt(np.sum(rest**2 @ (weights * s**2)) / np.sum(whole**2 @ (weights * s**2)))

    few, many = left_out(12), left_out(24)
    assert many < 6e-4
    assert few / many > 4


@pytest.mark.parametrize("modes", CURVED)
@pytest.mark.parametrize("posture", POSTURES)
def test_a_mode_is_coupled_by_the_work_of_the_static_load_on_it(posture, modes):
    """Reciprocity: κ² c = δF·l(ε) + ε' Λ cos φ ϑ_l(ε), since Ū needs δF and the load moved by ε' along the shaft."""
    unit, flat = unit_response(posture), on_the_flat(posture)
    found = basis(modes, flat, 8)
    phi, force, contact = posture.friction_angle, flat.contact_force, posture.contact
    gain = unit.load * contact**2 + 2 * flat.curve.load * contact * unit.contact
    change = gain * np.array([-np.sin(phi), np.cos(phi)])
    change -= force * unit.contact_angle * np.array([np.cos(phi), np.sin(phi)])
    step = 1e-4 * np.arange(6)
    near = found.adjoint(contact + step)
    turn = np.polynomial.Polynomial.fit
    rotation = np.array([turn(step, row, 5).deriv()(0.0) for row in near[1]])
    work = change @ near[..., 0] + unit.contact * force * np.cos(phi) * rotation
    if modes == "curved-edge":  # the shaft's own slip is the mode's affair, what is left is the edge's way
        work = -force * np.cos(phi) * rotation
    np.testing.assert_allclose(found.kappa**2 * couplings(found, unit), work, rtol=1e-6)


@pytest.mark.parametrize("modes", CURVED)
def test_nothing_but_the_modes_changes(modes):
    straight, curved = (
        predict(WHISKER, POSTURES[0], TEXTURE, replace(SCAN, modes=which), n_modes=6) for which in ("straight", modes)
    )
    t = np.linspace(0, 0.04, 300)
    np.testing.assert_array_equal(straight.drive(t)[6:], curved.drive(t)[6:])
    np.testing.assert_array_equal(straight.events.time, curved.events.time)
    assert np.all(curved.omega[:2] < straight.omega[:2])


@pytest.mark.parametrize("response", ["exact", "linear"])
@pytest.mark.parametrize("modes", CURVED)
def test_a_whisker_that_hardly_bends_moves_as_the_straight_one(modes, response):
    posture = Posture(contact=0.3, base_angle=2e-3)
    texture = Gaps(position=np.array([1e-3, 1.5e-3]), width=np.array([2e-4, 1e-4]))
    t, s = np.linspace(0, 0.03, 200), np.linspace(0.3, 1, 9)
    shown, there = [], []
    for which in ("straight", modes):
        one = predict(WHISKER, posture, texture, replace(SCAN, modes=which, response=response), n_modes=6)
        shown.append(one.mode_displacement(t))
        there.append(one.displacement(t, s))
    np.testing.assert_allclose(shown[1], shown[0], rtol=0, atol=1e-2 * np.abs(shown[0]).max())
    np.testing.assert_allclose(there[1], there[0], rtol=0, atol=1e-2 * np.abs(there[0]).max())


@pytest.mark.parametrize("modes", CURVED)
def test_the_whole_shaft_is_continuous_where_the_contact_jumps(modes):
    scan = replace(SCAN, modes=modes, response="linear", damping=0.0)
    prediction = predict(WHISKER, POSTURES[0], TEXTURE, scan, n_modes=40)
    jump = prediction.events.time[1] + 1e-9 * np.array([-1.0, 1.0])
    s = np.linspace(0.32, 1, 400)
    x, y = prediction.position(jump, s)
    alone = prediction.response.position(prediction.events.excursion(jump), s)
    for whole, slow in zip((x, y), alone, strict=True):
        assert np.abs(np.diff(whole, axis=0)).max() < 2e-3 * np.abs(np.diff(slow, axis=0)).max()


def test_ringing_is_at_the_curved_frequency():
    prediction = predict(WHISKER, POSTURES[0], TEXTURE, replace(SCAN, modes="curved", damping=0.0), n_modes=1)
    t = prediction.events.time[-1] + np.arange(4000) / 50e3
    q = prediction.amplitudes(t)[0]
    rising = np.flatnonzero((q[:-1] < 0) & (q[1:] >= 0))
    crossing = t[rising] - q[rising] * np.diff(t[:2]) / (q[rising + 1] - q[rising])
    expected = basis("curved", on_the_flat(POSTURES[0]), 1).kappa[0] / (2 * np.pi * WHISKER.timescale)
    assert 1 / np.diff(crossing).mean() == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("modes", CURVED)
def test_curved_modes_carry_axial_force_and_the_load_of_their_momentum(modes):
    prediction = predict(WHISKER, POSTURES[0], TEXTURE, replace(SCAN, modes=modes, damping=0.0), n_modes=3)
    t = np.linspace(0, 0.04, 400)
    signals = follicle_signals(prediction, t)
    assert np.isfinite(signals["axial_force"]).all()
    angle, q = POSTURES[0].base_angle, prediction.amplitudes(t)
    found = prediction.response.basis
    s, weights = shaft_quadrature(0.29, 100)
    momentum = found.kappa**2 * (found.displacement(s) * weights * s**2).sum(axis=-1)
    friction = {"curved": np.zeros(3), "curved-coulomb": -0.4 * found.contact_load}
    friction["curved-edge"] = found.contact_force[0]  # turns with the whisker: tests/mechanics/modes/test_curved.py
    load = (momentum + np.stack([friction[modes], found.contact_load])) @ q
    unit = np.pi / 4 * WHISKER.youngs_modulus * WHISKER.cone_angle**4 * WHISKER.length**2
    along = unit * (np.cos(angle) * load[0] + np.sin(angle) * load[1])
    scale = np.abs(along).max()
    np.testing.assert_allclose(signals["axial_force_vibration"], along, rtol=0, atol=1e-9 * scale)


def test_a_batch_and_the_record_keep_the_modes():
    scan = replace(SCAN, modes="curved-coulomb")
    one, other = predict_all(WHISKER, POSTURES[0], [TEXTURE, TEXTURE.reversed(5e-3)], scan, n_modes=2)
    assert one.response is other.response
    assert predicted_signals(one, np.linspace(0, 0.01, 50)).attrs["modes"] == "curved-coulomb"
    with refusal("conflict", "response"):
        predict(WHISKER, POSTURES[0], TEXTURE, SCAN, n_modes=2, response=one.response)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Scan(speed=0.1, damping=0.1, modes="bent"), ("unknown", "Scan.modes")),
        (lambda: basis("bent", on_the_flat(POSTURES[0]), 3), ("unknown", "modes")),
        (
            lambda: basis("curved-coulomb", on_the_flat(Posture(contact=0.8, base_angle=1.2, friction=10)), 3),
            ("range", "modes"),
        ),
        (
            lambda: basis("curved-edge", on_the_flat(Posture(contact=0.1, base_angle=1.4)), 3),
            ("range", "modes"),
        ),
    ],
)
def test_bad_requests_are_refused(call, message):
    with refusal(*message):
        call()
