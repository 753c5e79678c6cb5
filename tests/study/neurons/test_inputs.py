"""One way in: what is presented and recorded means the same in every form, and what is odd ends in one line."""

import json

import h5py
import numpy as np
import pytest
from refusals import refusal
from scipy.io import savemat

from vibrissa.neural.coupling.presentation import BinnedAnalysis, Presentation
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.stimuli import has_no_carrier, labelled_stimulus, presented
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.neurons.inputs import read_recording
from vibrissa.study.neurons.stimuli import read_stimulus
from vibrissa.study.neurons.trial_stimuli import end_to_end
from vibrissa.study.spec.given import SpikesInput, StimulusInput

RATE, TRIALS = 1000, 12
TIME = np.arange(3 * RATE) / RATE
SLOW = 1 + 0.5 * np.sin(2 * np.pi * 0.7 * TIME) + 0.3 * np.sin(2 * np.pi * 2.9 * TIME)
MOTION = 5e-5 * SLOW * np.sin(2 * np.pi * 65 * TIME)  # [m]


def table(path, **columns):
    np.savetxt(
        path, np.stack(list(columns.values()), 1), delimiter=",", header=",".join(columns), comments="", fmt="%.9g"
    )
    return path


def trains(seed=0):
    """Times of two units in each trial [s]."""
    rng = np.random.default_rng(seed)
    return [[np.sort(rng.uniform(0, 2.95, 30)) for _ in range(TRIALS)] for _ in range(2)]


def spike_lines(recording):
    rows = [f"u{u},{k},{t:.6f}" for u, unit in enumerate(recording) for k, one in enumerate(unit) for t in one]
    return "\n".join(["unit,trial,spike_time", *rows]) + "\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One recording and one stimulus, in many forms."""
    here = tmp_path_factory.mktemp("inputs")
    recording = trains()
    (here / "s.csv").write_text(spike_lines(recording))
    counts = np.zeros((300, TRIALS, 2), np.uint8)
    for u, unit in enumerate(recording):
        for k, one in enumerate(unit):
            np.add.at(counts[:, k, u], (one / 0.01).astype(int), 1)
    np.save(here / "s.npy", counts)
    savemat(here / "s.mat", {"counts": counts})
    with h5py.File(here / "s73.mat", "w") as file:
        file["counts"] = counts.T
    table(here / "m.csv", time=TIME, displacement=MOTION)
    table(here / "um.csv", time=TIME, displacement_um=1e6 * MOTION)
    table(here / "deg.csv", time=TIME, angle_deg=1e3 * MOTION)
    table(here / "two.csv", time=TIME, contra_um=1e6 * MOTION, ipsi_um=1e6 * MOTION[::-1])
    table(here / "bare.csv", time=TIME, contra=1e6 * MOTION)
    table(here / "env.csv", time=TIME, envelope_um=50 * SLOW)
    table(here / "level.csv", time=TIME, sound_dB=20 * np.log10(SLOW))
    table(here / "positive.csv", time=TIME, loudness_au=SLOW)
    table(here / "signed.csv", time=TIME, loudness_au=SLOW - 1)
    return here


def shown(folder, name, **how):
    return read_stimulus(StimulusInput(stimulus=name, **how), folder)


def test_one_motion_is_the_same_in_every_unit(folder):
    same = presented(shown(folder, "m.csv")[0])
    assert (same.unit, same.is_envelope) == ("m", False)
    for name, how in (("um.csv", {}), ("two.csv", {"whisker": "contra"}), ("bare.csv", {"signal_unit": "um"})):
        np.testing.assert_allclose(presented(shown(folder, name, **how)[0]).values, same.values, rtol=1e-7, atol=1e-12)
    turned = presented(shown(folder, "deg.csv")[0])
    assert turned.unit == "rad"
    np.testing.assert_allclose(turned.values, 1e3 * MOTION * np.pi / 180, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("column", ["displacement_cm", "displacement (mm)", "angle (rad)", "contra [um]"])
def test_a_column_that_ends_in_no_known_unit_is_not_taken_as_metres(tmp_path, column):
    table(tmp_path / "odd.csv", time=TIME, **{column: MOTION})
    with refusal("unknown", f"odd.csv: column {column!r}"):
        shown(tmp_path, "odd.csv")
    known, _ = shown(tmp_path, "odd.csv", signal_unit="um")
    np.testing.assert_allclose(presented(known).values, 1e-6 * MOTION, rtol=1e-7, atol=1e-15)


@pytest.mark.parametrize("column", ["displacement_C1", "displacement_left", "envelope_low", "motor (C1)"])
def test_names_of_channels_are_no_units(tmp_path, column):
    table(tmp_path / "named.csv", time=TIME, **{column: np.abs(MOTION)})
    assert shown(tmp_path, "named.csv")[1][0] == (
        f"named.csv: no known unit ends the name of {column}: taken as metres"
    )


def test_a_speed_keeps_its_unit_and_a_channel_without_one_is_said_to_be_in_metres(tmp_path):
    table(tmp_path / "speed.csv", time=TIME, velocity_mm_s=MOTION)
    speed, remarks = shown(tmp_path, "speed.csv")
    assert (presented(speed).unit, remarks) == ("m/s", [])
    np.testing.assert_allclose(presented(speed).values, 1e-3 * MOTION, rtol=1e-7, atol=1e-15)
    table(tmp_path / "puff.csv", time=TIME, pressure_kPa=MOTION)
    puff, remarks = shown(tmp_path, "puff.csv")
    assert (presented(puff).unit, remarks) == ("Pa", [])
    table(tmp_path / "pressure.csv", time=TIME, pressure_mmHg=MOTION)
    assert shown(tmp_path, "pressure.csv")[1] == [
        "pressure.csv: no known unit ends the name of pressure_mmHg: taken as metres"
    ]


def test_an_envelope_is_not_enveloped_again(folder):
    for name, how, told in (("env.csv", {}, 0), ("level.csv", {}, 0), ("positive.csv", {}, 1)):
        stimulus, remarks = shown(folder, name, **how)
        assert presented(stimulus).is_envelope
        assert len(remarks) == told
        seen = Presentation.of(stimulus, skip=0.0)
        np.testing.assert_array_equal(seen.envelope, presented(stimulus).values)
        assert seen.edge == 0


def test_results_are_in_the_unit_of_the_stimulus(folder, vibrissa):
    words = ("neural", "--spikes", folder / "s.csv", "--trials", TRIALS, "--skip", "0.5s", "--json")
    found = [json.loads(vibrissa(*words, "--stimulus", folder / one)[1])["units"] for one in ("env.csv", "um.csv")]
    for mine, theirs in zip(*found, strict=True):  # of a motion whose envelope the first is
        assert mine["envelope_correlation"] == pytest.approx(theirs["envelope_correlation"], abs=0.02)
        assert mine["p_value"] == pytest.approx(theirs["p_value"], abs=0.1)  # more bins count at the ends
    out, err = vibrissa(*words[:-1], "--stimulus", folder / "level.csv")[1:]
    assert "[dB]" in out, err
    assert "µm" not in out


def test_counts_in_bins_are_the_spikes_of_the_table(folder):
    given = StimulusInput(stimulus="m.csv")
    plain = read_recording(SpikesInput(spikes="s.csv", trials=TRIALS), given, folder)
    for name in ("s.npy", "s.mat", "s73.mat"):
        dense = read_recording(SpikesInput(spikes=name, counted_bin=0.01), given, folder, bin_width=0.01)
        assert dense.n_trials == TRIALS
        counted = [
            np.histogramdd(
                np.stack([one.spikes.spike_time, one.spikes.spike_trial, one.spikes.spike_unit], 1),
                [np.linspace(0, 3, 301), np.arange(TRIALS + 1), np.arange(3)],
            )[0]
            for one in (plain, dense)
        ]
        np.testing.assert_array_equal(*counted)


def test_spikes_beyond_the_stimulus_and_doubled_ones_are_counted(folder, vibrissa):
    text = spike_lines(trains()) + "u0,0,7.5\nu1,3,3.9\nu1,4,1.5\nu1,4,1.5\n"
    (folder / "odd.csv").write_text(text)
    words = ("--spikes", folder / "odd.csv", "--trials", TRIALS)
    for verb in (("neural", "--skip", "0.5s"), ("demodulation", "--skip", "0.5s", "--bin-width", "2ms")):
        code, _, err = vibrissa(*verb, *words, "--stimulus", folder / "m.csv")
        assert code == 0, err
        assert "2 of 724 spikes lie beyond the stimulus" in err
        assert "1 spikes have the very time of another of their unit" in err
    assert "1 spikes have the very time" in vibrissa("information", *words, "--window", 0, 3)[2]


def test_a_stimulus_of_each_trial_is_compared_with_that_trial(folder, vibrissa):
    """Units driven by the envelope of their own trial are found; with the envelopes of other trials they are not."""
    rng, lines, spikes = np.random.default_rng(3), ["trial,time,envelope_au"], ["unit,trial,spike_time"]
    for k in range(8):
        phase, pace = rng.uniform(0, 6, 2)
        own = 1 + 0.9 * np.sin(2 * np.pi * (1.1 + pace / 3) * TIME + phase)
        lines += [f"{k},{t:.3f},{a:.6f}" for t, a in zip(TIME, own, strict=True)]
        fired = TIME[rng.uniform(size=TIME.size) < 0.05 * own]
        spikes += [f"u,{k},{t:.4f}" for t in fired] + [f"v,{(k + 3) % 8},{t:.4f}" for t in fired]
    (folder / "each.csv").write_text("\n".join(lines))
    (folder / "driven.csv").write_text("\n".join(spikes))
    words = ("--spikes", folder / "driven.csv", "--stimulus", folder / "each.csv", "--trials", 8, "--skip", "0.1s")
    code, out, err = vibrissa("neural", *words, "--json")
    assert code == 0, err
    assert "8 trials, each with its own stimulus, are analysed as one presentation" in err
    own, other = json.loads(out)["units"]
    assert own["p_value"] < 0.01 < other["p_value"]
    assert own["envelope_correlation"] > 0.3


def test_units_that_missed_a_trial_with_its_own_stimulus_are_refused():
    seen = np.array([[True, True], [True, False]])
    spikes = spike_table([0.5, 0.6], [0, 1], ["u", "v"], trial=[0, 0], unit_observed=seen)
    with refusal("too-few", "units", "1 of 2 for 'v'"):
        end_to_end(spikes, labelled_stimulus(TIME, np.stack([MOTION, -MOTION]), lead={"trial": None}), BinnedAnalysis())


@pytest.mark.parametrize("fast", [65.0, 120.0])
def test_a_carrier_is_told_from_an_envelope(fast):
    rng = np.random.default_rng(1)
    slow = np.cumsum(rng.normal(size=6000))
    slow = 2 + (slow - slow.mean()) / slow.std()
    time = np.arange(6000) / RATE
    assert not has_no_carrier(slow * np.sin(2 * np.pi * fast * time), 1 / RATE)
    assert has_no_carrier(slow, 1 / RATE)
    assert has_no_carrier(rng.normal(size=6000), 1 / RATE)  # noise of all frequencies has none


def test_envelope_given_is_that_of_the_motion():
    motion = labelled_stimulus(TIME, MOTION)
    given = labelled_stimulus(TIME, analytic_envelope(MOTION)[0], envelope=True)
    ours, theirs = (Presentation.of(one, skip=0.5) for one in (motion, given))
    np.testing.assert_allclose(ours.binned(), theirs.binned(), rtol=1e-12)


STIMULI = {  # a file of a stimulus, and what the refusal says
    "time,displacement\n": "must hold",
    "displacement\n1\n": "must have a column time",
    "time\n0\n1\n": "must have a column beside time",
    "time;displacement\n0;1\n": "must separate its columns by commas",
    "time,displacement\n0,x\n": "must be a finite number",
    "time,displacement\n0,\n": "must be a finite number",
    "time,displacement\n0,inf\n": "must be a finite number",
    "time,displacement\n0,1,2\n": "must have 2 cells",
    "time,displacement,displacement_um\n0,1,2\n": "must name each channel once",
    "time,displacement,envelope_dB\n0,1,2\n": "must have channels of one unit and kind",
    "time,contra,ipsi\nLONG2": "must be given",
    "time,envelope_dB\nSHORT": "at least 100 samples",
    "time_ms,displacement_um\nLONG": "must be sampled at 100 Hz or above",
    "time,displacement\nFLAT": "must move",
    "time,displacement\nBIG": "must move by less than 1 cm",
    "time,contra\nBIG": "say otherwise by --signal-unit",
    "time,displacement\nBACK": "must be later than the one before",
    "time,displacement\nROUNDED": "times are rounded to 0.001 s",
    "time,displacement\nGAP": "must follow the one before evenly, by 0.001 s",
    "trial,time,displacement\n0,0,1\n1,0,1\n1,1,2\n": "must have as many samples",
    "trial,time,displacement\n-1,0,1\n": "must be a whole number from 0",
    "trial,time,displacement\n0,0,1\n0,1,2\n1,5,1\n1,6,2\n": "must have the same times in all trials",
    "\0\0\0": "must",
    "": "an empty file",
}


def filled(text):
    """Text with many lines in place of a word."""
    wave = 5e-5 * np.sin(2 * np.pi * 65 * TIME) * SLOW
    rows = {
        "LONG2": [f"{t},{x},{x}" for t, x in zip(TIME, 1e-3 * wave, strict=True)],
        "SHORT": [f"{t},{t}" for t in TIME[:50]],
        "LONG": [f"{1e5 * t},{x}" for t, x in zip(TIME, 1e6 * wave, strict=True)],
        "FLAT": [f"{t},0" for t in TIME],
        "BIG": [f"{t},{1e6 * x}" for t, x in zip(TIME, wave, strict=True)],
        "BACK": [f"{t if k != 50 else 0},{x}" for k, (t, x) in enumerate(zip(TIME, wave, strict=True))],
        "ROUNDED": [f"{t / 2:.3f},{x}" for t, x in zip(TIME, wave, strict=True)],
        "GAP": [f"{t + (k > 50)},{x}" for k, (t, x) in enumerate(zip(TIME, wave, strict=True))],
    }
    for word, lines in rows.items():
        if text.endswith("\n" + word):
            return text.removesuffix(word) + "\n".join(lines)
    return text


def refused(vibrissa, *words):
    """Refusal of a command, which is one line."""
    code, out, err = vibrissa(*words)
    lines = [line for line in err.splitlines() if "0:00:" not in line]
    assert (code, out, len(lines)) == (2, "", 1), err
    return lines[0]


@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize("trials", [TRIALS - 1, 2 * TRIALS])
def test_another_number_of_trials_than_a_file_states_is_refused(folder, tmp_path, vibrissa, trials, lost):
    counts = np.load(folder / "s.npy").astype(float)
    if lost:
        counts[:, 3, 1] = np.nan
    np.save(tmp_path / "s.npy", counts)
    spikes = ("--spikes", tmp_path / "s.npy", "--counted-bin", "10ms", "--trials", trials)
    for words in (("neural", *spikes, "--stimulus", folder / "m.csv"), ("information", *spikes, "--window", 0, 3)):
        line = refused(vibrissa, *words)
        assert f"--trials must be left out: the recording has {TRIALS}, got {trials}" in line


@pytest.mark.parametrize(("text", "message"), STIMULI.items())
def test_odd_stimuli_end_in_one_line(folder, tmp_path, vibrissa, text, message):
    (tmp_path / "x.csv").write_text(filled(text))
    words = ("neural", "--spikes", folder / "s.csv", "--stimulus", tmp_path / "x.csv", "--trials", TRIALS)
    assert message in refused(vibrissa, *words)


SPIKES = {  # a file of spikes, and what the refusal says
    "unit,trial,spike_time\n": "must hold at least one spike",
    "unit,trial\na,0\n": "must have a column spike_time",
    "unit,trial,spike_time\na,-1,0.5\n": "must be a whole number",
    "unit,trial,spike_time\na,0.5,0.5\n": "must be a whole number",
    "unit,trial,spike_time\na,0,now\n": "must be a finite number",
    "unit,trial,spike_time\n,0,0.5\n": "must name a unit",
    "unit,trial,spike_time\na,99,0.5\n": "must lie below the number of trials",
    "unit,trial,spike_time\na,0,500\na,0,900\n": "must lie within the stimulus",
    "unit,trial,spike_time\na,0,1e9\n": "give times in seconds",
    "unit,spike_time\na,0.5\n": "must be given the onsets of its trials",
    "unit,trial,spike_time,quality\na,0,0.5,SU\na,0,0.6,MU\n": "must be the same on all lines of a unit",
}


@pytest.mark.parametrize(("text", "message"), SPIKES.items())
def test_odd_spikes_end_in_one_line(folder, tmp_path, vibrissa, text, message):
    (tmp_path / "x.csv").write_text(text)
    words = ("neural", "--spikes", tmp_path / "x.csv", "--stimulus", folder / "m.csv")
    trials = () if text.startswith("unit,spike") else ("--trials", TRIALS)
    assert message in refused(vibrissa, *words, *trials)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((300, 12, 2)), "at least one spike"),
        (np.zeros(300), "bins x trials x units"),
        (np.zeros((3, 4, 5, 6)), "bins x trials x units"),
        (-np.ones((300, 12, 2)), "whole numbers from 0"),
        (0.5 * np.ones((300, 12, 2)), "whole numbers from 0"),
        (np.where(np.arange(300)[:, None, None] < 9, np.nan, np.ones((300, 12, 2))), "NaN throughout a trial"),
        (np.array([["a"]]), "must hold numbers"),
        (np.array([[None]], object), "without Python objects"),
        (np.full((300, 12, 2), 5000), "whole numbers from 0"),
    ],
)
def test_odd_counts_end_in_one_line(folder, tmp_path, vibrissa, array, message):
    np.save(tmp_path / "x.npy", array)
    words = ("neural", "--spikes", tmp_path / "x.npy", "--stimulus", folder / "m.csv", "--counted-bin", "10ms")
    assert message in refused(vibrissa, *words)


def test_odd_matlab_files_end_in_one_line(folder, tmp_path, vibrissa):
    words = ("neural", "--spikes", tmp_path / "x.mat", "--stimulus", folder / "m.csv", "--counted-bin", "10ms")
    savemat(tmp_path / "x.mat", {"one": np.ones((9, 9)), "two": np.ones((9, 9))})
    assert "must hold one array" in refused(vibrissa, *words)
    (tmp_path / "x.mat").write_bytes(b"MATLAB 5.0" + bytes(200))
    assert "must be a whole file of MATLAB" in refused(vibrissa, *words)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--spikes", "s.npy", "--stimulus", "m.csv"), "--counted-bin must be given"),
        (("--spikes", "s.npy", "--stimulus", "m.csv", "--counted-bin", "10ms", "--bin-width", "15ms"), "whole bins"),
        (("--spikes", "s.csv", "--stimulus", "m.csv", "--counted-bin", "10ms", "--trials", 12), "must go with counts"),
        (("--spikes", "s.csv", "--stimulus", "m.csv", "--unsorted", "--trials", 12), "must go with a .plx or .nex"),
        (("--spikes", "s.csv", "--stimulus", "m.csv", "--group", "good", "--trials", 12), "must state the quality"),
        (("--spikes", "s.csv", "--stimulus", "m.csv"), "--trials must be given"),
        (("--spikes", "s.csv", "--stimulus", "m.csv", "--trials", 0), "--trials must be at least 1"),
        (("--spikes", "s.csv", "--stimulus", "m.csv", "--trial-table", "trials"), "must be an existing file"),
        (("--spikes", "s.csv", "--stimulus", "two.csv", "--trials", 12), "--whisker must be given"),
        (("--spikes", "s.csv", "--stimulus", "two.csv", "--whisker", "left", "--trials", 12), "contra, ipsi"),
        (("--spikes", "s.csv", "--stimulus", "bare.csv", "--signal-unit", "furlong", "--trials", 12), "must be a unit"),
        (("--spikes", "s.csv", "--stimulus", "um.csv", "--signal-unit", "mm", "--trials", 12), "states it"),
        (("--spikes", "s.csv", "--stimulus", "signed.csv", "--trials", 12), "give --envelope if it is one already"),
        (("--spikes", "s.csv", "--stimulus", "m.csv", "--band", 300, 400, "--trials", 12), "must hold a carrier"),
        (("--spikes", "s.csv", "--stimulus", "env.csv", "--band", 30, 90, "--trials", 12), "--band must go with"),
    ],
)
def test_options_that_do_not_fit_end_in_one_line(folder, vibrissa, monkeypatch, words, message):
    monkeypatch.chdir(folder)
    assert message in refused(vibrissa, "neural", *words)


def test_envelopes_have_neither_phase_nor_speed(folder, vibrissa):
    words = ("--spikes", folder / "s.csv", "--stimulus", folder / "env.csv", "--trials", TRIALS)
    assert "has a phase" in refused(vibrissa, "demodulation", *words, "--bin-width", "1ms")
    assert "has a speed" in refused(vibrissa, "drives", *words)
    needed = ("--threshold", "45um", "--slope", "2.5e5", "--baseline", "5Hz", "--threshold-within", "9um")
    assert "which is in dB" in refused(vibrissa, "trials-needed", "--stimulus", folder / "level.csv", *needed)


def test_channels_of_a_table_are_the_whiskers_of_a_map(folder, vibrissa):
    words = ("--spikes", folder / "s.csv", "--command", folder / "two.csv", "--trials", TRIALS, "--skip", "0.5s")
    code, out, err = vibrissa("surround", *words, "--json")
    assert code == 0, err
    assert "contra" in out
    assert "must have a channel for each whisker" in refused(
        vibrissa, "surround", *words[:3], folder / "m.csv", *words[4:]
    )
