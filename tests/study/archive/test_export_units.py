"""Export of units: spike times on the session's clock, tuning and quality as columns, trials, stimulus."""

import json
import warnings

import numpy as np
import pytest

from vibrissa.netcdf import save
from vibrissa.neural.io.formats.nwb import read_nwb, read_nwb_trials
from vibrissa.neural.io.tables.spike_csv import write_csv
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.trials import cut_into_trials, trial_table
from vibrissa.quantities import dataset

pynwb = pytest.importorskip("pynwb")

WHO = (
    "--session-start",
    "2014-05-07T09:30:00Z",
    "--age",
    "P90D",
    "--sex",
    "U",
    "--subject",
    "rat 7",
    "--species",
    "Rattus norvegicus",
)
NAMES = ["b", "a", "c"]


def spikes(trial=None, **more):
    rng = np.random.default_rng(4)
    unit = np.repeat([0, 1], [30, 12])  # the third is silent
    which = None if trial is None else rng.integers(0, trial, unit.size)
    attrs = {"sampling_rate": 40e3, **more.pop("attrs", {})}
    quality = np.array(["SU", "MU", "SU"])
    time = rng.uniform(0, 4, unit.size)
    return spike_table(time, unit, NAMES, trial=which, attrs=attrs, unit_quality=quality, **more)


def tuning(names=("a", "b", "c"), **attrs):
    """Give what was found of units, in another order than they fired."""
    n = len(names)
    numbers = {name: np.arange(n) + k + 0.5 for k, name in enumerate(("threshold", "slope", "latency", "p_value"))}
    return dataset(attrs, unit_name=np.array(names), significant=np.arange(n) > 0, **numbers)


def motion():
    time = np.arange(4000) / 1000
    return dataset(time=time, point_displacement=1e-4 * np.sin(2 * np.pi * 70 * time))


def read(path, look):
    with warnings.catch_warnings(), pynwb.NWBHDF5IO(str(path), "r") as io:
        warnings.simplefilter("ignore")
        return look(io.read())


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "results").mkdir()
    return tmp_path / "results"


def test_units_on_the_sessions_clock_come_back_with_their_tuning(folder, tmp_path, vibrissa):
    save(spikes(), folder / "sorted.nc")
    save(tuning(), folder / "fits.nc")
    save(trial_table(np.array([0.5, 5.0]), np.array([4.5, 9.0]), ["T1", "T2"]), folder / "any.nc")
    save(motion(), folder / "motion.nc")
    code, out, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 0, err
    assert out.endswith("a.nwb: rat 7, 0 series, 0 tables, 3 units, 2 trials\n")
    back = read_nwb(tmp_path / "a.nwb")
    for name in ("spike_time", "spike_unit", "unit_name", "unit_quality"):
        np.testing.assert_array_equal(back[name], spikes()[name])
    assert read_nwb_trials(tmp_path / "a.nwb").trial_stimulus.values.tolist() == ["T1", "T2"]

    def look(file):
        table = file.units.to_dataframe().set_index("unit_name")
        for k, name in enumerate(("a", "b", "c")):
            found = [k + 0.5, k + 1.5, k + 2.5, k + 3.5]
            assert [table[one][name] for one in ("threshold", "slope", "latency", "p_value")] == found
            assert table.significant[name] == (k > 0)
        assert file.units["threshold"].description == "envelope above which the rate rises [m]"
        assert file.units["slope"].description.endswith("[1/(s m)]")
        assert file.units.resolution == 1 / 40e3
        assert file.units.description == "sorted units"
        template = file.stimulus_template["command"]
        np.testing.assert_array_equal(template.data[:, 0], motion().point_displacement)
        assert (template.rate, template.unit) == (1000.0, "meters")
        assert file.trials["timeseries"][1][0].timeseries.name == "command"
        assert "behavior" not in file.processing
        assert "VIRTUAL" not in file.session_description

    read(tmp_path / "a.nwb", look)
    inspector = pytest.importorskip("nwbinspector")
    nap = pytest.importorskip("pynapple")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        faults = inspector.inspect_nwbfile(
            nwbfile_path=tmp_path / "a.nwb",
            config=inspector.load_config("dandi"),
            importance_threshold=inspector.Importance.BEST_PRACTICE_VIOLATION,
        )
        assert [one.message for one in faults] == []
        units = nap.load_file(str(tmp_path / "a.nwb"))["units"]
        assert units["threshold"].tolist() == [1.5, 0.5, 2.5]  # in the order in which they fired
        own = spikes().spike_time.values[spikes().spike_unit.values == 0]
        np.testing.assert_allclose(units[0].t, own, rtol=0, atol=1e-9)  # the program rounds to nanoseconds


def test_spikes_in_trials_are_laid_on_the_clock_and_cut_again(folder, tmp_path, vibrissa):
    given = spikes(trial=3, attrs={"n_trials": 3, "window_start": -0.5, "window_stop": 4.0})
    save(given, folder / "spikes.nc")
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 0, err
    trials = read_nwb_trials(tmp_path / "a.nwb")
    start, stop = trials.trial_start.values, trials.trial_stop.values
    assert (stop - start).tolist() == [4.0] * 3
    assert ((start[1:] - 0.5) - stop[:-1] >= 1.0).all()  # what is before an onset is after the trial before
    back = cut_into_trials(read_nwb(tmp_path / "a.nwb"), trials, (-0.5, 4.0))
    np.testing.assert_array_equal(back.spike_trial, given.spike_trial)
    np.testing.assert_array_equal(back.spike_unit, given.spike_unit)
    np.testing.assert_allclose(back.spike_time, given.spike_time, rtol=0, atol=1e-13)


def test_a_movie_is_laid_after_a_session_that_has_its_own_clock(folder, tmp_path, vibrissa):
    save(spikes(), folder / "spikes.nc")
    modal = dataset(mode=np.arange(1, 2), time=np.arange(50) / 100, mode_displacement=np.ones((1, 50)))
    save(modal, folder / "modal.nc")
    code, _, err = vibrissa("export", folder, "--out", tmp_path, *WHO)
    assert code == 0, err
    path = tmp_path / "sub-rat-7_ses-results_behavior+ecephys.nwb"
    last = spikes().spike_time.values.max()

    def look(file):
        start = file.processing["behavior"]["mode_displacement"].starting_time
        assert start == np.ceil(last + 1)
        assert file.intervals["recordings"].to_dataframe().start_time.tolist() == [start]

    read(path, look)


def test_of_units_whose_spikes_are_elsewhere_the_tuning_is_told(folder, tmp_path, vibrissa):
    shown = spikes(trial=3, attrs={"n_trials": 3}).isel(unit=[0])
    save(shown.isel(spike=np.flatnonzero(shown.spike_unit.values == 0)), folder / "spikes.nc")
    save(tuning(n_trials=3), folder / "units.nc")
    save(motion(), folder / "motion.nc")
    save(tuning(("x", "y")), folder / "units_2.nc")
    code, out, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 0, err
    assert "1 units, 3 trials" in out
    assert "left out: spikes of a, c, x, y: a study keeps those of the unit that its figure shows" in err
    assert "; --spikes and --trials add all" in err

    def look(file):
        assert file.units["unit_name"][:].tolist() == ["b"]
        assert file.units["threshold"][:].tolist() == [1.5]
        tables = file.processing["behavior"].data_interfaces
        assert tables["tuning"]["unit_name"][:].tolist() == ["a", "b", "c"]
        assert tables["tuning"]["threshold"][:].tolist() == [0.5, 1.5, 2.5]
        assert tables["tuning_2"]["unit_name"][:].tolist() == ["x", "y"]
        lasts = file.trials["stop_time"][:] - file.trials["start_time"][:]
        played = motion().time.values  # its last sample lasts as long as the others
        np.testing.assert_allclose(lasts, played[-1] + played[1] - played[0], rtol=0, atol=1e-9)

    read(tmp_path / "a.nwb", look)


def test_spikes_trials_and_command_may_come_from_other_files(folder, tmp_path, vibrissa):
    save(tuning(), folder / "units.nc")
    given = spikes()
    write_csv(given, tmp_path / "spikes.csv")
    (tmp_path / "trials.csv").write_text("start,stop,stimulus\n0,4,T1\n5,9,T2\n")
    time = np.arange(4000) / 1000
    command = dataset(whisker=["C1", "C2"], time=time, command=1e-4 * np.stack([np.sin(time), np.cos(time)]))
    save(command, tmp_path / "command.nc")
    call = ("export", folder, "--out", tmp_path / "a.nwb", *WHO, "--spikes", tmp_path / "spikes.csv")
    call += ("--trial-table", tmp_path / "trials.csv", "--command", tmp_path / "command.nc")
    code, _, err = vibrissa(*call)
    assert code == 2
    assert err.startswith("vibrissa: --sampling-rate must be given; of the recording")
    code, _, err = vibrissa(*call, "--sampling-rate", "0")
    assert "--sampling-rate must be positive (Hz)" in err
    code, _, err = vibrissa(*call, "--sampling-rate", "25000")
    assert code == 0, err

    def look(file):
        assert sorted(file.units["unit_name"][:].tolist()) == ["a", "b", "c"]
        assert sorted(map(len, file.units["spike_times"][:])) == [0, 12, 30]
        assert file.units.resolution == 1 / 25000
        np.testing.assert_array_equal(file.stimulus_template["command"].data[:].T, command.command)
        assert file.trials["stimulus"][:].tolist() == ["T1", "T2"]
        assert file.trials["timeseries"][0][0].timeseries.name == "command"

    read(tmp_path / "a.nwb", look)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: spikes(trial=3), "spikes in trials must hold the number of trials and the length of each"),
        (lambda: spikes(trial=3, attrs={"n_trials": 3}), "must hold the number of trials and the length of each"),
    ],
)
def test_trials_of_unknown_length_are_refused(folder, tmp_path, vibrissa, make, message):
    save(make(), folder / "spikes.nc")
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 2
    assert message in err
    assert not (tmp_path / "a.nwb").exists()


def test_a_table_without_a_spike_is_refused(folder, tmp_path, vibrissa):
    save(tuning(), folder / "units.nc")
    (tmp_path / "spikes.csv").write_text("spike_time,unit\n")
    call = ("export", folder, "--out", tmp_path / "a.nwb", *WHO, "--spikes", tmp_path / "spikes.csv")
    code, _, err = vibrissa(*call, "--sampling-rate", "25000")
    assert code == 2
    assert "spikes.csv must hold at least one spike, got a header alone" in err
    assert not (tmp_path / "a.nwb").exists()


def test_two_recordings_in_a_folder_are_refused(folder, tmp_path, vibrissa):
    save(spikes(), folder / "one.nc")
    save(spikes(), folder / "two.nc")
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 2
    assert "spikes must be in one file, got one.nc and two.nc; move one to another folder" in err


@pytest.mark.parametrize("form", ["npy", "csv"])
def test_recordings_without_results_are_exported_and_read_again(tmp_path, vibrissa, form):
    """What `neural` finds in the file exported is what it finds in the recording."""
    rng, time = np.random.default_rng(4), np.arange(3000) / 1000
    slow = 1 + 0.8 * np.sin(2 * np.pi * 1.3 * time)
    rows = np.c_[time, 20 * np.log10(slow + 0.3)]
    np.savetxt(tmp_path / "level.csv", rows, delimiter=",", header="time,level_dB", comments="", fmt="%.9f")
    counts = (rng.uniform(size=(3000, 9, 2)) < 0.02 * slow[:, None, None]).astype(np.uint8)
    np.save(tmp_path / "s.npy", counts)
    lines = [f"{u},{k},{(b + 0.5) / 1000:.6f}" for b, k, u in np.argwhere(counts)]
    (tmp_path / "s.csv").write_text("\n".join(["unit,trial,spike_time", *lines]))
    recording = ("--spikes", tmp_path / f"s.{form}", *(("--counted-bin", "1ms") if form == "npy" else ()))
    shown = ("--stimulus", tmp_path / "level.csv")
    (tmp_path / "none").mkdir()
    out = tmp_path / "s.nwb"
    who = ("--experimenter", "Doe, Jane", "--institution", "I", "--lab", "L", "--sampling-rate", "20kHz")
    code, _, err = vibrissa("export", tmp_path / "none", "--out", out, *recording, *shown, *who, *WHO)
    assert code == 0, err
    with pynwb.NWBHDF5IO(str(out), "r") as io:
        file = io.read()
        assert (file.experimenter, file.institution, file.lab) == (("Doe, Jane",), "I", "L")
        assert file.stimulus_template["stimulus_envelope"].unit == "dB"
    words = ("neural", "--skip", "0.3s", "--level", "0.1", "--json")  # 2.7 s have few independent shifts
    trials = ("--trials", 9) if form == "csv" else ()
    first = json.loads(vibrissa(*words, *recording, *shown, *trials)[1])["units"]
    again = json.loads(vibrissa(*words, "--spikes", out, "--stimulus", out)[1])["units"]
    for one, other in zip(first, again, strict=True):
        assert one["significant"]
        assert other["p_value"] == one["p_value"]
        assert other["threshold"] == pytest.approx(one["threshold"], abs=1e-6)


def test_trials_in_which_a_unit_was_not_observed_come_back(folder, tmp_path, vibrissa):
    seen = np.array([[True, True, True], [True, False, True], [False, False, False]])
    cut = {"n_trials": 3, "window_start": -0.5, "window_stop": 4.0}
    save(spikes(trial=3, attrs=cut, unit_observed=seen), folder / "spikes.nc")
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 0, err
    back = cut_into_trials(read_nwb(tmp_path / "a.nwb"), read_nwb_trials(tmp_path / "a.nwb"), (-0.5, 4.0))
    assert back.unit_observed.values.tolist() == seen.tolist()


@pytest.mark.parametrize("stops", [True, False])
def test_trials_whose_times_are_known_keep_them(folder, tmp_path, vibrissa, stops):
    trials = trial_table(np.array([0.5, 5.0, 11.0]), np.array([4.5, 9.0, 15.0]), ["T1", "T2", "T1"])
    session = spike_table(np.array([0.75, 5.5, 14.0]), np.array([0, 1, 0]), ["a", "b"], attrs={"sampling_rate": 40e3})
    cut = cut_into_trials(session, trials)
    save(cut if stops else cut.drop_vars("trial_stop").assign_attrs(duration=4.0), folder / "spikes.nc")
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 0, err
    back = read_nwb_trials(tmp_path / "a.nwb")
    for name in ("trial_start", "trial_stop", "trial_stimulus"):
        np.testing.assert_array_equal(back[name], trials[name])
    np.testing.assert_allclose(read_nwb(tmp_path / "a.nwb").spike_time, session.sortby("spike_unit").spike_time)
