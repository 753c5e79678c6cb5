"""Maps over the seeds of random gratings: each seed's map is that of its own grating, whoever draws it."""

import json

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa.netcdf import load
from vibrissa.sweep.engine import Engine
from vibrissa.sweep.gratings import Gratings
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.maps import sweep
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
GRID = Grid(contact=[0.12, 0.2, 0.3], base_angle=[0.8, 1.2, 1.42], speed=[0.1, 0.2], friction=[0.3, 0.4])
RMS = Measure(quantity="rms", response="exact")
CONE = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3")
WHERE = ("--contact", "0.2,0.3", "--base-angle", "0.8,1.2", "--speed", "0.1", "--quantity", "rms")


def grating(seed, length=0.01, **how):
    return random_grating(length, rng=np.random.default_rng(seed), **how)


def test_the_map_of_a_seed_is_that_of_its_grating():
    together = sweep(WHISKER, Gratings(seed=[2, 3, 7], length=0.01), GRID, RMS)
    assert together.mode_rms.dims == ("seed", "friction", "speed", "contact", "base_angle")
    assert together.cell_reason.dims == together.jump_linearity.dims == ("seed", "friction", "contact", "base_angle")
    assert set(np.unique(together.cell_reason)) > {0}  # cells without a value take part in this
    for seed in (2, 3, 7):
        alone = sweep(WHISKER, grating(seed), GRID, RMS)
        for name in ("mode_rms", "cell_reason", "jump_linearity"):
            np.testing.assert_array_equal(together[name].sel(seed=seed), alone[name])


def test_seeds_make_different_maps_and_more_seeds_leave_those_of_others():
    few, many = (sweep(WHISKER, Gratings(seed=seed, length=0.01), GRID, RMS) for seed in ([3], [1, 3]))
    np.testing.assert_array_equal(few.mode_rms.sel(seed=3), many.mode_rms.sel(seed=3))
    one, three = many.mode_rms.stack(cell=["friction", "speed", "contact", "base_angle"])
    assert (one.dropna("cell") != three.dropna("cell")).all()


def test_schedulers_agree_to_the_last_bit():
    gratings = Gratings(seed=[0, 1], length=0.02, reading="widths", mean_period=1e-3)
    engines = [Engine(scheduler=name, workers=2) for name in ("synchronous", "threads", "processes")]
    one, *others = (sweep(WHISKER, gratings, GRID, RMS, engine=engine) for engine in engines)
    assert all(one.identical(other) for other in others)
    assert one.attrs["widest_gap"] == max(
        grating(seed, 0.02, reading="widths", mean_period=1e-3).width.max() for seed in (0, 1)
    )


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"seed": [1, 1]}, ("format", "seeds")),
        ({"seed": [0.5]}, ("format", "seeds")),
        ({"seed": [-1, 2]}, ("format", "seeds")),
        ({"seed": []}, ("format", "seeds")),
        ({"seed": [np.inf]}, ("format", "seeds")),
        ({"length": 1e-5}, ("range", "length of the grating")),
        ({"reading": "square"}, ("unknown", "reading")),
        ({"mean_period": 1e-6}, ("range", "grating")),
    ],
)
def test_bad_gratings_are_refused(how, words):
    with refusal(*words):
        Gratings(**({"seed": [0, 1], "length": 0.01} | how))


def test_gratings_too_narrow_for_the_whisker_are_refused():
    with refusal("range", "texture"):
        sweep(Whisker(length=1e-5, cone_angle=1.5e-3), Gratings(seed=[1], length=0.01), GRID, RMS)


def test_the_verb_writes_a_map_for_each_seed(vibrissa, tmp_path):
    words = ("--seeds", "0:4:3", "--grating-length", "0.01", "--mean-period", "8e-4", "--out", tmp_path / "map.nc")
    code, out, err = vibrissa("map", *words, *WHERE, *CONE, "--json", "--scheduler", "synchronous")
    assert (code, err.count("\n")) == (0, 1)
    assert err.startswith("vibrissa: outside the model: free end is longer than every gap")
    written = load(tmp_path / "map.nc")
    assert json.loads(out)["seed"] == written.seed.values.tolist() == [0, 2, 4]
    known = sweep(
        WHISKER,
        grating(4, mean_period=8e-4),
        Grid(contact=[0.2, 0.3], base_angle=[0.8, 1.2], speed=[0.1]),
        Measure(quantity="rms"),
    )
    np.testing.assert_array_equal(written.mode_rms.sel(seed=4), known.mode_rms)
    assert (written.attrs["grating_length"], written.attrs["mean_period"]) == (0.01, 8e-4)


def test_a_large_map_is_a_whole_folder_of_zarr(vibrissa, tmp_path):
    words = ("map", "--seeds", "1,2", "--grating-length", "0.01", *WHERE, *CONE, "--scheduler", "synchronous")
    for name in ("map.nc", "map.zarr", "map.zarr"):  # the second replaces the first
        code, _, err = vibrissa(*words, "--out", tmp_path / name)
        assert (code, err.count("\n")) == (0, 1), err  # the verdict alone
    with xr.open_zarr(tmp_path / "map.zarr", decode_times=False) as written:
        assert written.load().identical(load(tmp_path / "map.nc"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["map.nc", "map.zarr"]

    chunk = next((tmp_path / "map.zarr/mode_rms").glob("[0-9]*"))
    damaged = bytearray(chunk.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    whole = chunk.read_bytes()
    chunk.write_bytes(damaged)
    with xr.open_zarr(tmp_path / "map.zarr", decode_times=False) as read, pytest.raises(Exception, match=r"\w"):
        read.load()
    chunk.write_bytes(whole)
    (tmp_path / "mine.zarr").mkdir()
    (tmp_path / "mine.zarr/notes.txt").touch()
    for out, said in ((tmp_path / "mine.zarr", "--out must be free"), (tmp_path / "no/map.zarr", "existing folder")):
        code, _, err = vibrissa(*words, "--out", out)
        assert (code, err.count("\n")) == (2, 1)
        assert said in err
    assert (tmp_path / "mine.zarr/notes.txt").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "texture must be given once; either --texture, or --seeds"),
        (("--seeds", "1"), "--grating-length must be given with --seeds"),
        (("--seeds", "1", "--grating-length", "0.01", "--texture", "gap.csv"), "--texture must be given once"),
        (("--reading", "widths", "--texture", "gap.csv"), "--texture must be given once"),
        (("--seeds", "0:3:3", "--grating-length", "0.01"), "--seeds must be a strictly ascending row of whole numbers"),
        (("--seeds", "one", "--grating-length", "0.01"), "--seeds must be FIRST:LAST:HOW-MANY"),
        (("--seeds", "1", "--grating-length", "0.01", "--scheduler", "cluster"), "--scheduler must be one of"),
        (("--seeds", "1", "--grating-length", "0.01", "--workers", "0"), "--workers must lie between 1"),
    ],
)
def test_bad_words_are_one_line(vibrissa, words, said):
    code, out, err = vibrissa("map", *words, *WHERE, *CONE)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err
