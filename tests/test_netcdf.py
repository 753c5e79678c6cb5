"""Datasets that were damaged, that others wrote, or that break the table of quantities."""

import datetime
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from vibrissa import reader_process
from vibrissa.errors import InputError
from vibrissa.netcdf import attributes, encoded, load, save
from vibrissa.quantities import dataset, require


def tracks(**other):
    t, s = np.arange(6) / 500, np.linspace(0, 0.02, 4)
    x, y = np.broadcast_to(s, (6, 4)), np.random.default_rng(1).normal(size=(6, 4))
    return dataset({"frame": "image"}, **({"time": t, "node": np.arange(4), "x": x, "y": y, "arc_length": s} | other))


@contextmanager
def refused(code, *words):
    with pytest.raises(InputError) as caught:
        yield
    line = str(caught.value)
    assert caught.value.code == code, line
    assert "\n" not in line
    assert all(word in line for word in words), line


@pytest.fixture
def file(tmp_path):
    return tmp_path / "profile.nc"


def test_attributes_of_one_character_may_be_stored_as_bytes(file):
    """As the library of netCDF writes them, by which xarray writes if it is installed."""
    tracks().assign_attrs(side="L").to_netcdf(file, engine="h5netcdf")
    with h5py.File(file, "r+") as stored:
        stored["time"].attrs["units"], stored.attrs["side"] = np.bytes_("s"), np.bytes_("L")
        stored.attrs["degree"] = np.bytes_(b"\xb0")  # of a program that writes Latin-1
    assert load(file).identical(tracks().assign_attrs(side="L", degree="°"))
    assert attributes(file)["side"] == "L"


def test_no_flipped_bit_is_taken_for_a_result(file):
    save(tracks(), file)
    whole, rng = file.read_bytes(), np.random.default_rng(0)
    for place in rng.choice(len(whole), 300, replace=False):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        file.write_bytes(damaged)
        try:
            again = load(file)
        except InputError as error:
            assert error.code == "format"  # noqa: PT017
            assert "\n" not in str(error)  # noqa: PT017
        else:  # of the line itself that tells a checksum from a remark of another program
            assert place > len(whole) - 120
            assert again.identical(tracks())


def test_the_attributes_alone_are_verified_too(file):
    save(tracks(), file)
    whole = bytearray(file.read_bytes())
    whole[len(whole) // 2] ^= 1
    file.write_bytes(whole)
    with refused("format", "checksum"):
        attributes(file)


def test_what_others_write_anew_has_no_checksum_to_break(file):
    save(tracks(), file)
    changed = xr.load_dataset(file, engine="h5netcdf").isel(time=slice(3))
    changed.to_netcdf(file, engine="h5netcdf")
    assert load(file).sizes["time"] == 3
    save(tracks(), file)
    with h5py.File(file, "a") as opened:  # in place
        opened["y"][0, 0] = 7
        opened.create_dataset("added", data=np.zeros(1000))
    with h5py.File(file) as opened:
        assert opened["y"][0, 0] == 7


def test_a_file_with_a_checksum_is_hdf5_and_netcdf(file):
    file.write_bytes(encoded(tracks()))
    with h5py.File(file) as opened:
        np.testing.assert_array_equal(opened["y"], tracks().y)
    assert xr.load_dataset(file, engine="h5netcdf").identical(tracks())


def test_dimensions_in_another_order_are_turned(file):
    save(tracks().transpose("node", "time"), file)
    assert load(file).identical(tracks())
    several = tracks().expand_dims(whisker=2).transpose("time", "whisker", "node")
    save(several, file)
    assert load(file).y.dims == ("whisker", "time", "node")


def _written(file, values, name="y", dims=("time", "node")):
    tracks().drop_vars(name).assign({name: (dims, values)}).to_netcdf(file, engine="h5netcdf")


def test_text_where_numbers_belong_is_refused(file):
    _written(file, np.full((6, 4), "0.1"))
    with refused("format", "variable 'y' must hold numbers", "0.1"):
        load(file)


def test_objects_are_refused(file):
    save(tracks(), file)
    with h5py.File(file, "a") as opened:
        del opened["y"]
        kind = h5py.vlen_dtype(np.float64)
        ragged = opened.create_dataset("y", (6, 4), dtype=kind)
        ragged[0, 0] = [1.0, 2.0]
        for axis, name in enumerate(("time", "node")):
            ragged.dims[axis].attach_scale(opened[name])
    with pytest.raises(InputError, match=r"profile\.nc") as error:
        load(file)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("time", "word"),
    [
        ([0, 0.1, 0.2, 0.2, 0.3, 0.4], "0.2 after 0.2 at sample 3"),
        ([0.5, 0.4, 0.3, 0.2, 0.1, 0], "0.4 after 0.5 at sample 1"),
        ([0, 0.1, np.nan, 0.3, 0.4, 0.5], "nan at sample 2"),
        ([0, 0.1, 0.2, 0.3, 0.4, np.inf], "inf at sample 5"),
    ],
)
def test_time_that_does_not_ascend_is_refused(file, time, word):
    save(tracks(time=np.array(time)), file)
    with refused("range", "variable 'time'", word):
        load(file)
    with refused("range", "variable 'time'", word):
        require(tracks(time=np.array(time)), "time")


def test_time_that_is_absent_is_refused(file):
    tracks().drop_vars("time").to_netcdf(file, engine="h5netcdf")
    with refused("missing", "variable 'time'"):
        load(file)


@pytest.mark.parametrize("name", ["x", "arc_length"])
def test_infinite_places_are_refused(file, name):
    values = tracks()[name].values.copy()
    values[..., 2] = np.inf
    save(tracks(**{name: values}), file)
    with refused("range", f"variable {name!r}", "inf at ["):
        load(file)


def test_damage_on_which_hdf5_runs_for_ever_is_refused(monkeypatch):
    monkeypatch.setattr(reader_process, "PATIENCE", 3.0)
    with refused("format", "attribute.nc", "does not end within 3 s"):
        load(Path(__file__).parent / "corpus" / "endless" / "attribute.nc")


def test_a_bomb_is_refused_before_it_is_read(file):
    save(tracks(), file)
    with h5py.File(file, "a") as opened:  # a few kB: chunks that were never written
        opened.create_dataset("bomb", (10**6, 10**6), dtype="f8", chunks=(1000, 1000), compression="gzip", fillvalue=1)
    assert file.stat().st_size < 1e5
    with refused("range", "profile.nc", "8e+03 GB"):
        load(file)


def test_modules_in_the_folder_of_the_data_are_not_run(tmp_path, monkeypatch):
    """The process that reads a doubtful file does not look for its libraries beside that file."""
    save(tracks(), tmp_path / "profile.nc")
    (tmp_path / "h5py.py").write_text("raise SystemExit('code of the data folder ran')")
    (tmp_path / "table.mat").write_bytes(b"MATLAB 5.0 MAT-file")
    monkeypatch.chdir(tmp_path)
    load(tmp_path / "profile.nc")
    with pytest.raises(InputError) as found:
        reader_process.tables_read_by("vibrissa.neural.io.formats.matlab_tables", tmp_path / "table.mat", "must be one")
    assert "ran" not in str(found.value)


@pytest.mark.parametrize("value", [True, np.bool_(False), np.array([True, False])])
@pytest.mark.parametrize("place", ["dataset", "time"])
def test_an_attribute_that_is_true_or_false_is_refused_by_its_name(tmp_path, place, value):
    data = dataset(time=np.arange(3.0))
    (data if place == "dataset" else data.time).attrs["checked"] = value
    with pytest.raises(InputError, match=f"attribute 'checked' of {place} must be text or numbers"):
        save(data, tmp_path / "x.nc")
    assert not (tmp_path / "x.nc").exists()


TIMES = {
    "dates": (np.array(["2026-11-29", "NaT"], "datetime64[ns]"), "astype(str)"),
    "one date": (np.datetime64("2026-11-29", "ns"), "astype(str)"),
    "dates of no trial": (np.array([], "datetime64[ns]"), "astype(str)"),
    "durations": (np.array([1500, "NaT"], "timedelta64[ms]"), "data['lag'] / np.timedelta64(1, 's')"),
    "dates as objects": (np.array([datetime.date(2026, 11, 29)], object), "astype(str)"),
}


@pytest.mark.parametrize("kind", TIMES)
def test_dates_and_durations_are_refused_with_a_way_that_works(file, kind):
    values, remedy = TIMES[kind]
    dims = ("trial",) if np.ndim(values) else ()
    data = xr.Dataset({"lag": (dims, values)})
    with refused("format", "variable 'lag' must hold numbers or text", remedy):
        save(data, file)
    assert not file.exists()
    text = data.assign(lag=data["lag"].astype(str))
    save(text, file)
    assert load(file)["lag"].values.tolist() == text["lag"].values.tolist()
    if data["lag"].dtype.kind in "mM":
        since = data["lag"] if kind == "durations" else data["lag"] - np.datetime64("2000-01-01")
        save(data.assign(lag=since / np.timedelta64(1, "s")), file)
        nanoseconds = np.where(np.isnat(since), np.nan, since.values.astype("timedelta64[ns]").astype(np.int64))
        np.testing.assert_allclose(load(file)["lag"], nanoseconds / 1e9)
    with refused("format", "attribute 'lag' of dataset must be text or numbers"):
        save(xr.Dataset(attrs={"lag": values}), file)


def test_dates_as_a_coordinate_are_refused_too(file):
    with refused("format", "variable 'time'", "datetime64"):
        save(xr.Dataset({"x": ("time", [1.0])}, {"time": np.array(["2026-11-29"], "datetime64[ns]")}), file)
