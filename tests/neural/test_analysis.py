"""From two files to a table of units: what was put into the spikes, and every input that is refused."""

import json

import numpy as np
import pytest
from cyclopts import App
from populations import ringing

from vibrissa.cli.neural import neural
from vibrissa.errors import InputError
from vibrissa.figures import fig9
from vibrissa.files import load, save
from vibrissa.neural.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.inputs import read_spikes, read_stimulus
from vibrissa.neural.presentation import Presentation
from vibrissa.neural.spikes import join_units, spike_table
from vibrissa.neural.virtual import HingeUnit, simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope

N_TRIALS = 50
TRUTH = {
    "driven": HingeUnit(),
    "late": HingeUnit(latency=0.024),
    "idle": HingeUnit(slope=0.0),
    "linear": HingeUnit(threshold=0.0, slope=1.5e5),
    "rare": HingeUnit(slope=0.0, baseline=0.02),
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


def test_other_units_change_the_adjusted_p_value_alone(units, spikes, stimulus):
    first = spikes.isel(spike=np.flatnonzero(spikes.spike_unit.values == 0), unit=[0])
    alone = analyse_units(first, stimulus, N_TRIALS)
    for name in ("p_value", "threshold", "threshold_low", "slope_high", "noise_ceiling"):
        assert float(alone[name][0]) == float(units[name][0])


def test_one_driven_unit_among_many_is_found(stimulus):
    rng = np.random.default_rng(16)
    envelope = analytic_envelope(stimulus.point_displacement.values)[0]
    many = {f"idle {k}": HingeUnit(slope=0.0) for k in range(40)} | {"driven": HingeUnit(slope=1e5)}
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
    unit = HingeUnit(slope=3e6, baseline=20)
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
    spikes = simulate_spikes(HingeUnit(slope=1e6), stimulus.time.values, envelope, 4, rng=np.random.default_rng(17))
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


def test_verb_prints_units_as_json(verb, files, units, tmp_path):
    words = ("--spikes", files[0], "--stimulus", files[1], "--trials", N_TRIALS)
    printed = json.loads(verb(*words, "--json", "--out", tmp_path / "units.nc"))["units"]
    assert [row["unit"] for row in printed] == list(TRUTH)
    for row, name in zip(printed, TRUTH, strict=True):
        assert row["significant"] is bool(of(units, name).significant)
        assert row["identified"] is bool(of(units, name).identified)
        for key in ("threshold", "slope", "latency", "baseline"):
            for end in ("", "_low", "_high"):
                value = float(of(units, name)[key + end])
                assert row[key + end] == (None if np.isnan(value) else pytest.approx(value, rel=1e-4))
    assert load(tmp_path / "units.nc").threshold.attrs["units"] == "m"
    table = verb(*words)
    assert "threshold [m]" in table
    assert "no significant coupling" in table


def test_spikes_need_not_be_sorted(tmp_path):
    path = tmp_path / "spikes.csv"
    path.write_text("trial,spike_time,unit\n1,0.5,b\n0,0.7,a\n0,0.2,b\n1,0.1,a\n")
    table = read_spikes(path)
    assert table.unit_name.values.tolist() == ["b", "a"]
    assert table.spike_time.values.tolist() == [0.2, 0.5, 0.7, 0.1]
    assert table.spike_unit.values.tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("", "empty"),
        ("unit,trial,spike_time\n", "at least one spike"),
        ("unit,trial,spike_times\na,0,1\n", "must have a column spike_time.*is it 'spike_times'"),
        ("unit,trial,spike_time\na,0.5,1\n", "line 2, trial must be a whole number"),
        ("unit,trial,spike_time\na,-1,1\n", "line 2, trial must be a whole number"),
        ("unit,trial,spike_time\na,0,nan\n", "line 2, spike_time must be a finite number"),
        ("unit,trial,spike_time\na,0,1\nb,x,1\n", "line 3, trial must be a finite number"),
        ("unit,trial,spike_time\n,0,1\n", "unit must name a unit"),
    ],
)
def test_bad_spike_files_are_refused(tmp_path, text, rule):
    path = tmp_path / "spikes.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=rule) as told:
        read_spikes(path)
    assert "\n" not in str(told.value)


def lines(time, displacement):
    return "time,displacement\n" + "\n".join(f"{t:.9g},{x:.9g}" for t, x in zip(time, displacement, strict=True))


GOOD = np.arange(3000) / 1000
WAVE = 5e-5 * np.sin(2 * np.pi * 60 * GOOD)


def test_a_scan_without_spikes_is_no_stimulus(tmp_path):
    save(dataset(time=np.arange(9) / 1e4, mode=[1], mode_displacement=np.zeros((1, 9))), tmp_path / "scan.nc")
    with pytest.raises(InputError, match="must tell what was presented, got a scan without spikes; scan with --spikes"):
        read_stimulus(tmp_path / "scan.nc")


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        (lines(GOOD[:50], WAVE[:50]), "at least 100 samples"),
        (lines(GOOD * 1000, WAVE), "times are in seconds"),
        (lines(GOOD, WAVE * 1e6), "displacement is in metres"),
        (lines(GOOD, 0 * WAVE), "must move"),
        (lines(np.where(GOOD == 1, 0.9, GOOD), WAVE), "line 1002, time must be later"),
        (lines(np.where(GOOD > 1, GOOD + 0.5, GOOD), WAVE), "evenly"),
        ("time,position\n0,1\n", "must have a column displacement"),
    ],
)
def test_bad_stimulus_files_are_refused(tmp_path, text, rule):
    path = tmp_path / "stimulus.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=rule):
        read_stimulus(path)


def at(*times, trial=0):
    return spike_table(np.array(times), np.zeros(len(times), int), ["u"], trial=np.full(len(times), trial))


@pytest.mark.parametrize(
    ("spikes", "n_trials", "how", "rule"),
    [
        (at(500.0, 9000.0), 1, {}, "milliseconds"),
        (at(500.0, 9000.0), 1, {"window": (0.0, 9.0)}, "milliseconds"),
        (at(1.0, 12.0), 1, {}, "--window"),
        (at(1.0, -0.5), 1, {}, "--window"),
        (at(1.0, trial=3), 3, {}, "below the number of trials.*from 0"),
        (at(1.0), 0, {}, "number of trials"),
        (at(), 1, {}, "at least one"),
        (at(1.0), 1, {"window": (5.0, 12.0)}, "window must lie within the stimulus"),
        (at(1.0), 1, {"skip": 9.5}, "at least 100 bins"),
        (at(1.0), 1, {"band": (50.0, 2000.0)}, "band"),
        (at(1.0), 1, {"bin_width": 1e-4}, "bin width must hold"),
    ],
)
def test_spikes_that_do_not_fit_the_stimulus_are_refused(stimulus, spikes, n_trials, how, rule):
    with pytest.raises(InputError, match=rule):
        analyse_units(spikes, stimulus, n_trials, EnvelopeAnalysis(**how))


@pytest.mark.parametrize(
    "how",
    [{"bin_width": 0.0}, {"skip": -1.0}, {"level": 1.0}, {"window": (2.0, 1.0)}, {"seed": -1}, {"n_resamples": 3}],
    ids=str,
)
def test_impossible_analyses_are_refused(how):
    with pytest.raises(InputError, match=next(iter(how)).replace("bin_width", "bin width").replace("n_", "")):
        EnvelopeAnalysis(**how)


def test_who_the_units_are_goes_along_into_the_table_so_that_figure_9_can_be_made_of_it(spikes, stimulus):
    known = spikes.assign(unit_quality=("unit", ["SU", "MU", "SU", "MU", "MU"]), unit_session=("unit", [0, 0, 1, 1, 2]))
    units = analyse_units(known, stimulus, N_TRIALS)
    assert units.unit_quality.values.tolist() == ["SU", "MU", "SU", "MU", "MU"]
    assert units.unit_session.values.tolist() == [0, 0, 1, 1, 2]
    assert fig9.compute(units, rng=np.random.default_rng(0)).sizes["unit"] == len(TRUTH)


def test_table_without_quality_is_told_how_to_get_one(units):
    with pytest.raises(InputError, match="must have unit_quality; give the table of spikes a column quality"):
        fig9.compute(units, rng=np.random.default_rng(0))
