"""Export of one movie: values to the last bit, frames and units told, archives content, faults in one line."""

import errno
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from simulated_whiskers import circle_profile

from vibrissa.errors import install
from vibrissa.measures.face import Face
from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
from vibrissa.measures.touched_object import Pole
from vibrissa.netcdf import save
from vibrissa.quantities import dataset
from vibrissa.study.archive.export_series import Clock, sampling

pynwb = pytest.importorskip("pynwb")

WHO = (
    "--session-start",
    "2014-05-07T09:30:00+02:00",
    "--age",
    "P90D",
    "--sex",
    "F",
    "--subject",
    "rat 7",
    "--species",
    "Rattus norvegicus",
)
T, NODES, RATE = 60, 5, 500.0
TIME = np.arange(T) / RATE


def numbers(*shape, seed=1):
    return np.random.default_rng(seed).normal(size=shape)


def movie(folder):
    """Write results as of a recorded movie: two whiskers, the second lost in some frames."""
    x, y = numbers(2, T, NODES), numbers(2, T, NODES, seed=2)
    x[1, 10:20] = y[1, 10:20] = np.nan
    profile = dataset(
        {"frame": "image", "frame_rate": RATE, "pixel_size": 9.5e-5}, lead=("whisker",), whisker=np.arange(2),
        time=TIME, node=np.arange(NODES), x=x, y=y, y_sd=np.abs(x), arc_length=1e-3 * np.tile(np.arange(NODES), (2, 1)),
    )  # fmt: skip
    modal = dataset(
        {"modes": "straight", "whisker_length": 0.04}, mode=np.arange(1, 4), time=TIME, kappa=np.array([22.0, 64, 128]),
        mode_displacement=numbers(3, T, seed=3), envelope=np.abs(numbers(3, T, seed=4)), contact=0.3,
    )  # fmt: skip
    fit = {"resonant_frequency": np.array([120.0, 340, 700]), "damping": np.array([0.1, 0.11, np.nan])}
    posture = dataset(contact=0.3, contact_low=0.29, contact_high=0.31, base_angle=1.2, friction_se=np.nan)
    for name, data in {
        "profile": profile,
        "modal": modal,
        "resonance_white": dataset({"forcing": "white"}, mode=np.arange(1, 4), **fit),
        "posture": posture,
        "spectra_white": dataset(frequency=np.arange(3.0), mode=np.arange(1, 4), power=numbers(3, 3)),
    }.items():
        save(data, folder / f"{name}.nc")
    return profile, modal


def base_signal(folder, number=1, start=-0.25):
    time = start + np.arange(100) / 100
    attrs = {"kind": "moment", "label": "robot"}
    data = dataset(
        attrs, time=time, base_moment=numbers(100), mode=np.array([1]), resonant_frequency_white=np.array([125.0])
    )
    save(data, folder / f"base_signal_{number}.nc")
    return data


def read(path, look):
    with warnings.catch_warnings(), pynwb.NWBHDF5IO(str(path), "r") as io:
        warnings.simplefilter("ignore")
        return look(io.read())


def faults(path):
    """Give what the archives' inspector finds, suggestions aside, by the archive's own configuration too."""
    inspector = pytest.importorskip("nwbinspector")
    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for config in (None, inspector.load_config("dandi")):
            found += inspector.inspect_nwbfile(
                nwbfile_path=path, config=config, importance_threshold=inspector.Importance.BEST_PRACTICE_VIOLATION
            )
    return [(one.importance.name, one.check_function_name, one.object_name, one.message) for one in found]


def napped(path):
    nap = pytest.importorskip("pynapple")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return nap.load_file(str(path))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "day 3").mkdir()
    return tmp_path / "day 3"


# What comes out


def test_tracks_and_modes_come_back_to_the_last_bit(folder, tmp_path, vibrissa):
    profile, modal = movie(folder)
    code, out, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 0, err
    assert out == f"{tmp_path / 'a.nwb'}: rat 7, 8 series, 4 tables\n"
    assert err == "vibrissa: left out: spectra_white.nc: for figures and reports\n"

    def look(file):
        module = file.processing["behavior"]
        for k in range(2):
            for name in ("x", "y", "y_sd"):
                series = module[f"whisker_{k}_{name}"]
                np.testing.assert_array_equal(series.data[:], profile[name].values[k])
                assert (series.unit, series.rate, series.starting_time) == ("meters", RATE, 0.0)
                assert "y down along its columns" in series.comments
                assert "A pixel is 9.5e-05 m" in series.comments
        for name in ("mode_displacement", "envelope"):
            np.testing.assert_array_equal(module[name].data[:], modal[name].values.T)
            assert module[name].unit == {"mode_displacement": "1", "envelope": "meters"}[name]
        assert "over L" in module["mode_displacement"].description
        assert "L is 0.04 m" in module["mode_displacement"].comments
        nodes = module["whisker_1_nodes"].to_dataframe()
        assert nodes.arc_length.tolist() == profile.arc_length.values[1].tolist()
        modes = module["modes"].to_dataframe()
        assert modes["mode"].tolist() == [1, 2, 3]
        assert modes.kappa.tolist() == [22.0, 64, 128]
        assert modes.resonant_frequency_white.tolist() == [120.0, 340, 700]
        np.testing.assert_array_equal(modes.damping_white, [0.1, 0.11, np.nan])
        assert module["modes"]["resonant_frequency_white"].description.endswith("[Hz]")
        posture = module["posture"].to_dataframe()
        assert (posture.contact[0], posture.contact_low[0], posture.base_angle[0]) == (0.3, 0.29, 1.2)
        assert "friction_se" not in posture  # not measured
        assert file.session_start_time.isoformat() == "2014-05-07T09:30:00+02:00"
        assert (file.subject.subject_id, file.subject.age, file.subject.sex) == ("rat 7", "P90D", "F")
        assert (file.identifier, file.session_id) == ("rat 7 day 3", "day 3")
        assert "VIRTUAL" not in file.session_description

    read(tmp_path / "a.nwb", look)
    again = napped(tmp_path / "a.nwb")
    np.testing.assert_array_equal(again["whisker_1_x"].values, profile.x.values[1])
    np.testing.assert_array_equal(again["envelope"].values, modal.envelope.values.T)
    np.testing.assert_allclose(again["envelope"].t, TIME, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("profile_as", "kinematics_as"), [("profile", "kinematics"), ("whisking", "measures")])
def test_kinematics_are_behavioral_series_and_touches_intervals(folder, tmp_path, vibrissa, profile_as, kinematics_as):
    """Files are known by what they hold, whatever their names."""
    time = np.arange(1000) / RATE
    direction = 0.1 - 0.3 * np.cos(2 * np.pi * 5 * time)
    profile = circle_profile(direction, 0.0)
    pole = Pole(centre=(6e-3 * np.cos(0.2), 6e-3 * np.sin(0.2)))
    face = Face(caudal=(0.0, 0.0), rostral=(0.0, 1.0))
    found = kinematics_of(profile, KinematicsSettings(face=face, touched=pole, touch_distance=1e-4))
    save(profile, folder / f"{profile_as}.nc")
    save(found, folder / f"{kinematics_as}.nc")
    code, out, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 0, err
    measures = sum(found[name].dims == ("whisker", "time") for name in found.data_vars)
    places = sum(profile[name].dims[-2:] == ("time", "node") for name in profile.data_vars)
    assert f"{measures + places} series" in out

    def look(file):
        series = file.processing["behavior"]["whisker_kinematics"].time_series
        for name in ("whisker_angle", "whisking_phase", "set_point", "curvature_change", "touching"):
            np.testing.assert_array_equal(series[name].data[:], found[name].values.T)
        assert series["whisker_angle"].unit == "radians"
        assert "Columns: whiskers 1." in series["whisker_angle"].comments
        touches = file.intervals["whisker_touches"].to_dataframe()
        np.testing.assert_allclose(touches.start_time, found.touch_onset)
        np.testing.assert_allclose(touches.stop_time, found.touch_onset + found.touch_duration)
        np.testing.assert_array_equal(touches.touch_angle, found.touch_angle)
        assert (touches.stop_time > touches.start_time).all()
        assert touches.touch_whisker.tolist() == ["1"] * found.sizes["touch"]
        assert touches.touch_whisker_number.tolist() == [0] * found.sizes["touch"]

    assert found.sizes["touch"] == 20  # the straight whisker sweeps over the place to and fro
    read(tmp_path / "a.nwb", look)
    assert faults(tmp_path / "a.nwb") == []


def test_virtual_data_say_so(folder, tmp_path, vibrissa):
    movie(folder)
    true = dataset({"frame": "image"}, time=TIME, x=numbers(T, 2), y=numbers(T, 2), arc_length=np.array([0.0, 1e-3]))
    save(true, folder / "true_profile.nc")
    amplitude = numbers(2, T, seed=9)
    save(dataset(time=TIME, mode=np.arange(1, 3), mode_displacement=amplitude), folder / "prediction.nc")
    spikes = dataset(
        {"n_trials": 3, "duration": 1.5}, spike_time=np.array([0.25, 1.0, 0.5]), spike_trial=np.array([0, 0, 2])
    )
    save(spikes, folder / "spikes.nc")
    code, out, err = vibrissa("export", folder, "--out", tmp_path, *WHO, "--json")
    assert code == 0, err
    (made,) = json.loads(out)["files"]
    assert made["virtual"]
    assert Path(made["path"]).name == "sub-rat-7_ses-day-3_behavior+ecephys.nwb"
    assert (made["units"], made["trials"]) == (1, 3)

    def look(file):
        assert file.session_description.startswith("VIRTUAL DATA, simulated with vibrissa")
        assert "virtual data" in file.keywords[:]
        assert "no animal" in file.subject.description
        assert file.units.description == "simulated units"
        module = file.processing["behavior"]
        assert "Truth of the simulation" in module["whisker_0_x_true"].comments
        assert "Predicted by the model" in module["mode_displacement_model"].comments
        np.testing.assert_array_equal(module["mode_displacement_model"].data[:], amplitude.T)
        trials = file.trials.to_dataframe()  # after the movie, at whole seconds, 1 s apart at least
        assert trials.start_time.tolist() == [2.0, 5.0, 8.0]
        assert trials.stop_time.tolist() == [3.5, 6.5, 9.5]
        assert file.units["spike_times"][0].tolist() == [2.25, 3.0, 8.5]

    read(made["path"], look)
    assert faults(made["path"]) == []


def test_base_signals_are_laid_on_the_same_clock(folder, tmp_path, vibrissa):
    movie(folder)
    first, second = base_signal(folder, 1), base_signal(folder, 2, start=3.5)
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO, "--pause", "2")
    assert code == 0, err

    def look(file):
        module = file.processing["behavior"]
        series = module["base_signal_1_base_moment"]
        np.testing.assert_array_equal(series.data[:], first.base_moment)
        assert (series.unit, series.starting_time, series.rate) == ("N m", 2.75, 100.0)  # −0.25 s, 3 s later
        assert "Base signal robot; sensor: moment" in series.comments
        assert module["base_signal_1_modes"]["resonant_frequency_white"][:].tolist() == [125.0]
        rows = file.intervals["recordings"].to_dataframe()
        assert rows.what.tolist() == ["movie", "base signal 1, robot", "base signal 2, robot"]
        assert rows.own_start.tolist() == [0.0, -0.25, 3.5]
        assert rows.start_time.tolist() == [0.0, 2.75, 6.5]
        assert module["base_signal_2_base_moment"].starting_time == 6.5
        np.testing.assert_array_equal(module["base_signal_2_base_moment"].data[:], second.base_moment)

    read(tmp_path / "a.nwb", look)
    assert faults(tmp_path / "a.nwb") == []


def test_a_scan_is_told_as_a_prediction(folder, tmp_path, vibrissa):
    scan = dataset(time=TIME, mode=np.arange(1, 3), mode_amplitude=numbers(2, T), base_moment=numbers(T))
    save(scan, folder / "any name.nc")
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 0, err

    def look(file):
        np.testing.assert_array_equal(file.processing["behavior"]["scan_base_moment_model"].data[:], scan.base_moment)
        assert file.session_description.startswith("VIRTUAL DATA")

    read(tmp_path / "a.nwb", look)


# Times


@pytest.mark.parametrize("rate", [500.0, 2000.0, 1017.25, 24414.0625, 1 / 3])
@pytest.mark.parametrize("start", [0.0, 0.1, -3.7, 5e3])
def test_even_times_are_told_by_their_rate(rate, start):
    time = start + np.arange(5000) / rate
    told = sampling(time)
    assert set(told) == {"rate", "starting_time"}
    np.testing.assert_allclose(told["starting_time"] + np.arange(5000) / told["rate"], time, rtol=0, atol=1e-9)


def test_uneven_times_are_told_one_by_one():
    for time in (TIME[[0, 1, 3]], TIME[:1], TIME + 1e-6 * (np.arange(T) == 30)):
        np.testing.assert_array_equal(sampling(time)["timestamps"], time)


def test_recordings_are_laid_one_after_the_other_by_whole_seconds():
    clock = Clock(pause=1.0)
    spans = [(0.25, 1.75), (-0.5, 3.0), (100.125, 101.0)]
    laid = [clock.lay(np.array(span)) for span in spans]
    assert laid[0].tolist() == [0.25, 1.75]
    for before, after, own in zip(laid, laid[1:], spans[1:], strict=False):
        assert 1.0 <= after[0] - before[1] < 2.0
        assert (after[0] - own[0]) % 1 == 0
        assert after[1] - after[0] == own[1] - own[0]
    assert Clock(pause=1.0).lay(np.array([-0.5, 1.0])).tolist() == [0.5, 2.0]
    assert Clock(pause=1.0, taken=10.0).lay(np.array([0.0, 1.0])).tolist() == [11.0, 12.0]


# What is refused


def test_what_is_not_told_is_asked_for_by_the_options_name(folder, tmp_path, vibrissa):
    movie(folder)
    call = ("export", folder, "--out", tmp_path / "a.nwb")
    code, _, err = vibrissa(*call)
    assert code == 2
    assert err.startswith("vibrissa: --subject, --age, --sex, --species, --session-start must be given; ")
    for missing in ("--age", "--sex", "--species", "--session-start", "--subject"):
        k = WHO.index(missing)
        code, _, err = vibrissa(*call, *WHO[:k], *WHO[k + 2 :])
        assert code == 2
        assert err.startswith(f"vibrissa: {missing} must be given")
        assert err.count("\n") == 1
    assert not (tmp_path / "a.nwb").exists()


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--session-start", "2014-05-07T09:30:00", "--session-start must have a time zone"),
        ("--session-start", "2014-05-07", "--session-start must have a time of day and its zone"),
        ("--session-start", "2014-05-07+00:00", "--session-start must have a time of day and its zone"),
        ("--session-start", "yesterday", "--session-start must be date and time of ISO 8601"),
        ("--session-start", "2914-05-07T09:30:00Z", "--session-start must not lie in the future"),
        ("--age", "3 months", "--age must be a duration of ISO 8601"),
        ("--sex", "male", "--sex must be M, F, O or U"),
        ("--species", "rat", "--species must be a Latin name"),
        ("--subject", "a/b", "--subject must not hold a /"),
        ("--session", "a/b", "--session must not hold a /"),
        ("--pause", "0", "--pause must be positive"),
        ("--animals", "none.csv", "none.csv must be an existing file"),
        ("--out", "no/where/a.nwb", "must be an existing folder"),
    ],
)
def test_what_archives_would_not_take_is_one_line(folder, tmp_path, vibrissa, option, value, message):
    movie(folder)
    words = {"--out": str(tmp_path / "a.nwb"), **dict(zip(WHO[::2], WHO[1::2], strict=True)), option: value}
    code, out, err = vibrissa("export", folder, *(word for pair in words.items() for word in pair))
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "a.nwb").exists()


def test_folders_without_results_are_refused(folder, tmp_path, vibrissa):
    call = ("--out", tmp_path / "a.nwb", *WHO)
    assert "must be an existing folder of results" in vibrissa("export", tmp_path / "none", *call)[2]
    assert "must hold results: datasets (.nc)" in vibrissa("export", folder, *call)[2]
    save(dataset(frequency=np.arange(3.0)), folder / "spectra.nc")
    assert "must hold results: datasets (.nc)" in vibrissa("export", folder, *call)[2]
    (folder / "profile.nc").write_bytes(b"no dataset")
    code, _, err = vibrissa("export", folder, *call)
    assert code == 2
    assert "profile.nc must be a NetCDF file" in err


def test_files_that_exist_are_kept_unless_asked(folder, tmp_path, vibrissa):
    movie(folder)
    path = tmp_path / "a.nwb"
    path.write_text("mine")
    code, _, err = vibrissa("export", folder, "--out", path, *WHO)
    assert code == 2
    assert "--out must not name a file that exists" in err
    assert "--overwrite replaces it" in err
    assert path.read_text() == "mine"
    assert vibrissa("export", folder, "--out", path, *WHO, "--overwrite")[0] == 0
    assert read(path, lambda file: file.session_id) == "day 3"


def test_a_full_disk_leaves_nothing(folder, tmp_path, vibrissa, monkeypatch):
    movie(folder)

    def full(path, content):
        with path.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 2
    assert "could not be written (No space left on device)" in err
    assert [one.name for one in tmp_path.iterdir()] == ["day 3"]


def test_without_pynwb_the_remedy_is_told(folder, tmp_path, vibrissa, monkeypatch):
    movie(folder)
    monkeypatch.setitem(__import__("sys").modules, "pynwb", None)
    code, _, err = vibrissa("export", folder, "--out", tmp_path / "a.nwb", *WHO)
    assert code == 2
    assert f"needs pynwb; {install('neuro')}" in err
