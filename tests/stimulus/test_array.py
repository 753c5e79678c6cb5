"""The command of 24 whiskers: copies, limits, and what it says about itself."""

import re

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.scan.sampled import scanned
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.stimulus.array import replay_command
from vibrissa.stimulus.band import Band
from vibrissa.stimulus.delays import WHISKERS
from vibrissa.stimulus.limits import Limits, rate_of
from vibrissa.stimulus.waveform import PointMotion, motion_at
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

RATE = 1000.0
QUICK = {"duration": 10.0, "sampling_rate": RATE}


def noise(seed, resonance=np.nan, rate=RATE):
    moved = Band(low=1.0).filtered(np.random.default_rng(seed).normal(0, 1e-5, round(4 * rate)), rate)
    return PointMotion(displacement=moved, sampling_rate=rate, source=f"texture {seed}", resonance=resonance)


MOTIONS = [noise(seed) for seed in range(3)]


def test_24_whiskers_are_four_straddlers_and_four_columns_of_five_rows():
    assert len(set(WHISKERS)) == 24
    assert {"alpha", "beta", "gamma", "delta", "A1", "E4", "C2"} <= set(WHISKERS)


@pytest.mark.parametrize("delays", ["even", "random", "least"])
def test_every_whisker_moves_as_the_first_after_its_delay(delays):
    data = replay_command(MOTIONS, **QUICK, delays=delays, seed=3)
    assert data.command.dims == ("whisker", "time")
    assert data.command.shape == (24, 10000)
    for copy, delay in zip(data.command.values, data.delay.values, strict=True):
        np.testing.assert_array_equal(copy, np.roll(data.command.values[0], round(delay * RATE)))
    np.testing.assert_array_equal(data.start_value, data.command[:, 0])


@pytest.mark.parametrize("delays", ["even", "random", "least"])
def test_the_copies_are_uncorrelated_as_told(delays):
    data = replay_command(MOTIONS, **QUICK, delays=delays)
    r = np.abs(np.corrcoef(data.command.values) - np.eye(24))
    np.testing.assert_allclose(data.largest_correlation, r.max(), atol=1e-12)
    np.testing.assert_allclose(data.copy_correlation, r.max(1), atol=1e-12)
    assert r.max() < 0.1 or delays == "random"  # the copies of the paper are "uncorrelated"
    assert (data.attrs["correlation_note"] == "") == (r.max() < 0.1)


def test_the_command_is_zero_at_rest_and_lies_in_the_band():
    data = replay_command(MOTIONS, **QUICK)
    assert np.abs(data.command.mean("time")).max() < 1e-18
    power = np.abs(np.fft.rfft(data.command.values[0])) ** 2
    assert power[2000:].sum() < 1e-3 * power.sum()  # above 200 Hz


def test_the_scale_scales_and_the_filter_is_stated():
    once, twice = (replay_command(MOTIONS, **QUICK, scale=scale) for scale in (1.0, 2.0))
    np.testing.assert_allclose(twice.command, 2 * once.command)
    assert "order 4, norm mag, causal" in once.attrs["filter"]
    assert "zero-phase" in replay_command(MOTIONS, **QUICK, band=Band(causal=False)).attrs["filter"]
    np.testing.assert_allclose(once.frequency, [69, 83, 88, 89])
    np.testing.assert_allclose(once.band_gain, np.abs(Band().response(once.frequency.values, RATE)))


def test_a_resonance_that_the_band_takes_away_is_told():
    lost = replay_command([noise(0, 123.0), *MOTIONS], **QUICK)
    assert 123.0 in lost.frequency
    assert "first resonance, 123 Hz, passes the band with gain 0.4" in lost.attrs["resonance_note"]
    assert replay_command([noise(0, 40.0), *MOTIONS], **QUICK).attrs["resonance_note"] == ""


def test_a_seam_steeper_than_the_motion_is_named():
    # An end 100 µm from the start is reached within the fade, beside a sine of at most 2.5 mm/s
    t = np.arange(round(11 * RATE) + 1) / RATE
    moved = 5e-5 * np.cos(np.pi * t / 11) + 2e-5 * np.sin(2 * np.pi * 20 * t)
    motion = PointMotion(displacement=moved, sampling_rate=RATE)
    steep = replay_command([motion], **QUICK, fade=0.01)
    ratio = float(steep.seam_step_unfiltered[0])
    assert ratio > 1e-4 / 0.01 / 2.5e-3 - np.sqrt(2)
    assert steep.attrs["seam_note"].startswith(f"in the overlap from 0 s on the motion is {ratio:.2g} times as fast")
    assert replay_command([motion], **QUICK, fade=0.9).attrs["seam_note"] == ""
    assert replay_command(MOTIONS, **QUICK).attrs["seam_note"] == ""


def test_the_replayed_stimulus_is_dominated_by_the_fundamental_mode():
    # Results of the paper; a whisker that rings at 88 Hz, as those of Fig. 7A
    cone = Whisker(length=0.05, cone_angle=1.341e-3)
    texture = random_grating(0.25, rng=np.random.default_rng(1))
    prediction = predict(cone, Posture(contact=0.29, base_angle=1.2), texture, Scan(speed=0.1, damping=0.11))
    motion = motion_at(scanned(prediction, 4000.0, nodes=[5e-3]), 5e-3)
    assert motion.resonance == pytest.approx(88, abs=0.5)
    data = replay_command([motion], duration=2.0, sampling_rate=4000.0)
    power = np.abs(np.fft.rfft(data.command.values[0])) ** 2
    near = np.abs(np.fft.rfftfreq(8000, 1 / 4000) / 88 - 1) < 0.3
    assert power[near].sum() > 0.5 * power.sum()
    assert data.attrs["resonance_note"] == ""


def test_a_ramp_leads_from_rest_into_the_loop_and_back():
    plain, led = (replay_command(MOTIONS, **QUICK, ramp=ramp) for ramp in (0.0, 0.5))
    assert led.command.shape == (24, 11000)
    np.testing.assert_array_equal(led.command.values[:, 500:-500], plain.command)
    np.testing.assert_allclose(led.time[[0, 500, -1]], [-0.5, 0, 10.499])
    assert np.abs(led.start_value).max() == 0
    ends = led.command.values[:, [0, 1, -2, -1]]
    assert np.abs(ends).max() < 1e-3 * float(plain.peak_travel)
    joints = np.abs(np.diff(led.command.values, axis=1))[:, [498, 499, 500, -502, -501, -500]]
    assert joints.max() <= float(plain.peak_speed) / RATE


def test_a_ramp_too_steep_is_refused():
    free = replay_command(MOTIONS, **QUICK)
    limits = Limits(acceleration=1.01 * float(free.peak_acceleration))
    replay_command(MOTIONS, **QUICK, limits=limits, ramp=0.5)
    with refusal("range", "acceleration of A1 in the ramp at -0.0020 s"):
        replay_command(MOTIONS, **QUICK, limits=limits, ramp=0.004)
    with refusal("range", "ramp"):
        replay_command(MOTIONS, **QUICK, ramp=11.0)


def test_the_derivative_of_a_sine_is_a_cosine():
    t = np.arange(1000) / RATE
    w = 2 * np.pi * 20
    np.testing.assert_allclose(rate_of(np.sin(w * t), RATE), w * np.cos(w * t), atol=1e-9)
    np.testing.assert_allclose(rate_of(np.sin(w * t), RATE, 2), -(w**2) * np.sin(w * t), atol=1e-7)


@pytest.mark.parametrize(("kind", "unit"), [("travel", "m"), ("speed", "m/s"), ("acceleration", "m/s²")])
def test_a_command_beyond_a_limit_is_refused_with_the_scale_that_fits(kind, unit):
    free = replay_command(MOTIONS, **QUICK)
    peak = float(free[f"peak_{kind}"])
    with refusal("range", value=f"{peak:.6g} {unit}") as caught:
        replay_command(MOTIONS, **QUICK, limits=Limits(**{kind: 0.80001 * peak}))
    assert caught.value.rule == f"must be at most {0.80001 * peak:.6g} {unit}"
    assert caught.value.remedy == f"`scale=0.8` would fit, or raise `{kind}`"
    name, at = re.fullmatch(rf"{kind} of (\w+) at ([\d.]+) s", caught.value.quantity).groups()
    values = free.command.sel(whisker=name).values
    times = {"travel": 0, "speed": 1, "acceleration": 2}[kind]
    moved = np.abs(rate_of(values, RATE, times) if times else values)
    assert moved[round(float(at) * RATE)] == pytest.approx(peak)
    fitting = replay_command(MOTIONS, **QUICK, limits=Limits(**{kind: 0.80001 * peak}), scale=0.8)
    np.testing.assert_allclose(fitting.command, 0.8 * free.command)  # not clipped


def test_the_scale_that_fits_is_told_however_small():
    free = replay_command(MOTIONS, **QUICK)
    with refusal("range", "travel of A1 at 0.1650 s"):
        replay_command(MOTIONS, **QUICK, limits=Limits(travel=1.2345e-7 * float(free.peak_travel)))


def test_of_several_limits_the_scale_fits_all():
    free = replay_command(MOTIONS, **QUICK)
    limits = Limits(travel=0.7 * float(free.peak_travel), speed=0.5 * float(free.peak_speed))
    with refusal("range", "speed of D2 at 0.1140 s"):
        replay_command(MOTIONS, **QUICK, limits=limits)


def test_given_delays_are_kept():
    delays = np.arange(24) * 0.3
    np.testing.assert_allclose(replay_command(MOTIONS, **QUICK, delays=delays).delay, delays, atol=1e-12)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"delays": [0.0] * 23 + [10.0]}, ("range", "delay of E4")),
        ({"delays": [-0.1] + [0.0] * 23}, ("range", "delay of alpha")),
        ({"delays": [np.nan] * 24}, ("range", "delay of alpha")),
        ({"delays": [0.0, 1.0]}, ("shape", "delays")),
        ({"delays": "odd"}, ("shape", "delays")),
        ({"delays": "random", "separation": 0.5}, ("range", "separation")),
        ({"separation": -1.0}, ("range", "separation")),
        ({"scale": 0.0}, ("range", "scale")),
        ({"seed": -1}, ("range", "seed")),
        ({"sampling_rate": 160.0}, ("range", "sampling_rate")),
        ({"duration": np.nan}, ("range", "duration")),
    ],
)
def test_settings_out_of_range_are_refused(values, words):
    with refusal(*words):
        replay_command(MOTIONS, **(QUICK | values))


def test_limits_and_motions_out_of_range_are_refused():
    with refusal("range", "Limits.speed", value="0.0"):
        Limits(speed=0.0)
    with refusal("range", "inputs"):
        replay_command([], **QUICK)
    with refusal("range", "texture 0: sampling rate"):
        replay_command([noise(0, rate=300.0)], **QUICK)
    with refusal("range", "stimulus"):
        replay_command([PointMotion(displacement=np.zeros(20000), sampling_rate=RATE)], **QUICK)


def test_given_delays_that_are_alike_are_told_as_correlated():
    delays = np.arange(24) * 0.3
    delays[5] = delays[4]
    data = replay_command(MOTIONS, **QUICK, delays=delays)
    assert float(data.largest_correlation) == pytest.approx(1)
    assert "these delays meet peaks" in data.attrs["correlation_note"]
