"""A stimulus recorded on the session's clock: cut into trials, on which all doors agree."""

from datetime import UTC, datetime

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.api.remarks import Remark
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.stimuli import labelled_stimulus, name_of
from vibrissa.neural.io.tables.trials import trial_table
from vibrissa.study.neurons.inputs import read_recording
from vibrissa.study.neurons.session_stimuli import channels_that_differ, cut_stimulus
from vibrissa.study.spec.given import SpikesInput, StimulusInput

pynwb = pytest.importorskip("pynwb")

RATE, LENGTH, TRIALS = 1000.0, 3.0, 12
TIME = np.arange(int(LENGTH * RATE)) / RATE
SLOW = 1 + 0.9 * np.sin(2 * np.pi * 1.3 * TIME)
MOTION = 40e-6 * SLOW * np.sin(2 * np.pi * 65 * TIME)  # [m]
ONSETS = 3.0 + 4.0 * np.arange(TRIALS)


def spike_times(seed=1):
    """Times of a unit in each trial, driven by the envelope [s]."""
    rng = np.random.default_rng(seed)
    return [TIME[rng.uniform(size=TIME.size) < 25 * SLOW / RATE] for _ in range(TRIALS)]


def whole_session():
    """The motion on the session's clock, still between the trials [m]."""
    whole = np.zeros(round((ONSETS[-1] + LENGTH + 2) * RATE))
    for onset in ONSETS:
        whole[round(onset * RATE) :][: MOTION.size] = MOTION
    return whole


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """An archive file of one unit, its trials and what was recorded of its stimulus."""
    file = pynwb.NWBFile("s", "i", datetime(2020, 1, 1, tzinfo=UTC))
    file.add_unit(spike_times=np.concatenate([onset + own for onset, own in zip(ONSETS, spike_times(), strict=True)]))
    for onset in ONSETS:
        file.add_trial(start_time=onset, stop_time=onset + LENGTH)
    motion = {"data": 1e6 * whole_session(), "unit": "um", "rate": RATE, "starting_time": 0.0}
    file.add_stimulus(pynwb.TimeSeries(name="motion", **motion))
    path = tmp_path_factory.mktemp("session") / "session.nwb"
    with pynwb.NWBHDF5IO(str(path), "w") as io:
        io.write(file)
    return path


def test_python_cuts_a_stimulus_on_the_clock_of_the_session_into_trials(session):
    shown = xr.DataArray(MOTION, {"time": TIME}, ["time"], attrs={"units": "m"})
    by_hand = vb.envelope_coupling(vb.read_spikes(session), shown, skip=0.5)
    with pytest.warns(Remark, match="the same in all 12 trials"):
        found = vb.envelope_coupling(session, session, skip=0.5)
    for name in ("envelope_correlation", "p_value", "threshold", "slope", "latency", "unit_rate"):
        np.testing.assert_allclose(found[name], by_hand[name], rtol=1e-6, err_msg=name)
    assert found.envelope_correlation.item() > 0.5


def test_a_stimulus_on_the_clock_of_the_session_needs_the_times_of_the_trials(session, tmp_path):
    rows = [f"u,{k},{t:.4f}" for k, own in enumerate(spike_times()) for t in own]
    (tmp_path / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *rows]))
    with refusal("missing", "spikes", "a stimulus on the session's clock"):
        vb.envelope_coupling(tmp_path / "spikes.csv", session, n_trials=TRIALS)


def test_the_times_of_a_cut_stimulus_count_from_the_onset_itself():
    """An envelope at 100 Hz, 4 ms before whose samples the trials begin."""
    clock = np.arange(0, 60, 0.01)
    stimulus = labelled_stimulus(clock, 1 + np.sin(2 * np.pi * 0.7 * clock), "a.u.", envelope=True)
    onsets = 3.006 + 5 * np.arange(10)
    found, _ = cut_stimulus(stimulus, trial_table(onsets, onsets + 3), "s")
    assert found.time.values[0] == pytest.approx(0.004, abs=1e-9)


@pytest.mark.parametrize("rate", [600.0, 3000.0, 24414.0625, 30000.0])
def test_a_clock_that_is_rounded_gives_the_stimulus_that_it_gives_exactly(rate):
    """A motion from each onset on, at times to the microsecond: its step is no whole number of them."""
    clock = np.arange(int(rate * 12)) / rate
    onsets = np.round(np.array([1.0, 5.0, 8.5]) * rate) / rate
    motion = np.sin(2 * np.pi * 65 * (clock - onsets[np.clip(np.searchsorted(onsets, clock, "right") - 1, 0, None)]))
    trials = trial_table(onsets, onsets + LENGTH)
    exact, _ = cut_stimulus(labelled_stimulus(clock, motion), trials, "s")
    found, _ = cut_stimulus(labelled_stimulus(np.round(clock, 6), motion), trials, "s")
    np.testing.assert_allclose(found.time, exact.time, rtol=0, atol=2e-6)  # twice the rounding
    np.testing.assert_allclose(found.point_displacement, exact.point_displacement, rtol=0, atol=2e-4 * rate / 600)
    assert len(Presentation.of(found, window=(0, LENGTH)).edges) == 301


@pytest.mark.parametrize("slower", [1.06, 1.25, 0.8, 1.001])
def test_a_trial_at_another_rate_is_refused(slower):
    """Each trial is even; the last one has another step, so that its samples would be those of another time."""
    clock = np.arange(0, 12, 1e-3)
    clock[clock > 8] = 8 + slower * (clock[clock > 8] - 8)
    stimulus = labelled_stimulus(clock, np.sin(2 * np.pi * 65 * clock))
    with refusal("range", "s: time", "uneven"):
        cut_stimulus(stimulus, trial_table(np.array([1.0, 4.5, 8.1]), np.array([4.0, 7.5, 11.1])), "s")


def test_samples_of_an_envelope_that_scatter_about_the_onsets_are_remarked_on():
    clock = np.arange(0, 60, 0.01)
    stimulus = labelled_stimulus(clock, np.ones(clock.size), "a.u.", envelope=True)
    onsets = 3.0 + 5 * np.arange(10) + np.where(np.arange(10) % 2, 0.004, 0.0)
    _, remarks = cut_stimulus(stimulus, trial_table(onsets, onsets + 3), "s")
    assert any("latencies are uncertain by 2 ms" in line for line in remarks)


@pytest.mark.parametrize("rate", [1000.0, 2000.0, 20000.0])
def test_one_motion_is_the_same_in_all_trials_wherever_its_samples_lie(rate):
    """A carrier of 100 Hz, played at onsets anywhere between two samples; its mean keeps its size."""
    onsets = 1.0 + 2 * np.arange(12) + np.random.default_rng(2).uniform(0, 0.5, 12)
    clock = np.arange(0, 27, 1 / rate)
    since = clock - onsets[np.clip(np.searchsorted(onsets, clock) - 1, 0, None)]

    def played(time):
        slow = 1 + 0.5 * np.sin(2 * np.pi * 3 * time)
        return np.where((time > -0.1) & (time < 1.4), 40e-6 * slow * np.sin(2 * np.pi * 100 * time), 0.0)

    trials = trial_table(onsets, onsets + 1)
    found, remarks = cut_stimulus(labelled_stimulus(clock, played(since)), trials, "s")
    assert "trial" not in found.dims, remarks
    time, inside = found.time.values, slice(20, -20)
    np.testing.assert_allclose(found.point_displacement[inside], played(time)[inside], atol=0.02 * 40e-6)


def test_stimuli_that_differ_are_said_to_with_their_correlation():
    clock = np.arange(0, 30, 1 / RATE)
    stimulus = labelled_stimulus(clock, 1e-5 * np.random.default_rng(1).normal(size=clock.size))
    found, remarks = cut_stimulus(stimulus, trial_table(ONSETS[:2], ONSETS[:2] + LENGTH), "s")
    each = found.point_displacement.values
    r = min(np.corrcoef(one, each.mean(0))[0, 1] for one in each)
    assert f"down to {r:.3f}" in remarks[0]


def played_in_trials(sizes, noise=0.0):
    """The motion in each trial by these sizes, and noise, as parts of its own [m]."""
    whole = whole_session()
    for onset, size in zip(ONSETS, sizes, strict=True):
        whole[round(onset * RATE) :][: MOTION.size] *= size
    return whole + noise * MOTION.std() * np.random.default_rng(5).normal(size=whole.size)


@pytest.mark.parametrize("sizes", [[1, 0.2], [1, 0], [1, -1], [1.2, 0.8]], ids=str)
def test_trials_of_other_sizes_have_their_own_stimulus(sizes):
    """What was played, also in trials without stimulus; the mean was played in none."""
    sizes = np.resize(np.array(sizes, float), TRIALS)
    stimulus = labelled_stimulus(np.arange(played_in_trials(sizes).size) / RATE, played_in_trials(sizes))
    found, remarks = cut_stimulus(stimulus, trial_table(ONSETS, ONSETS + LENGTH), "s")
    np.testing.assert_allclose(found.point_displacement, sizes[:, None] * MOTION, atol=1e-12)
    assert "each of 12 trials has its own" in remarks[0]


@pytest.mark.parametrize(("sizes", "noise"), [([1, 1], 0.1), ([1.05, 0.95], 0.0)])
def test_one_motion_with_noise_is_the_same_in_all_trials(sizes, noise):
    whole = played_in_trials(np.resize(sizes, TRIALS), noise)
    stimulus = labelled_stimulus(np.arange(whole.size) / RATE, whole)
    found, remarks = cut_stimulus(stimulus, trial_table(ONSETS, ONSETS + LENGTH), "s")
    assert found.point_displacement.dims == ("time",), remarks


@pytest.mark.parametrize(("level", "alike"), [(0.0, True), (5.0, False)])
def test_envelopes_of_another_level_are_others(level, alike):
    clock = np.arange(0, 60, 1 / RATE)
    envelope = np.full(clock.size, 1.0)
    for k, onset in enumerate(ONSETS):
        envelope[round(onset * RATE) :][: SLOW.size] = SLOW + level * (k % 2)
    stimulus = labelled_stimulus(clock, envelope, "a.u.", envelope=True)
    found, _ = cut_stimulus(stimulus, trial_table(ONSETS, ONSETS + LENGTH), "s")
    assert ("trial" not in found.dims) is alike


def test_trials_without_stimulus_keep_the_threshold(tmp_path):
    """A unit that fires 400 Hz per 40 µm above 30 µm, and 5 Hz at rest; every other trial is at rest."""
    rng, size = np.random.default_rng(6), 40e-6 * SLOW
    rate = 5 + 1e7 * np.maximum(size - 30e-6, 0)
    own = [rate if k % 2 else np.full(TIME.size, 5.0) for k in range(TRIALS)]
    times = [onset + TIME[rng.uniform(size=TIME.size) < one / RATE] for onset, one in zip(ONSETS, own, strict=True)]
    whole = played_in_trials(np.arange(TRIALS) % 2)
    path = session_of(tmp_path / "catch.nwb", whole, ONSETS, np.array([0.5]))
    spikes = vb.read_spikes({"u": np.concatenate(times)}, trials=np.stack([ONSETS, ONSETS + LENGTH], 1))
    with pytest.warns(Remark, match="each of 12 trials has its own"):
        found = vb.envelope_coupling(spikes, path, skip=0.2)
    assert found.threshold.item() == pytest.approx(30e-6, rel=0.1)


JITTER = 60e-6 * np.random.default_rng(3).uniform(-1, 1, TRIALS)


@pytest.mark.parametrize(
    "late", [2e-9, -2e-9, 4e-4, -4e-4, JITTER], ids=["2 ns", "-2 ns", "0.4 ms", "-0.4 ms", "jitter"]
)
def test_trials_between_samples_have_as_many_samples_as_those_on_them(late):
    """Onsets by less than half a sample before or after one, and a window that is the whole trial."""
    clock = np.arange(0, 60, 1 / RATE)
    stimulus = labelled_stimulus(clock, np.resize(MOTION, clock.size))
    onsets = ONSETS - late
    found, _ = cut_stimulus(stimulus, trial_table(onsets, onsets + LENGTH), "s")
    assert found.sizes["time"] == TIME.size
    assert found.time.values[0] == pytest.approx(np.mean(late), abs=1e-3 / RATE)
    one = found.isel(trial=0) if "trial" in found.dims else found
    assert len(Presentation.of(one, window=(0, LENGTH)).edges) == 301


def test_a_recording_may_end_within_a_sample_of_its_last_trial_but_not_a_whole_one_before():
    onsets = np.array([1.0, 5.0]) - 4e-4
    trials = trial_table(onsets, onsets + LENGTH)
    clock = np.arange(7999) / RATE  # the last of 3000 samples of the second trial would be at 7.999 s
    found, _ = cut_stimulus(labelled_stimulus(clock, np.sin(400 * clock)), trials, "s")
    assert found.sizes["time"] == 2999
    assert len(Presentation.of(found.isel(trial=0), window=(0, LENGTH)).edges) == 301
    with refusal("range", "s", "0 to 7.997 s"):
        cut_stimulus(labelled_stimulus(clock[:-1], np.sin(400 * clock[:-1])), trials, "s")
    with refusal("range", "s", "0 to 7.998 s"):
        cut_stimulus(
            labelled_stimulus(clock, np.sin(400 * clock)), trial_table(onsets + 4e-4, onsets + 4e-4 + LENGTH), "s"
        )


def session_of(path, motion, onsets, times, rate=RATE):
    """An archive file of a unit that fires at the same times of every trial."""
    file = pynwb.NWBFile("s", "i", datetime(2020, 1, 1, tzinfo=UTC))
    file.add_unit(spike_times=np.concatenate([onset + times for onset in onsets]))
    for onset in onsets:
        file.add_trial(start_time=onset, stop_time=onset + LENGTH)
    file.add_stimulus(pynwb.TimeSeries(name="motion", data=1e6 * motion, unit="um", rate=rate, starting_time=0.0))
    with pynwb.NWBHDF5IO(str(path), "w") as io:
        io.write(file)
    return path


def test_spikes_before_the_first_sample_are_left_out_by_both_doors_with_a_remark(tmp_path):
    """One spike of every trial lies between its onset and the first sample of its stimulus."""
    times = np.append(1e-4, np.arange(0.05, 2.95, 0.07))
    path = session_of(tmp_path / "late.nwb", whole_session(), ONSETS - 4e-4, times)
    line = f"{TRIALS} of {TRIALS * times.size} spikes lie beyond the stimulus, 0.0004 to 3.0004 s, and are left out"
    read = read_recording(SpikesInput(spikes=str(path)), StimulusInput(stimulus=str(path)))
    assert f"{TRIALS} spikes lie outside 0.0004 to 3.0004 s of every trial and are left out" in read.remarks
    with pytest.warns(Remark) as seen:
        found = vb.envelope_coupling(path, path, skip=0.5)
    assert line in " ".join(str(one.message) for one in seen)
    assert found.sizes["spike"] == read.spikes.sizes["spike"] == TRIALS * (times.size - 1)


def test_trials_end_within_a_step_of_a_slow_envelope(tmp_path):
    """At 20 Hz the last sample, which lies in the trial, lasts 20 ms longer than the trial."""
    clock = np.arange(0, 55, 0.05)
    envelope = labelled_stimulus(clock, 1 + np.sin(2 * np.pi * 0.7 * clock), "a.u.", envelope=True)
    trials = trial_table(ONSETS - 0.02, ONSETS - 0.02 + LENGTH)
    cut, _ = cut_stimulus(envelope, trials, "s")
    assert cut.sizes["time"] == 60
    times = np.concatenate([one + np.arange(0.05, 2.95, 0.07) for one in trials.trial_start.values])
    spikes = vb.read_spikes({"u": times}, trials=np.stack([trials.trial_start, trials.trial_stop], 1))
    refuse_misplaced(spikes, cut, TRIALS)


@pytest.mark.parametrize("lead", [None, "whisker"])
def test_one_sample_that_is_not_known_leaves_the_others_of_its_trial(lead):
    """A sine of 65 Hz at onsets between samples: what is known is the sine at the times of the table."""
    clock = np.arange(0, 10, 1 / RATE)
    motion = np.sin(2 * np.pi * 65 * clock)
    motion[2500] = np.nan
    onsets = np.array([1.0, 5.0003])
    several = {"whisker": np.array(["C1", "C2"])} if lead else {}
    values = np.stack([motion, motion]) if lead else motion
    trials = trial_table(onsets, onsets + LENGTH)
    found, remarks = cut_stimulus(labelled_stimulus(clock, values, lead=several), trials, "s")
    each = found[name_of(found)].transpose(..., "trial", "time").values
    assert np.isnan(each[..., 0, :]).sum(-1).max() == 2  # the samples on both sides of it
    assert np.isfinite(each[..., 1, :]).all()
    expected = np.sin(2 * np.pi * 65 * (onsets[:, None] + found.time.values))
    error = np.abs(each - expected)[..., 20:-20]
    assert np.nanmax(error) < 1e-3
    assert "trials cannot be compared" in remarks[0]


def two_channels(others):
    """The motion in all trials, and another channel [m]."""
    return labelled_stimulus(
        np.arange(whole_session().size) / RATE,
        np.stack([whole_session(), others]),
        lead={"whisker": np.array(["C1", "C2"])},
    )


def test_a_channel_at_rest_under_noise_is_named_as_that_which_differs(tmp_path, vibrissa):
    noise = 1e-3 * MOTION.std() * np.random.default_rng(5).normal(size=whole_session().size)
    trials = trial_table(ONSETS, ONSETS + LENGTH)
    for others, differing in (
        (noise, {"C2": pytest.approx(1e-3, rel=0.05)}),
        (noise + 5.0, {"C2": pytest.approx(1e-3, rel=0.05)}),
        (played_in_trials(np.resize([1.0, 0.2], TRIALS)), {"C2": pytest.approx(0.72, abs=0.01)}),
        (1e-3 * whole_session(), None),
        (0 * noise, None),
    ):
        found, _ = cut_stimulus(two_channels(others), trials, "s")
        assert ("trial" in found.dims) == (differing is not None)
        assert differing is None or channels_that_differ(found) == differing
    both, _ = cut_stimulus(two_channels(noise).isel(whisker=[1, 1]), trials, "s")
    assert channels_that_differ(both) == {}
    path = session_of(tmp_path / "two.nwb", np.stack([whole_session(), noise], 1), ONSETS, np.array([0.5]))
    for verb in ("glm", "surround"):
        code, out, err = vibrissa(verb, "--spikes", path, "--stimulus", path)
        assert (code, out) == (2, "")
        assert (
            "must be the same in all trials, got one for each in motion:1 (0.1 % of the largest), not in other" in err
        )
        assert "leave a channel out that rested" in err
    path = session_of(tmp_path / "one.nwb", whole_session(), ONSETS, TIME[::60])
    assert vibrissa("glm", "--spikes", path, "--stimulus", path)[0] == 0
