"""A user's recorded spikes: the study and the verb read the same, and what was put into the spikes comes out."""

import json
from functools import partial

import numpy as np
import pytest
from refusals import refusal

from vibrissa.figures.paper import fig8
from vibrissa.netcdf import load
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stimulus.export import write_command
from vibrissa.study.neurons.neurons import neuron_results
from vibrissa.study.report.gallery import label_of, made
from vibrissa.study.report.report_neurons import neurons_of, unit_lines
from vibrissa.study.spec.neurons import Neurons
from vibrissa.study.stages.figure_table import served

TRIALS, DURATION, RATE = 40, 6.0, 2000.0
TRUTH = {
    "single": ThresholdLinearUnit(),
    "several": ThresholdLinearUnit(slope=1.5e5, latency=0.016),
    "idle": ThresholdLinearUnit(slope=0.0),
}
QUALITY = {"single": "SU", "several": "MU", "idle": "SU"}


def ringing():
    """A carrier of 70 Hz under a random envelope that passes the threshold often."""
    rng, time = np.random.default_rng(5), np.arange(int(DURATION * RATE)) / RATE
    slow = np.convolve(rng.normal(size=time.size), np.hanning(160), "same")
    envelope = 50e-6 * (1 + 0.6 * slow / slow.std()).clip(0.05)
    return time, envelope * np.cos(2 * np.pi * 70 * time)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Spikes in trials, the same on a session's clock, the stimulus, and a command with it on one whisker."""
    folder = tmp_path_factory.mktemp("recording")
    time, moved = ringing()
    envelope, rng = analytic_envelope(moved)[0], np.random.default_rng(6)
    in_trials, session = ["unit,trial,spike_time,quality"], ["spike_time,unit,quality"]
    for name, unit in TRUTH.items():
        spikes = simulate_spikes(unit, time, envelope, TRIALS, rng=rng)
        for when, trial in zip(spikes.spike_time.values.tolist(), spikes.spike_trial.values.tolist(), strict=True):
            in_trials.append(f"{name},{trial},{when!r},{QUALITY[name]}")
            session.append(f"{3.0 + 8.0 * trial + when!r},{name},{QUALITY[name]}")
    (folder / "spikes.csv").write_text("\n".join(in_trials))
    (folder / "session.csv").write_text("\n".join(session))
    (folder / "bare.csv").write_text("\n".join(",".join(line.split(",")[:3]) for line in in_trials))
    rows = "".join(f"{t!r},{y!r}\n" for t, y in zip(time.tolist(), moved.tolist(), strict=True))
    (folder / "stimulus.csv").write_text(f"time,displacement\n{rows}")
    command = dataset(whisker=["C1", "C2"], time=time, command=np.array([np.zeros_like(moved), moved]))
    write_command(command, folder / "command.nc")
    return folder


def asked(**changed):
    return Neurons(**{"spikes": "spikes.csv", "stimulus": "stimulus.csv", "trials": TRIALS, **changed})


@pytest.fixture(scope="module")
def results(folder):
    return neuron_results(asked(), folder)


def test_an_envelope_in_arbitrary_units_is_shown_in_its_own_unit(folder, results):
    """The same envelope, a million times as large: the same correlation and lag, a threshold of as many units."""
    time, moved = ringing()
    values = 1e6 * analytic_envelope(moved)[0]
    rows = "".join(f"{t!r},{one!r}\n" for t, one in zip(time.tolist(), values.tolist(), strict=True))
    (folder / "level.csv").write_text(f"time,envelope_au\n{rows}")
    shown = neuron_results(asked(stimulus="level.csv"), folder)
    data, one = fig8.compute(shown), shown["unit"]
    assert (data.attrs["shown_unit"], data.attrs["shown_factor"]) == ("a.u.", 1.0)
    assert data.bin_envelope.attrs["units"] == "a.u."
    assert data.attrs["lag"] == round(float(one.envelope_lag) / data.attrs["bin_width"])
    assert data.attrs["correlation"] == pytest.approx(float(one.envelope_correlation), abs=0.01)  # of all bins
    assert float(one.threshold) == pytest.approx(1e6 * float(results["unit"].threshold), rel=0.05)
    assert "envelope [a.u.]" in [axis.get_xlabel() for axis in fig8.draw(data).axes]
    assert "threshold [a.u.]" in neurons_of(shown)[0]["heads"]


def test_what_was_put_into_the_spikes_comes_out(results):
    units = results["units"]
    assert dict(zip(units.unit_name.values.tolist(), units.significant.values.tolist(), strict=True)) == {
        "single": True,
        "several": True,
        "idle": False,
    }
    for name, truth in TRUTH.items():
        unit = units.isel(unit=units.unit_name.values.tolist().index(name))
        if truth.slope:
            for part in ("threshold", "slope", "latency"):
                low, high = float(unit[f"{part}_low"]), float(unit[f"{part}_high"])
                margin = 0.3 * (high - low)  # one interval in twenty does not hold the truth
                assert low - margin <= getattr(truth, part) <= high + margin, (name, part)
    assert str(results["spikes"].unit_name.values[0]) == "single"  # a single unit before a better fitted other


def test_the_verb_gives_the_same_of_the_same_files(vibrissa, folder, results, tmp_path):
    files = ("--spikes", folder / "spikes.csv", "--stimulus", folder / "stimulus.csv", "--trials", TRIALS)
    code, _, err = vibrissa("neural", *files, "--out", tmp_path / "units.nc")
    assert (code, err) == (0, "")
    told = load(tmp_path / "units.nc")
    assert set(told.data_vars) == set(results["units"].data_vars)
    for name in told.data_vars:
        np.testing.assert_array_equal(told[name].values, results["units"][name].values)


def threshold_of_the_single_unit(results):
    units = results["units"]
    return float(units.threshold[units.unit_name.values.tolist().index("single")])


def test_onsets_at_even_times_cut_a_session_into_the_same_trials(vibrissa, folder, results):
    every = neuron_results(asked(spikes="session.csv", period=8.0, first_onset=3.0), folder)["units"]
    order = [every.unit_name.values.tolist().index(name) for name in results["units"].unit_name.values]
    for name in ("threshold", "p_value", "unit_rate"):
        np.testing.assert_allclose(every[name].values[order], results["units"][name].values, rtol=1e-6)
    words = ("--spikes", folder / "session.csv", "--stimulus", folder / "stimulus.csv", "--period", 8)
    code, text, _ = vibrissa("neural", *words, "--first-onset", 3, "--trials", TRIALS, "--json")
    assert code == 0
    found = {unit["unit"]: unit["threshold"] for unit in json.loads(text)["units"]}
    assert found["single"] == pytest.approx(threshold_of_the_single_unit(results), rel=1e-6)


def test_verb_draws_pages_and_says_which_units_have_none(vibrissa, folder, tmp_path):
    words = ("neural", "--spikes", folder / "spikes.csv", "--stimulus", folder / "stimulus.csv", "--trials", TRIALS)
    code, out, err = vibrissa(*words, "--picture", tmp_path / "units.html", "--most-pages", 1)
    assert code == 0
    assert "single" in out
    assert "vibrissa: 1 of 3 units have a page" in err
    assert "--unit-page chooses units by name, --most-pages draws more" in err
    assert (tmp_path / "units.html").read_text().count("<section") == 1
    named = ("--picture", tmp_path / "other.html", "--unit-page", "none", "--out", tmp_path / "units.nc")
    code, out, err = vibrissa(*words, *named)
    assert (code, [one.name for one in tmp_path.iterdir() if one.name in ("other.html", "units.nc")]) == (2, [])
    assert "--unit-page must name one of the units: " in err


def test_one_whisker_of_a_command_is_the_stimulus(folder, results):
    moved = neuron_results(asked(stimulus="command.nc", whisker="C2"), folder)
    np.testing.assert_allclose(moved["units"].threshold, results["units"].threshold, rtol=1e-6)


def test_the_unit_of_figure_8_answers_as_the_table_says(results):
    response = results["response"]
    counted = results["spikes"].sizes["spike"] / (TRIALS * DURATION)
    assert response.firing_rate.values.mean() == pytest.approx(counted, rel=1e-6)
    hinge = TRUTH["single"]
    quiet = response.firing_rate.values[response.bin_envelope.values < 20e-6]
    assert quiet.mean() == pytest.approx(hinge.baseline, rel=0.3)
    assert float(results["unit"].threshold) == threshold_of_the_single_unit(results)
    assert "single, whose fit explains most" in response.attrs["note"]


def test_what_is_absent_is_told(folder):
    bare = neuron_results(asked(spikes="bare.csv"), folder)
    (told,) = neurons_of({"units": bare["units"]})
    assert any("no Figure 9" in line for line in told["absent"])
    assert any("No window without stimulus" in line for line in told["absent"])
    assert [row[:3] for row in told["qualities"]] == [["all", "3", "2"]]
    with_rest = neuron_results(asked(spontaneous=(-1.0, 0.0)), folder)
    (told,) = neurons_of({"units": with_rest["units"]})
    assert any("no unit fired from -1 to 0 s" in line for line in told["remarks"])
    assert not any("No window without" in line for line in told["absent"])


def test_several_recordings_have_figures_of_their_own_and_a_line_each(folder, results):
    bare = neuron_results(asked(spikes="bare.csv", name="second"), folder)
    both = {f"{name}_{k}": data for k, one in enumerate((results, bare), 1) for name, data in one.items()}
    figures = list(served(both, partial(label_of, both)))
    assert [one.heading for one in figures] == [
        "Figure 8: one unit of spikes",
        "Figure 8: one unit of second",
        "Figure 9: spikes",
        "Figure 9: second",
    ]
    last = figures[-1]
    assert "must have unit_quality" in made(last.entry, {"units": both[f"units{last.end}"]}, None)
    plain = [one.heading for one in served(results, partial(label_of, results))]  # of the only population
    assert plain == ["Figure 8: one neuron", "Figure 9: the population"]
    lines = unit_lines(both)
    assert lines.population_name.values.tolist() == ["spikes", "second"]
    assert lines.units_passed.values.tolist() == [2, 2]
    told = results["units"].threshold.values[results["units"].identified.values]
    assert float(lines.median_threshold[0]) == pytest.approx(np.median(told))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"trials": None}, ("conflict", "[[neural]] spikes: trials")),
        ({"stimulus": "command.nc"}, ("conflict", "[[neural]] spikes: whisker")),
        ({"stimulus": "command.nc", "whisker": "C9"}, ("unknown", "[[neural]] spikes: whisker")),
        ({"spikes": "absent.csv"}, ("missing", "[[neural]] absent: absent.csv")),
        ({"spikes": "session.csv", "period": 2.0}, ("range", "[[neural]] session: period")),
        ({"period": 8.0}, ("conflict", "[[neural]] spikes: period")),
    ],
)
def test_what_does_not_fit_is_refused_by_the_name_of_its_key(folder, changed, message):
    with refusal(*message):
        neuron_results(asked(**changed), folder)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"period": 0.0}, ("range", "period")),
        ({"period": 8.0, "trials": None}, ("conflict", "trials")),
        ({"period": 8.0, "event": "onset"}, ("conflict", "period")),
        ({"first_onset": 5.0}, ("conflict", "first_onset")),
        ({"first_segment": "free-first"}, ("conflict", "first_segment")),
        ({"bin_width": -1.0}, ("range", "bin width")),
        ({"window": (2.0, 1.0)}, ("range", "window")),
    ],
)
def test_what_makes_no_sense_is_refused_before_a_file_is_read(changed, message):
    with refusal(*message):
        asked(**changed)
