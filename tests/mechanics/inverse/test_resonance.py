"""Resonance and damping come back from the model's own signals, if the texture's forcing is known."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.errors import ConvergenceError
from vibrissa.mechanics.inverse import resonance
from vibrissa.mechanics.inverse.resonance import fit_modes
from vibrissa.mechanics.scan.sampled import predicted_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.signals.spectra import fit_resonance
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
TIME = np.arange(4000) / 2000


def prediction(seed, *, jump="continuous"):
    texture = random_grating(0.25, rng=np.random.default_rng(seed))
    return predict(WHISKER, POSTURE, texture, Scan(speed=0.1, damping=0.11, jump=jump), n_modes=3)


def noisy(signals, seed, share=0.01):
    clean = signals.mode_displacement.values
    noise = np.random.default_rng(seed).normal(size=clean.shape) * share * clean.std(axis=1, keepdims=True)
    return signals.assign(mode_displacement=signals.mode_displacement + noise)


@pytest.mark.parametrize("jump", ["continuous", "ramp-limit", "paper2014"])
def test_a_known_texture_gives_back_what_was_put_in(jump):
    truth = prediction(0, jump=jump)
    signals = noisy(predicted_signals(truth, TIME), 1)
    fit, _ = fit_modes(signals, 1.03 * truth.omega / (2 * np.pi), prediction=truth)  # a guess that is 3 % off
    np.testing.assert_allclose(fit.resonant_frequency, truth.omega / (2 * np.pi), rtol=1e-3)
    np.testing.assert_allclose(fit.damping, 0.11, rtol=0.02)


def test_white_forcing_errs_by_several_per_cent_where_the_texture_is_not_white():
    known, white = [], []
    for seed in range(6):
        truth = prediction(seed)
        signals = noisy(predicted_signals(truth, TIME), seed).isel(mode=[0])
        guess = truth.omega[:1] / (2 * np.pi)
        known.append(fit_modes(signals, guess, prediction=truth)[0].resonant_frequency.item() / guess[0] - 1)
        white.append(fit_modes(signals, guess)[0].resonant_frequency.item() / guess[0] - 1)
    assert np.abs(known).max() < 1e-3
    assert 0.02 < np.abs(np.mean(white)) < 0.15  # −7 … +7 % for mode 1, by speed and texture


def test_each_side_of_the_shutter_is_the_same_only_if_it_is_told():
    truth = prediction(2)
    exposure, parts = 0.45e-3, 21  # a long shutter, so that what it takes away is seen
    fine = (TIME[:, None] + exposure * ((np.arange(parts) + 0.5) / parts - 0.5)).ravel()
    exposed = predicted_signals(truth, fine).mode_displacement.values.reshape(3, len(TIME), parts).mean(axis=2)
    signals = predicted_signals(truth, TIME).assign(mode_displacement=(("mode", "time"), exposed))
    guess = truth.omega / (2 * np.pi)
    told = fit_modes(signals, guess, prediction=truth, exposure=exposure)[0].damping.values
    untold = fit_modes(signals, guess, prediction=truth)[0].damping.values
    assert abs(told[1] / 0.11 - 1) < abs(untold[1] / 0.11 - 1)
    np.testing.assert_allclose(told[:2], 0.11, rtol=0.02)


@pytest.mark.parametrize(("error", "change"), [(0.5e-6, 2e-4), (2.4e-6, 1e-3)])
def test_stamps_that_are_rounded_change_a_fit_by_less_than_its_error(error, change):
    """To microseconds, and to nearly a hundredth of an interval: so far times are even. What they stamp is even."""
    truth = prediction(0)
    signals, guess = noisy(predicted_signals(truth, TIME), 1), 1.03 * truth.omega / (2 * np.pi)
    stamps = TIME + np.random.default_rng(5).uniform(-error, error, TIME.size)
    even, stamped = (
        fit_modes(one, guess, prediction=truth)[0] for one in (signals, signals.assign_coords(time=stamps))
    )
    np.testing.assert_allclose(stamped.resonant_frequency, even.resonant_frequency, rtol=change)
    half_width = (even.resonant_frequency_high - even.resonant_frequency_low) / 2
    assert (np.abs(stamped.resonant_frequency - even.resonant_frequency) < half_width).all()


def test_lost_or_uneven_samples_are_refused():
    truth = prediction(0)
    signals = predicted_signals(truth, TIME)
    guess = truth.omega / (2 * np.pi)
    with refusal("too-few", "mode_displacement"):
        fit_modes(signals.assign(mode_displacement=signals.mode_displacement.where(signals.time > 0.1)), guess)
    with refusal("range", "time"):
        fit_modes(signals.isel(time=np.r_[0:1000, 1005:2000]), guess)


def test_a_mode_whose_fit_has_no_maximum_is_not_measured_and_the_others_are(monkeypatch):
    truth = prediction(0)
    signals = noisy(predicted_signals(truth, TIME), 1)
    guess = truth.omega / (2 * np.pi)
    whole, _ = fit_modes(signals, guess, prediction=truth)

    def fails_for_mode_2(frequency, power, *, guess, **options):
        if 300 < guess < 400:
            raise ConvergenceError("resonance fit", 1.0, 3)
        return fit_resonance(frequency, power, guess=guess, **options)

    monkeypatch.setattr(resonance, "fit_resonance", fails_for_mode_2)
    fit, spectra = fit_modes(signals, guess, prediction=truth)
    np.testing.assert_array_equal(fit.damping.values[[0, 2]], whole.damping.values[[0, 2]])
    assert np.isnan([fit[name].values[1] for name in ("resonant_frequency", "damping_low", "damping_high")]).all()
    assert fit.attrs["left_out"].startswith("mode 2: resonance fit did not converge")
    assert np.isnan(spectra.power_fit[1]).all()


def test_what_folds_back_at_a_slow_camera_is_in_the_model_too():
    """The jumps of d go far above half the frame rate; a shutter put on afterwards misses what they fold back."""
    truth = prediction(3)
    exposure, parts = 1 / 3000, 24
    fine = (TIME[:, None] + exposure * ((np.arange(parts) + 0.5) / parts - 0.5)).ravel()
    exposed = predicted_signals(truth, fine).mode_displacement.values.reshape(3, len(TIME), parts).mean(axis=2)
    signals = predicted_signals(truth, TIME).assign(mode_displacement=(("mode", "time"), exposed))
    guess = truth.omega / (2 * np.pi)
    fit, _ = fit_modes(signals, guess, prediction=truth, exposure=exposure)
    np.testing.assert_allclose(fit.resonant_frequency, guess, rtol=6e-4)
    np.testing.assert_allclose(fit.damping, 0.11, rtol=6e-3)
    exact, _ = fit_modes(signals, guess, prediction=truth, exposure=exposure, instants=parts)
    np.testing.assert_allclose(exact.resonant_frequency, guess, rtol=1e-6)
    np.testing.assert_allclose(exact.damping, 0.11, rtol=1e-5)


def test_a_short_record_leaves_out_the_modes_whose_bands_have_too_few_bins():
    """Of 200 frames at 2 kHz bins are 10 Hz apart: a band of 1.1 times the resonance has 20 from 182 Hz on."""
    truth = prediction(0)
    guess = truth.omega / (2 * np.pi)
    fit, _ = fit_modes(predicted_signals(truth, TIME[:200]), guess)
    few = 1.1 * guess / 10 < 19
    assert few.tolist() == [True, False, False]
    assert np.isnan(fit.damping.values[few]).all()
    assert "mode 1: spectrum must have at least 20 bins in the band of the fit, got" in fit.attrs["left_out"]


def test_a_mode_above_half_the_frame_rate_is_named_with_the_frequency_to_which_it_folds():
    truth = prediction(0)
    time = np.arange(2000) / 500
    guess = np.array([120.0, 348.0, 690.0])
    fit, _ = fit_modes(noisy(predicted_signals(truth, time), 1), guess)
    reasons = fit.attrs["left_out"].split("; record faster")
    assert "mode 2 is expected at 348 Hz, above half the frame rate of 500 Hz: it folds to 152 Hz" in reasons[0]
    assert "mode 3 is expected at 690 Hz, above half the frame rate of 500 Hz: it folds to 190 Hz" in reasons[1]
    # a sine of 348 Hz sampled at 500 Hz is one of 152 Hz
    sine = np.cos(2 * np.pi * 348 * time)
    assert np.fft.rfftfreq(2000, 1 / 500)[np.argmax(np.abs(np.fft.rfft(sine)))] == 152
