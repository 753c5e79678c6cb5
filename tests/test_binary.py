"""Arrays in binary files: damaged, of objects, or larger than memory though the file is small."""

import io
import struct
import zipfile

import numpy as np
import pytest
from refusals import refusal
from scipy.io import wavfile

from vibrissa.binary import read_npy, read_wav, refuse_bomb


def test_an_array_is_read_as_it_was_written(tmp_path):
    values = np.random.default_rng(0).normal(size=(5, 3))
    np.save(tmp_path / "a.npy", values)
    np.testing.assert_array_equal(read_npy(tmp_path / "a.npy"), values)


def claiming(shape):
    """A file of NumPy whose header claims more than its 80 bytes of numbers."""
    file = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue() + bytes(80)


@pytest.mark.parametrize("shape", [(11,), (10**12, 2), (10**30,), (-1,)])
def test_a_header_that_claims_more_than_the_file_has_is_refused(tmp_path, shape):
    (tmp_path / "a.npy").write_bytes(claiming(shape))
    with refusal("format", f"{tmp_path}/a.npy"):
        read_npy(tmp_path / "a.npy")


def test_an_array_that_ends_before_its_file_is_refused(tmp_path):
    """A file written twice, a damaged shape, or several arrays of which one would be read alone."""
    path, array = tmp_path / "a.npy", io.BytesIO()
    np.save(array, np.arange(6.0))
    for rest in (b"\0", array.getvalue()):
        path.write_bytes(array.getvalue() + rest)
        with refusal("format", "a.npy", value=f"{len(rest)} bytes more"):
            read_npy(path)
    path.write_bytes(claiming((9,)))
    with refusal("format", "a.npy", value="8 bytes more"):
        read_npy(path)


def test_objects_archives_and_absent_files_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}]), allow_pickle=True)
    np.savez(tmp_path / "b.npz", a=1)
    for name, code in (("a.npy", "format"), ("b.npz", "format"), ("c.npy", "missing")):
        with refusal(code, name):
            read_npy(tmp_path / name)


def test_an_archive_of_zeros_is_refused_by_what_it_unpacks_to(tmp_path, monkeypatch):
    with zipfile.ZipFile(tmp_path / "surface.x3p", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bindata/data.bin", bytes(30_000_000))
    assert (tmp_path / "surface.x3p").stat().st_size < 40_000
    refuse_bomb(tmp_path / "surface.x3p")
    monkeypatch.setenv("VIBRISSA_MEMORY", "0.2")
    with refusal("range", "surface.x3p", "0.03 GB unpacked, which need 0.12 GB"):
        refuse_bomb(tmp_path / "surface.x3p")


def sound(path, stated=None, extra=b""):
    """400 samples of two channels, with a chunk before them, and as many bytes stated as one likes."""
    values = np.random.default_rng(0).integers(-1000, 1000, (400, 2)).astype(np.int16)
    wavfile.write(path, 2000, values)
    whole = path.read_bytes()
    size = 1600 if stated is None else stated
    path.write_bytes(whole[:36] + extra + b"data" + struct.pack("<I", size) + whole[44:])
    return values


@pytest.mark.parametrize("stated", [None, 0xFFFFFFFF, 0xFFFFFFFF - 36, 0x80000000, 0x7FFFFFFF, 0x7FFFF000, 1601])
def test_a_sound_is_read_whole_also_where_its_recorder_could_not_state_a_length(tmp_path, stated):
    values = sound(tmp_path / "a.wav", stated)
    np.testing.assert_array_equal(read_wav(tmp_path / "a.wav")[1], values)


@pytest.mark.parametrize("extra", [b"", b"note" + struct.pack("<I", 3) + b"abc\0"])
@pytest.mark.parametrize(("cut", "found"), [(4, 399), (5, 398), (800, 200), (1600, 0)])
def test_a_sound_that_is_cut_off_is_refused_with_what_is_missing(tmp_path, extra, cut, found):
    sound(tmp_path / "a.wav", extra=extra)
    whole = (tmp_path / "a.wav").read_bytes()
    (tmp_path / "a.wav").write_bytes(whole[:-cut])
    with refusal("format", "a.wav", value=str(found)) as caught:
        read_wav(tmp_path / "a.wav")
    assert caught.value.rule == "must hold the 400 samples that its header states"
    assert caught.value.remedy.startswith(f"{400 - found} samples are missing")
