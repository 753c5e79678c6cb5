"""The neural half of a study from its file to the report: names that do not clash, work kept, equal bytes."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.netcdf import load, save
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.neurons.cortex import run_cortex
from vibrissa.study.neurons.populations import FOLDER, kept_cortex, recorded_results, simulated_results
from vibrissa.study.report.gallery import figure_of
from vibrissa.study.run.study import run_study
from vibrissa.study.spec.cortex import Cortex
from vibrissa.study.spec.neurons import Neurons
from vibrissa.study.spec.settings import Study, UnitRecording, read_study
from vibrissa.study.store.run_state import Run
from vibrissa.sweep.engine import Engine

HERE = Engine(scheduler="synchronous")
TINY = Cortex(every=170, n_trials=12)
TRIALS = 16
SHOWN = ("spikes", "response", "motion", "unit", "unit_examples")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Spikes of a driven and an idle unit, the stimulus, and study files of one and of two recordings."""
    folder = tmp_path_factory.mktemp("study")
    rng, time = np.random.default_rng(5), np.arange(8000) / 2000
    slow = np.convolve(rng.normal(size=time.size), np.hanning(160), "same")
    moved = 50e-6 * (1 + 0.6 * slow / slow.std()).clip(0.05) * np.cos(2 * np.pi * 70 * time)
    envelope, lines = analytic_envelope(moved)[0], ["unit,trial,spike_time,quality"]
    for name, unit in (("driven", ThresholdLinearUnit(slope=5e5)), ("idle", ThresholdLinearUnit(slope=0.0))):
        spikes = simulate_spikes(unit, time, envelope, TRIALS, rng=rng)
        for when, trial in zip(spikes.spike_time.values.tolist(), spikes.spike_trial.values.tolist(), strict=True):
            lines.append(f"{name},{trial},{when!r},SU")
    (folder / "spikes.csv").write_text("\n".join(lines))
    rows = "".join(f"{t!r},{y!r}\n" for t, y in zip(time.tolist(), moved.tolist(), strict=True))
    (folder / "stimulus.csv").write_text(f"time,displacement\n{rows}")
    part = f'[[neural]]\nspikes = "spikes.csv"\nstimulus = "stimulus.csv"\ntrials = {TRIALS}\n'
    (folder / "one.toml").write_text(f'name = "One recording"\n{part}')
    (folder / "two.toml").write_text(f'name = "Two recordings"\n{part}{part}name = "again"\nspontaneous = [-1, 0]\n')
    return folder


def populations_of(study, out):
    run = Run(study, out, out, HERE)
    return simulated_results(run) | recorded_results(run)


def neurons(**changed):
    return Neurons(spikes="spikes.csv", stimulus="stimulus.csv", trials=TRIALS, **changed)


def test_names_of_the_only_population_are_plain_and_others_numbered(folder, tmp_path):
    def names(**parts):
        return set(populations_of(Study(name="s", folder=folder, **parts), tmp_path))

    plain, numbered = {"units", *SHOWN}, {f"{name}_1" for name in ("units", *SHOWN)}
    assert names(neural=(neurons(),)) == plain
    assert names(cortex=TINY) >= {"units", "spikes", "response", "motion"}
    assert names(neural=(neurons(),), recording=UnitRecording()) == numbered
    assert names(cortex=TINY, recording=UnitRecording()) == {
        "units",
        "unit_examples",
    }  # Figure 8A is of the [recording]
    both = names(cortex=TINY, neural=(neurons(),))
    assert numbered | {"units", "spikes"} <= both
    assert names(texture=read_study().texture, whisker=read_study().whisker, posture=read_study().posture,
                 scan=read_study().scan) == set()  # fmt: skip


def test_units_of_a_whisker_that_are_there_are_not_analysed_again(tmp_path):
    first = kept_cortex(TINY, tmp_path, HERE)
    files = sorted((tmp_path / FOLDER).glob("*.nc"))
    assert len(files) == len(np.unique(first["units"].unit_whisker))
    content = [path.read_bytes() for path in files]
    files[0].unlink()
    files[1].write_bytes(content[1][:100])  # cut off by a crash
    stamps = [path.stat().st_mtime_ns for path in files[2:]]
    second = kept_cortex(TINY, tmp_path, HERE)
    assert [path.read_bytes() for path in files] == content
    assert [path.stat().st_mtime_ns for path in files[2:]] == stamps
    for name, data in first.items():
        assert data.to_netcdf(engine="h5netcdf") == second[name].to_netcdf(engine="h5netcdf"), name
    plain = run_cortex(TINY)["units"]
    np.testing.assert_array_equal(first["units"].significant, plain.significant)
    np.testing.assert_allclose(first["units"].envelope_correlation, plain.envelope_correlation, rtol=1e-9)


def test_a_study_of_one_recording_ends_in_a_report(folder, tmp_path):
    told = run_study(read_study(folder / "one.toml"), tmp_path / "out", engine=HERE)
    assert told.population_name.values.tolist() == ["spikes"]
    assert (int(told.units_counted[0]), int(told.units_passed[0])) == (2, 1)
    units = load(tmp_path / "out/units.nc")
    low, high = units.threshold_low.values[0], units.threshold_high.values[0]
    assert low < ThresholdLinearUnit().threshold < high
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    for text in (
        *("Units: spikes", "2 units of spikes.csv, 16 presentations, 1 pass", "Figure 9: the population"),
        *("Paper | here | same?", "no sweeps: the study has no [laboratory]", "No window without stimulus"),
    ):
        assert text in page, text
    assert figure_of("8", tmp_path / "out") is not None
    assert figure_of("9", tmp_path / "out/units.nc") is not None


def test_two_recordings_stand_beside_each_other_and_a_repetition_gives_equal_bytes(folder, tmp_path):
    study = read_study(folder / "two.toml")
    run_study(study, tmp_path / "a", engine=HERE)
    again = populations_of(study, tmp_path / "b")
    assert set(again) == {f"{name}_{k}" for name in ("units", *SHOWN) for k in (1, 2)}
    for name, data in again.items():
        save(data, tmp_path / "again.nc")
        assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "a" / f"{name}.nc").read_bytes(), name
    page = (tmp_path / "a/report.html").read_text(encoding="utf-8")
    for text in ("Units: spikes", "Units: again", "Figure 8: one unit of again", "no unit fired from -1 to 0 s"):
        assert text in page, text


def test_a_study_without_any_part_is_refused_and_a_wrong_key_is_answered(tmp_path):
    with refusal("missing", "study"):
        Study(name="nothing")
    path = tmp_path / "study.toml"
    path.write_text('name = "s"\n[cortex]\ntrials = 40\n')
    with refusal("unknown", "study.toml: [cortex]: key 'trials'"):
        read_study(path)
    path.write_text('name = "s"\n[cortex]\nevery = 0\n')
    with refusal("format", "study.toml: cortex"):
        read_study(path)
    path.write_text('name = "s"\n[[neural]]\nspikes = "s.csv"\nstimulus = "m.csv"\nspontaneous = [1, 0]\n')
    with refusal("format", "study.toml: neural.0"):
        read_study(path)
