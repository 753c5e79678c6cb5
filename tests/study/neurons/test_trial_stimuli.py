"""Trials with stimuli of their own: what is joined counts as the trials did, in files and in Python."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.api.remarks import Remark
from vibrissa.neural.io.tables.stimuli import labelled_stimulus
from vibrissa.quantities import dataset
from vibrissa.study.neurons.neurons import analyse_neurons
from vibrissa.study.neurons.rest import remarks_on_rest
from vibrissa.study.spec.neurons import Neurons

RATE, LENGTH, TRIALS, SKIP = 500, 3.0, 12, 0.5
TIME = np.arange(int(LENGTH * RATE)) / RATE


def envelopes(seed=3):
    """A slow envelope of each trial, 0 to 2."""
    rng = np.random.default_rng(seed)
    phase, pace = rng.uniform(0, 6, (2, TRIALS, 1))
    return 1 + 0.9 * np.sin(2 * np.pi * (1.1 + pace / 3) * TIME + phase)


def spikes_of(envelope, seed=4):
    """Times in each trial: before the onset 12 Hz, then 25 Hz times the envelope, and 100 Hz more for 0.3 s."""
    rng, found = np.random.default_rng(seed), []
    for own in envelope:
        driven = TIME[rng.uniform(size=TIME.size) < 25 * own / RATE]
        before, onset = rng.uniform(-1, 0, rng.poisson(12)), rng.uniform(0, 0.3, rng.poisson(30))
        found.append(np.sort(np.concatenate([before, onset, driven])).round(6))
    return found


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Files of one unit and of the stimuli of its trials, and its spike times."""
    here, shown = tmp_path_factory.mktemp("trials"), envelopes()
    times = spikes_of(shown)
    rows = [(k, t, a) for k, own in enumerate(shown) for t, a in zip(TIME, own, strict=True)]
    pd.DataFrame(rows, columns=["trial", "time", "envelope_au"]).to_csv(here / "stimulus.csv", index=False)
    rows = [("u", k, t) for k, own in enumerate(times) for t in own]
    pd.DataFrame(rows, columns=["unit", "trial", "spike_time"]).to_csv(here / "spikes.csv", index=False)
    return here, times


def rate(times, start, stop):
    """Rate in a part of every trial [Hz], counted by hand."""
    return float(np.mean([np.sum((own >= start) & (own < stop)) for own in times])) / (stop - start)


@pytest.fixture(scope="module")
def joined(recording):
    """Units of the verb."""
    files = {"spikes": "spikes.csv", "stimulus": "stimulus.csv", "trials": TRIALS}
    return analyse_neurons(Neurons(**files, skip=SKIP, spontaneous=(-1.0, 0.0)), recording[0]).units


def test_the_spontaneous_rate_is_that_of_the_trials_before_they_are_joined(recording, joined):
    assert joined.spontaneous_rate.item() == pytest.approx(rate(recording[1], -1, 0), rel=1e-9)
    assert joined.attrs["spontaneous"].tolist() == [-1.0, 0.0]


def test_the_skip_is_left_out_of_the_rate_of_every_joined_trial(recording, joined):
    assert joined.unit_rate.item() == pytest.approx(rate(recording[1], SKIP, LENGTH), rel=1e-9)
    assert joined.attrs["skip"] == SKIP


def test_rates_at_the_onsets_of_joined_trials_change_no_result(recording, joined, tmp_path):
    """Spikes in the skip of every trial count nowhere, in the test, its chance nor the fit."""
    here, times = recording
    late = [("u", k, t) for k, own in enumerate(times) for t in own if t < 0 or t >= SKIP]
    pd.DataFrame(late, columns=["unit", "trial", "spike_time"]).to_csv(tmp_path / "late.csv", index=False)
    files = {"spikes": str(tmp_path / "late.csv"), "stimulus": str(here / "stimulus.csv"), "trials": TRIALS}
    found = analyse_neurons(Neurons(**files, skip=SKIP, spontaneous=(-1.0, 0.0))).units
    for name in ("unit_rate", "envelope_correlation", "p_value", "tail_p_value", "threshold", "slope", "latency"):
        np.testing.assert_allclose(found[name], joined[name], rtol=1e-9, err_msg=name)


def test_python_joins_trials_with_stimuli_of_their_own_as_the_verb_does(recording, joined):
    here, times = recording
    frame = pd.DataFrame([("u", k, t) for k, own in enumerate(times) for t in own], columns=["unit", "trial", "time"])
    how = {"n_trials": TRIALS, "skip": SKIP, "spontaneous": (-1.0, 0.0)}
    with pytest.warns(Remark, match="12 trials, each with its own stimulus"):
        found = vb.envelope_coupling(frame, here / "stimulus.csv", **how)
    for name in joined.data_vars:
        np.testing.assert_array_equal(found[name].values, joined[name].values, err_msg=name)
    assert found.attrs.keys() == joined.attrs.keys()
    assert len(vb.plot_unit(found).axes) > 3


def test_other_numbers_of_trials_in_spikes_and_stimulus_are_refused_in_python(recording):
    frame = pd.DataFrame({"unit": ["u"], "trial": [0], "time": [0.5]})
    with refusal("shape", "stimulus.csv", "12"):
        vb.envelope_coupling(frame, recording[0] / "stimulus.csv", n_trials=13)


def test_python_remarks_on_silent_trials_and_on_a_window_in_which_no_unit_fired(recording):
    """The same lines as of the verb."""
    frame = pd.DataFrame(
        [("u", k, t) for k in range(8) for t in np.linspace(0.01, 2.99, 40)], columns=["unit", "trial", "time"]
    )
    shown = xr.DataArray(envelopes()[0], {"time": TIME}, ["time"])
    with pytest.warns(Remark) as seen:
        vb.envelope_coupling(
            frame, shown, n_trials=TRIALS, skip=SKIP, spontaneous=(-1.0, 0.0), envelope=True, unit="a.u."
        )
    lines = " ".join(str(one.message) for one in seen)
    assert "The last 4 of 12 trials hold no spike of any unit: were they presented? " in lines + " "
    assert "o unit fired from -1 to 0 s" in lines


def test_a_unit_of_joined_motions_is_drawn_whatever_band_and_spontaneous_window_they_had(recording, tmp_path):
    """Of the result and of what was saved of it; the rate is that of the table."""
    _, times = recording
    rows = [
        (k, t, a)
        for k, own in enumerate(envelopes() * np.sin(2 * np.pi * 65 * TIME))
        for t, a in zip(TIME, own, strict=True)
    ]
    pd.DataFrame(rows, columns=["trial", "time", "displacement_um"]).to_csv(tmp_path / "motion.csv", index=False)
    frame = pd.DataFrame([("u", k, t) for k, own in enumerate(times) for t in own], columns=["unit", "trial", "time"])
    how = {"n_trials": TRIALS, "skip": SKIP, "spontaneous": (-1.0, 0.0), "band": (20.0, 200.0)}
    with pytest.warns(Remark):
        found = vb.envelope_coupling(frame, tmp_path / "motion.csv", **how)
    assert found.attrs["band"].tolist() == [20.0, 200.0]
    vb.save(found, tmp_path / "units.nc")
    for units in (found, vb.load(tmp_path / "units.nc")):
        assert len(vb.plot_unit(units, "u").axes) > 3


def test_spikes_beyond_the_stimulus_are_left_out_by_both_doors_with_a_remark(recording, tmp_path):
    """A table of one stimulus for all trials: the results of the verb, of the spikes within, and in Python are one."""
    here, _ = recording
    (tmp_path / "one.csv").write_text(
        "time,envelope_au\n" + "".join(f"{t},{a}\n" for t, a in zip(TIME, envelopes()[0], strict=True))
    )
    spikes = pd.read_csv(here / "spikes.csv")
    inside = spikes[spikes.spike_time >= 0]
    far = pd.DataFrame({"unit": ["u", "u"], "trial": [0, 5], "spike_time": [3.2, 7.0]})
    pd.concat([inside, far]).to_csv(tmp_path / "spikes.csv", index=False)
    line = f"2 of {len(inside) + 2} spikes lie beyond the stimulus, 0 to 3 s, and are left out"
    files = {"spikes": str(tmp_path / "spikes.csv"), "stimulus": str(tmp_path / "one.csv")}
    read = analyse_neurons(Neurons(**files, trials=TRIALS, skip=SKIP))
    assert line in read.remarks
    with pytest.warns(Remark, match=line):
        found = vb.envelope_coupling(files["spikes"], files["stimulus"], n_trials=TRIALS, skip=SKIP)
    plain = vb.envelope_coupling(inside, files["stimulus"], n_trials=TRIALS, skip=SKIP)
    for name in read.units.data_vars:
        np.testing.assert_array_equal(found[name].values, read.units[name].values, err_msg=name)
        np.testing.assert_array_equal(found[name].values, plain[name].values, err_msg=name)
    late = inside.assign(spike_time=inside.spike_time + 2.8)  # most lie beyond: no few
    with refusal("range", "spike_time"):
        vb.envelope_coupling(late, files["stimulus"], n_trials=TRIALS, skip=SKIP)


def coupling(spikes, stimulus, **how):
    """Results whose numbers are those of all trials together, whatever their order."""
    with pytest.warns(Remark, match="each with its own stimulus"):
        found = vb.envelope_coupling(spikes, stimulus, skip=SKIP, **how)
    return np.array([found[name].item() for name in ("unit_rate", "envelope_correlation", "slope")])


@pytest.fixture(scope="module")
def trials(recording):
    """The spikes of the recording as a table of trials on a clock, 10 s apart."""
    onsets = 10.0 + 10 * np.arange(TRIALS)
    times = np.concatenate([onset + own[own >= 0] for onset, own in zip(onsets, recording[1], strict=True)])
    return vb.read_spikes({"u": times}, trials=np.stack([onsets, onsets + LENGTH], 1))


def test_trials_in_another_order_keep_their_own_stimuli(recording, trials, tmp_path):
    """By both doors, and of a file of the table."""
    stimulus, mixed = recording[0] / "stimulus.csv", trials.isel(trial=np.random.default_rng(8).permutation(TRIALS))
    expected = coupling(trials, stimulus)
    assert expected[1] > 0.3
    vb.save(mixed, tmp_path / "mixed.nc")
    for one in (mixed, trials.sortby("trial", ascending=False), vb.read_spikes(mixed), tmp_path / "mixed.nc"):
        np.testing.assert_allclose(coupling(one, stimulus), expected, rtol=0.02)
    files = {"spikes": str(tmp_path / "mixed.nc"), "stimulus": str(stimulus), "skip": SKIP}
    verb = analyse_neurons(Neurons(**files)).units
    np.testing.assert_allclose(verb.envelope_correlation, expected[1], rtol=0.02)


def test_selected_trials_have_the_stimuli_of_their_numbers(recording, trials, tmp_path):
    """Those of a file of all trials are those of a file of the selected ones."""
    here, some = recording[0], [9, 2, 5, 7, 10, 0]
    rows = pd.read_csv(here / "stimulus.csv")
    parts = [rows[rows.trial == k].assign(trial=place) for place, k in enumerate(some)]
    pd.concat(parts).to_csv(tmp_path / "some.csv", index=False)
    chosen = vb.read_spikes(trials.isel(trial=some))
    first = coupling(vb.read_spikes(trials.isel(trial=slice(0, 6))), here / "stimulus.csv")
    mixed = coupling(vb.read_spikes(trials.isel(trial=[5, 4, 3, 2, 1, 0])), here / "stimulus.csv")
    np.testing.assert_allclose(first, mixed, rtol=0.02)
    anew = chosen.drop_vars("trial_number")
    np.testing.assert_array_equal(coupling(chosen, here / "stimulus.csv"), coupling(anew, tmp_path / "some.csv"))
    with refusal("shape", "some.csv", "6 trials"):
        vb.envelope_coupling(chosen, tmp_path / "some.csv")


@pytest.mark.parametrize("width", [0.01, 0.02])
def test_times_of_trials_may_be_rounded(recording, tmp_path, width):
    """At 1500 Hz, to the microsecond; the envelope and spikes are the same."""
    time = np.arange(int(LENGTH * 1500)) / 1500
    for name, clock in (("exact", time), ("rounded", np.round(time, 6))):
        parts = [
            pd.DataFrame({"trial": k, "time": clock, "a_au": np.interp(time, TIME, own)})
            for k, own in enumerate(envelopes())
        ]
        pd.concat(parts).to_csv(tmp_path / f"{name}.csv", index=False)
    rows = [("u", k, t) for k, own in enumerate(recording[1]) for t in own[own >= 0]]
    frame = pd.DataFrame(rows, columns=["unit", "trial", "time"])
    how = {"n_trials": TRIALS, "bin_width": width, "envelope": True}
    exact, rounded = (coupling(frame, tmp_path / f"{name}.csv", **how) for name in ("exact", "rounded"))
    np.testing.assert_allclose(rounded, exact, rtol=1e-3)
    with refusal("range", "bin_width", "0.0105"):
        vb.envelope_coupling(frame, tmp_path / "rounded.csv", n_trials=TRIALS, bin_width=0.0105, envelope=True)


@pytest.mark.parametrize(("moves", "hole"), [(0.0, 2.5), (0.0, 0.25), (1.0, 2.5)])
def test_a_hole_in_an_envelope_is_no_motion_before_the_onset(moves, hole):
    """An envelope that is 0 (or not) in its first half second, and not known in 10 ms."""
    envelope = np.where(TIME < 0.5, moves, 1 + 0.9 * np.sin(8 * TIME))
    envelope[(hole <= TIME) & (hole + 0.01 > TIME)] = np.nan
    stimulus = labelled_stimulus(TIME, envelope, "a.u.", envelope=True)
    heard = dataset(spike_time=[0.1])
    assert bool(remarks_on_rest(heard, stimulus, (0.0, 0.5))) is bool(moves)


def test_the_window_that_is_asked_for_leaves_out_most_spikes_where_the_stimulus_is_short():
    """Spikes over 12 s, a stimulus of 3 s: the remedy of the refusal serves, of times in milliseconds it does not."""
    rng = np.random.default_rng(9)
    frame = pd.DataFrame({"unit": "u", "trial": np.repeat(np.arange(8), 400), "time": rng.uniform(0, 12, 3200)})
    shown = xr.DataArray(envelopes()[0], {"time": TIME}, ["time"], attrs={"units": "a.u."})
    how = {"n_trials": 8, "skip": SKIP, "envelope": True}
    with refusal("range", "spike_time") as caught:
        vb.envelope_coupling(frame, shown, **how)
    assert "give `window`" in caught.value.remedy
    with pytest.warns(Remark, match="of 3200 spikes lie beyond the stimulus"):
        found = vb.envelope_coupling(frame, shown, window=(0.0, LENGTH), **how)
    inside = frame.time[(frame.time >= SKIP) & (frame.time < LENGTH)].size
    assert found.unit_rate.item() == pytest.approx(inside / 8 / (LENGTH - SKIP), rel=1e-9)
    for scale in (1e3, -1e3):  # on either side of the onset
        with refusal("range", "spike_time") as caught:
            vb.envelope_coupling(frame.assign(time=scale * frame.time), shown, window=(0.0, LENGTH), **how)
        assert "milliseconds" in caught.value.remedy


@pytest.mark.parametrize("lasted", [30.0, 40.0])
def test_spikes_in_long_trials_of_a_session_are_in_seconds(lasted):
    """Trials ten times as long as the stimulus and longer; the window alone is that of spikes cut to it."""
    onsets = 5 + 50 * np.arange(8.0)
    times = np.sort(np.random.default_rng(2).uniform(0, 400, 4000))
    shown = xr.DataArray(envelopes()[0], {"time": TIME}, ["time"], attrs={"units": "a.u."})
    how = {"skip": SKIP, "envelope": True, "window": (0.0, LENGTH)}
    long = vb.read_spikes({"u": times}, trials=np.stack([onsets, onsets + lasted], 1))
    with pytest.warns(Remark, match=f"of {long.sizes['spike']} spikes lie beyond the stimulus"):
        found = vb.envelope_coupling(long, shown, **how)
    cut = vb.envelope_coupling(vb.read_spikes({"u": times}, trials=onsets, window=(0.0, LENGTH)), shown, **how)
    for name in ("envelope_correlation", "p_value", "unit_rate"):
        np.testing.assert_array_equal(found[name], cut[name])
    scaled = long.assign(spike_time=1e3 * long.spike_time)
    with refusal("range", "spike_time") as caught:
        vb.envelope_coupling(scaled, shown, **how)
    assert "milliseconds" in caught.value.remedy


def test_the_remedy_of_long_trials_without_a_session_serves():
    frame = pd.DataFrame({"unit": "u", "trial": np.repeat(np.arange(8), 400)})
    frame["time"] = np.random.default_rng(9).uniform(0, 40, 3200)
    shown = xr.DataArray(envelopes()[0], {"time": TIME}, ["time"], attrs={"units": "a.u."})
    how = {"n_trials": 8, "skip": SKIP, "envelope": True, "window": (0.0, LENGTH)}
    with refusal("range", "spike_time") as caught:
        vb.envelope_coupling(frame, shown, **how)
    assert caught.value.remedy.endswith("if these are seconds from it, leave out those beyond the stimulus")
    assert vb.envelope_coupling(frame[frame.time < LENGTH], shown, **how).unit_rate.item() > 0


def test_a_stimulus_in_volts_is_taken_once_it_is_in_metres():
    volts = xr.DataArray(envelopes()[0] * np.sin(400 * TIME), {"time": TIME}, ["time"], attrs={"units": "V"})
    frame = pd.DataFrame({"unit": "u", "trial": 0, "time": np.linspace(0.1, 2.9, 300)})
    with refusal("unknown") as caught:
        vb.envelope_coupling(frame, volts, n_trials=1)
    assert "quantity" not in caught.value.remedy
    metres = (50e-6 * volts).assign_attrs(units="m")
    assert vb.envelope_coupling(frame, metres, n_trials=1).attrs["n_trials"] == 1
