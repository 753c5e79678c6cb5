"""Command against motion: simulated stimulators of known transfer."""

import numpy as np
import pytest
from refusals import refusal
from scipy.signal import bilinear, butter, lfilter, sosfiltfilt

from vibrissa.errors import RangeError
from vibrissa.netcdf import save
from vibrissa.quantities import dataset
from vibrissa.stimulus.band import Band
from vibrissa.stimulus.delays import WHISKERS
from vibrissa.stimulus.export import write_command
from vibrissa.stimulus.fidelity import compare, compare_file

RATE = 5000.0
COMMAND = 1e-5 * Band(low=1.0, norm="phase").filtered(np.random.default_rng(0).normal(size=50000), RATE)


def delayed(signal, time):
    f = np.fft.rfftfreq(len(signal), 1 / RATE)
    return np.fft.irfft(np.fft.rfft(signal) * np.exp(-2j * np.pi * f * time), len(signal))


def test_a_perfect_stimulator_is_perfect():
    data = compare(COMMAND, COMMAND + 3e-6, RATE)
    for name in ("replay_correlation", "replay_correlation_aligned", "replay_gain", "replay_coherence_mean"):
        assert float(data[name]) == pytest.approx(1)
    assert float(data.replay_lag) == pytest.approx(0, abs=1e-9)
    assert float(data.replay_error) < 1e-18


@pytest.mark.parametrize("lag", [-3.13e-3, 0.4e-3, 1.47e-3])
@pytest.mark.parametrize("gain", [0.8, 1.1])
def test_gain_and_lag_are_found_to_a_fraction_of_a_sample(gain, lag):
    data = compare(COMMAND, gain * delayed(COMMAND, lag), RATE)
    assert float(data.replay_lag) == pytest.approx(lag, abs=4e-6)
    assert float(data.replay_gain) == pytest.approx(gain, rel=2e-3)
    assert float(data.replay_correlation_aligned) > 0.999
    assert float(data.replay_correlation) < float(data.replay_correlation_aligned) + 1e-12


@pytest.mark.parametrize("highest", [2, 5, 20])
@pytest.mark.parametrize("samples", [-35, 35, 250])
def test_slow_motion_is_found_as_late_as_it_is(highest, samples):
    """An exact copy: every sample that overlaps at its lag is the same, however slow the motion."""
    slow = sosfiltfilt(butter(3, highest, fs=RATE, output="sos"), np.random.default_rng(3).normal(size=50000))
    for first in (5000, 15000, 25000):
        data = compare(slow[first:][:20000], slow[first - samples :][:20000], RATE)
        assert float(data.replay_lag) == pytest.approx(samples / RATE, abs=1e-6)
        assert float(data.replay_gain) == pytest.approx(1, abs=1e-3)  # their means over the records differ
        assert float(data.replay_correlation_aligned) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_of_lags_that_a_tone_has_the_shortest_is_taken(seed):
    time = np.arange(10000) / RATE
    tone, late = (np.sin(2 * np.pi * 80 * (time - lag)) for lag in (0, 3e-3))
    noise = 0.01 * np.random.default_rng(seed).normal(size=time.size)
    assert float(compare(tone, 0.9 * late + noise, RATE).replay_lag) == pytest.approx(3e-3, abs=1e-5)


def test_motion_at_the_end_of_a_record_alone_is_no_reason_for_a_lag():
    pulse = np.zeros(5000)
    pulse[-200:] = np.sin(np.linspace(0, np.pi, 200)) ** 2
    assert float(compare(pulse, pulse, RATE).replay_lag) == pytest.approx(0, abs=1e-9)


def test_noise_lowers_correlation_and_coherence_by_its_share_of_the_power():
    noise = np.random.default_rng(1).normal(size=len(COMMAND)) * COMMAND.std() * 0.136
    data = compare(COMMAND, COMMAND + noise, RATE)
    assert float(data.replay_correlation) == pytest.approx(1 / np.sqrt(1 + 0.136**2), abs=5e-4)
    assert float(data.replay_correlation) == pytest.approx(data.attrs["printed_correlation"], abs=1e-3)
    assert float(data.replay_error) == pytest.approx(noise.std(), rel=1e-3)
    # white noise to 2.5 kHz, the command to about 40 Hz: in the band hardly any of it is left
    assert 0.99 < float(data.replay_coherence_mean) < 1


def test_a_second_order_actuator_lags_by_its_group_delay_at_low_frequency():
    omega, zeta = 2 * np.pi * 400, 0.7
    b, a = bilinear([omega**2], [1, 2 * zeta * omega, omega**2], RATE)
    looped = lfilter(b, a, np.tile(COMMAND, 2))[len(COMMAND) :]
    data = compare(COMMAND, looped, RATE)
    assert float(data.replay_lag) == pytest.approx(2 * zeta / omega, rel=0.02)
    assert float(data.replay_gain) == pytest.approx(1, abs=0.01)
    assert float(data.replay_coherence.min()) > 0.99
    assert float(data.replay_correlation) > 0.98


def command():
    copies = np.array([np.roll(COMMAND, 2000 * k) for k in range(24)])
    return dataset(whisker=np.array(WHISKERS), time=np.arange(len(COMMAND)) / RATE, command=copies)


def test_a_measured_file_at_another_rate_is_brought_to_the_commands(tmp_path):
    t = np.arange(20000) / 2000.0
    motion = np.interp(t, np.arange(len(COMMAND)) / RATE, 0.9 * delayed(np.roll(COMMAND, 2000 * 2), 1e-3))
    np.savetxt(tmp_path / "m.csv", np.c_[t, motion], delimiter=",", header="time,displacement", comments="")
    data = compare_file(command(), tmp_path / "m.csv", "A2")
    assert float(data.replay_lag) == pytest.approx(1e-3, abs=2e-5)
    assert float(data.replay_gain) == pytest.approx(0.9, rel=5e-3)
    assert data.attrs["measured_whisker"] == "A2"
    assert float(compare_file(command(), tmp_path / "m.csv", "A1").replay_correlation_aligned) < 0.5


@pytest.mark.parametrize("first", [0, 100])
@pytest.mark.parametrize("ramp", [0.0, 0.2])
def test_times_of_a_measured_table_are_those_since_the_first_sample_of_the_command(first, ramp, tmp_path):
    commanded = command().assign_coords(time=command().time - ramp)
    table = np.c_[np.arange(len(COMMAND)) / RATE, commanded.command.sel(whisker="alpha")][first:]
    np.savetxt(tmp_path / "m.csv", table, delimiter=",", header="time,displacement", comments="")
    data = compare_file(commanded, tmp_path / "m.csv", "alpha")
    assert float(data.replay_correlation) == pytest.approx(1)
    assert float(data.replay_lag) == pytest.approx(0, abs=1e-6)


def test_a_measured_command_of_all_whiskers_is_compared_by_name(tmp_path):
    write_command(command(), tmp_path / "m.npy")
    assert float(compare_file(command(), tmp_path / "m.npy", "C2").replay_correlation) == pytest.approx(1)
    with refusal("unknown", "measured whisker"):
        compare_file(command(), tmp_path / "m.npy", "Z9")


@pytest.mark.parametrize("late", [0.2, -0.2, 0.2001])
def test_a_measured_file_with_times_of_its_own_is_compared_where_both_last(late, tmp_path):
    ramped = command().assign_coords(time=command().time - 0.2)
    measured = ramped.assign_coords(time=ramped.time + late)
    moved = np.array([np.interp(measured.time, ramped.time, one) for one in ramped.command.values])
    save(measured.assign(command=(("whisker", "time"), moved)), tmp_path / "m.nc")
    found = compare_file(ramped, tmp_path / "m.nc", "C2")
    assert float(found.replay_correlation) == pytest.approx(1, abs=1e-6)
    assert float(found.replay_lag) == pytest.approx(0, abs=1e-5)
    save(measured.assign_coords(time=measured.time + 20), tmp_path / "later.nc")
    with pytest.raises(RangeError, match="must have been measured during the command"):
        compare_file(ramped, tmp_path / "later.nc", "C2")


def test_a_line_between_frequencies_of_the_coherence_counts_in_its_mean():
    time = np.arange(50000) / RATE
    line, noise = 1e-5 * np.sin(2 * np.pi * 41 * time), 1e-8 * np.random.default_rng(2).normal(size=(2, 50000))
    assert float(compare(line + noise[0], line + noise[1], RATE, resolution=2.0).replay_coherence_mean) > 0.9999


@pytest.mark.parametrize(
    ("commanded", "measured", "words"),
    [
        (COMMAND, COMMAND[:-1], ("shape", "commanded and measured")),
        (COMMAND[:100], COMMAND[:100], ("too-few", "record")),
        (COMMAND, np.where(np.arange(50000) == 7, np.nan, COMMAND), ("range", "measured")),
        (np.zeros(50000), COMMAND, ("range", "commanded")),
    ],
)
def test_records_that_cannot_be_compared_are_refused(commanded, measured, words):
    with refusal(*words):
        compare(commanded, measured, RATE)


def test_settings_that_are_not_positive_are_refused():
    with refusal("range", "longest_lag"):
        compare(COMMAND, COMMAND, RATE, longest_lag=0.0)


def test_a_resolution_too_coarse_for_the_band_is_refused():
    with refusal("range", "resolution"):
        compare(COMMAND, COMMAND, RATE, resolution=100.0)
