"""The window without stimulus: how it is typed, and that it holds none."""

import json

import numpy as np
import pytest
from refusals import refusal

import vibrissa as vb
from vibrissa.api.objects.spikes import as_spikes
from vibrissa.cli.shared.words.units import with_negative
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.stimuli import labelled_stimulus
from vibrissa.study.neurons.rest import refuse_driven

TRIALS, LENGTH, PERIOD, REST = 12, 4.0, 7.0, 2.0  # of a rate of 2 Hz at rest and of 20 Hz under the stimulus


@pytest.fixture
def session(tmp_path):
    """A ringing stimulus of 4 s every 7 s, and a unit of 2 Hz that fires at 20 Hz under it, on the session's clock."""
    rng = np.random.default_rng(0)
    time = np.arange(8000) / 2000
    motion = 5e-5 * (1 + np.sin(2 * np.pi * 0.7 * time)) * np.sin(2 * np.pi * 65 * time)
    np.savetxt(tmp_path / "stimulus.csv", np.c_[time, motion], delimiter=",", header="time,displacement", comments="")
    onset = 10 + PERIOD * np.arange(TRIALS)
    rest = rng.uniform(0, 100, rng.poisson(REST * 100))
    driven = [start + rng.uniform(0, LENGTH, rng.poisson(18 * LENGTH)) for start in onset]
    lines = [f"a,{t:.5f}" for t in np.sort(np.concatenate([rest, *driven]))]
    (tmp_path / "spikes.csv").write_text("\n".join(["unit,spike_time", *lines]))
    (tmp_path / "trials.csv").write_text("\n".join(["start,stop", *(f"{s},{s + LENGTH}" for s in onset)]))
    return tmp_path


def neural(folder, *window):
    files = ("--spikes", folder / "spikes.csv", "--stimulus", folder / "stimulus.csv")
    return ("neural", *files, "--trial-table", folder / "trials.csv", "--json", "--spontaneous", *window)


@pytest.mark.parametrize("window", [("-2s", "-0.5s"), ("-2", "-500ms"), ("-2000ms", "-0.5"), ("-2e0s", "-.5s")])
def test_both_values_of_a_window_may_be_negative_with_a_unit(vibrissa, session, window):
    (code, out, _), (_, bare, _) = (vibrissa(*neural(session, *one)) for one in (window, (-2, -0.5)))
    assert code == 0
    assert json.loads(out) == json.loads(bare)
    code, _, err = vibrissa(*neural(session, "-0.5s", "-2s"))
    assert (code, err) == (2, "vibrissa: --spontaneous must start before it stops, got (-0.5, -2.0)\n")


def test_names_after_two_dashes_stay():
    words = ["show", "--json", "--window", "-2s", "-1s", "--", "-5mm.nc", "-2s"]
    assert with_negative(words) == ["show", "--json", "--window=-2s", " -1s", "--", "-5mm.nc", "-2s"]


def test_one_negative_value_of_two_is_too_few(vibrissa, session):
    code, _, err = vibrissa(*neural(session, "-2s"))
    assert code == 2
    assert "must be given, with its 2 values. Only got 1; for example --spontaneous" in err


def test_a_window_that_reaches_into_the_stimulus_of_another_trial_is_refused(vibrissa, session):
    """Of 4 s every 7 s: rest is from -3 to 0 s, and from 4 to 7 s."""
    rule = "--spontaneous must not reach into the stimulus of another trial, got"
    for window, found in {
        (-5, 0): "-5 to 0 s, by 2 s in 11 of 12 trials; start it at -3 s",
        (4, 9): "4 to 9 s, by 2 s in 11 of 12 trials; stop it at 7 s",
        (-4, 8): "-4 to 8 s, by 2 s in 12 of 12 trials; start it at -3 s and stop it at 7 s",
        (-6, -5): "-6 to -5 s, by 1 s in 11 of 12 trials; no stimulus is there from -3 to 0 s",
    }.items():
        code, out, err = vibrissa(*neural(session, *window))
        assert (code, out, err) == (2, "", f"vibrissa: {rule} {found}\n")
    code, out, _ = vibrissa(*neural(session, -3, 0))
    rate = json.loads(out)["units"][0]["spontaneous_rate"]
    assert (code, rate) == (0, pytest.approx(REST, abs=3 * np.sqrt(REST / (3 * TRIALS))))


def test_a_window_that_reaches_into_trials_left_out_is_remarked_on(vibrissa, session):
    """Every other trial is of another protocol, whose stimulus is not known."""
    lines = (session / "trials.csv").read_text().splitlines()
    named = [f"{line},{'AB'[k % 2]}" for k, line in enumerate(lines[1:])]
    (session / "trials.csv").write_text("\n".join(["start,stop,protocol", *named]))
    for window, expected in {
        (-5, 0): "in 5 of 6 trials -5 to 0 s reaches into one that is left out",
        (-3, 0): "",
    }.items():
        code, _, err = vibrissa(*neural(session, *window), "--only", "protocol", "A")
        assert code == 0
        assert ("left out: the rate there" in err) == bool(expected)
        assert expected in err


def test_the_same_window_is_refused_in_python(session):
    trials = np.loadtxt(session / "trials.csv", delimiter=",", skiprows=1)
    spikes = as_spikes(session / "spikes.csv", trials=trials, window=(-5.0, 4.0))
    with refusal("range", "spontaneous", "-5 to 0 s, by 2 s in 11 of 12 trials"):
        vb.envelope_coupling(spikes, session / "stimulus.csv", spontaneous=(-5.0, 0.0))


def test_a_window_in_the_rest_at_the_end_of_a_stimulus_is_taken(session):
    """The same stimulus, recorded to the next onset: its end overlaps the window, and nothing moves there."""
    time, motion = np.loadtxt(session / "stimulus.csv", delimiter=",", skiprows=1).T
    more = np.arange(time.size, round(PERIOD * 2000)) / 2000
    rested = [(np.r_[time, more], np.r_[motion, 0 * more]), (time, motion)]
    long, short = (labelled_stimulus(when, moved) for when, moved in rested)
    onset = 10 + PERIOD * np.arange(TRIALS)
    spikes = spike_table([0.5], [0], ["a"], trial=[0]).assign(trial_start=("trial", onset))
    for window in ((-2.0, 0.0), (4.5, 6.5)):
        refuse_driven(spikes, long, window)
        refuse_driven(spikes, short, window)
    for stimulus in (long, short):
        with refusal("range", "spontaneous", "-4 to -3 s, by 1 s in 11 of 12 trials"):
            refuse_driven(spikes, stimulus, (-4.0, -3.0))
    each = long.expand_dims(trial=TRIALS, axis=0).copy(deep=True)
    each["point_displacement"][:3] = 0.0  # nothing was shown in the first three
    with refusal("range", "spontaneous", "-4 to -3 s, by 1 s in 8 of 12 trials"):
        refuse_driven(spikes, each, (-4.0, -3.0))
    refuse_driven(spikes.assign(trial_start=("trial", 100 * onset)), short, (-50.0, 0.0))
    with refusal("range", "spontaneous", "-4 to -3 s, by 1 s in 8 of 12 trials"):
        refuse_driven(
            spikes.assign(trial_start=("trial", onset[::-1])), each.isel(trial=slice(None, None, -1)), (-4, -3)
        )
    refuse_driven(spikes.drop_vars("trial_start"), short, (-50.0, 0.0))
