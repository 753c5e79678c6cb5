"""The window without stimulus, of a stimulus on the session's clock, of trials that were selected, and under noise."""

import json
from datetime import UTC, datetime

import numpy as np
import pandas as pd
import pytest
from refusals import refusal

import vibrissa as vb
from vibrissa.api.remarks import Remark
from vibrissa.neural.io.tables.stimuli import labelled_stimulus
from vibrissa.neural.io.tables.trials import trial_table
from vibrissa.quantities import dataset
from vibrissa.study.neurons.rest import refuse_driven, refuse_moving, remarks_on_rest
from vibrissa.study.neurons.session_stimuli import cut_stimulus

pynwb = pytest.importorskip("pynwb")

RATE, LENGTH, PERIOD, TRIALS = 1000.0, 2.0, 3.0, 20  # of a unit of 6 Hz at rest and of 56 Hz under the stimulus
ONSETS = 5 + PERIOD * np.arange(TRIALS)
CLOCK = np.arange(round(RATE * (ONSETS[-1] + 5))) / RATE
INTO, REST = (-2.5, -1.1), (-1.0, 0.0)  # windows in the stimulus of the trial before, and after it
CATCH = np.arange(TRIALS) % 2 == 0  # trials that have none, where some have none
RULE = "must lie where the stimulus on the session's clock rests"


def motion(sizes, noise=0.0):
    """What was recorded of a ringing motion of these sizes in the trials, and of the noise of the sensor [m]."""
    rng, found = np.random.default_rng(7), np.zeros(CLOCK.size)
    for onset, size in zip(ONSETS, sizes, strict=True):
        since, phase = CLOCK - onset, rng.uniform(0, 6)
        slow = 1 + 0.8 * np.sin(2 * np.pi * 2.3 * since + phase)
        found += np.where((since >= 0) & (since < LENGTH), 1e-4 * size * slow * np.sin(2 * np.pi * 120 * since), 0)
    return found + noise * rng.normal(size=CLOCK.size)


def session(path, sizes, noise=0.0):
    """An archive file of one unit, its trials and what was recorded of its stimulus."""
    rng = np.random.default_rng(5)
    driven = [onset + rng.uniform(0, LENGTH, 100) for onset, size in zip(ONSETS, sizes, strict=True) if size]
    file = pynwb.NWBFile("s", "i", datetime(2020, 1, 1, tzinfo=UTC))
    file.add_unit(spike_times=np.sort(np.concatenate([rng.uniform(0, CLOCK[-1], round(6 * CLOCK[-1])), *driven])))
    for onset in ONSETS:
        file.add_trial(start_time=onset, stop_time=onset + LENGTH)
    file.add_stimulus(
        pynwb.TimeSeries(name="motion", data=motion(sizes, noise), unit="m", rate=RATE, starting_time=0.0)
    )
    with pynwb.NWBHDF5IO(str(path), "w") as io:
        io.write(file)
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A stimulus in all trials."""
    return session(tmp_path_factory.mktemp("rest") / "all.nwb", np.ones(TRIALS))


def near_rest(rate, trials, seconds):
    assert rate == pytest.approx(6, abs=4 * np.sqrt(6 / (trials * seconds)))


@pytest.mark.parametrize("trials", [[1, 3, 6, 8], [8, 6, 3, 1], [3]])
def test_trials_that_were_selected_leave_the_stimuli_of_the_others_where_they_were(recording, trials):
    spikes = vb.read_spikes(recording, window=(-3.0, LENGTH)).isel(trial=trials)
    found = f"-2.5 to -1.1 s, where it moves in {len(trials)} of {len(trials)} trials"
    with refusal("range", "spontaneous", found) as caught:
        vb.envelope_coupling(spikes, recording, skip=0.1, spontaneous=INTO)
    assert (caught.value.rule, caught.value.remedy) == (RULE, "it rests from -1 to 0 s")
    found = vb.envelope_coupling(spikes, recording, skip=0.1, spontaneous=REST)
    near_rest(found.spontaneous_rate.item(), len(trials), 1.0)


def test_none_selected_is_refused_in_one_line(recording):
    with refusal("too-few", "n_trials"):
        vb.envelope_coupling(vb.read_spikes(recording).isel(trial=[]), recording, skip=0.1, spontaneous=REST)


def test_so_does_a_table_of_some_trials(recording, tmp_path, vibrissa):
    frame = pd.DataFrame({"start": ONSETS, "stop": ONSETS + LENGTH, "kind": np.resize(["a", "b", "b"], TRIALS)})
    frame[::3].to_csv(tmp_path / "some.csv", index=False)
    frame.to_csv(tmp_path / "all.csv", index=False)
    words = ("neural", "--spikes", recording, "--stimulus", recording, "--skip", "0.1s", "--json", "--trial-table")
    for table in ((tmp_path / "some.csv",), (tmp_path / "all.csv", "--only", "kind", "a")):
        code, out, err = vibrissa(*words, *table, "--spontaneous", *INTO)
        assert (code, out) == (2, "")
        assert f"--spontaneous {RULE}, got -2.5 to -1.1 s, where it moves in 6 of 7 trials; it rests from -1 to" in err
        code, out, _ = vibrissa(*words, *table, "--spontaneous", *REST)
        near_rest(json.loads(out)["units"][0]["spontaneous_rate"], 7, 1.0)


@pytest.mark.parametrize("noise", [0.0, 1e-7])
def test_trials_without_stimulus_are_rest_also_where_the_sensor_has_noise(tmp_path, vibrissa, noise):
    """Every other trial, in which the window of the driven ones lies."""
    path = session(tmp_path / "catch.nwb", 1.0 * ~CATCH, noise)
    spikes = vb.read_spikes(path, window=(-3.0, LENGTH))
    with refusal("range", "spontaneous", "-2.5 to -1.1 s, by 1.4 s in 9 of 20 trials"):
        vb.envelope_coupling(spikes, path, skip=0.1, spontaneous=INTO)
    with pytest.warns(Remark) as seen:
        found = vb.envelope_coupling(spikes.isel(trial=~CATCH), path, skip=0.1, spontaneous=INTO)
    near_rest(found.spontaneous_rate.item(), (~CATCH).sum(), 1.4)
    said = " ".join(str(one.message) for one in seen)
    assert "in 10 of 10 trials -2.5 to -1.1 s reaches into one that is left out".capitalize() in said


def onsets_of(sizes, noise=0.0):
    """Trials in pairs, 3 s apart and 11 s from the next; of each the first is without stimulus."""
    onset = np.sort(np.r_[10 + 14.0 * np.arange(8), 13 + 14.0 * np.arange(8)])
    rng, time = np.random.default_rng(1), np.arange(2000) / RATE
    values = np.outer(sizes, np.sin(700 * time)) + noise * rng.normal(size=(16, 2000))
    spikes = dataset(spike_time=[-1.5], trial_start=onset)
    return spikes, labelled_stimulus(time, values, lead={"trial": None})


def test_noise_is_no_stimulus_and_a_weak_one_is_remarked_on():
    sizes = np.tile([0.0, 1e-4], 8)
    for noise, share in ((0.0, None), (1e-7, "0.2 %"), (1e-6, "2 %")):
        spikes, stimulus = onsets_of(sizes, noise)
        refuse_driven(spikes, stimulus, INTO)
        said = [line for line in remarks_on_rest(spikes, stimulus, INTO) if "taken as none" in line]
        assert len(said) == (share is not None)
        if said:
            size = 100 * noise / np.sqrt((1e-8 / 2 + 2 * noise**2) / 2)
            assert said == [
                f"in 8 of 16 trials -2.5 to -1.1 s reaches into a stimulus of {size:.2g} % of the size of all: "
                "it is taken as none"
            ]
    spikes, stimulus = onsets_of(np.tile([1e-5, 1e-4], 8))
    with refusal("range", "spontaneous", "-2.5 to -1.1 s, by 1.4 s in 8 of 16 trials"):
        refuse_driven(spikes, stimulus, INTO)


def test_offsets_of_trials_are_no_motion_and_hide_none():
    """A sensor that drifts by a hundred times the motion from trial to trial."""
    spikes, stimulus = onsets_of(np.tile([0.0, 1e-6], 8))
    drifted = stimulus.copy(data={"point_displacement": stimulus.point_displacement + 1e-4 * np.arange(16)[:, None]})
    refuse_driven(spikes, drifted, INTO)
    spikes, stimulus = onsets_of(np.full(16, 1e-6))
    drifted = stimulus.copy(data={"point_displacement": stimulus.point_displacement + 1e-4 * np.arange(16)[:, None]})
    with refusal("range", "spontaneous", "-2.5 to -1.1 s, by 1.4 s in 8 of 16 trials"):
        refuse_driven(spikes, drifted, INTO)


def judged(values, onsets, window, rate=RATE, **about):
    """Refusal of a window by what the session's stimulus does, if it is refused."""
    whole = labelled_stimulus(np.arange(values.size) / rate, values, **about)
    trials = trial_table(onsets, onsets + LENGTH)
    try:
        refuse_moving(whole, trials, cut_stimulus(whole, trials, "s")[0], window)
    except vb.InputError as error:
        return f"{error.value}; {error.remedy}"
    return ""


@pytest.mark.parametrize(("scale", "offset", "noise"), [(1.0, 0.0, 0.0), (1e6, 5e3, 0.0), (-1.0, 0.0, 2e-6)])
def test_the_session_says_where_its_stimulus_rests(scale, offset, noise):
    """Every fourth of trials of 2 s every 3 s: rest is from -1 to 0 s and from 2 to 3 s, and about the next ones."""
    values = scale * motion(np.ones(TRIALS), noise) + offset
    some, about = ONSETS[3::4], {"unit": "a.u."} if scale > 1 else {}
    for window, found in {
        (-2.5, -1.1): "-2.5 to -1.1 s, where it moves in 5 of 5 trials; it rests from -1 to 0 s",
        (-5.0, 0.0): "-5 to 0 s, where it moves in 5 of 5 trials; it rests from -1 to 0 s",
        (-1.5, 4.5): "-1.5 to 4.5 s, where it moves in 5 of 5 trials; it rests from -1 to 0 s and from 2 to 3 s",
        (3.1, 4.0): "3.1 to 4 s, where it moves in 4 of 5 trials; it rests from 2 to 3 s",
        (-1.0, 0.0): "",
        (-1.005, 0.0): "",  # by less than 10 ms
        (-4.0, -3.0): "",  # before the trial that is left out
        (2.0, 3.0): "",
        (0.5, 1.5): "",  # in the trial itself
        (-49.0, -48.0): "",  # before the recording, or at rest
    }.items():
        assert judged(values, some, window, **about) == found


@pytest.mark.parametrize("noise", [0.02, 0.1, 0.2])
def test_noise_of_the_sensor_is_rest_however_large(noise):
    """Up to a fifth of the motion."""
    clean = motion(np.ones(TRIALS))
    values = clean + noise * clean[clean != 0].std() * np.random.default_rng(3).normal(size=clean.size)
    for window, moves in ((REST, False), ((2.0, 3.0), False), (INTO, True), ((3.1, 4.0), True), ((-1.3, 0.0), True)):
        assert bool(judged(values, ONSETS[3::4], window)) is moves
    assert judged(values[ONSETS[0] <= CLOCK], ONSETS[3::4] - ONSETS[0], INTO)


def test_a_stimulus_that_never_rests_is_not_taken_for_noise():
    values = 1e-4 * np.sin(2 * np.pi * 120 * CLOCK)
    for window in (REST, INTO, (2.0, 3.0)):
        assert "let it lie where no stimulus moves" in judged(values, ONSETS, window)


def test_the_session_at_other_rates_with_holes_and_as_an_envelope():
    some = ONSETS[3::4]
    slow = np.abs(motion(np.ones(TRIALS)))
    assert "in 5 of 5 trials; it rests from -1 to 0 s" in judged(slow, some, INTO, envelope=True, unit="a.u.")
    assert judged(slow, some, REST, envelope=True, unit="a.u.") == ""
    assert judged(20 * np.log10(slow + 1e-9), some, INTO, envelope=True, unit="dB") == ""  # no level of rest is known
    holed = motion(np.ones(TRIALS))
    holed[np.abs(CLOCK - some[0] + 1.8) < 0.8] = np.nan  # what was not measured is not known to move
    assert "in 4 of 5 trials" in judged(holed, some, INTO)
    twice = np.repeat(motion(np.ones(TRIALS)), 2)
    assert "it rests from -1 to 0 s" in judged(twice, some, INTO, rate=2 * RATE)


def test_a_motion_between_the_trials_is_no_rest():
    values = motion(np.ones(TRIALS))
    back = (ONSETS[:, None] - 0.6 <= CLOCK) & (ONSETS[:, None] - 0.3 > CLOCK)
    values += np.where(back.any(0), 1e-4, 0.0)  # to another place and back, half a second before the next onset
    assert judged(values, ONSETS, REST) == "-1 to 0 s, where it moves in 20 of 20 trials; it rests from -0.3 to 0 s"
    assert judged(values, ONSETS, (-0.3, 0.0)) == ""


def test_a_window_that_reaches_into_trials_that_were_not_selected_is_remarked_on_as_with_only(tmp_path):
    """Of a stimulus that is known by the time from the onset alone."""
    time = np.arange(0, LENGTH, 1 / RATE)
    values = 1e-4 * (1 + 0.8 * np.sin(14 * time)) * np.sin(754 * time)
    pd.DataFrame({"time": time, "displacement": values}).to_csv(tmp_path / "s.csv", index=False)
    frame = pd.DataFrame({"start": ONSETS, "stop": ONSETS + LENGTH, "kind": np.resize(["a", "b", "b"], TRIALS)})
    times = {"u": np.sort(np.random.default_rng(2).uniform(0, 70, 900))}
    every = vb.read_spikes(times, trials=trial_table(ONSETS, ONSETS + LENGTH), window=(-3.0, LENGTH))
    frame.to_csv(tmp_path / "t.csv", index=False)
    some = vb.read_spikes(times, trials=trial_table(ONSETS[::3], ONSETS[::3] + LENGTH), window=(-3.0, LENGTH))
    twice = vb.read_spikes(every.isel(trial=slice(0, None, 3))).isel(trial=[5, 2, 1])
    line = "trials -2.5 to -1.1 s reaches into one that is left out: the rate there is spontaneous only if that one"
    for spikes, expected in ((every.isel(trial=slice(0, None, 3)), "In 6 of 7 "), (twice, "In 3 of 3 "), (some, "")):
        with pytest.warns(Remark) as seen:
            found = vb.envelope_coupling(spikes, tmp_path / "s.csv", skip=0.1, spontaneous=INTO)
        said = [str(one.message) for one in seen if line in str(one.message)]
        assert [one[: one.index("trials")] for one in said] == ([expected] if expected else [])
        assert "onsets" not in found.attrs
    with pytest.warns(Remark) as seen:
        vb.envelope_coupling(every.isel(trial=slice(0, None, 3)), tmp_path / "s.csv", skip=0.1, spontaneous=REST)
    assert not any(line in str(one.message) for one in seen)


@pytest.mark.parametrize("rate", [100, 150, 1000])
@pytest.mark.parametrize(("noise", "drift"), [(0.1, 0.0), (0.3, 0.0), (0.4, 0.0), (0.0, 0.2), (0.0, 1.0), (0.1, 0.2)])
def test_noise_and_drift_of_the_sensor_are_no_movement(rate, noise, drift):
    """Of the SD of the stimulus, and of that SD a second; another trial's stimulus is still seen beside them."""
    time = np.arange(0, 67, 1 / rate)
    shown = ((time[:, None] >= ONSETS) & (time[:, None] < ONSETS + LENGTH)).any(1)
    values = np.where(shown, np.sqrt(2) * np.sin(2 * np.pi * 0.3 * rate * time), 0.0)
    values += noise * np.random.default_rng(1).standard_normal(time.size) + drift * time
    some = ONSETS[3::4]
    assert judged(values, some, (-1.0, 0.0), rate=rate) == ""
    assert "where it moves in 5 of 5 trials" in judged(values, some, INTO, rate=rate)
