"""Phase, amplitude and set point are those of an angle that was made of them; nothing is invented in gaps."""

import numpy as np
import pytest
from scipy import signal

from vibrissa.errors import InputError
from vibrissa.measures.whisk_cycle import stretches, whisk_cycle

RATE = 500.0
TIME = np.arange(2000) / RATE


def made(slow=1.0, rate=8.0):
    """Angle of a known phase, amplitude and set point, which change with 0.4 and 0.5 Hz times ``slow``."""
    phase = 2 * np.pi * (rate * TIME + 0.15 * TIME**2) + 0.5
    amplitude = np.radians(15 + 4 * np.sin(2 * np.pi * 0.4 * slow * TIME))
    middle = np.radians(80 + 8 * np.cos(2 * np.pi * 0.5 * slow * TIME))
    return middle + amplitude * np.cos(phase), phase, amplitude, middle


def wrapped(angle):
    return np.angle(np.exp(1j * angle))


def worst(found, true):
    return np.nanmax(np.abs(found - true))


@pytest.mark.parametrize("rate", [6.0, 8.0, 16.0])
def test_the_cycle_is_the_one_that_was_made(rate):
    angle, phase, amplitude, middle = made(rate=rate)
    found = whisk_cycle(TIME, angle)
    assert np.isfinite(found.amplitude).mean() > 0.85
    # the amplitude changes by 1 °/s · (a sixth of a second) within a cycle; linear interpolation leaves its square
    assert worst(found.amplitude, amplitude) < np.radians(0.25)
    assert worst(found.set_point, middle) < np.radians(0.25)
    assert np.nanmax(np.abs(wrapped(found.phase - phase))) < 0.1
    inner = slice(250, -250)
    assert worst(found.frequency[inner], (rate + 0.3 * TIME)[inner]) < 0.1
    rebuilt = found.set_point + found.amplitude * np.cos(found.phase)
    assert np.nanmedian(np.abs(rebuilt - angle)) < np.radians(0.15)


def test_the_phase_is_that_of_scipy_alone():
    angle, *_ = made()
    b, a = signal.butter(2, [4.0, 30.0], "bandpass", fs=RATE)
    theirs = np.angle(signal.hilbert(signal.filtfilt(b, a, angle)))
    inner = slice(500, -500)  # a second from the ends, which both treat in their own ways
    assert np.abs(wrapped(whisk_cycle(TIME, angle).phase - theirs))[inner].max() < 0.02


def test_the_error_falls_with_the_square_of_how_slowly_the_parameters_change():
    inner = slice(250, -250)

    def errors(slow):
        angle, _, amplitude, middle = made(slow=slow)
        found = whisk_cycle(TIME, angle)
        return worst(found.amplitude[inner], amplitude[inner]), worst(found.set_point[inner], middle[inner])

    for coarse, fine in zip(errors(1.0), errors(0.5), strict=True):
        assert 3 < coarse / fine < 5.5


def test_protraction_has_a_negative_phase():
    angle, *_ = made()
    found = whisk_cycle(TIME, angle)
    rising = np.gradient(angle) > np.radians(0.5)  # per frame: well within protraction
    assert (found.phase[rising & np.isfinite(found.phase)] < 0).all()


def test_short_gaps_are_bridged_for_the_filter_and_stay_nan():
    angle, phase, amplitude, _ = made()
    gap = np.zeros(TIME.size, bool)
    gap[900:906] = gap[1100:1103] = True
    seen = np.where(gap, np.nan, angle)
    found = whisk_cycle(TIME, seen, bridged=6)
    assert all(np.isnan(one[gap]).all() for one in found)
    assert np.isfinite(found.phase[890:900]).all()
    assert np.nanmax(np.abs(wrapped(found.phase - phase))[600:1400]) < 0.15
    assert worst(found.amplitude, amplitude) < np.radians(1)
    parted = whisk_cycle(TIME, seen, bridged=5)
    assert np.isnan(parted.phase[850:960]).all()  # half a period of 4 Hz beside the gap that is not bridged
    assert np.isfinite(parted.phase[1000:1100]).all()


def test_short_stretches_have_no_cycle():
    angle, *_ = made()
    seen = np.full(TIME.size, np.nan)
    seen[100:349] = angle[100:349]
    assert np.isnan(whisk_cycle(TIME, seen).phase).all()
    seen[100:351] = angle[100:351]
    assert np.isfinite(whisk_cycle(TIME, seen).phase).any()


def test_stretches_join_over_bridged_gaps():
    seen = np.array([0, 1, 1, 0, 1, 0, 0, 1], bool)
    assert stretches(seen) == [(1, 3), (4, 5), (7, 8)]
    assert stretches(seen, 1) == [(1, 5), (7, 8)]
    assert stretches(seen, 2) == [(1, 8)]
    assert stretches(np.zeros(3, bool)) == []


def test_frames_too_slow_for_the_band_and_uneven_ones_are_refused():
    with pytest.raises(InputError, match="below half of the frame rate of 50 Hz"):
        whisk_cycle(np.arange(100) / 50, np.zeros(100))
    with pytest.raises(InputError, match="time must be even"):
        whisk_cycle(np.delete(np.arange(100) / 500, 50), np.zeros(99))


def test_a_rate_lies_in_the_band_and_an_amplitude_is_not_below_zero():
    """Noise in the band has a phase that at times runs backwards or jumps, and ranges that are none."""
    angle = np.cumsum(np.random.default_rng(3).standard_normal(4000)) * 1e-2
    found = whisk_cycle(np.arange(4000) / 500.0, angle)
    assert np.isfinite(found.phase).mean() > 0.9
    assert np.nanmin(found.frequency) >= 4
    assert np.nanmax(found.frequency) <= 30
    assert np.nanmin(found.amplitude) > 0
    assert np.isnan(found.frequency[np.isfinite(found.phase)]).any()
