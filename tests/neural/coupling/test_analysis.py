"""From two files to a table of units: what was put into the spikes, and every input that is refused."""

import json
import re
import tracemalloc

import numpy as np
import pytest
from cyclopts import App
from populations import ringing
from refusals import refusal
from scipy.ndimage import gaussian_filter1d
from scipy.stats import false_discovery_control

from vibrissa.cli.spikes.neural import neural
from vibrissa.figures.paper import fig9
from vibrissa.netcdf import load, save
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.coupling.response import psth
from vibrissa.neural.io.recording import recorded_spikes
from vibrissa.neural.io.tables.spike_csv import read_spikes
from vibrissa.neural.io.tables.spikes import join_units, spike_table
from vibrissa.neural.io.tables.stimulus_csv import read_stimulus_csv
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.neurons.shown_unit import best_unit, shown_unit, unit_examples
from vibrissa.study.neurons.stimuli import read_stimulus
from vibrissa.study.spec.given import StimulusInput

N_TRIALS = 50
TRUTH = {
    "driven": ThresholdLinearUnit(),
    "late": ThresholdLinearUnit(latency=0.024),
    "idle": ThresholdLinearUnit(slope=0.0),
    "linear": ThresholdLinearUnit(threshold=0.0, slope=1.5e5),
    "rare": ThresholdLinearUnit(slope=0.0, baseline=0.02),
}


@pytest.fixture(scope="module")
def stimulus():
    time, displacement = ringing(np.random.default_rng(11))
    return dataset(time=time, point_displacement=displacement)


@pytest.fixture(scope="module")
def spikes(stimulus):
    rng = np.random.default_rng(12)
    envelope = analytic_envelope(stimulus.point_displacement.values)[0]
    return join_units(
        {name: simulate_spikes(unit, stimulus.time.values, envelope, N_TRIALS, rng=rng) for name, unit in TRUTH.items()}
    )


@pytest.fixture(scope="module")
def units(spikes, stimulus):
    return analyse_units(spikes, stimulus, N_TRIALS)


def of(units, name):
    return units.isel(unit=list(units.unit_name.values).index(name))


# What comes out


def test_units_are_told_apart(units):
    assert [str(name) for name in units.unit_name.values[units.significant.values]] == ["driven", "late", "linear"]
    assert [str(name) for name in units.unit_name.values[units.identified.values]] == ["driven", "late"]
    reasons = dict(zip(units.unit_name.values.tolist(), units.reason.values.tolist(), strict=True))
    assert reasons["driven"] == reasons["late"] == ""
    assert "no significant coupling" in reasons["idle"]
    assert "below the envelope's range" in reasons["linear"]
    assert "too few spikes" in reasons["rare"]


@pytest.mark.parametrize("name", ["driven", "late"])
def test_intervals_of_driven_units_hold_the_truth(units, name):
    one, truth = of(units, name), TRUTH[name]
    assert abs(one.threshold - truth.threshold) <= 6e-6
    assert abs(one.slope - truth.slope) <= 4e4
    assert abs(one.latency - truth.latency) <= 2e-3
    assert abs(one.baseline - truth.baseline) <= 1
    for key in ("threshold", "slope", "latency", "baseline"):
        assert one[f"{key}_low"] < one[key] < one[f"{key}_high"]
    assert 0.3 < one.tuning_r_squared_unseen < one.tuning_r_squared < 1
    assert one.sub_threshold_rate == pytest.approx(truth.baseline, rel=0.1)


def test_what_was_not_fitted_is_not_a_number(units):
    for name in ("idle", "rare"):
        assert np.isnan(of(units, name)[["threshold", "slope_low", "latency_high", "noise_ceiling"]].to_array()).all()
    assert np.isnan(units.spontaneous_rate).all()  # no window without stimulus was given


def test_results_repeat_and_do_not_depend_on_the_order_of_spikes(units, spikes, stimulus):
    shuffled = spikes.isel(spike=np.random.default_rng(13).permutation(spikes.sizes["spike"]))
    assert analyse_units(shuffled, stimulus, N_TRIALS).identical(units)


def test_results_do_not_depend_on_the_order_of_the_lines(spikes, stimulus, tmp_path):
    names, trial = spikes.unit_name.values[spikes.spike_unit.values], spikes.spike_trial.values
    lines = [f"{a},{b},{c!r}" for a, b, c in zip(names, trial, spikes.spike_time.values.tolist(), strict=True)]
    found = []
    for seed in (21, 22):
        order = np.random.default_rng(seed).permutation(len(lines))
        (tmp_path / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *(lines[k] for k in order)]) + "\n")
        table, _ = recorded_spikes(tmp_path / "spikes.csv", window=(0.0, 10.0))
        found.append(analyse_units(table, stimulus, N_TRIALS))
    assert found[0].identical(found[1])
    assert found[0].unit_name.values.tolist() == ["driven", "idle", "late", "linear", "rare"]


def test_adjusted_p_values_follow_from_the_column_beside_them(units):
    made = np.isfinite(units.tail_p_value.values)
    adjusted = false_discovery_control(units.tail_p_value.values[made])
    np.testing.assert_array_equal(units.adjusted_p_value.values[made], adjusted)
    assert (units.tail_p_value <= units.p_value).values[made].all()


def test_memory_does_not_grow_with_units_times_trials(stimulus):
    rng, n_units, n_trials = np.random.default_rng(14), 200, 200
    unit = np.repeat(np.arange(n_units), 60)
    time, trial = rng.uniform(0, 10, unit.size), rng.integers(0, n_trials, unit.size)
    spikes = spike_table(time, unit, [f"u{k}" for k in range(n_units)], trial=trial)
    tracemalloc.start()
    analyse_units(spikes, stimulus, n_trials)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 * n_units * n_trials * 1000 / 4  # a quarter of the counts of all units, trials and bins


@pytest.mark.parametrize("name", ["driven", "late", "linear"])
def test_other_units_change_the_adjusted_p_value_alone(name, units, spikes, stimulus):
    unit = spikes.unit_name.values.tolist().index(name)
    one = spikes.isel(spike=np.flatnonzero(spikes.spike_unit.values == unit), unit=[unit])
    alone = analyse_units(one.assign(spike_unit=0 * one.spike_unit), stimulus, N_TRIALS)
    same = ["p_value", *(f"{key}_{end}" for key in ("threshold", "slope", "latency") for end in ("low", "high"))]
    for key in (*same, "noise_ceiling", "identified", "reason"):
        assert alone[key].values[0] == of(units, name)[key].item()


def test_one_driven_unit_among_many_is_found(stimulus):
    rng = np.random.default_rng(16)
    envelope = analytic_envelope(stimulus.point_displacement.values)[0]
    many = {f"idle {k}": ThresholdLinearUnit(slope=0.0) for k in range(40)} | {"driven": ThresholdLinearUnit(slope=1e5)}
    spikes = join_units(
        {name: simulate_spikes(unit, stimulus.time.values, envelope, 20, rng=rng) for name, unit in many.items()}
    )
    found = analyse_units(spikes, stimulus, 20)
    assert np.flatnonzero(found.significant.values).tolist() == [40]
    assert float(found.p_value[40]) * 41 > 0.01  # which counting shifts alone could not tell


def test_silent_trials_count(units, spikes, stimulus):
    twice = analyse_units(spikes, stimulus, 2 * N_TRIALS)  # the second half of the trials is silent
    np.testing.assert_allclose(twice.slope[0], units.slope[0] / 2, rtol=0.02)
    np.testing.assert_allclose(twice.threshold[0], units.threshold[0], rtol=0.02)


def test_one_trial_gives_no_interval_and_says_so(stimulus):
    unit = ThresholdLinearUnit(slope=3e6, baseline=20)
    envelope = analytic_envelope(stimulus.point_displacement.values)[0]
    spikes = simulate_spikes(unit, stimulus.time.values, envelope, 1, rng=np.random.default_rng(14))
    one = analyse_units(join_units({"u": spikes}), stimulus, 1).isel(unit=0)
    assert bool(one.significant)
    assert not bool(one.identified)
    assert "one trial" in str(one.reason.values)
    assert abs(one.threshold - unit.threshold) < 1e-5
    assert np.isnan(one.threshold_low)


def test_few_trials_are_not_trusted(stimulus):
    envelope = analytic_envelope(stimulus.point_displacement.values)[0]
    spikes = simulate_spikes(
        ThresholdLinearUnit(slope=1e6), stimulus.time.values, envelope, 4, rng=np.random.default_rng(17)
    )
    one = analyse_units(join_units({"u": spikes}), stimulus, 4).isel(unit=0)
    assert bool(one.significant)
    assert not bool(one.identified)
    assert "4 trials" in str(one.reason.values)
    assert one.threshold_low < one.threshold < one.threshold_high


def test_onset_is_left_out(stimulus):
    rng = np.random.default_rng(15)
    table = spike_table(rng.uniform(0, 1, 4000), np.zeros(4000, int), ["burst"], trial=rng.integers(0, 20, 4000))
    found = analyse_units(table, stimulus, 20).isel(unit=0)
    assert float(found.unit_rate) == 0
    assert np.isnan(found.p_value)
    whole = analyse_units(table, stimulus, 20, EnvelopeAnalysis(skip=0.0)).isel(unit=0)
    assert float(whole.unit_rate) == pytest.approx(4000 / 20 / 10)


def test_spontaneous_rate_comes_from_its_window(spikes, stimulus):
    before = spike_table(np.linspace(-2, -0.001, 300), np.zeros(300, int), ["driven"], trial=np.zeros(300, int))
    own = spikes.isel(spike=np.flatnonzero(spikes.spike_unit.values == 0), unit=[0])
    joined = spike_table(
        np.concatenate([before.spike_time, own.spike_time]),
        np.zeros(300 + own.sizes["spike"], int),
        ["driven"],
        trial=np.concatenate([before.spike_trial, own.spike_trial]),
    )
    found = analyse_units(joined, stimulus, N_TRIALS, EnvelopeAnalysis(spontaneous=(-2.0, 0.0)))
    assert float(found.spontaneous_rate[0]) == pytest.approx(300 / 2 / N_TRIALS)


def test_papers_reading_gives_lower_values_and_no_interval(spikes, stimulus):
    found = analyse_units(spikes, stimulus, N_TRIALS, EnvelopeAnalysis(null="paper2014", fit="paper2014"))
    one = of(found, "driven")
    assert 1.7e5 < one.slope < 2.5e5
    assert float(one.latency) in (-0.01, 0.0, 0.01)
    assert np.isnan(one.slope_low)
    assert "no interval" in str(one.reason.values)


@pytest.fixture(scope="module")
def ahead(stimulus):
    """A unit that answers the envelope 10 ms before it comes, as a stimulus file that is late by as much makes it."""
    envelope = np.roll(analytic_envelope(stimulus.point_displacement.values)[0], -20)
    rng = np.random.default_rng(15)
    unit = ThresholdLinearUnit(slope=2.5e5, latency=0.0)
    return join_units({"ahead": simulate_spikes(unit, stimulus.time.values, envelope, N_TRIALS, rng=rng)})


@pytest.mark.parametrize("fit", ["forward", "paper2014"])
def test_a_response_before_its_stimulus_is_said_to_be_none(ahead, stimulus, fit):
    found = analyse_units(ahead, stimulus, N_TRIALS, EnvelopeAnalysis(null="paper2014", fit=fit))
    assert found.significant.item()  # the paper's form, as it is
    assert found.envelope_lag.item() == -0.01
    assert "the rate leads the envelope by 10 ms, and no response comes before its stimulus" in found.reason.item()


def test_the_verb_warns_of_responses_before_the_stimulus(vibrissa, ahead, stimulus, tmp_path):
    save(ahead, tmp_path / "spikes.nc")
    save(stimulus, tmp_path / "stimulus.nc")
    words = ("--spikes", tmp_path / "spikes.nc", "--stimulus", tmp_path / "stimulus.nc", "--null", "paper2014")
    code, out, err = vibrissa("neural", *words, "--fit", "paper2014", "--json")
    assert code == 0
    assert "1 of 1 units that pass the test do so at a negative lag" in err
    assert "leads the envelope by 10 ms" in json.loads(out)["units"][0]["reason"]
    table = vibrissa("neural", *words, "--fit", "paper2014")[1]
    assert "leads the envelope by 10 ms" in " ".join(table.split())  # a reason is wrapped in its column


# The presentation


def test_envelope_is_masked_at_both_ends_by_periods_of_the_carrier():
    time = np.arange(8000) / 2000
    tone = dataset(time=time, point_displacement=3e-5 * np.cos(2 * np.pi * 50 * time) + 1e-3)
    shown = Presentation.of(tone, skip=0.5)
    assert shown.edge == pytest.approx(3 / 50, rel=1e-2)
    assert np.flatnonzero(shown.envelope_valid)[[0, -1]].tolist() == [6, 393]
    assert np.flatnonzero(shown.rate_valid)[0] == 50
    np.testing.assert_allclose(shown.binned()[shown.envelope_valid], 3e-5, rtol=0.01)


def test_band_takes_slow_drift_out_of_the_envelope():
    time = np.arange(20000) / 2000
    slow = 1e-4 * np.sin(2 * np.pi * 1.3 * time)
    both = dataset(time=time, point_displacement=slow + 3e-5 * np.cos(2 * np.pi * 60 * time))
    inner = slice(100, 900)
    np.testing.assert_allclose(Presentation.of(both, band=(30.0, 90.0)).binned()[inner], 3e-5, rtol=0.02)
    assert Presentation.of(both).binned()[inner].mean() > 6e-5


def test_window_of_the_stimulus_is_analysed_alone(spikes, stimulus):
    found = analyse_units(spikes, stimulus, N_TRIALS, EnvelopeAnalysis(window=(2.0, 9.0), skip=0.0))
    inside = (spikes.spike_time >= 2) & (spikes.spike_time < 9) & (spikes.spike_unit == 0)
    assert float(found.unit_rate[0]) == pytest.approx(float(inside.sum()) / N_TRIALS / 7)
    assert bool(found.identified[0])


# Files and the verb


@pytest.fixture
def files(tmp_path, spikes, stimulus):
    stim, spk = tmp_path / "stimulus.csv", tmp_path / "spikes.csv"
    table = np.c_[stimulus.time, stimulus.point_displacement]
    np.savetxt(stim, table, delimiter=",", header="time,displacement", comments="", fmt="%.12g")
    names = spikes.unit_name.values[spikes.spike_unit.values]
    rows = zip(names, spikes.spike_trial.values, spikes.spike_time.values, strict=True)
    spk.write_text("unit,trial,spike_time\n" + "\n".join(f"{n},{k},{t:.9f}" for n, k, t in rows) + "\n")
    return spk, stim


@pytest.fixture
def verb(capsys):
    def call(*words):
        App(default_command=neural, result_action="return_value")([str(word) for word in words], exit_on_error=False)
        return capsys.readouterr().out

    return call


def test_verb_prints_units_as_json(verb, files, tmp_path):
    words = ("--spikes", files[0], "--stimulus", files[1], "--trials", N_TRIALS)
    printed = json.loads(verb(*words, "--json", "--out", tmp_path / "units.nc"))["units"]
    units = analyse_units(read_spikes(files[0]), read_stimulus_csv(files[1]), N_TRIALS)
    assert [row["unit"] for row in printed] == [row["unit_name"] for row in printed] == sorted(TRUTH)
    for row, name in zip(printed, sorted(TRUTH), strict=True):
        assert row["significant"] is bool(of(units, name).significant)
        assert row["identified"] is bool(of(units, name).identified)
        for key in ("threshold", "slope", "latency", "baseline"):
            for end in ("", "_low", "_high"):
                value = float(of(units, name)[key + end])
                assert row[key + end] == (None if np.isnan(value) else pytest.approx(value, rel=1e-4))
    assert load(tmp_path / "units.nc").threshold.attrs["units"] == "m"
    table = " ".join(verb(*words).split())  # reasons are wrapped in their column, and units are below the names
    assert re.search(r"threshold_low threshold_high .*\[µm\] \[µm\]", table)
    assert "no significant coupling" in table


def test_spikes_need_not_be_sorted(tmp_path):
    path = tmp_path / "spikes.csv"
    path.write_text("trial,spike_time,unit\n1,0.5,b\n0,0.7,a\n0,0.2,b\n1,0.1,a\n")
    table = read_spikes(path)
    assert table.unit_name.values.tolist() == ["a", "b"]
    assert table.spike_time.values.tolist() == [0.7, 0.1, 0.2, 0.5]
    assert table.spike_unit.values.tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("", ("too-few", "spikes.csv")),
        ("unit,trial,spike_time\n", ("too-few", "spikes.csv")),
        ("unit,trial,spike_times\na,0,1\n", ("missing", "spikes.csv, line 1")),
        ("unit,trial,spike_time\na,0.5,1\n", ("format", "spikes.csv, line 2, trial")),
        ("unit,trial,spike_time\na,-1,1\n", ("format", "spikes.csv, line 2, trial")),
        ("unit,trial,spike_time\na,0,nan\n", ("format", "spikes.csv, line 2, spike_time")),
        ("unit,trial,spike_time\na,0,1\nb,x,1\n", ("format", "spikes.csv, line 3, trial")),
        ("unit,trial,spike_time\n,0,1\n", ("format", "spikes.csv, line 2, unit")),
    ],
)
def test_bad_spike_files_are_refused(tmp_path, text, rule):
    path = tmp_path / "spikes.csv"
    path.write_text(text)
    with refusal(*rule) as told:
        read_spikes(path)
    assert "\n" not in str(told.value)


def lines(time, displacement):
    return "time,displacement\n" + "\n".join(f"{t:.9g},{x:.9g}" for t, x in zip(time, displacement, strict=True))


GOOD = np.arange(3000) / 1000
WAVE = 5e-5 * np.sin(2 * np.pi * 60 * GOOD)


def test_a_scan_without_spikes_is_no_stimulus(tmp_path):
    save(dataset(time=np.arange(9) / 1e4, mode=[1], mode_displacement=np.zeros((1, 9))), tmp_path / "scan.nc")
    with refusal("missing", "scan.nc", value="a scan"):
        read_stimulus(StimulusInput(stimulus=str(tmp_path / "scan.nc")))


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        (lines(GOOD[:50], WAVE[:50]), ("too-few", "stimulus.csv")),
        (lines(GOOD * 1000, WAVE), ("range", "stimulus.csv")),
        (lines(GOOD, WAVE * 1e6), ("range", "stimulus.csv")),
        (lines(GOOD, 0 * WAVE), ("range", "stimulus.csv")),
        (lines(np.where(GOOD == 1, 0.9, GOOD), WAVE), ("format", "stimulus.csv, line 1002, time")),
        (lines(np.where(GOOD > 1, GOOD + 0.5, GOOD), WAVE), ("format", "stimulus.csv, line 1003, time")),
        ("time\n0\n", ("missing", "stimulus.csv")),
    ],
)
def test_bad_stimulus_files_are_refused(tmp_path, text, rule):
    path = tmp_path / "stimulus.csv"
    path.write_text(text)
    with refusal(*rule):
        read_stimulus_csv(path)


def at(*times, trial=0):
    return spike_table(np.array(times), np.zeros(len(times), int), ["u"], trial=np.full(len(times), trial))


@pytest.mark.parametrize(
    ("spikes", "n_trials", "how", "rule"),
    [
        (at(500.0, 9000.0), 1, {}, ("range", "spike_time")),
        (at(500.0, 9000.0), 1, {"window": (0.0, 9.0)}, ("range", "spike_time")),
        (at(1.0, 12.0), 1, {}, ("range", "spike_time")),
        (at(1.0, -0.5), 1, {}, ("range", "spike_time")),
        (at(1.0, trial=3), 3, {}, ("range", "trial")),
        (at(1.0), 0, {}, ("range", "number of trials")),
        (at(), 1, {}, ("range", "spikes")),
        (at(1.0), 1, {"window": (5.0, 12.0)}, ("range", "window")),
        (at(1.0), 1, {"skip": 9.5}, ("too-few", "stimulus")),
        (at(1.0), 1, {"skip": 9.5, "window": (0.0, 10.0)}, ("too-few", "window")),
        (at(1.0), 1, {"band": (50.0, 2000.0)}, ("range", "band")),
        (at(1.0), 1, {"bin_width": 1e-4}, ("too-few", "bin width")),
    ],
)
def test_spikes_that_do_not_fit_the_stimulus_are_refused(stimulus, spikes, n_trials, how, rule):
    with refusal(*rule):
        analyse_units(spikes, stimulus, n_trials, EnvelopeAnalysis(**how))


@pytest.mark.parametrize(
    ("how", "quantity", "value"),
    [
        ({"bin_width": 0.0}, "bin width", "0.0"),
        ({"skip": -1.0}, "skip", "-1.0"),
        ({"level": 1.0}, "level", "1.0"),
        ({"window": (2.0, 1.0)}, "window", "(2.0, 1.0)"),
        ({"seed": -1}, "resamples and seed", "400, -1"),
        ({"n_resamples": 3}, "resamples and seed", "3, 0"),
    ],
)
def test_impossible_analyses_are_refused(how, quantity, value):
    with refusal("range", quantity, value):
        EnvelopeAnalysis(**how)


def test_who_the_units_are_goes_along_into_the_table_so_that_figure_9_can_be_made_of_it(spikes, stimulus):
    known = spikes.assign(unit_quality=("unit", ["SU", "MU", "SU", "MU", "MU"]), unit_session=("unit", [0, 0, 1, 1, 2]))
    units = analyse_units(known, stimulus, N_TRIALS)
    assert units.unit_quality.values.tolist() == ["SU", "MU", "SU", "MU", "MU"]
    assert units.unit_session.values.tolist() == [0, 0, 1, 1, 2]
    assert fig9.compute(units).sizes["unit"] == len(TRUTH)


def test_table_without_quality_is_told_how_to_get_one(units):
    with refusal("missing", "table of units"):
        fig9.compute(units)


def test_a_unit_observed_in_some_trials_is_analysed_over_these_alone(spikes, stimulus):
    kept = spikes.spike_trial.values < N_TRIALS // 2
    observed = np.ones((spikes.sizes["unit"], N_TRIALS), bool)
    observed[:, N_TRIALS // 2 :] = False
    half = spikes.isel(spike=np.flatnonzero(kept))
    partly = analyse_units(spikes.assign(unit_observed=(("unit", "trial"), observed)), stimulus, N_TRIALS)
    alone = analyse_units(half, stimulus, N_TRIALS // 2)
    for name in ("unit_rate", "envelope_correlation", "threshold", "slope", "baseline"):
        np.testing.assert_allclose(partly[name], alone[name], rtol=1e-9)


def test_a_response_later_than_the_lags_tested_is_said_to_be(stimulus):
    rng = np.random.default_rng(18)
    envelope = analytic_envelope(stimulus.point_displacement.values)[0]
    late = simulate_spikes(ThresholdLinearUnit(latency=0.045), stimulus.time.values, envelope, N_TRIALS, rng=rng)
    found = analyse_units(join_units({"late": late}), stimulus, N_TRIALS).isel(unit=0)
    assert 0.04 <= float(found.peak_lag) <= 0.05
    assert "outside the lags tested (0 to 30 ms)" in str(found.reason.values)


def test_explained_variance_stands_beside_its_ceiling(units):
    for name in ("driven", "late"):
        one = of(units, name)
        assert float(one.tuning_r_squared) == pytest.approx(float(one.tuning_r_squared_ceiling), abs=0.03)
        assert float(one.fano_factor) == pytest.approx(1, abs=0.03)
        assert str(one.response_model.values) == "threshold-linear"
        assert str(one.envelope_verdict.values) == "envelope"


def test_a_word_for_null_or_fit_that_is_none_is_refused():
    for word in ("null", "fit"):
        with refusal("unknown", word):
            EnvelopeAnalysis(**{word: "paper"})


def played(latency, wave, seed=0):
    """Spikes in 20 trials of 6 s of a unit that follows the envelope, later by a latency [s], and the stimulus."""
    rng, step = np.random.default_rng(seed), 1 / 4000
    time = np.arange(24000) * step
    envelope = 50e-6 + 30e-6 * wave(time, rng)
    driving = np.interp(time - latency, time, envelope)
    fired = rng.random((20, time.size)) < step * (4 + 6e5 * np.maximum(driving - 45e-6, 0))
    trial, sample = np.nonzero(fired)
    table = spike_table(time[sample], np.zeros(sample.size, int), ["A"], trial=trial)
    return table, dataset(time=time, point_displacement=envelope * np.cos(2 * np.pi * 120 * time))


def noisy(time, rng):
    slow = gaussian_filter1d(rng.standard_normal(time.size), 120)
    return np.clip(slow / slow.std() / 1.5, -1.5, None)


@pytest.mark.parametrize(("latency", "identified"), [(-0.015, False), (-0.005, False), (0.0, True), (0.012, True)])
def test_a_rate_that_leads_the_envelope_is_not_identified(latency, identified):
    found = analyse_units(*played(latency, noisy), 20)
    assert found.significant.item()
    assert found.identified.item() == identified
    assert ("the rate may lead" in found.reason.item()) != identified


def test_of_an_envelope_that_repeats_it_says_that_shifts_are_no_chance():
    found = analyse_units(*played(0.012, lambda time, rng: np.sin(2 * np.pi * 4 * time)), 20)
    assert not found.significant.item()
    assert "the envelope repeats after 0.25 s" in found.reason.item()
    assert "repeats" not in analyse_units(*played(0.012, noisy), 20).reason.item()


def test_of_a_unit_observed_in_no_trial_nothing_is_measured(spikes, stimulus):
    observed = np.ones((spikes.sizes["unit"], N_TRIALS), bool)
    observed[0] = False
    asked = EnvelopeAnalysis(spontaneous=(0.0, 0.5))
    found = analyse_units(spikes.assign(unit_observed=(("unit", "trial"), observed)), stimulus, N_TRIALS, asked)
    one = found.isel(unit=0)
    assert np.isnan([one.unit_rate, one.spontaneous_rate, one.envelope_correlation, one.p_value]).all()
    assert str(one.reason.values) == "cannot tell: the unit was observed in no trial"
    assert found.unit_rate.values[1:].min() > 0


def test_figure_8_has_the_rate_of_the_trials_in_which_its_unit_was_observed(spikes, stimulus):
    observed = np.ones((spikes.sizes["unit"], N_TRIALS), bool)
    observed[:, N_TRIALS // 2 :] = False
    partly = spikes.assign(unit_observed=(("unit", "trial"), observed))
    half = spikes.isel(spike=np.flatnonzero(spikes.spike_trial.values < N_TRIALS // 2))
    how = EnvelopeAnalysis()
    units = analyse_units(partly, stimulus, N_TRIALS, how)
    place = best_unit(units)
    shown = shown_unit(partly, units.isel(unit=place), stimulus, N_TRIALS, how)
    alone = shown_unit(half, units.isel(unit=place), stimulus, N_TRIALS // 2, how)
    np.testing.assert_allclose(shown["response"].firing_rate, alone["response"].firing_rate, rtol=1e-12)
    assert shown["spikes"].spike_trial.values.max() < N_TRIALS // 2
    examples = unit_examples(partly, units, [place], lambda _: stimulus, N_TRIALS, how)
    np.testing.assert_allclose(examples.example_rate[0], alone["response"].firing_rate, rtol=1e-12)


@pytest.mark.parametrize("given", [N_TRIALS - 1, N_TRIALS + 1])
def test_another_number_of_trials_than_units_were_observed_in_is_refused(spikes, stimulus, given):
    observed = np.ones((spikes.sizes["unit"], N_TRIALS), bool)
    some = spikes.isel(spike=np.flatnonzero(spikes.spike_trial.values < N_TRIALS - 1))
    partly = some.assign(unit_observed=(("unit", "trial"), observed))
    with refusal("shape", "number of trials", str(given)):
        analyse_units(partly, stimulus, given)
    with refusal("shape", "number of trials", str(given)):
        psth(partly, np.arange(0, 2.0), n_trials=given)
