"""Track files that are cut, damaged or of another kind: one line each, no hang, nothing silently left out."""

import struct

import h5py
import numpy as np
import pytest
from refusals import refusal
from scipy.io import savemat

from vibrissa import reader_process
from vibrissa.errors import InputError
from vibrissa.video.foreign.tracks import read_tracks
from vibrissa.video.foreign.whisk_files import read_measurements, read_whiskers
from vibrissa.video.tracking import Calibration

CALIBRATION = Calibration(frame_rate=500.0, pixel_size=1e-4)
N_PROCESSES = 12  # mutations that are read by a process each


def segment(wid=0, frame=0, points=20, x=None, y=None, says=None) -> bytes:
    x = np.arange(10.0, 10 + points) if x is None else x
    y = np.full(points, 5.0) if y is None else y
    head = struct.pack("<3i", wid, frame, points if says is None else says)
    return head + np.array([x, y, 2 + 0 * x, 100 + 0 * x], "<f4").tobytes()


def whiskers(*segments, count=None, head=b"bwhiskbin1\0\0") -> bytes:
    return head + b"".join(segments) + struct.pack("<i", len(segments) if count is None else count)


def measurements(rows=1, measures=8, says=None, frame=0, follicle=(10.0, 5.0), inner=8, column=4) -> bytes:
    row = struct.pack("<10i", 0, frame, 0, 0, -5, 5, column, column + 1, 0, inner) + b"y"
    row += struct.pack("<8d", 19, 100, 0, 0, *follicle, 29, 5) + bytes(64)
    return b"measv3\0\0" + struct.pack("<2i", rows if says is None else says, measures) + rows * row


GOOD = whiskers(segment(), segment(frame=1))


def circle_far(points=20):
    return np.linspace(0, 9e4, points)


FORMAT, SEGMENT = ("format", "bad.whiskers"), ("format", "bad.whiskers, segment 0")
OTHER, LINE = "must be a file of tracked whiskers", ("range", "bad.whiskers, frame 0")
COUNTS, COORDINATES = "must hold the {} segments it counts", "must have finite coordinates below 100000 px"
HEADER, LONG = "must have id, frame and points", "must be a line of at most 10000 px"

# content; code, quantity and value; rule; remedy where the rule says not enough
TRACES = {
    "empty": (b"", (*FORMAT, "b''"), OTHER),
    "head alone": (b"bwhiskbin1\0\0", (*FORMAT, "12 bytes"), "must hold its count of segments"),
    "half a head": (b"bwhiskbin1", (*FORMAT, "b'bwhiskbin1'"), "must be a .whiskers file of kind bwhiskbin1"),
    "no segments": (whiskers(), ("too-few", "bad.whiskers"), "must hold at least one segment"),
    "cut in a segment's head": (GOOD[:20], (*SEGMENT, "4 left"), "must have a head of 12 bytes"),
    "cut in points": (GOOD[:100], (*SEGMENT, "72 bytes left"), "must hold its 20 points"),
    "cut between segments": (GOOD[: 12 + 332 + 4], (*FORMAT, "1"), COUNTS.format(0)),
    "more bytes than told": (
        GOOD + bytes(16),
        ("format", "bad.whiskers, segment 2", "2, 0 and 0"),
        HEADER,
    ),
    "counts too many": (whiskers(segment(), count=2), (*FORMAT, "1"), COUNTS.format(2)),
    "counts below zero": (whiskers(segment(), count=-1), (*FORMAT, "1"), COUNTS.format(-1)),
    "no points": (whiskers(segment(points=0)), (*SEGMENT, "0, 0 and 0"), HEADER),
    "points below zero": (whiskers(segment(says=-20)), (*SEGMENT, "0, 0 and -20"), HEADER),
    "points beyond the file": (
        whiskers(segment(says=2**31 - 1)),
        (*SEGMENT, "320 bytes left"),
        "must hold its 2147483647 points",
    ),
    "frame below zero": (whiskers(segment(frame=-1)), (*SEGMENT, "0, -1 and 20"), HEADER),
    "frame beyond reason": (
        whiskers(segment(), segment(frame=2**31 - 2)),
        ("too-few", "bad.whiskers"),
        "must hold traces in more of its frames",
        "a frame's number may be damaged",
    ),
    "not a number": (whiskers(segment(x=np.full(20, np.nan))), SEGMENT, COORDINATES),
    "infinite": (whiskers(segment(y=np.full(20, np.inf))), SEGMENT, COORDINATES),
    "beyond any image": (whiskers(segment(x=np.full(20, 1e30))), SEGMENT, COORDINATES),
    "longer than any image": (whiskers(segment(x=circle_far())), (*LINE, "20 points over 90000 px"), LONG),
    "one point": (whiskers(segment(points=1)), (*LINE, "1 points over 0 px"), LONG),
    "one place": (whiskers(segment(x=np.full(20, 7.0))), (*LINE, "20 points over 0 px"), LONG),
    "twice the same": (whiskers(segment(), segment()), FORMAT, "must hold each segment of a frame once"),
    "measurements alone": (
        measurements(),
        FORMAT,
        "must hold curves, not measurements",
        "give the .whiskers file beside it",
    ),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(40), (*FORMAT, r"b'\x89PNG\r\n\x1a\n\x00\x00\x00\x00'"), OTHER),
    "an HDF5 signature alone": (b"\x89HDF\r\n\x1a\n" + bytes(40), FORMAT, "must be a whole HDF5 file"),
    "a MATLAB head alone": (
        b"MATLAB 5.0 MAT-file" + bytes(40),
        FORMAT,
        "must be a MATLAB file with numbers in g_tMovieInfo.SplinePoints",
    ),
    "a MATLAB file of today": (
        b"MATLAB 7.3 MAT-file" + bytes(40),
        FORMAT,
        "must be a MATLAB file before version 7.3",
        "save it with -v7",
    ),
    "a table without rows": (
        b"scorer,n,n,n\nbodyparts,a,a,a\ncoords,x,y,likelihood\n",
        ("too-few", "bad.csv"),
        "must hold at least one frame",
    ),
    "a table that is no text": (b"scorer,\xff\xfe\n0,1\n", ("format", "bad.csv"), "must be text"),
    "a table of labelled pictures": (
        b"scorer,n,n\nbodyparts,a,a\ncoords,x,y\nimg01.png,1,2\n",
        ("format", "bad.csv", "'img01.png'"),
        "must have frame 0 in row 0",
        "give predictions, a row for every frame",
    ),
    "a table that counts frames from 1": (
        b"scorer,n,n,n\nbodyparts,a,a,a\ncoords,x,y,likelihood\n1,1,2,1\n2,1,2,1\n",
        ("format", "bad.csv", "'1'"),
        "must have frame 0 in row 0",
        "frames count from 0: subtract 1 from every number",
    ),
    "a table without a column": (
        b"scorer,n,n,n,n,n\nbodyparts,a,a,a,b,b\ncoords,x,y,likelihood,x,likelihood\n0,1,2,1,3,1\n",
        ("missing", "bad.csv, column 'y' of b"),
        "must be in the table of DeepLabCut",
    ),
}


def told(path, *fields, **options) -> InputError:
    with refusal(*fields) as caught:
        read_tracks(path, CALIBRATION, **options)
    assert len(str(caught.value)) < 500
    return caught.value


@pytest.mark.parametrize("case", TRACES)
def test_bad_file_is_told_in_one_line(case, tmp_path):
    content, fields, rule, *remedy = TRACES[case]
    suffix = ".csv" if content.startswith(b"scorer") else ".whiskers"
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    options = {"identity": "number", "base": "left"} if suffix == ".whiskers" and b"bwhisk" in content[:8] else {}
    error = told(path, *fields, **options)
    assert error.rule == rule
    assert remedy in ([], [error.remedy])


MEASURED, MEASV3 = ("format", "a.measurements"), "must be a .measurements file of kind measv3"
ROWS, ORDER = "must have rows of 8 measures", "must have the measures of WHISK in their order"

MEASURES = {
    "empty": (b"", (*MEASURED, "b''"), MEASV3),
    "older": (
        b"measV1\0\0" + bytes(100),
        (*MEASURED, r"b'measV1\x00\x00'"),
        MEASV3,
        "convert it with WHISK's measurements_convert to v3",
    ),
    "head alone": (
        b"measv3\0\0",
        ("missing", "a.measurements", "8 bytes"),
        "must state its numbers of rows and measures",
    ),
    "cut": (measurements(rows=2)[:-1], (*MEASURED, f"{len(measurements(rows=2)) - 1} bytes"), "must hold its 2 rows"),
    "too long": (measurements() + b"\0", (*MEASURED, f"{len(measurements()) + 1} bytes"), "must hold its 1 rows"),
    "rows beyond the file": (
        measurements(says=2**31 - 1),
        (*MEASURED, f"{len(measurements())} bytes"),
        "must hold its 2147483647 rows",
    ),
    "rows below zero": (measurements(says=-1), (*MEASURED, "-1 of 8"), ROWS),
    "measures beyond reason": (measurements(measures=2**31 - 1), (*MEASURED, "1 of 2147483647"), ROWS),
    "inconsistent": (measurements(inner=7), MEASURED, ORDER),
    "other columns": (measurements(column=0), MEASURED, ORDER),
    "frame below zero": (measurements(frame=-3), ("range", "a.measurements"), "must have frames and segments from 0"),
    "twice the same": (measurements(rows=2), MEASURED, "must measure each segment of a frame once"),
    "of another movie": (
        measurements(frame=7),
        ("missing", "segment 0 in frame 0 of a.whiskers"),
        "must be measured",
    ),
    "follicle nowhere": (
        measurements(follicle=(np.nan, 5.0)),
        ("range", "segment 0 in frame 0 of a.whiskers", "(nan, 5.0)"),
        "must have its follicle at pixels",
    ),
}


@pytest.mark.parametrize("case", MEASURES)
def test_bad_measurements_are_told_in_one_line(case, tmp_path):
    content, fields, rule, *remedy = MEASURES[case]
    (tmp_path / "a.whiskers").write_bytes(whiskers(segment()))
    (tmp_path / "a.measurements").write_bytes(content)
    error = told(tmp_path / "a.whiskers", *fields)
    assert error.rule == rule
    assert remedy in ([], [error.remedy])


def test_nothing_measured_is_told_with_the_remedy(tmp_path):
    (tmp_path / "a.whiskers").write_bytes(GOOD)
    error = told(tmp_path / "a.whiskers", "missing", "a.whiskers")
    assert error.remedy.startswith("have lines linked to whiskers (`identity='link'`), classify them")
    error = told(tmp_path / "a.whiskers", "missing", "base", identity="number")
    assert error.remedy == "one of left, right, top, bottom"


def table(**columns):
    rows = np.zeros(2, [(name, "<f4" if name.startswith("follicle") else "<u4") for name in columns])
    for name, values in columns.items():
        rows[name] = values
    return rows


WHISKIWRAP = "must be a WhiskiWrap HDF5 file with its pixels"
SUMMARY = {"fid": [0, 1], "wid": [0, 0], "label": [0, 0], "follicle_x": [10, 10], "follicle_y": [5, 5]}


@pytest.mark.parametrize(
    ("change", "fields", "rule", "remedy"),
    [
        ({"pixels_x": None}, ("format", "a.h5"), WHISKIWRAP, "has no table pixels_x; write it with the pixels"),
        (
            {"summary": table(fid=[0, 1])},
            ("missing", "a.h5, summary"),
            "must have the columns follicle_x, follicle_y, wid",
            "",
        ),
        (
            {"pixels_y": 1},
            ("shape", "a.h5", "2 rows, 2 and 1 lists"),
            "must have pixels for each row of summary",
            "",
        ),
        ({"pixels_y": "short"}, ("shape", "a.h5, row 0", "20 and 10"), "must have as many x as y", ""),
        (
            {"summary": table(**{**SUMMARY, "fid": [0, 0]})},
            ("format", "a.h5"),
            "must hold each segment of a frame once",
            "was a chunk written twice?",
        ),
        (
            {"summary": table(**{**SUMMARY, "fid": [0, 2**31]})},
            ("too-few", "a.h5"),
            "must hold traces in more of its frames",
            "a frame's number may be damaged",
        ),
        (
            {"summary": np.arange(3.0)},
            ("missing", "a.h5, summary"),
            "must have the columns fid, follicle_x, follicle_y, wid",
            "",
        ),
        (
            {"pixels_x": np.array([b"a", b"b"])},
            ("format", "a.h5"),
            WHISKIWRAP,
            "could not convert string to float",
        ),
    ],
)
def test_bad_whiskiwrap_files_are_told_in_one_line(change, fields, rule, remedy, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        content = {"summary": table(**SUMMARY), "pixels_x": 2, "pixels_y": 2, **change}
        for name, one in content.items():
            if isinstance(one, int | str):
                lists = file.create_dataset(name, (one if isinstance(one, int) else 2,), h5py.vlen_dtype("<f4"))
                for i in range(lists.shape[0]):
                    lists[i] = np.arange(10.0, 20.0 if isinstance(one, str) else 30.0, dtype="f4")
            elif one is not None:
                file[name] = one
    error = told(tmp_path / "a.h5", *fields)
    assert error.rule == rule
    assert remedy in error.remedy


@pytest.mark.parametrize(
    ("content", "fields"),
    [
        ({"other": 1.0}, ("format", "a.mat")),
        ({"g_tMovieInfo": 1.0}, ("format", "a.mat")),
        ({"g_tMovieInfo": {"SplinePoints": np.ones((2, 2, 5))}}, ("shape", "a.mat", "shape (2, 2, 5, 1)")),
        ({"g_tMovieInfo": {"SplinePoints": np.empty((3, 2, 0))}}, ("shape", "a.mat", "shape (3, 2, 0, 1)")),
        ({"g_tMovieInfo": {"SplinePoints": "three"}}, ("format", "a.mat")),
        ({"g_tMovieInfo": {"SplinePoints": np.full((3, 2, 5), np.inf)}}, ("format", "a.mat")),
        ({"g_tMovieInfo": {"SplinePoints": np.zeros((3, 2, 5))}}, ("too-few", "a.mat", "never base and middle")),
    ],
)
def test_bad_matlab_files_are_told_in_one_line(content, fields, tmp_path):
    savemat(tmp_path / "a.mat", content)
    told(tmp_path / "a.mat", *fields)


# Fuzz: any change of bytes is read as some other whole file, or told; it never takes long or fills memory


def fuzzed(good: bytes, rng: np.random.Generator) -> bytes:
    data = bytearray(good)
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(0, len(data)))
        match rng.integers(0, 4):
            case 0:
                data[at] = int(rng.integers(0, 256))
            case 1:
                data[at : at + 4] = struct.pack("<i", int(rng.choice([-1, 0, 1, 2**31 - 1, -(2**31)])))
            case 2:
                del data[at : at + int(rng.integers(1, 40))]
            case _:
                data[at:at] = rng.bytes(int(rng.integers(1, 40)))
        data = data or bytearray(b"\0")
    return bytes(data)


def survives(path, content: bytes, read) -> bool:
    path.write_bytes(content)
    error = None
    try:
        read(path)
    except InputError as raised:
        error = raised
    assert "\n" not in str(error)
    return error is None


def test_fuzzed_whiskers_are_read_or_told(tmp_path):
    rng = np.random.default_rng(20)
    good = whiskers(*(segment(frame=f, wid=w, points=12) for f in range(3) for w in range(2)))

    def read(path):
        read_tracks(path, CALIBRATION, identity="number", base="left")

    passed = [survives(tmp_path / "a.whiskers", fuzzed(good, rng), read) for _ in range(1500)]
    assert 0 < sum(passed) < len(passed)


def test_every_cut_of_a_whole_file_is_told(tmp_path):
    for good, read in ((GOOD, read_whiskers), (measurements(), read_measurements)):
        assert survives(tmp_path / "a", good, read)
        assert not any(survives(tmp_path / "a", good[:end], read) for end in range(len(good)))


def test_fuzzed_measurements_are_read_or_told(tmp_path):
    rng = np.random.default_rng(21)
    (tmp_path / "a.whiskers").write_bytes(whiskers(segment()))

    def read(_):
        read_tracks(tmp_path / "a.whiskers", CALIBRATION)

    passed = [survives(tmp_path / "a.measurements", fuzzed(measurements(), rng), read) for _ in range(800)]
    assert 0 < sum(passed) < len(passed)


def test_fuzzed_matlab_files_are_read_or_told(tmp_path):
    rng = np.random.default_rng(22)
    splines = 1 + 100 * rng.random((3, 2, 6))
    savemat(tmp_path / "good.mat", {"g_tMovieInfo": {"SplinePoints": splines}})
    good = (tmp_path / "good.mat").read_bytes()
    passed = [
        survives(tmp_path / "a.mat", fuzzed(good, rng), lambda path: read_tracks(path, CALIBRATION))
        for _ in range(N_PROCESSES)
    ]
    assert 0 < sum(passed) < len(passed)


def test_a_reader_that_crashes_is_one_line_and_the_program_lives_on(tmp_path, monkeypatch):
    (tmp_path / "crashing.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with refusal("format", "crashing.py") as caught:
        reader_process.tables_read_by("crashing", tmp_path / "crashing.py", "must be whole")
    assert caught.value.rule == "must be whole"
    assert "crashed" in caught.value.remedy


def test_a_table_that_counts_more_rows_than_the_file_can_hold_is_told(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["summary"] = table(**SUMMARY)
        for name in ("pixels_x", "pixels_y"):
            file.create_dataset(name, (2**40,), h5py.vlen_dtype("<f4"), chunks=(1024,))
    error = told(tmp_path / "a.h5", "format", "a.h5")
    assert error.rule == WHISKIWRAP
    assert "more than the file can hold" in error.remedy


def test_cut_hdf5_files_are_told(tmp_path):
    with h5py.File(tmp_path / "good.h5", "w") as file:
        file["summary"] = table(**SUMMARY)
        for name in ("pixels_x", "pixels_y"):
            lists = file.create_dataset(name, (2,), h5py.vlen_dtype("<f4"))
            for i in range(2):
                lists[i] = np.arange(10.0, 30.0, dtype="f4")
    good = (tmp_path / "good.h5").read_bytes()

    def read(path):
        read_tracks(path, CALIBRATION)

    assert survives(tmp_path / "a.h5", good, read)
    assert not any(survives(tmp_path / "a.h5", good[:end], read) for end in range(8, len(good), 97))


def test_fuzzed_hdf5_files_are_read_or_told(tmp_path, monkeypatch):
    rng = np.random.default_rng(23)
    monkeypatch.setattr(reader_process, "PATIENCE", 5.0)
    with h5py.File(tmp_path / "good.h5", "w") as file:
        file["summary"] = table(**SUMMARY)
        for name in ("pixels_x", "pixels_y"):
            lists = file.create_dataset(name, (2,), h5py.vlen_dtype("<f4"))
            for i in range(2):
                lists[i] = np.arange(10.0, 30.0, dtype="f4")
    good = (tmp_path / "good.h5").read_bytes()
    passed = [
        survives(tmp_path / "a.h5", fuzzed(good, rng), lambda path: read_tracks(path, CALIBRATION, base="left"))
        for _ in range(N_PROCESSES)
    ]
    assert 0 < sum(passed) < len(passed)
