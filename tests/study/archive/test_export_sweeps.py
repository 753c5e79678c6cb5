"""Export of many sweeps: a file for each animal, each sweep on one clock and whole, what was rejected told."""

import errno
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from vibrissa.netcdf import load, save
from vibrissa.quantities import dataset
from vibrissa.study.archive.export import export_nwb
from vibrissa.study.archive.export_session import SessionDetails, read_animals
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.sweeps.laboratory import plan
from vibrissa.study.sweeps.sweeps import read_series, run_recorded
from vibrissa.study.sweeps.virtual_sweep import filmed_sweep
from vibrissa.sweep.engine import Engine
from vibrissa.texture.io import write_gaps

pynwb = pytest.importorskip("pynwb")

LABORATORY = Laboratory(
    truth="modes", animals=1, whiskers=("C1",), conditions=1, textures=1, n_frames=400, speeds=(0.15,), seed=3
)
TOLD = SessionDetails(age="P90D", sex="M", species="Rattus norvegicus", start="2014-05-07T09:30:00+02:00", name="s1")
LINES = """track,animal,whisker,texture,scan_speed_mm_s,length,cone_angle,substrate,run,start
track.nc,rat 1,C1,texture.csv,150,{whisker},{line},0,0
missing.nc,rat 1,C1,texture.csv,150,{whisker},{line},1,0
track.nc,rat 2,C1,unknown,150,{whisker},{line},0,0.05
track.nc,rat 1,C1,unknown,150,{whisker},{line},2,0.05
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Give the results of four recorded sweeps: two of an animal and one of another, one without its file."""
    home = tmp_path_factory.mktemp("recorded")
    sweep = plan(LABORATORY)[0][0]
    filmed = filmed_sweep(LABORATORY, sweep)
    save(filmed.profile, home / "track.nc")
    write_gaps(LABORATORY.grating(0), home / "texture.csv")
    pixel = filmed.profile.attrs["pixel_size"]
    points = [coordinate / pixel for point in filmed.known.substrate for coordinate in point]
    whisker = f"{sweep.whisker.length!r},{sweep.whisker.cone_angle!r}"
    (home / "sweeps.csv").write_text(LINES.format(whisker=whisker, line=" ".join(f"{one:.3f}" for one in points)))
    run_recorded(home / "sweeps.csv", home / "out", engine=Engine(scheduler="synchronous"))
    return home / "out"


@pytest.fixture(scope="module")
def files(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("archive")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        written, _ = export_nwb(folder, out / "new", TOLD)
    return {one.session.subject: one for one in written}


def read(path, look):
    with warnings.catch_warnings(), pynwb.NWBHDF5IO(str(path), "r") as io:
        warnings.simplefilter("ignore")
        return look(io.read())


def times(series):
    """Give the times of a series as any reader finds them."""
    if series.timestamps is not None:
        return series.timestamps[:]
    return series.starting_time + np.arange(len(series.data)) / series.rate


def test_each_animal_has_a_file_of_its_name(files):
    assert {name: one.path.name for name, one in files.items()} == {
        "rat 1": "sub-rat-1_ses-s1_behavior.nwb",
        "rat 2": "sub-rat-2_ses-s1_behavior.nwb",
    }
    assert [(one.holds["sweeps"], one.holds["rejected"]) for one in files.values()] == [(2, 1), (1, 0)]
    assert not any(one.session.virtual for one in files.values())
    for one in files.values():
        assert read(one.path, lambda file: file.subject.subject_id) == one.session.subject


def test_each_sweep_is_cut_out_of_the_series_by_its_interval(files, folder):
    series = {number: read_series(folder, number) for number in (0, 3)}

    def look(file):
        rows = file.intervals["sweeps"].to_dataframe()
        assert rows.sweep_number.tolist() == [0, 3]
        assert "in the order of the table, " in file.intervals["sweeps"].description
        assert rows.start_time[1] - rows.stop_time[0] >= 1.0
        for name in ("mode_displacement", "envelope", "mode_displacement_model", "envelope_model"):
            one = file.processing["behavior"][name]
            time = times(one)
            for _, row in rows.iterrows():
                here = (time >= row.start_time) & (time <= row.stop_time)
                own = series[row.sweep_number]
                if name not in own:  # no texture, no prediction
                    assert not here.any()
                    continue
                np.testing.assert_array_equal(one.data[here], own[name].values.T)
                np.testing.assert_allclose(time[here] - row.start_time, own.time - own.time[0], rtol=0, atol=1e-12)
                assert row.own_start == own.time.values[0]
                assert (row.start_time - row.own_start) % 1 == pytest.approx(0, abs=1e-12)
        assert rows.own_start[1] == pytest.approx(-0.05)

    read(files["rat 1"].path, look)


def test_rows_are_those_of_the_table(files, folder):
    table = load(folder / "sweeps.nc")

    def look(file):
        rows = file.intervals["sweeps"].to_dataframe()
        for name in ("contact", "base_angle", "scan_speed", "length", "texture", "run"):
            assert rows[name].tolist() == table[name].values[[0, 3]].tolist(), name
        for name in ("resonant_frequency_white", "damping_white_low", "mode_rms"):
            for mode in (1, 2, 3):
                assert rows[f"{name}_mode_{mode}"].tolist() == table[name].sel(mode=mode).values[[0, 3]].tolist()
        assert rows.texture_name.tolist() == ["texture.csv", "unknown"]
        assert rows.whisker_name.tolist() == ["C1", "C1"]
        assert "friction" not in rows  # nobody measured it
        assert file.intervals["sweeps"]["scan_speed"].description.endswith("[m/s]")
        lost = file.processing["behavior"]["rejected_sweeps"].to_dataframe()
        assert lost.sweep_number.tolist() == [1]
        assert "missing.nc must be an existing file" in lost.rejected[0]

    read(files["rat 1"].path, look)


def test_one_sweep_tells_its_rate(files, folder):
    def look(file):
        one = file.processing["behavior"]["mode_displacement"]
        assert one.rate == 2000.0
        row = file.intervals["sweeps"].to_dataframe().iloc[0]
        assert ((times(one) >= row.start_time) & (times(one) <= row.stop_time)).all()
        np.testing.assert_array_equal(one.data[:], read_series(folder, 2).mode_displacement.values.T)
        assert "rejected_sweeps" not in file.processing["behavior"].data_interfaces

    read(files["rat 2"].path, look)


def test_archives_find_no_fault(files):
    inspector = pytest.importorskip("nwbinspector")
    violation = inspector.Importance.BEST_PRACTICE_VIOLATION
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        dandi = inspector.load_config("dandi")
        found = [
            (one.check_function_name, one.object_name, one.message)
            for written in files.values()
            for one in inspector.inspect_nwbfile(
                nwbfile_path=written.path, config=dandi, importance_threshold=violation
            )
        ]
    assert found == []


def test_pynapple_cuts_a_sweep_out(files, folder):
    nap = pytest.importorskip("pynapple")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        data = nap.load_file(str(files["rat 1"].path))
        sweeps, moved = data["sweeps"], data["mode_displacement"]
        assert sweeps["contact"].tolist() == load(folder / "sweeps.nc").contact.values[[0, 3]].tolist()
        unknown = sweeps[sweeps["texture"] < 0]
        np.testing.assert_array_equal(moved.restrict(unknown).values, read_series(folder, 3).mode_displacement.values.T)


# Beside the sweeps


@pytest.fixture
def more(folder, tmp_path):
    """Give a folder like the other to put more results into."""
    (tmp_path / "out").mkdir()
    for one in folder.iterdir():
        (tmp_path / "out" / one.name).symlink_to(one)
    return tmp_path / "out"


def exported(*args, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return export_nwb(*args, **options)


def test_tracks_of_the_sweep_that_figures_show_stand_at_that_sweep(more, tmp_path):
    series = read_series(more, 3)
    own = series.time.values + 0.05  # the movie's own time
    x = np.random.default_rng(0).normal(size=(1, own.size, 4))
    arc = np.zeros((1, 4))
    profile = dataset(lead=("whisker",), whisker=np.arange(1), time=own, node=np.arange(4), x=x, y=x, arc_length=arc)
    save(profile, more / "profile.nc")
    save(dataset({"sweep": 3}, contact=0.3), more / "posture.nc")
    (first, _), left_out = exported(more, tmp_path / "nwb", TOLD)
    assert "posture.nc" in left_out
    assert "profile.nc" not in left_out
    save(profile.isel(time=slice(9)), more / "profile.nc")
    (again, _), left_out = exported(more, tmp_path / "other", TOLD)
    assert left_out["profile.nc"].startswith("its times are not those of sweep 3")
    assert not any("whisker" in name for name in again.holds["series"])

    def look(file):
        start = file.intervals["sweeps"].to_dataframe().start_time[1]
        shown = file.processing["behavior"]["whisker_0_x"]
        np.testing.assert_array_equal(shown.data[:], x[0])
        assert (shown.starting_time, shown.rate) == (pytest.approx(start, abs=1e-12), 2000.0)

    read(first.path, look)


def test_a_movie_that_is_none_of_the_sweeps_is_of_an_animal_by_itself(more, tmp_path):
    values = np.zeros((1, 50, 4))
    labels = {"whisker": np.arange(1), "time": np.arange(50) / 100, "node": np.arange(4)}
    save(dataset(lead=("whisker",), **labels, x=values, y=values, arc_length=values[:, 0]), more / "profile.nc")
    save(dataset(contact=0.3), more / "posture.nc")  # of no sweep
    with refusal("format", "subject", value="rat 2"):
        exported(more, tmp_path / "nwb", SessionDetails(**{**vars(TOLD), "subject": "rat 2"}))
    assert not (tmp_path / "nwb").exists()
    written, _ = exported(more, tmp_path / "nwb", SessionDetails(**{**vars(TOLD), "subject": "robot"}))
    assert "whisker_0_x" in {one.session.subject: one for one in written}["robot"].holds["series"]


def test_base_signals_of_several_animals_ask_whose_they_are(more, tmp_path):
    signal = dataset(time=np.arange(50) / 100, base_moment=np.arange(50.0))
    save(signal, more / "base_signal_1.nc")
    with refusal("missing", "subject"):
        exported(more, tmp_path / "nwb", TOLD)
    assert not (tmp_path / "nwb").exists()
    for subject, names in (("rat 2", ["rat 1", "rat 2"]), ("robot", ["rat 1", "rat 2", "robot"])):
        told = SessionDetails(**{**vars(TOLD), "subject": subject})
        written, _ = exported(more, tmp_path / subject, told)
        assert [one.session.subject for one in written] == names
        assert "base_signal_1_base_moment" in {one.session.subject: one for one in written}[subject].holds["series"]
    with refusal("conflict", "sub-rat-2"):
        exported(more, tmp_path / "alike", SessionDetails(**{**vars(TOLD), "subject": "rat-2"}))


def test_animals_that_differ_are_told_by_a_table(folder, tmp_path):
    (tmp_path / "animals.csv").write_text(
        "animal,age,sex,start,session\nrat 1,P60D,F,,x\nrat 2,,,2015-01-02T03:04+00:00,\n"
    )
    written, _ = exported(folder, tmp_path / "nwb", TOLD, animals=read_animals(tmp_path / "animals.csv"))
    one, two = (each.session for each in written)
    assert (one.age, one.sex, one.session, one.start.year) == ("P60D", "F", "x", 2014)
    assert (two.age, two.sex, two.session, two.start.year) == ("P90D", "M", "s1", 2015)
    for text, fields in (
        ("animal,colour\nrat 1,white\n", ("unknown", "animals.csv, line 1", "'colour'")),
        ("age\nP90D\n", ("missing", "animals.csv, line 1", "'age'")),
        ("animal,age\nrat 1\n", ("shape", "animals.csv, line 2", "1")),
        ("animal,age\nrat 1,P1D\nrat 1,P2D\n", ("conflict", "animals.csv, line 3, animal", "'rat 1'")),
    ):
        (tmp_path / "animals.csv").write_text(text)
        with refusal(*fields):
            read_animals(tmp_path / "animals.csv")


# All or none


def test_names_that_fit_no_sweep_are_refused(folder, tmp_path):
    with refusal("conflict", "subject", value="x"):
        exported(folder, tmp_path / "nwb", SessionDetails(**{**vars(TOLD), "subject": "x"}))
    with refusal("missing", "animals", value="rat 3"):
        exported(folder, tmp_path / "nwb", TOLD, animals={"rat 3": {"age": "P1D"}})
    assert not (tmp_path / "nwb").exists()


def test_two_animals_need_a_folder(folder, tmp_path):
    with refusal("missing", "out"):
        exported(folder, tmp_path / "a.nwb", TOLD)


def test_a_disk_that_fills_up_at_the_second_file_leaves_none(folder, tmp_path, monkeypatch):
    whole, count = Path.write_bytes, []

    def full(path, content):
        count.append(path)
        if len(count) == 2:
            whole(path, content[:1000])
            raise OSError(errno.ENOSPC, "No space left on device")
        return whole(path, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    with refusal("machine", "sub-rat-2_ses-s1_behavior.nwb"):
        exported(folder, tmp_path, TOLD)
    assert list(tmp_path.iterdir()) == []


def test_a_sweep_whose_series_is_gone_is_told(more, tmp_path):
    names = {path.name for path in (more / "sweeps").iterdir()}
    (more / "sweeps").unlink()
    (more / "sweeps").mkdir()
    with refusal("missing") as caught:
        exported(more, tmp_path / "nwb", TOLD)
    assert Path(caught.value.quantity).name in names
    assert not (tmp_path / "nwb").exists()


def test_names_of_animals_that_archives_cannot_tell_apart_are_refused(more, tmp_path):
    table = load(more / "sweeps.nc")
    (more / "sweeps.nc").unlink()
    renamed = table.assign_coords(animal=("sweep", ["rat 1", "rat 1", "rat-1", "rat 1"]))
    save(renamed, more / "sweeps.nc")
    with refusal("conflict", "sub-rat-1"):
        exported(more, tmp_path / "nwb", TOLD)


def test_a_laboratory_is_virtual_and_what_is_found_stands_beside_the_truth(folder, more, tmp_path):
    table = load(folder / "sweeps.nc").isel(sweep=[0])
    (more / "sweeps.nc").unlink()
    true = table.contact + 0.01
    whole = table.assign(contact_true=true).assign_attrs(laboratory=json.dumps({"seed": 3}))
    save(whole, more / "sweeps.nc")
    comparison = dataset(
        lead=("sweep",), sweep=np.array([0]), mode=np.array([1, 2]), correlation=np.array([[0.9, 0.8]])
    )
    save(comparison, more / "comparison.nc")
    (written,), _ = exported(more, tmp_path / "a.nwb", TOLD)
    assert written.session.virtual

    def look(file):
        assert file.session_description.startswith("VIRTUAL DATA, simulated with vibrissa")
        row = file.intervals["sweeps"].to_dataframe().iloc[0]
        assert (row.contact, row.contact_true) == (table.contact.item(), true.item())
        assert (row.correlation_mode_1, row.correlation_mode_2) == (0.9, 0.8)

    read(written.path, look)
