"""Arrays of MATLAB's files, whole and damaged: what crashes the library that reads them ends in one line."""

import h5py
import numpy as np
import pytest
from refusals import refusal
from scipy.io import savemat

from vibrissa.errors import InputError
from vibrissa.neural.io.formats import binned, matlab_tables
from vibrissa.reader_process import tables_read_by

COUNTS = np.random.default_rng(0).poisson(1.0, (40, 6, 3)).astype(float)
RULE = "must be a whole file of MATLAB"


def read(path):
    return tables_read_by(matlab_tables.__name__, path, RULE)["counts"]


def test_both_versions_give_one_array(tmp_path):
    savemat(tmp_path / "five.mat", {"counts": COUNTS}, do_compression=True)
    with h5py.File(tmp_path / "seven.mat", "w") as file:
        file["counts"] = COUNTS.T  # as MATLAB's version 7.3 stores it
    for name in ("five.mat", "seven.mat"):
        np.testing.assert_array_equal(read(tmp_path / name), COUNTS)
        np.testing.assert_array_equal(binned._counts(tmp_path / name), COUNTS)


def test_many_zeros_in_a_small_file_are_refused(tmp_path, monkeypatch):
    savemat(tmp_path / "five.mat", {"counts": np.zeros((1000, 3000))}, do_compression=True)
    with h5py.File(tmp_path / "seven.mat", "w") as file:
        file.create_dataset("counts", (10**6, 10**6), dtype="f8", chunks=(100, 100), compression="gzip")
    monkeypatch.setenv("VIBRISSA_MEMORY", "0.1")
    for name in ("five.mat", "seven.mat"):
        assert (tmp_path / name).stat().st_size < 50_000
        with refusal("format", name) as caught:
            read(tmp_path / name)
        assert "GB" in str(caught.value)


@pytest.mark.parametrize("seed", range(6))
def test_a_damaged_file_is_read_or_refused_in_one_line(tmp_path, seed):
    path, rng = tmp_path / "five.mat", np.random.default_rng(seed)
    savemat(path, {"counts": COUNTS[:3, :2, :1], "b": {"c": "text"}})
    damaged = bytearray(path.read_bytes())
    for place in rng.integers(128, len(damaged), 6):
        damaged[place] ^= 1 << int(rng.integers(8))
    path.write_bytes(damaged)
    try:
        read(path)
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017
    except KeyError as error:  # the name itself was damaged
        assert "counts" in str(error)  # noqa: PT017
