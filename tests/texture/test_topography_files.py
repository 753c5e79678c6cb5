"""Instruments' files: the values that another reader finds in them, the line of a map, the right refusal."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from instrument_files import HEIGHTS, MAPS, NX, STEP, hfm
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.mechanics.scan.relief_prediction import predict_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.io import read_height_profile
from vibrissa.whisker import Whisker

REAL = Path(__file__).parents[2] / ".." / "shared" / "data" / "topography"
AS_READ = {"level": "none"}
WHISKER = Whisker(length=0.040, cone_angle=1.5e-3, tip=0.05)
HOW = Posture(contact=0.29, base_angle=1.2), Scan(speed=0.1, damping=0.11)

with warnings.catch_warnings():
    warnings.simplefilter("ignore", ImportWarning)  # that there is no MPI
    READERS = pytest.importorskip("SurfaceTopography.IO")


def real(name):
    path = REAL / name
    if not path.is_file():
        pytest.skip(f"real data {name} is not here")
    return path


def mean(x, z):
    return ((z[1:] + z[:-1]) * np.diff(x)).sum() / 2 / (x[-1] - x[0])


def assert_profile(relief, x, z):
    """Same places and heights [m], but for the zeros of the instrument."""
    np.testing.assert_allclose(relief.position, x - x[0], atol=1e-15)
    np.testing.assert_allclose(relief.height, z - mean(x, z), atol=1e-15)


# files made here


SDF = """aISO-1.0
ManufacID = vibrissa
CreateDate = 010120140000
ModDate = 010120140000
NumPoints = {nx}
NumProfiles = {ny}
Xscale = {dx!r}
Yscale = {dy!r}
Zscale = 1e-06
Zresolution = -1
Compression = 0
DataType = 7
CheckType = 0
*
{rows}
*
"""


def surface_file(folder, height, dx=1e-4, dy=2e-4):
    """ISO 25178-71 text of a map (y, x) of heights [µm]."""
    rows = "\n".join(" ".join("BAD" if np.isnan(z) else repr(z) for z in row) for row in height.tolist())
    path = folder / "map.sdf"
    path.write_text(SDF.format(nx=height.shape[1], ny=height.shape[0], dx=dx, dy=dy, rows=rows))
    return path


def wavy(ny=6, nx=11):
    y, x = np.mgrid[:ny, :nx]
    return np.cos(2.0 * x + y) + 0.1 * y


@pytest.mark.parametrize(
    ("line", "step", "expected"), [("x:4", 1e-4, wavy()[4]), ("y:7", 2e-4, wavy()[:, 7])], ids=["along x", "along y"]
)
def test_a_line_of_a_map_is_what_was_written(tmp_path, line, step, expected):
    relief = read_height_profile(surface_file(tmp_path, wavy()), line=line, **AS_READ)
    assert_profile(relief, step * np.arange(expected.size), expected * 1e-6)


def test_a_map_asks_for_its_line_and_names_the_clearest(tmp_path):
    height = wavy()
    height[:3, 2] = height[3, :5] = height[5, 1] = np.nan
    with refusal("format", "map.sdf", value="11 × 6 points, 1.1 × 1.2 mm"):
        read_height_profile(surface_file(tmp_path, height))


@pytest.mark.parametrize("line", ["x:6", "y:11", "x:-1", "4", "z:1", "x:1.5", "", "x:9999999999"])
def test_a_line_that_is_not_there_is_refused(tmp_path, line):
    with refusal("unknown", "line"):
        read_height_profile(surface_file(tmp_path, wavy()), line=line)


def test_holes_of_a_map_are_holes_of_its_lines(tmp_path):
    height = wavy()
    height[2, [4, 5]] = np.nan
    path, said = surface_file(tmp_path, height), []
    with refusal("format", "map.sdf, line x:2", value="none at 2 of 11, the widest hole 0.3 mm"):
        read_height_profile(path, line="x:2", **AS_READ)
    relief = read_height_profile(path, line="x:2", fill=True, tell=said.append, **AS_READ)
    np.testing.assert_allclose(np.diff(relief.height[3:7]), (height[2, 6] - height[2, 3]) * 1e-6 / 3, rtol=1e-9)
    assert "2 points without height bridged by straight lines, 0.3 mm the widest hole" in said


def test_a_map_too_small_for_a_whisker_is_refused_before_all_else(tmp_path):
    with refusal("too-few", "map.sdf", value="0.011 × 0.012 mm"):
        read_height_profile(surface_file(tmp_path, wavy(), dx=1e-6, dy=2e-6))


def test_a_point_marked_as_invalid_is_a_hole(tmp_path):
    path = tmp_path / "a.hfm"
    rows = [f"{8 + x / 10};{106 + np.cos(x):.6f};{int(x != 3)}" for x in range(9)]
    path.write_text("\n".join(["X;Y;valid", "[mm];[um];[1/0]", *rows, ""]))
    with refusal("format", "a.hfm"):
        read_height_profile(path, **AS_READ)
    path.write_text("\n".join(["X;Y;valid", "[mm];[um];[1/0]", *rows[:3], *rows[4:], ""]))
    x = np.delete(np.arange(9.0), 3)
    relief = read_height_profile(path, **AS_READ)
    np.testing.assert_allclose(np.ptp(relief.position), 0.8e-3)
    np.testing.assert_allclose(np.diff(relief.height), np.diff(np.cos(x)) * 1e-6, atol=2e-12)  # six decimals


LOST_ROWS = {  # a file of 60 points with a row instead of its tenth one: its reader would leave out nine or more
    "two cells": (b"8.09;105.1", "a.hfm, line 12"),
    "no height": (b"8.09;;1", "a.hfm, line 12"),
    "a word": (b"8.09;abc;1", "a.hfm, line 12"),
    "a word for the mark": (b"8.09;105.1;q", "a.hfm, line 12"),
    "another separator": (b"8.09,105.1;1", "a.hfm"),
}


@pytest.mark.parametrize(("row", "quantity"), LOST_ROWS.values(), ids=LOST_ROWS)
def test_a_row_that_hides_others_is_refused(tmp_path, row, quantity):
    rows = hfm().splitlines()
    rows[11] = row
    path = tmp_path / "a.hfm"
    path.write_bytes(b"\n".join([*rows, b""]))
    with refusal("format", quantity):
        read_height_profile(path, **AS_READ)


def test_a_row_of_a_matrix_that_would_be_left_out_is_refused(tmp_path):
    head = ["# Channel: a", "# Width: 1 mm", "# Height: 2 mm", "# Value units: mm"]
    rows, path = ["1 2 3 4"] * 5, tmp_path / "a.asc"
    path.write_text("\n".join([*head, *rows, ""]))
    assert read_height_profile(path, line="x:4", **AS_READ).position.size == 4
    path.write_text("\n".join([*head, *rows[:2], "1 2 x 4", *rows[:2], ""]))
    with refusal("format", "a.asc, line 7"):
        read_height_profile(path, line="x:3", **AS_READ)


@pytest.mark.parametrize("name", MAPS)
def test_a_map_of_each_maker_is_what_was_written(tmp_path, name):
    path = tmp_path / f"a.{name}"
    path.write_bytes(MAPS[name]())
    relief = read_height_profile(path, line="x:1", **AS_READ)
    heights = HEIGHTS[1] - mean(STEP * np.arange(NX), HEIGHTS[1])
    np.testing.assert_allclose(relief.position, STEP * np.arange(NX), atol=1e-10)  # single precision
    np.testing.assert_allclose(relief.height, heights, atol=1e-14)


def test_without_the_readers_the_extra_is_named(tmp_path, monkeypatch):
    path = surface_file(tmp_path, wavy())
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", None)
    with refusal("package", "map.sdf"):
        read_height_profile(path, line="x:4")


@pytest.mark.parametrize("cut", [30, 250, 400])
def test_a_file_cut_short_is_refused_in_one_line(tmp_path, cut):
    path = surface_file(tmp_path, wavy())
    path.write_bytes(path.read_bytes()[:cut])
    with refusal("format", "map.sdf") as refused:
        read_height_profile(path, line="x:4")
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize("start", [b"", b"1 2 3\n4 5 6\n"])
@pytest.mark.parametrize("unit", [b",", b"\n", b"\0", b"whisker", b"1234567890"])
def test_junk_is_refused_and_no_reader_of_text_goes_through_it(tmp_path, monkeypatch, unit, start):
    """Of newlines alone such a reader takes a time that grows as the square of their number."""
    path, asked = surface_file(tmp_path, wavy()), []
    path.write_bytes(start + (unit * 3_000_000)[:3_000_000])
    inner = READERS.open_topography
    monkeypatch.setattr(READERS, "open_topography", lambda path, format: asked.append(format) or inner(path, format))
    with refusal("format", "map.sdf"):
        read_height_profile(path)
    digits = start and unit.isdigit()
    assert asked == [None] if digits else not {None, "xyz", "asc"} & set(asked)


def test_a_file_larger_than_memory_is_refused_unread(tmp_path, monkeypatch):
    monkeypatch.setenv("VIBRISSA_MEMORY", "2")  # [GB]
    path = tmp_path / "map.sdf"
    with open(path, "wb") as file:
        file.truncate(1_100_000_000)  # without content: it takes no place
    with refusal("range", "map.sdf"):
        read_height_profile(path)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=400) | st.text().map(str.encode))
def test_what_is_no_topography_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "a.dat"
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        read_height_profile(path)
    assert refused.value.quantity.startswith(str(path))
    assert len(str(refused.value).splitlines()) == 1


# real files


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("al3d-1.al3d", {}, ("too-few", "al3d-1.al3d")),
        ("stp-1.stp", {}, ("too-few", "stp-1.stp")),
        ("opdx-3.opdx", {}, ("too-few", "opdx-3.opdx")),
        ("xy-4.txt", {}, ("missing", "xy-4.txt")),
        ("xy-4.txt", {"x_unit": "um", "z_unit": "um"}, ("too-few", "xy-4.txt")),
        ("nonuniform.asc", {"x_unit": "um"}, ("missing", "nonuniform.asc")),
        ("hfm-1.hfm", {}, ("format", "hfm-1.hfm")),
        ("dektak-1.csv", {}, ("format", "dektak-1.csv")),
        ("dektak-1.csv", {"x_unit": "mm"}, ("conflict", "dektak-1.csv")),
        ("sur-3.sur", {}, ("format", "sur-3.sur")),
        ("sur-3.sur", {"line": "x:255"}, ("format", "sur-3.sur, line x:255")),
        ("frt-2.frt", {}, ("format", "frt-2.frt")),
        ("frt-2.frt", {"line": "y:93"}, ("format", "frt-2.frt, line y:93")),
        ("frt-2.frt", {"line": "x:3", "fill": True}, ("range", "frt-2.frt, line x:3")),
        ("LICENSE.md", {}, ("format", "LICENSE.md")),
    ],
)
def test_real_files_are_refused_for_what_they_leave_open(name, options, message):
    path = real(name)
    with refusal(*message) as refused:
        read_height_profile(path, **options)
    assert str(refused.value).startswith(str(path))
    assert len(str(refused.value).splitlines()) == 1


def test_a_profile_in_mm_as_its_text_says():
    path = real("hfm-1.hfm")
    x, z, _ = np.array([line.split(";") for line in path.read_text().split()[2:]], float).T * 1e-3
    assert_profile(read_height_profile(path, **AS_READ), x, z)
    assert x.size == 9600


def test_a_profile_in_micrometres_as_its_text_says():
    path, said = real("dektak-1.csv"), []
    lines = path.read_text("latin-1").splitlines()
    rows = lines[lines.index("Lateral um,Raw Micrometer,") + 1 :]
    x, z = np.array([row.split(",")[:2] for row in rows if row], float).T * 1e-6
    assert_profile(read_height_profile(path, tell=said.append, **AS_READ), x, z)
    assert x.size == 9600
    assert "measured with a stylus of radius 2.5 µm: grooves that it cannot enter are not in the file" in said


@pytest.mark.parametrize(("name", "skip", "per_metre"), [("xy-4.txt", 0, 1e3), ("nonuniform.asc", 0, 1e6)])
def test_bare_columns_in_the_unit_given(name, skip, per_metre):
    path, unit = real(name), {1e3: "mm", 1e6: "um"}[per_metre]
    x, z = np.loadtxt(path, skiprows=skip).T / per_metre
    assert_profile(read_height_profile(path, x_unit=unit, z_unit=unit, **AS_READ), x, z)


@pytest.mark.parametrize(
    ("name", "line", "pick"), [("frt-2.frt", "x:120", np.s_[:, 120]), ("sur-3.sur", "x:255", np.s_[2:511, 255])]
)
def test_a_line_of_a_real_map(name, line, pick):
    from SurfaceTopography import read_topography

    surface = read_topography(str(real(name)))
    z = np.asarray(surface.heights()[pick], float)
    x = np.arange(z.size) * surface.pixel_size[0]
    assert surface.unit == "m"
    assert_profile(read_height_profile(real(name), line=line, fill=True, **AS_READ), x, z)


# from file to vibration


def scanned(relief):
    posture, scan = HOW
    return predict_relief(WHISKER, posture, relief, scan, n_modes=3)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("hfm-1.hfm", {"level": "line"}),
        ("dektak-1.csv", {"level": "line"}),
        ("dektak-1.csv", {"level": "line", "flip": True}),
        ("xy-4.txt", {"x_unit": "mm", "z_unit": "mm"}),
        ("nonuniform.asc", {"x_unit": "um", "z_unit": "um"}),
        ("frt-2.frt", {"line": "x:109", "level": "line"}),
        ("sur-3.sur", {"line": "x:255", "part": (0.06, 0.09), "level": "none"}),
    ],
)
def test_a_real_surface_is_touched_where_it_is_and_lets_the_whisker_ring(name, options):
    relief = read_height_profile(real(name), **options)
    prediction = scanned(relief)
    t = np.linspace(0, prediction.end + 0.1, 400)
    _, z, place = prediction.contact(t)
    np.testing.assert_allclose(z * WHISKER.length, relief.at(place * WHISKER.length), atol=1e-12)
    assert np.all(np.diff(place) > -1e-12)  # the contact only goes towards the base on the texture
    q = prediction.amplitudes(t)[0]
    assert np.abs(q[t < prediction.end]).max() > 1e-6  # 40 nm
    assert np.abs(q[-1]) < 1e-2 * np.abs(q).max()


def test_a_bar_that_rises_by_a_sixth_of_the_whisker_is_refused():
    relief = read_height_profile(real("sur-3.sur"), line="x:255", fill=True)
    with refusal("range", "the relief"):
        scanned(relief)
