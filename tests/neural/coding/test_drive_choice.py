"""Which drive a unit follows: known truth comes out, and what stimuli cannot tell is said."""

from functools import cache

import numpy as np
import pytest
from populations import ringing
from refusals import refusal

from vibrissa.neural.coding.drive_choice import DriveAnalysis, compare_drives
from vibrissa.neural.coding.drives import DRIVES, Stimuli
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.signals.smoothing import low_pass

TRIALS, SLOPE = 20, 2.5e5
UNITS = {  # threshold and slope in the unit of the drive, at like rates
    "envelope": (42e-6, SLOPE),
    "speed": (42e-6 * 2 * np.pi * 70, SLOPE / (2 * np.pi * 70)),
    "rise": (0.0, SLOPE / 75),
    "smoothed": (42e-6, SLOPE),
}
MANY, ONE = (50, 60, 70, 80, 95, 110), (70,) * 6


@cache
def stimuli(seed, carriers, duration=2.5):
    rngs = [np.random.default_rng([seed, k]) for k in range(len(carriers))]
    shown = [ringing(rng, duration=duration, frequency=f) for rng, f in zip(rngs, carriers, strict=True)]
    return [dataset(time=time, point_displacement=motion) for time, motion in shown]


def drive_of(stimulus, name):
    """Drive by its definition."""
    time, motion = stimulus.time.values, stimulus.point_displacement.values
    step, envelope = time[1] - time[0], analytic_envelope(motion)[0]
    return {
        "envelope": lambda: envelope,
        "speed": lambda: analytic_envelope(np.gradient(motion, step))[0],
        "rise": lambda: np.gradient(envelope, step),
        "smoothed": lambda: low_pass(time, envelope, 0.03),
    }[name]()


def recorded(shown, seed, *, units=1, share=1.0, names=DRIVES):
    """Tables of spikes, one for each stimulus, with units of every drive."""
    tables = []
    for k, stimulus in enumerate(shown):
        own = {}
        for i, name in enumerate(names):
            threshold, slope = UNITS[name]
            unit = ThresholdLinearUnit(threshold=threshold, slope=share * slope, baseline=5.0, latency=0.012)
            drive = drive_of(stimulus, name)
            for j in range(units):
                rng = np.random.default_rng([seed, k, i, j])
                own[f"{name}{j}"] = simulate_spikes(unit, stimulus.time.values, drive, TRIALS, rng=rng)
        tables.append(join_units(own))
    return tables


def compared(seed, carriers, **options):
    shown = stimuli(seed, carriers)
    found = compare_drives(recorded(shown, seed, **options), shown, [TRIALS] * len(shown))
    return found, np.array([str(name).rstrip("0123456789") for name in found.unit_name.values])


def test_the_drive_put_in_comes_out():
    right = wrong = n = 0
    for seed in range(5):  # 60 units
        found, truth = compared(seed, MANY, units=3)
        named = found.best_drive.values
        right, n = right + np.sum(named == truth), n + truth.size
        wrong += np.sum((named != truth) & (named != "cannot tell"))
    assert right >= 0.9 * n
    assert wrong == 0


def test_latency_of_the_true_drive_comes_out():
    found, truth = compared(1, MANY)
    own = found.drive_latency.values[np.arange(4), [DRIVES.index(name) for name in truth]]
    np.testing.assert_allclose(own, 0.012, atol=0.004)  # the smoothed envelope hardly tells


def test_one_carrier_cannot_tell_envelope_from_speed():
    found, truth = compared(2, ONE, units=3)
    either = np.isin(truth, ["envelope", "speed"])
    assert (found.best_drive.values[either] == "cannot tell").all()
    assert all("cannot tell envelope from speed" in reason for reason in found.reason.values[either])
    assert (found.best_drive.values[truth == "rise"] == "rise").all()  # the carrier does not matter there
    assert found.drive_likeness.sel(drive="speed").item() > 0.9


def test_few_spikes_and_no_drive_are_said():
    weak, _ = compared(3, MANY, share=0.05)
    assert (weak.best_drive.values == "cannot tell").all()
    none, _ = compared(3, MANY, share=0.0, units=4)
    assert np.mean([reason.startswith("no drive") for reason in none.reason.values]) >= 0.85
    few = recorded(stimuli(0, MANY), 0, names=("envelope",))
    few = [table.isel(spike=slice(0, 10)) for table in few]
    found = compare_drives(few, stimuli(0, MANY), [TRIALS] * 6)
    assert found.reason.item().startswith("too few spikes")
    assert np.isnan(found.drive_gain.values).all()


def test_interval_of_the_loss_holds_its_mean_over_recordings():
    """Truth of the loss is its mean over many recordings of the same stimuli."""
    shown = stimuli(4, MANY)
    found = compare_drives(recorded(shown, 4, units=50, names=("envelope",)), shown, [TRIALS] * 6)
    speed = DRIVES.index("speed")
    low, high = found.drive_loss_low.values[:, speed], found.drive_loss_high.values[:, speed]
    truth = found.drive_loss.values[:, speed].mean()
    assert np.mean((low < truth) & (truth < high)) >= 0.9  # pieces differ too, so that it is wide for one set of them
    assert np.median(low) > 0


def test_speed_is_the_envelope_times_the_carrier_s_frequency():
    time = np.arange(6000) / 2000
    tone = 50e-6 * (1 + 0.5 * np.sin(2 * np.pi * 2 * time)) * np.sin(2 * np.pi * 80 * time)
    shown = Stimuli.of([dataset(time=time, point_displacement=tone)])
    inner = slice(500, -500)
    envelope, speed = (shown.drives[name].envelope[inner] for name in ("envelope", "speed"))
    np.testing.assert_allclose(envelope, 50e-6 * (1 + 0.5 * np.sin(2 * np.pi * 2 * time[::2]))[inner], rtol=6e-3)
    np.testing.assert_allclose(speed, 2 * np.pi * 80 * envelope, rtol=0.03)  # differences at 2 kHz
    assert shown.carrier.item() == pytest.approx(80, abs=0.1)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda s, m, n: (s[:1], m, n), ("shape", "spikes, stimuli and trials")),
        (lambda s, m, n: ([], [], []), ("shape", "spikes, stimuli and trials")),
        (lambda s, m, n: (s, m, [5, 5]), ("range", "trial")),
        (lambda s, m, n: ([s[0], s[1].assign(unit_name=("unit", ["x"]))], m, n), ("conflict", "units of stimulus 2")),
    ],
)
def test_bad_input_is_told_in_one_line(change, match):
    shown = stimuli(0, (60, 90))
    spikes = recorded(shown, 0, names=("envelope",))
    with refusal(*match) as told:
        compare_drives(*change(spikes, shown, [TRIALS, TRIALS]))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    "wrong", [{"bin_width": 0.0}, {"skip": -1.0}, {"level": 0.0}, {"smoothing": 0.0}, {"latest": 0.05}]
)
def test_settings_are_checked(wrong):
    with refusal("range"):
        DriveAnalysis(**wrong)


def test_stimuli_that_a_unit_did_not_meet_do_not_count_for_it():
    shown = stimuli(1, MANY)
    tables = recorded(shown, 1, names=("envelope", "speed"))
    lost = [2, 4]
    silent = [
        table.isel(spike=np.flatnonzero(table.spike_unit.values == 0)) if k in lost else table
        for k, table in enumerate(tables)
    ]
    seen = [np.repeat([[True], [k not in lost]], TRIALS, axis=1) for k in range(len(MANY))]
    partly = [table.assign(unit_observed=(("unit", "trial"), one)) for table, one in zip(silent, seen, strict=True)]
    found = compare_drives(partly, shown, [TRIALS] * len(MANY))
    kept = [k for k in range(len(MANY)) if k not in lost]
    alone = compare_drives([tables[k] for k in kept], [shown[k] for k in kept], [TRIALS] * len(kept))
    whole = compare_drives(tables, shown, [TRIALS] * len(MANY))
    assert float(found.drive_gain[1, 1]) == pytest.approx(float(alone.drive_gain[1, 1]), rel=0.02)
    assert str(found.best_drive.values[1]) == "speed"
    np.testing.assert_array_equal(found.drive_gain[0], whole.drive_gain[0])  # the other unit met them all
    nowhere = [table.assign(unit_observed=(("unit", "trial"), one & [[True], [False]]))
               for table, one in zip(silent, seen, strict=True)]  # fmt: skip
    assert "observed in no trial" in str(compare_drives(nowhere, shown, [TRIALS] * len(MANY)).reason.values[1])
