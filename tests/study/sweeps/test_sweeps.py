"""Many sweeps: found is near true, files are whole and used again, a user's table goes the same way."""

import copy
import dataclasses
import json
from functools import partial

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa.errors import ConvergenceError, InputError, RangeError
from vibrissa.mechanics.inverse.stationary_posture import fit_profile
from vibrissa.netcdf import load, save
from vibrissa.study.movie.apparatus import true_profile
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.spec.nuisance import Nuisance
from vibrissa.study.spec.recorded_sweeps import read_sweeps
from vibrissa.study.store.result_store import StoredWork, made_of
from vibrissa.study.sweeps.laboratory import plan
from vibrissa.study.sweeps.sweep_analysis import analyse_sweep
from vibrissa.study.sweeps.sweep_table import COORDINATES, N_MODES, sweep_table
from vibrissa.study.sweeps.sweeps import read_series, recorded_jobs, run_jobs, run_laboratory, run_recorded
from vibrissa.study.sweeps.virtual_sweep import filmed_sweep, virtual_sweep
from vibrissa.sweep.engine import Engine
from vibrissa.texture.io import write_gaps
from vibrissa.texture.surface import random_grating
from vibrissa.video.foreign.whisk_files import WHISKERS

LABORATORY = Laboratory(
    truth="modes", animals=1, whiskers=("C1",), conditions=1, textures=1, n_frames=500, speeds=(0.15,), seed=3
)
ONE = Engine(scheduler="synchronous")
HEADER = "track,animal,whisker,texture,scan_speed_mm_s,base_height_mm,length,cone_angle,exposure,substrate\n"
WHAT = {"animal": "a", "whisker_name": "C1", "texture": 0, "condition": 0, "run": 0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("laboratory")


@pytest.fixture(scope="module")
def table(folder):
    return run_laboratory(LABORATORY, folder, engine=ONE)


@pytest.fixture(scope="module")
def filmed():
    return filmed_sweep(LABORATORY, plan(LABORATORY)[0][0])


# The table


def test_a_row_may_hold_columns_that_the_table_does_not_list():
    row = WHAT | {"accepted": True, "rejected": "", "tip": 2.0, "kappa": np.arange(1.0, N_MODES + 1)}
    found = sweep_table([row, WHAT | {"accepted": False, "rejected": "lost"}])
    assert found.tip.dims == ("sweep",)
    assert found.kappa.dims == ("sweep", "mode")
    assert found.tip.values[0] == 2.0
    assert np.isnan(found.tip.values[1])
    with pytest.raises(KeyError, match="no_such_quantity"):
        sweep_table([row | {"no_such_quantity": 1.0}])


def test_what_a_row_lacks_was_not_measured():
    found = sweep_table([WHAT | {"contact": 0.3, "accepted": True, "rejected": ""}])
    assert set(COORDINATES) < set(found.coords)
    assert found.resonant_frequency.dims == ("sweep", "mode")
    assert found.resonant_frequency.shape == (1, N_MODES)
    assert np.isnan(found.resonant_frequency).all()
    assert np.isnan(found.base_angle).all()
    assert found.contact.values.tolist() == [0.3]
    assert not any(name.endswith("_true") for name in found)
    assert found.resonant_frequency.attrs["units"] == "Hz"


# A virtual sweep


def test_what_is_found_is_near_the_truth(table):
    one = table.isel(sweep=0)
    assert bool(one.accepted)
    assert str(one.rejected.values) == ""
    assert float(one.contact) == pytest.approx(float(one.contact_true), abs=0.004)
    assert float(one.base_angle) == pytest.approx(float(one.base_angle_true), abs=0.02)
    first = one.sel(mode=1)
    assert float(first.resonant_frequency) == pytest.approx(float(first.resonant_frequency_true), rel=0.005)
    assert float(first.damping) == pytest.approx(float(first.damping_true), rel=0.1)
    assert float(first.mode_rms) == pytest.approx(float(first.mode_rms_true), rel=0.02)
    assert float(first.fit_r2) > 0.99 > float(first.fit_r2_white)


def test_taking_the_textures_mean_off_brings_the_posture_nearer(table, filmed):
    raw = fit_profile(filmed.profile, filmed.known.whisker, substrate=filmed.known.substrate)
    for name in ("contact", "base_angle"):
        truth = float(table[f"{name}_true"].item())
        assert abs(table[name].item() - truth) < abs(float(raw[name]) - truth) / 3


def test_a_perfect_tracker_finds_the_posture_of_the_flat(filmed):
    """The mean over a texture holds that of the vibration, which without its part leaves 0.0005 in ε and 0.004 rad."""
    tracked, posture = filmed.profile, filmed.motion.prediction.posture
    true = true_profile(filmed.motion.position, filmed.film, filmed.scene, tracked.arc_length.values)
    perfect = tracked.assign({name: tracked[name].copy(data=true[name].values) for name in ("x", "y")})
    row, _ = analyse_sweep(perfect, filmed.known)
    assert row["contact"] == pytest.approx(posture.contact, abs=3e-5)
    assert row["base_angle"] == pytest.approx(posture.base_angle, abs=3e-4)


def test_a_tip_that_wanders_spoils_the_prediction_and_the_forcing_that_is_known():
    wandering = dataclasses.replace(LABORATORY, nuisance=Nuisance(wander=3e-4, wander_time=0.1))
    row, series = virtual_sweep(wandering, plan(wandering)[0][0])
    found, model, true = (series[f"mode_displacement{end}"].values[0] for end in ("", "_model", "_true"))
    assert 1e-4 < row["phase_jitter"] < 9e-4
    assert np.corrcoef(found, true)[0, 1] > 0.999  # the tracker is not to blame
    assert np.corrcoef(found, model)[0, 1] < 0.9
    assert row["fit_r2"][0] < row["fit_r2_white"][0]
    assert model.std() == pytest.approx(true.std(), rel=0.5)  # made with what the white forcing tells


def test_series_hold_what_was_found_predicted_and_true(table, folder):
    series = read_series(folder, 0)
    found, model, true = (series[f"mode_displacement{end}"].values[0] for end in ("", "_model", "_true"))
    assert found.size == LABORATORY.n_frames
    assert np.corrcoef(found, true)[0, 1] > 0.999
    assert np.corrcoef(found, model)[0, 1] > 0.99
    assert found.std() == pytest.approx(float(table.mode_rms[0, 0]))
    assert model.std() == pytest.approx(float(table.mode_rms_model[0, 0]))


def test_shares_of_the_modes_are_told_with_the_trackers_noise_and_without(table, filmed):
    found, true = (table[f"variance_explained{end}"].values[0] for end in ("", "_true"))
    np.testing.assert_allclose(found, true, atol=0.01)
    assert found.sum() < true.sum() < 1  # noise is in no mode
    assert filmed.image.shape == (filmed.film.camera.height, filmed.film.camera.width)


def test_the_table_is_saved_with_what_made_it(table, folder):
    assert load(folder / "sweeps.nc").identical(table)
    assert '"seed": 3' in table.attrs["laboratory"]
    assert table.attrs["impossible_fold"] >= 0


def test_equal_seeds_give_equal_bytes(table, folder, tmp_path):
    run_laboratory(LABORATORY, tmp_path, engine=ONE)
    for name in ("sweeps.nc", f"sweeps/{table.address.values[0]}.nc"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


# What is there already


def job(number, work, mark="m"):
    return StoredWork(WHAT, work, made_of(number=number, mark=mark))


def given(contact):
    return partial(copy.copy, ({"contact": contact}, xr.Dataset()))


def refuse(error):
    raise error


def test_sweeps_made_of_the_same_are_kept_and_others_done_anew(tmp_path):
    run_jobs([job(0, given(0.1)), job(1, given(0.2))], tmp_path, {}, ONE, None)
    again = run_jobs([job(0, given(0.9)), job(1, given(0.9), mark="n")], tmp_path, {}, ONE, None)
    assert again.contact.values.tolist() == [0.1, 0.9]


def test_a_sweep_that_cannot_be_analysed_is_reported_and_the_others_go_on(tmp_path):
    bad = [partial(refuse, InputError("the whisker", "must be seen")), partial(refuse, ConvergenceError("x", 1.0, 3))]
    found = run_jobs([job(0, bad[0]), job(1, given(0.2)), job(2, bad[1])], tmp_path, {}, ONE, None)
    assert found.accepted.values.tolist() == [False, True, False]
    assert found.rejected.values[0] == "the whisker must be seen"
    assert "did not converge" in found.rejected.values[2]
    np.testing.assert_array_equal(found.contact, [np.nan, 0.2, np.nan])


def test_a_fault_of_the_program_is_no_rejected_sweep(tmp_path):
    with pytest.raises(ZeroDivisionError):
        run_jobs([job(0, partial(refuse, ZeroDivisionError()))], tmp_path, {}, ONE, None)
    assert not (tmp_path / "sweeps.nc").exists()


def test_processes_give_what_one_process_gives(tmp_path):
    jobs = [job(number, given(number / 10)) for number in range(3)]
    told = []
    one = run_jobs(jobs, tmp_path / "one", {}, ONE, None)
    two = run_jobs(jobs, tmp_path / "two", {}, Engine(workers=2), lambda *progress: told.append(progress))
    assert one.identical(two)
    assert told[-1] == ("sweeps", 3, 3)
    files = [sorted((tmp_path / name / "sweeps").iterdir()) for name in ("one", "two")]
    assert [path.name for path in files[0]] == sorted(f"{one}.nc" for one in one.address.values)
    for a, b in zip(*files, strict=True):
        assert a.read_bytes() == b.read_bytes()


# A user's table


@pytest.fixture
def recorded(filmed, tmp_path):
    """Write the virtual sweep as if a user had recorded it; give a line of the table."""
    profile, known = filmed.profile, filmed.known
    save(profile, tmp_path / "track.nc")
    write_gaps(known.texture, tmp_path / "texture.csv")
    pixels = " ".join(f"{value / profile.attrs['pixel_size']!r}" for point in known.substrate for value in point)
    geometry = f"{known.whisker.length!r},{known.whisker.cone_angle!r},{known.exposure!r},{pixels}"
    return f"rat 1,C1,texture.csv,{1e3 * known.scan_speed!r},{1e3 * known.base_height!r},{geometry}"


def test_a_users_sweeps_are_analysed_like_the_laboratorys(recorded, filmed, tmp_path):
    unknown = recorded.replace("texture.csv", "unknown")
    lines = [f"track.nc,{recorded}", f"absent.nc,{recorded}", f"track.nc,{unknown}"]
    (tmp_path / "sweeps.csv").write_text(HEADER + "\n".join(lines))
    found = run_recorded(tmp_path / "sweeps.csv", tmp_path / "out", engine=ONE)
    assert found.accepted.values.tolist() == [True, False, True]
    assert "absent.nc must be an existing file" in found.rejected.values[1]
    assert found.texture.values.tolist() == [0, 0, -1]
    row, series = analyse_sweep(filmed.profile, dataclasses.replace(filmed.known, instants=5))
    for name in ("contact", "base_angle", "resonant_frequency", "damping_white", "mode_rms_model"):
        np.testing.assert_allclose(found[name][0], row[name], rtol=1e-6)
    np.testing.assert_allclose(read_series(tmp_path / "out", 0).envelope_model, series.envelope_model, rtol=1e-6)
    assert np.isnan(found.resonant_frequency[2]).all()  # no texture, no forcing …
    white = found.resonant_frequency_white[2]  # … but Eq. 5, about a posture on which the texture is not taken off
    np.testing.assert_allclose(white, row["resonant_frequency_white"], rtol=0.01)
    assert float(found.base_height[0]) == pytest.approx(filmed.known.base_height)


def test_sweeps_of_a_table_that_was_edited_have_the_textures_of_its_lines(tmp_path):
    """A texture's number follows the order of the lines, which no file of a sweep depends on."""
    for name, seed in (("plate.csv", 1), ("grid.csv", 2)):
        write_gaps(random_grating(0.05, rng=np.random.default_rng(seed)), tmp_path / name)
    head = "track,animal,whisker,texture,scan_speed,run\n"
    lines = {name: f"absent.nc,r,C2,{name},0.1,{run}\n" for run, name in enumerate(("plate.csv", "grid.csv"))}
    for names in (("plate.csv", "grid.csv"), ("grid.csv", "plate.csv"), ("grid.csv",)):
        (tmp_path / "sweeps.csv").write_text(head + "".join(lines[name] for name in names))
        found = run_recorded(tmp_path / "sweeps.csv", tmp_path / "out", engine=ONE)
        assert [json.loads(found.attrs["textures"])[number] for number in found.texture.values] == list(names)
        assert found.run.values.tolist() == [("plate.csv", "grid.csv").index(name) for name in names]
    assert len(list((tmp_path / "out" / "sweeps").iterdir())) == 2  # no sweep was done again


def test_the_frames_beside_a_header_and_the_measurements_beside_curves_are_part_of_a_sweep(tmp_path):
    """Each change of any of them, and their first coming, makes another sweep; other files beside them do not."""
    (tmp_path / "sweeps.csv").write_text(
        "track,movie,animal,whisker,texture,scan_speed,pixel_size,seed\n"
        ",a.cih,r,C2,unknown,0.1,1e-4,10 10\n,B.mraw,r,C2,unknown,0.1,1e-4,10 10\n"
        "c.whiskers,,r,C2,unknown,0.1,,\nd.nc,,r,C2,unknown,0.1,,\n"
    )
    for name, content in (("a.cih", b"header"), ("B.mraw", b"frames"), ("c.whiskers", WHISKERS), ("d.nc", b"CDF")):
        (tmp_path / name).write_bytes(content)
    before = [job.address for job in recorded_jobs(tmp_path / "sweeps.csv")[0]]
    changes = (("a.mraw", 0), ("B.cihx", 1), ("c.measurements", 2), ("d.measurements", None), ("a.measurements", None))
    for content in (b"one", b"two"):
        for name, line in changes:
            (tmp_path / name).write_bytes(content)
            after = [job.address for job in recorded_jobs(tmp_path / "sweeps.csv")[0]]
            assert [k for k in range(4) if after[k] != before[k]] == ([] if line is None else [line]), name
            before = after


LINE = "m.avi,r,C2,unknown,100"


@pytest.mark.parametrize(
    ("header", "line", "rule"),
    [
        (
            "movie,animal,whisker,texture,speed",
            LINE,
            ("unknown", "sweeps.csv, line 1"),
        ),
        (
            "movie,animal,whisker,texture,scan_speed,scan_speed_mm_s",
            LINE + ",1",
            ("missing", "sweeps.csv, line 1"),
        ),
        ("movie,animal,whisker,scan_speed", "m.avi,r,C2,1", ("missing", "sweeps.csv, line 1")),
        ("movie,animal,whisker,texture,scan_speed_mm_s", "m.avi,r,C2,unknown", ("shape", "sweeps.csv, line 2")),
        ("movie,animal,whisker,texture,scan_speed_mm_s", LINE, ("missing", "sweeps.csv, line 2")),
        ("track,animal,whisker,texture,scan_speed", LINE, ("range", "sweeps.csv, line 2, scan_speed")),
        (
            "track,animal,whisker,texture,scan_speed",
            "t.nc,r,C2,unknown,fast",
            ("format", "sweeps.csv, line 2, scan_speed"),
        ),
        ("track,animal,whisker,texture,scan_speed", "t.nc,r,Z9,unknown,0.1", ("unknown", "sweeps.csv, line 2")),
        (
            "track,animal,whisker,texture,scan_speed,length",
            "t.nc,r,C2,unknown,0.1,0.04",
            ("conflict", "sweeps.csv, line 2"),
        ),
        (
            "track,animal,whisker,texture,scan_speed,skin",
            "t.nc,r,C2,unknown,0.1,3",
            ("shape", "sweeps.csv, line 2, skin"),
        ),
        (
            "track,animal,whisker,texture,scan_speed,contact",
            "t.nc,r,C2,unknown,0.1,0.3",
            ("conflict", "sweeps.csv, line 2"),
        ),
        (
            "track,movie,animal,whisker,texture,scan_speed",
            "t.nc,m.avi,r,C2,unknown,0.1",
            ("conflict", "sweeps.csv, line 2"),
        ),
        ("track,animal,whisker,texture,scan_speed", "t.nc,,C2,unknown,0.1", ("missing", "sweeps.csv, line 2, animal")),
    ],
)
def test_tables_that_are_not_clear_are_refused(tmp_path, header, line, rule):
    (tmp_path / "sweeps.csv").write_text(f"{header}\n{line}\n")
    with refusal(*rule):
        read_sweeps(tmp_path / "sweeps.csv")


def test_units_of_the_header_are_those_of_the_numbers(tmp_path):
    (tmp_path / "sweeps.csv").write_text(
        "movie,animal,whisker,texture,scan_speed_mm_s,base_height_mm,pixel_size_um,seed,skin,run\n"
        "m.avi,r,C2,unknown,150,20,95,120 44,3 40,2\n"
    )
    (one,) = read_sweeps(tmp_path / "sweeps.csv")
    assert (one.scan_speed, one.base_height, one.pixel_size) == pytest.approx((0.15, 0.02, 95e-6))
    assert (one.seed, one.skin, one.run, one.texture) == ((120, 44), (3, 40), 2, None)
    assert one.folder == tmp_path


def test_a_texture_may_come_before_the_movie_and_friction_may_pull(tmp_path):
    head = "track,animal,whisker,texture,scan_speed,start_ms,friction,exposure"
    (tmp_path / "sweeps.csv").write_text(f"{head}\nt.nc,r,C2,unknown,0.1,-50,-0.2,0\n")
    (one,) = read_sweeps(tmp_path / "sweeps.csv")
    assert (one.start, one.friction) == (-0.05, -0.2)


@pytest.mark.parametrize(
    ("column", "cell", "said"),
    [
        ("exposure_ms", "-1", "exposure_ms must be zero or positive, got '-1'"),
        ("length_mm", "4000", "must be at most 1000, got '4000'; .*: length, length_m, length_mm, length_um"),
        ("pixel_size", "100", "must be at most 0.001, got '100'; .*pixel_size_um"),
    ],
)
def test_a_number_out_of_its_range_is_refused_with_the_remedy(tmp_path, column, cell, said):
    text = f"track,animal,whisker,texture,scan_speed,{column}\nt.nc,r,C2,unknown,0.1,{cell}\n"
    (tmp_path / "sweeps.csv").write_text(text)
    with pytest.raises(RangeError, match=said):
        read_sweeps(tmp_path / "sweeps.csv")


def test_what_a_line_needs_is_not_to_be_left_out(tmp_path):
    (tmp_path / "sweeps.csv").write_text("track,animal,whisker,texture,scan_speed\nt.nc,r,C2,unknown,-0.1\n")
    with pytest.raises(RangeError, match=r"scan_speed must be zero or positive, got '-0.1'; give its size"):
        read_sweeps(tmp_path / "sweeps.csv")


def test_a_recorded_sweep_that_would_not_fit_into_memory_is_rejected(recorded, filmed, tmp_path, monkeypatch):
    frames, nodes = (filmed.profile.sizes[name] for name in ("time", "node"))
    monkeypatch.setenv("VIBRISSA_MEMORY", str(2 * 80 * frames * nodes / 1e9))  # of which a half may be taken
    (tmp_path / "sweeps.csv").write_text(HEADER + f"track.nc,{recorded}\n")
    found = run_recorded(tmp_path / "sweeps.csv", tmp_path / "out", engine=ONE)
    assert f"{frames} frames of {nodes} nodes" in found.rejected.values[0]
    assert "cut it into several" in found.rejected.values[0]
