"""Files of unusual kinds, each made by a function; see unusual.py."""

# ruff: noqa: E501 (a case is one line)
from __future__ import annotations

import io
import json
import os
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat, wavfile
from scipy.sparse import eye

HUGE = 1 << 62
Maker = Callable[[Path], object]


def text(content: str | bytes) -> Maker:
    """A file of this content."""
    return lambda path: path.write_bytes(content if isinstance(content, bytes) else content.encode())


def sparse(path: Path, size: int = 100 << 30) -> None:
    """A file of 100 GB that takes no place."""
    with open(path, "wb") as file:
        file.truncate(size)


def array(values: np.ndarray, pickled: bool = False) -> Maker:
    """A file of NumPy."""
    return lambda path: np.save(path, values, allow_pickle=pickled)


def npy_head(said: str, version: int = 1) -> Maker:
    """A header of NumPy with a few bytes below it."""
    line = said.encode() + b"\n"
    return text(b"\x93NUMPY" + bytes([version, 0]) + struct.pack("<H", len(line)) + line + bytes(64))


def wav(
    rate: int = 2000, channels: int = 1, bits: int = 16, kind: int = 1, samples: int = 8000, said: int = -1
) -> Maker:
    """A WAV whose header may lie."""
    data = (np.arange(samples) % 100).astype("<i2").tobytes()
    size = len(data) if said < 0 else said
    head = struct.pack("<HHIIHH", kind, channels, rate, rate * 2 & 0xFFFFFFFF, 2 * channels & 0xFFFF, bits)
    chunks = b"WAVEfmt " + struct.pack("<I", 16) + head + b"data" + struct.pack("<I", size) + data
    return text(b"RIFF" + struct.pack("<I", min(size + 36, 0xFFFFFFFF)) + chunks)


def floats(values: np.ndarray) -> Maker:
    """A WAV of floating-point samples."""
    return lambda path: wavfile.write(path, 2000, values.astype(np.float32))


def hdf5(make: Callable[[h5py.File], object]) -> Maker:
    """A file of HDF5."""

    def write(path: Path) -> None:
        with h5py.File(path, "w") as file:
            make(file)

    return write


def changed(whole: str, change: Callable[[h5py.File], object]) -> Maker:
    """A copy of a file of HDF5 in which something is another."""

    def write(path: Path) -> None:
        path.write_bytes(Path(whole).read_bytes())
        with h5py.File(path, "r+") as file:
            change(file)

    return write


def replaced(name: str, values: object) -> Callable[[h5py.File], None]:
    """A variable of the same place with other values."""

    def change(file: h5py.File) -> None:
        attrs = dict(file[name].attrs)
        del file[name]
        one = file.create_dataset(name, data=values)
        for key in ("_Netcdf4Coordinates", "_Netcdf4Dimid", "units"):
            if key in attrs:
                one.attrs[key] = attrs[key]

    return change


def linked(where: str) -> Callable[[h5py.File], None]:
    """A variable that lies in another file."""

    def change(file: h5py.File) -> None:
        del file["x"]
        file["x"] = h5py.ExternalLink(where, "/x")

    return change


def unlimited(file: h5py.File) -> None:
    """A variable without data that says it has 10^12 values."""
    del file["x"]
    file.create_dataset("x", (10**6, 10**6), "f8", chunks=(100, 100), maxshape=(None, None))


def zips(depth: int = 6) -> Maker:
    """Archives in archives."""

    def write(path: Path) -> None:
        content = bytes(10_000_000)
        for k in range(depth):
            kept = io.BytesIO()
            with zipfile.ZipFile(kept, "w", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr(f"main{k}.xml", content)
            content = kept.getvalue()
        path.write_bytes(content)

    return write


def png(width: int, height: int) -> bytes:
    """The head of an image of this size."""
    import zlib

    head = struct.pack(">II", width, height) + b"\x08\0\0\0\0"
    chunk = b"IHDR" + head
    body = b"IDAT" + zlib.compress(bytes(1000))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(one) - 4) + one + struct.pack(">I", zlib.crc32(one)) for one in (chunk, body, b"IEND")
    )


def tiff(width: int, height: int) -> bytes:
    """A TIFF that says it has one strip of so many pixels."""
    tags = {
        256: width,
        257: height,
        258: 8,
        259: 1,
        262: 1,
        273: 8,
        277: 1,
        278: height,
        279: width * height & 0xFFFFFFFF,
    }
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags.items())
    return b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", len(tags)) + entries + bytes(4) + bytes(1000)


def folder_of(names: dict[str, bytes]) -> Maker:
    """A folder of files."""

    def write(path: Path) -> None:
        path.mkdir()
        for name, content in names.items():
            (path / name).write_bytes(content)

    return write


def matlab(**values: object) -> Maker:
    """A file of MATLAB."""
    return lambda path: savemat(path, values)


def command_with(sidecar: str | bytes) -> Maker:
    """A command whose sidecar is another."""

    def write(path: Path) -> None:
        path.write_bytes(Path("command.wav").read_bytes())
        Path(f"{path}.json").write_bytes(sidecar if isinstance(sidecar, bytes) else sidecar.encode())

    return write


def looped(path: Path) -> None:
    """A link to itself."""
    path.symlink_to(path.name)


def dangling(path: Path) -> None:
    """A link to nothing."""
    path.symlink_to("nowhere")


def rows(header: str, *lines: str, repeat: int = 1) -> Maker:
    """A table."""
    return text(header + "\n" + "".join(line + "\n" for line in lines) * repeat)


GAPS, SPIKES, STIMULUS, PATH = "position,width", "unit,trial,spike_time", "time,displacement", "time,base_angle,contact"
TWO = ("0.001,0.0003", "0.002,0.0003")
PAIR = "position_mm,height_um"
BAD_NAMES = (
    "résumé 鼠.csv",
    "‮csv.csv",
    "a\nb.csv",
    "-n.csv",
    "~.csv",
    "%s.csv",
    "{0}.csv",
    "a\tb.csv",
    os.fsdecode(b"\xff\xfe.csv"),
)

FILES: dict[str, list[tuple[str, str, Maker]]] = {  # by the kind: what it is, its name, how it is made
    "gaps": [
        ("byte-order mark", "a.csv", text(b"\xef\xbb\xbfposition,width\n0.001,0.0003\n")),
        ("two byte-order marks", "a.csv", text(b"\xef\xbb\xbf\xef\xbb\xbfposition,width\n0.001,0.0003\n")),
        ("ends of lines of Windows", "a.csv", text(b"position,width\r\n0.001,0.0003\r\n\r\n")),
        ("exponents", "a.csv", rows(GAPS, "1e400,1e-400", "1e-99999999999,1")),
        ("digits", "a.csv", rows(GAPS, "0." + "0" * 1_000_000 + "1,0.0003")),
        ("double columns", "a.csv", rows("position,position,width", "0.1,0.2,0.001")),
        ("header alone", "a.csv", rows(GAPS)),
        ("no names", "a.csv", rows(",,,", ",,,")),
        ("negative widths", "a.csv", rows(GAPS, "0.001,-0.0003")),
        ("zero width", "a.csv", rows(GAPS, "0.001,0")),
        ("widths below an atom", "a.csv", rows(GAPS, "0.001,1e-15")),
        ("a million gaps", "a.csv", text("position_um,width_um\n" + "".join(f"{k},0.5\n" for k in range(1_000_000)))),
        ("gaps one rounding apart", "a.csv", rows(GAPS, "0.001,0.0003", "0.0013000000000000002,0.0003")),
        ("place far away", "a.csv", rows(GAPS, "0.001,0.0003", "9.9,0.0003")),
        ("cell of 10 MB", "a.csv", rows(GAPS, "9" * 10_000_000 + ",1")),
        ("quoted cell over lines", "a.csv", rows(GAPS, '"0.001\n",0.0003')),
        ("open quote", "a.csv", text('position,width\n"' + "1,2\n" * 1_000_000)),
        ("null bytes", "a.csv", rows(GAPS, "0.0\x0001,0.0003")),
        ("separators of lines of Unicode", "a.csv", rows(GAPS, "0.001,0.0003\u20280.002,0.0003")),
        ("wide digits", "a.csv", rows(GAPS, "０.００１,0.0003")),
        ("depths that differ", "a.csv", rows("position,width,depth", "0.001,0.0003,1e-5", "0.002,0.0003,2e-5")),
        ("UTF-7", "a.csv", text("+AHA-osition,width\n0.001,0.0003\n")),
        ("100 GB, sparse", "a.csv", sparse),
        ("loop of links", "a.csv", looped),
        ("link to nothing", "a.csv", dangling),
        *[("name", name, rows(GAPS, *TWO)) for name in BAD_NAMES],
    ],
    "heights": [
        ("nothing measured", "a.csv", rows(PAIR, *(f"{k},nan" for k in range(20)))),
        ("infinite", "a.csv", rows(PAIR, *(f"{k / 10},{'inf' if k == 9 else 1}" for k in range(40)))),
        ("descending", "a.csv", rows(PAIR, *(f"{-k / 10},1" for k in range(40)))),
        ("all at one place", "a.csv", rows(PAIR, *(f"1,{k}" for k in range(40)))),
        ("two units", "a.csv", rows("position_mm,position_um,height_um", "1,1000,1")),
        ("100 GB, sparse", "a.npy", sparse),
        ("objects", "a.npy", array(np.array([[1, None]]), True)),
        ("complex", "a.npy", array(np.ones((9, 2), complex))),
        ("dates", "a.npy", array(np.ones((9, 2), "M8[s]"))),
        ("order of Fortran, big-endian", "a.npy", array(np.asfortranarray(np.c_[np.arange(900) * 1e-5, np.ones(900)].astype(">f4")))),
        ("huge shape", "a.npy", npy_head(f"{{'descr':'<f8','fortran_order':False,'shape':({HUGE},2)}}")),
        ("negative shape", "a.npy", npy_head("{'descr':'<f8','fortran_order':False,'shape':(-4,2)}")),
        ("deep header", "a.npy", npy_head("(" * 9000)),
        ("code in header", "a.npy", npy_head("__import__('os').system('touch hacked')")),
        ("unknown version", "a.npy", npy_head("{}", 9)),
        ("zip of zips", "a.x3p", zips()),
        ("archive with a lie", "a.x3p", lambda p: (zips(1)(p), p.write_bytes(p.read_bytes().replace(b"\x80\x96\x98\x00", b"\x01\0\0\0")))),
        ("HDF5 without arrays", "a.datx", hdf5(lambda f: f.create_group("a/b/c"))),
        ("HDF5 whose groups are a loop", "a.datx", hdf5(lambda f: f.__setitem__("a", h5py.SoftLink("/a")))),
        ("text of SDF with huge sizes", "a.sdf", text("aISO-1.0\nNumPoints = 999999999\nNumProfiles = 999999999\n*\n1 2 3\n*\n")),
        ("SRTM of zeros", "a.hgt", text(bytes(2 * 300 * 300))),
        ("PNG", "a.png", text(png(65535, 65535))),
    ],
    "path": [
        ("one row", "a.csv", rows(PATH, "0,1.2,0.29")),
        ("time doubled", "a.csv", rows(PATH, "0,1.2,0.29", "0,1.2,0.29")),
        ("centuries", "a.csv", rows(PATH, "0,1.2,0.29", "9e6,1.19,0.29")),
        ("beyond the shaft", "a.csv", rows(PATH, "0,1.2,0.29", "0.1,1.2,7")),
        ("jump of the angle", "a.csv", rows(PATH, "0,0.3,0.29", "1e-9,1.5,0.29", "0.1,1.5,0.29")),
    ],
    "wav": [
        ("no channel", "a.wav", wav(channels=0)),
        ("65535 channels", "a.wav", wav(channels=65535)),
        ("0 Hz", "a.wav", wav(rate=0)),
        ("4 GHz", "a.wav", wav(rate=0xFFFFFFFF)),
        ("8 bits said", "a.wav", wav(bits=8)),
        ("3 bits", "a.wav", wav(bits=3)),
        ("4 GB said", "a.wav", wav(said=0xFFFFFFF0)),
        ("no sample", "a.wav", wav(samples=0)),
        ("one sample", "a.wav", wav(samples=1)),
        ("five samples", "a.wav", wav(samples=5)),
        ("unknown coding", "a.wav", wav(kind=0x55)),
        ("not a number", "a.wav", floats(np.full(4000, np.nan))),
        ("infinite", "a.wav", floats(np.full(4000, np.inf))),
        ("constant", "a.wav", floats(np.ones(4000))),
        ("subnormal", "a.wav", floats(np.full(4000, 1e-42))),
        ("100 GB, sparse", "a.wav", sparse),
    ],
    "movie": [
        ("65,535² image in a folder", "frames", folder_of({f"f{k}.png": png(65535, 65535) for k in range(3)})),
        ("65,535² TIFF", "a.tif", text(tiff(65535, 65535))),
        ("gaps in numbers", "frames", folder_of({f"f{k:03}.png": png(60, 40) for k in (1, 3, 4)})),
        ("empty folder", "frames", folder_of({})),
        ("folder of texts", "frames", folder_of({"a.txt": b"1", "b.png": b"2"})),
        ("one pixel", "a.npy", array(np.zeros((9, 1, 1), np.uint8))),
        ("one frame", "a.npy", array(np.zeros((1, 80, 80), np.uint8))),
        ("no contrast", "a.npy", array(np.full((20, 80, 80), 7, np.uint8))),
        ("noise", "a.npy", array(np.random.default_rng(0).integers(0, 256, (5, 200, 200)).astype(np.uint8))),
        ("huge frames of nothing", "a.npy", npy_head(f"{{'descr':'|u1','fortran_order':False,'shape':(2,{1 << 30},{1 << 30})}}")),
        ("100 GB, sparse", "a.npy", sparse),
        ("100 GB, sparse", "a.mkv", sparse),
        ("head without frames", "a.mkv", lambda p: p.write_bytes(Path("movie.mkv").read_bytes()[:600])),
        ("playlist", "a.m3u8", text("#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n")),
        ("list of FFmpeg", "a.ffconcat", text("ffconcat version 1.0\nfile /dev/zero\n")),
        ("picture", "a.svg", text('<svg xmlns="http://www.w3.org/2000/svg"><image href="file:///dev/zero"/></svg>')),
    ],
    "profile": [
        ("link to another file", "a.nc", changed("foreign.nc", linked("profile.nc"))),
        ("link to a device", "a.nc", changed("foreign.nc", linked("/dev/zero"))),
        ("10^12 values of nothing", "a.nc", changed("foreign.nc", unlimited)),
        ("words", "a.nc", changed("foreign.nc", replaced("time", np.array([b"a"] * 60)))),
        ("time not a number", "a.nc", changed("foreign.nc", replaced("time", np.full(60, np.nan)))),
        ("time doubled", "a.nc", changed("foreign.nc", replaced("time", np.repeat(np.arange(30) / 500, 2)))),
        ("time of another length", "a.nc", changed("foreign.nc", replaced("time", np.arange(59) / 500))),
        ("no x", "a.nc", changed("foreign.nc", lambda f: f.__delitem__("x"))),
        ("x constant", "a.nc", changed("foreign.nc", lambda f: f["x"].write_direct(np.ones(f["x"].shape)))),
        ("x not measured", "a.nc", changed("foreign.nc", lambda f: f["x"].write_direct(np.full(f["x"].shape, np.nan)))),
        ("x huge", "a.nc", changed("foreign.nc", lambda f: f["x"].write_direct(np.full(f["x"].shape, 1e300)))),
        ("arc length zero", "a.nc", changed("foreign.nc", lambda f: f["arc_length"].write_direct(np.zeros(f["arc_length"].shape)))),
        ("groups alone", "a.nc", hdf5(lambda f: f.create_group("x"))),
        ("arrays of arrays", "a.nc", hdf5(lambda f: f.create_dataset("x", (3,), h5py.vlen_dtype(np.float64)))),
        ("deep attributes", "a.nc", changed("foreign.nc", lambda f: f.attrs.__setitem__("remarks", "[" * 100_000))),
        ("deep groups", "a.nc", hdf5(lambda f: f.create_group("/".join("a" * 2000)))),
        ("100 GB, sparse", "a.nc", sparse),
    ],
    "tracks": [
        ("one frame", "a.csv", text("scorer,a,a,a\nbodyparts,b,b,b\ncoords,x,y,likelihood\n0,1,2,0.9\n")),
        ("no likelihood", "a.csv", text("scorer,a,a\nbodyparts,b,b\ncoords,x,y\n0,1,2\n1,1,2\n")),
        ("likelihood beyond 1", "a.csv", text("scorer,a,a,a\nbodyparts,b,b,b\ncoords,x,y,likelihood\n0,1,2,9\n1,1,2,-9\n")),
        ("JSON, deep", "a.json", text("[" * 100_000)),
        ("100 GB, sparse", "a.whiskers", sparse),
        ("100 GB, sparse", "a.h5", sparse),
    ],
    "spikes": [
        ("trial before the first", "a.csv", rows(SPIKES, "a,-1,0.1")),
        ("trial beyond all", "a.csv", rows(SPIKES, "a,999999999999,0.1")),
        ("half a trial", "a.csv", rows(SPIKES, "a,1.5,0.1")),
        ("time without end", "a.csv", rows(SPIKES, "a,1,1e300", "a,1,inf")),
        ("no unit", "a.csv", rows(SPIKES, ",1,0.1")),
        ("a million units", "a.csv", text("unit,trial,spike_time\n" + "".join(f"u{k},0,0.1\n" for k in range(1_000_000)))),
        ("unit of 10 MB", "a.csv", rows(SPIKES, "u" * 100_000 + ",1,0.1", repeat=100)),
        ("units that look alike", "a.csv", rows(SPIKES, "é,1,0.1", "e\u0301,1,0.1", "a ,1,0.2", "a,1,0.3")),
        ("all at one time", "a.csv", rows(SPIKES, *(f"a,{k % 20},1" for k in range(400)))),
        ("100 GB, sparse", "a.nwb", sparse),
        ("HDF5, no NWB", "a.nwb", hdf5(lambda f: f.create_group("units"))),
        ("spikes not numbers", "a.nwb", changed("spikes.nwb", lambda f: f["units/spike_times"].write_direct(np.full(f["units/spike_times"].shape, np.nan)))),
        ("index beyond the spikes", "a.nwb", changed("spikes.nwb", lambda f: f["units/spike_times_index"].write_direct(np.full(f["units/spike_times_index"].shape, 200, np.uint16)))),
        ("trials that end before they start", "a.nwb", changed("spikes.nwb", lambda f: f["intervals/trials/stop_time"].write_direct(np.full(20, -1.0)))),
    ],
    "counts": [
        ("negative", "a.npy", array(-np.ones((400, 20, 2)))),
        ("not numbers", "a.npy", array(np.full((400, 20, 2), np.nan))),
        ("enormous", "a.npy", array(np.full((400, 20, 2), 1e300))),
        ("five dimensions", "a.npy", array(np.ones((2, 2, 2, 2, 2)))),
        ("nothing", "a.npy", array(np.ones((0, 20, 2)))),
        ("sparse matrix", "a.mat", matlab(counts=eye(400).tocsc())),
        ("structure", "a.mat", matlab(counts={"a": 1, "b": [1, 2]})),
        ("cells", "a.mat", matlab(counts=np.array([[1], ["a"], [np.ones(3)]], object))),
        ("words", "a.mat", matlab(counts="abc")),
        ("HDF5", "a.mat", hdf5(lambda f: f.create_dataset("counts", (10**6, 10**6), "f8", chunks=(10, 10)))),
    ],
    "stimulus": [
        ("one row", "a.csv", rows(STIMULUS, "0,0")),
        ("descending", "a.csv", rows(STIMULUS, "1,0", "0,1")),
        ("steps of nothing", "a.csv", rows(STIMULUS, *(f"{k}e-300,{k % 7}" for k in range(400)))),
        ("constant", "a.csv", rows(STIMULUS, *(f"{k / 100},0" for k in range(400)))),
        ("gap of a day", "a.csv", rows(STIMULUS, "0,0", "0.01,1", "86400,0")),
        ("infinite", "a.csv", rows(STIMULUS, *(f"{k / 100},inf" for k in range(400)))),
    ],
    "command": [
        ("sidecar deep", "a.wav", command_with("[" * 100_000)),
        ("sidecar no object", "a.wav", command_with("[]")),
        ("sidecar with NaN", "a.wav", command_with('{"full_scale": NaN, "sampling_rate": NaN}')),
        ("sidecar in Latin-1", "a.wav", command_with("{\"a\": \"é\"}".encode("latin-1"))),
        ("sidecar a number of a million digits", "a.wav", command_with('{"full_scale": ' + "9" * 1_000_000 + "}")),
        ("sidecar of other types", "a.wav", lambda p: command_with(json.dumps({key: [value] for key, value in json.loads(Path("command.wav.json").read_text()).items()}))(p)),
        ("no sidecar", "a.wav", lambda p: p.write_bytes(Path("command.wav").read_bytes())),
    ],
    "table": [
        ("movie absent", "a.csv", rows("movie,animal,whisker", "absent.mkv,a,C1")),
        ("movie is the table", "a.csv", rows("movie,animal,whisker", "a.csv,a,C1")),
        ("parents", "a.csv", rows("movie,animal,whisker", "../../../../../etc/passwd,a,C1")),
        ("ends of lines within", "a.csv", rows("movie,animal,whisker", '"a\nb",a,C1')),
    ],
    "diameters": [
        ("two rows", "a.csv", rows("distance_mm,diameter_um", "0,120", "1,119")),
        ("one place", "a.csv", rows("distance_mm,diameter_um", *["1,120"] * 9)),
        ("negative", "a.csv", rows("distance_mm,diameter_um", *(f"{k},{-k}" for k in range(9)))),
        ("a straight cone to rounding", "a.csv", rows("distance_mm,diameter_um", *(f"{k},{120 - 3 * k}" for k in range(9)))),
    ],
}  # fmt: skip
