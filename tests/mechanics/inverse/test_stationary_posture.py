"""Posture and friction from mean profiles whose truth is known from Eq. 1, solved by shooting."""

import numpy as np
import pytest
from refusals import refusal
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

import vibrissa as vb
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.inverse.stationary_posture import fit_profile
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
LENGTH, HIDDEN, SPACING, PIXEL = 0.04, 3e-3, 116e-6, 95e-6
TURN, PLACE = -0.6, 0.02 + 0.03j  # of the substrate and of the contact in a frame with y up
SEEDS = 50


def shot(contact, angle, friction, s):
    """Angle and place (x + iy, over L) by shooting on Eq. 1."""
    phi = np.arctan(friction)

    def integrated(force, at=None):
        def slope(t, state):
            theta, moment, _, _ = state
            return [moment / t**4, force * np.cos(phi - theta), np.cos(theta), np.sin(theta)]

        return solve_ivp(slope, (contact, 1), np.zeros(4), "DOP853", at, rtol=1e-10, atol=1e-12).y

    force = brentq(lambda one: integrated(one)[0, -1] - angle, 1e-6, 10 * contact, xtol=1e-12)
    theta, _, x, y = integrated(force, s[::-1])
    return theta[::-1], (x + 1j * y)[::-1], y[-1]


def tracked(contact, angle, rng, *, friction=0.4, frames=800, sd=15e-6, vibration=50e-6, mirrored=True):
    """Profile as a tracker writes it, the substrate's line, and the height of the base [m]."""
    arc = np.arange(0, (1 - contact) * LENGTH - HIDDEN, SPACING)
    s = 1 - arc / LENGTH
    theta, place, height = shot(contact, angle, friction, s)
    z = place * LENGTH * np.exp(1j * TURN) + PLACE
    modes = cone_modes(cone_kappa(contact, 3), contact, s)
    motion = np.zeros((frames, s.size))
    for share, mode in zip((1, 0.4, 0.2), modes, strict=True):
        amplitude = np.convolve(rng.standard_normal(frames + 19), np.ones(20) / np.sqrt(20), "valid")
        motion += vibration * share * amplitude[:, None] * mode / np.abs(mode).max()
    z = z + 1j * np.exp(1j * (theta + TURN)) * motion + 1j * sd * rng.standard_normal(motion.shape)
    line = PLACE + np.array([-5e-3, 15e-3]) * np.exp(1j * TURN)
    z, line = (np.conj(one) if mirrored else one for one in (z, line))
    profile = dataset(
        {"pixel_size": PIXEL},
        time=np.arange(frames) / 2000,
        x=z.real,
        y=z.imag,
        y_sd=np.full(z.shape, max(sd, 1e-9)),
        arc_length=arc,
    )
    return profile, tuple((one.real, one.imag) for one in line), height * LENGTH


def shifted(line, rng, sd):
    """The line as an observer marks it: either end off across it."""
    (a, b), (c, d) = line
    across = np.array([-(d - b), c - a]) / np.hypot(c - a, d - b)
    return tuple(tuple(np.array(one) + rng.normal(0, sd) * across) for one in line)


def postures(rng):
    return rng.uniform(0.1, 0.4), rng.uniform(0.8, 1.4)


@pytest.mark.parametrize("mirrored", [True, False])
@pytest.mark.parametrize(("contact", "angle"), [(0.1, 0.8), (0.29, 1.2), (0.4, 1.4)])
def test_profile_without_noise_gives_its_posture(contact, angle, mirrored):
    profile, _, height = tracked(contact, angle, np.random.default_rng(0), sd=0, vibration=0, mirrored=mirrored)
    found = fit_profile(profile, WHISKER)
    np.testing.assert_allclose([found.contact, found.base_angle], [contact, angle], rtol=1e-5)
    assert float(found.base_height) == pytest.approx(height, rel=1e-5)
    assert float(found.bend_r2) == pytest.approx(1, abs=1e-9)
    places = profile.x.values[0] + 1j * profile.y.values[0]
    fitted = found.fitted_x.values + 1j * found.fitted_y.values
    s = 1 - profile.arc_length.values / LENGTH
    np.testing.assert_allclose(np.interp(s, found.s, fitted), places, atol=2e-6)  # [m], chords of the 201 points


def test_friction_of_a_profile_without_noise_is_found():
    profile, _, _ = tracked(0.2, 1.2, np.random.default_rng(0), friction=0.9, sd=0, vibration=0, frames=2)
    found = fit_profile(profile, WHISKER, friction=None)
    assert float(found.friction_found) == pytest.approx(0.9, abs=2e-3)
    assert bool(found.friction_identified)


@pytest.fixture(scope="module")
def many():
    """Errors and half intervals of ε, θ_b and H over 50 seeds, without the line and with it."""
    errors = {False: [], True: []}
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        contact, angle = postures(rng)
        profile, line, height = tracked(contact, angle, rng)
        truth = {"contact": contact, "base_angle": angle, "base_height": height}
        for with_line, places in errors.items():
            given = {"substrate": shifted(line, rng, PIXEL / 2)} if with_line else {}
            found = fit_profile(profile, WHISKER, **given)
            places.append([(float(found[n]) - v, float(found[f"{n}_high"] - found[n])) for n, v in truth.items()])
    return {key: np.array(one) for key, one in errors.items()}


@pytest.mark.parametrize("with_line", [False, True])
def test_intervals_cover_and_estimates_have_no_bias(many, with_line):
    """Of 50 trials at 95 % fewer than 43 within have a chance of 1 %; the mean error is within 3 standard errors."""
    error, half = many[with_line][..., 0], many[with_line][..., 1]
    assert np.all((np.abs(error) <= half).sum(axis=0) >= 43)
    assert np.all(np.abs(error.mean(axis=0)) < 3 * error.std(axis=0) / np.sqrt(SEEDS))


def test_the_line_narrows_the_intervals(many):
    assert np.all(np.median(many[True][..., 1], axis=0) < 0.6 * np.median(many[False][..., 1], axis=0))


def test_friction_is_told_weakly_and_its_interval_covers():
    """Of 8 trials, fewer than 6 within have a chance of 0.6 %; μ is some 20 times less sure than the contact is."""
    within, widths = [], []
    for seed in range(8):
        rng = np.random.default_rng(100 + seed)
        contact, angle = postures(rng)
        profile, _, _ = tracked(contact, angle, rng)
        found = fit_profile(profile, WHISKER, friction=None)
        within.append(float(found.friction_low) <= 0.4 <= float(found.friction_high))
        sure = fit_profile(profile, WHISKER)
        relative = float((found.friction_high - found.friction_low) / 0.4)
        widths.append(relative * contact / float(sure.contact_high - sure.contact_low))
    assert sum(within) >= 6
    assert np.median(widths) > 20


def test_friction_that_a_noisy_still_cannot_tell_is_not_told():
    profile, _, _ = tracked(0.15, 0.8, np.random.default_rng(3), frames=2, sd=60e-6, vibration=0)
    found = fit_profile(profile, WHISKER, friction=None)
    assert found.attrs["friction_told"] == "not identified"
    assert not bool(found.friction_identified)
    assert np.isnan(found.friction_se)


def scanned(contact, angle, seed):
    """A whisker drawn over a grating by the model, its nodes with noise; the mean excursion [m]."""
    rng = np.random.default_rng(seed)
    posture = Posture(contact=contact, base_angle=angle)
    prediction = predict(WHISKER, posture, random_grating(0.25, rng=rng), Scan(speed=0.15, damping=0.11))
    arc, t = np.arange(0, (1 - contact) * LENGTH - HIDDEN, SPACING), 0.3 + np.arange(1500) / 2000
    x, y = (LENGTH * values for values in prediction.position(t, 1 - arc / LENGTH))
    y = -y + 15e-6 * rng.standard_normal(y.shape)
    profile = dataset(time=t, x=x, y=y, y_sd=np.full(y.shape, 15e-6), arc_length=arc)
    return profile, float(prediction.events.excursion(t).mean()) * LENGTH


def test_a_gratings_mean_excursion_biases_the_posture_and_is_allowed_for():
    plain, allowed, within = [], [], []
    for seed, (contact, angle) in enumerate([(0.29, 1.2), (0.2, 1.0), (0.35, 0.9), (0.25, 1.3)]):
        profile, excursion = scanned(contact, angle, seed)
        assert -0.3e-3 < excursion < -0.05e-3
        plain.append(float(fit_profile(profile, WHISKER).contact) - contact)
        found = fit_profile(profile, WHISKER, excursion=(excursion, 0.0))
        allowed.append(float(found.contact) - contact)
        within.append(float(found.contact_low) <= contact <= float(found.contact_high))
    assert np.mean(plain) > 0.002
    assert np.max(np.abs(allowed)) < 0.6 * np.min(np.abs(plain))
    assert all(within)


def test_the_border_of_a_shadow_does_not_draw_the_posture():
    """The last nodes are drawn as on film, by up to 0.4 pixel, and seen in the fewer frames the further they lie."""
    rng = np.random.default_rng(2)
    profile, line, _ = tracked(0.29, 1.2, rng, vibration=0)
    shares, drawn = [1, 1, 0.99, 0.94, 0.78], np.array([0.007, 0.013, 0.05, 0.17, 0.44]) * PIXEL
    z, sd = (profile.x + 1j * profile.y).values, profile.y_sd.values.copy()
    along = np.gradient(z.mean(axis=0))[-5:]
    z[:, -5:] += 1j * along / np.abs(along) * drawn
    sd[:, -5:] = np.where(rng.uniform(size=(len(z), 5)) < shares, sd[:, -5:], np.nan)
    seen = profile.assign({name: (("time", "node"), one) for name, one in (("x", z.real), ("y", z.imag), ("y_sd", sd))})
    bordered, cut = (fit_profile(one, WHISKER, substrate=line) for one in (seen, profile.isel(node=slice(None, -9))))
    for name in ("contact", "base_angle"):
        assert abs(float(bordered[name] - cut[name])) < 0.3 * float(cut[f"{name}_se"])


@pytest.mark.parametrize("mirrored", [True, False])
def test_r2_does_not_depend_on_how_the_whisker_lies_in_the_image(mirrored):
    """Turned so that the chord at the base points to ±π, with the data on one side of the cut and the fit on the other.

    The witness is the definition, with angles taken about the fitted chord at the base, far from the cut.
    """
    profile, _, _ = tracked(0.2, 1.1, np.random.default_rng(5), frames=3, mirrored=mirrored)
    found = fit_profile(profile, WHISKER)
    z = (profile.x + 1j * profile.y).values
    s, step = 1 - profile.arc_length.values / LENGTH, round(1e-3 / SPACING)
    fitted = CubicSpline(found.s, found.fitted_x.values + 1j * found.fitted_y.values)(s)
    chords, model = (one[:-step] - one[step:] for one in (z.mean(axis=0), fitted))
    angle, expected = (np.angle(one / model[0]) for one in (chords, model))
    r2 = 1 - np.sum((angle - expected) ** 2) / np.sum((angle - angle.mean()) ** 2)
    cut = -np.exp(-0.5j * np.angle(chords[0] * model[0]))
    for turn in (1, cut, -cut):
        turned = profile.assign(x=profile.x.copy(data=(turn * z).real), y=profile.y.copy(data=(turn * z).imag))
        assert float(fit_profile(turned, WHISKER).profile_r2) == pytest.approx(r2, abs=1e-4)


def test_length_and_skin_carry_their_uncertainty():
    profile, _, _ = tracked(0.29, 1.2, np.random.default_rng(0))
    sure = fit_profile(profile, WHISKER)
    longer = fit_profile(profile, Whisker(length=LENGTH + 0.5e-3, cone_angle=1.5e-3))
    off = profile.assign(arc_length=profile.arc_length.copy(data=profile.arc_length + 0.2e-3))
    later = fit_profile(off, WHISKER)
    for moved, given in ((longer, {"length_sd": 0.5e-3}), (later, {"skin_sd": 0.2e-3})):
        unsure = fit_profile(profile, WHISKER, **given)
        for name in ("contact", "base_angle"):
            added = np.sqrt(float(unsure[f"{name}_se"]) ** 2 - float(sure[f"{name}_se"]) ** 2)
            assert added == pytest.approx(abs(float(moved[name] - sure[name])), rel=0.1)


def test_bad_input_is_named():
    profile, line, _ = tracked(0.29, 1.2, np.random.default_rng(0), frames=2)
    with refusal("shape", "substrate"):
        fit_profile(profile, WHISKER, substrate=(line[0], line[0]))
    with refusal("too-few", "profile"):
        fit_profile(profile.isel(node=slice(0, 20)), WHISKER)
    with refusal("missing", "substrate_sd"):
        fit_profile(profile.drop_attrs(), WHISKER, substrate=line)


def test_tracks_in_single_precision_have_the_same_posture():
    profile = tracked(0.29, 1.2, np.random.default_rng(5), frames=100)[0]
    found = vb.fit_posture(profile, WHISKER)
    for names in (["arc_length"], ["x", "y", "arc_length"]):
        single = profile.assign({name: profile[name].astype("f4") for name in names})
        assert float(vb.fit_posture(single, WHISKER).contact) == pytest.approx(float(found.contact), abs=1e-5)
