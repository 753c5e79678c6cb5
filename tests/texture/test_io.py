"""Gaps on disk: the bits that were written, the units of the header, and one line for whatever else there is."""

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.texture.io import holds_gaps, read_gaps, read_texture, write_gaps
from vibrissa.texture.surface import DEPTH, Gaps, periodic_grating, random_grating

READINGS = ["telegraph", "widths"]
same_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)  # the disk's pace


def assert_same_bits(one, other):
    assert one.position.tobytes() == other.position.tobytes()
    assert one.width.tobytes() == other.width.tobytes()
    assert one.depth.hex() == other.depth.hex()


def written(folder, content):
    path = folder / "texture.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


# round trip


@same_folder
@given(
    st.sampled_from(READINGS), st.integers(0, 2**32), st.floats(0.005, 0.1), st.floats(1e-300, 1e-2), st.floats(-9, 9)
)
def test_what_is_written_is_read_to_the_last_bit(tmp_path, reading, seed, length, depth, shift):
    grating = random_grating(length, rng=np.random.default_rng(seed), reading=reading, depth=depth)
    texture = Gaps(position=grating.position + shift, width=grating.width, depth=depth)
    write_gaps(texture, tmp_path / "texture.csv")
    assert_same_bits(read_gaps(tmp_path / "texture.csv"), texture)


@same_folder
@given(st.lists(st.floats(-10, 10), min_size=2, unique=True), st.floats(0, 1, exclude_min=True))
def test_any_edges_are_read_to_the_last_bit(tmp_path, edges, share):
    edges = np.sort(edges)
    width = np.minimum(share * np.append(np.diff(edges), 1), 0.05)
    try:
        texture = Gaps(position=edges, width=width)
    except InputError:  # gaps that touch
        return
    write_gaps(texture, tmp_path / "texture.csv")
    assert_same_bits(read_gaps(tmp_path / "texture.csv"), texture)


def test_file_as_it_is_written(tmp_path):
    write_gaps(periodic_grating(0.5, period=0.0625, width=0.03125), tmp_path / "texture.csv")
    first = (tmp_path / "texture.csv").read_bytes().splitlines(keepends=True)[:3]
    assert first == [b"position,width,depth\n", b"0.03125,0.03125,3.5e-05\n", b"0.09375,0.03125,3.5e-05\n"]
    assert os.listdir(tmp_path) == ["texture.csv"]


@pytest.mark.parametrize(
    ("position", "width", "depth", "message"),
    [
        ([1.0, 20.0], [1e-3, 1e-3], DEPTH, ("range", "gap 2, position")),
        ([1.0], [0.3], DEPTH, ("range", "gap 1, width")),
        ([1.0], [1e-3], 35.0, ("range", "gap 1, depth")),
    ],
)
def test_what_would_not_be_read_again_is_not_written(tmp_path, position, width, depth, message):
    texture = Gaps(position=np.array(position), width=np.array(width), depth=depth)
    with refusal(*message):
        write_gaps(texture, tmp_path / "texture.csv")
    assert os.listdir(tmp_path) == []


def test_gaps_that_begin_before_0_are_reversed_where_they_lie(tmp_path):
    path = written(tmp_path, "position_mm,width_mm\n-1,0.5\n2,0.7\n")
    found = read_texture(path, flip=True)
    np.testing.assert_allclose(found.position, [-1e-3, 2.2e-3], atol=1e-15)
    np.testing.assert_allclose(found.width, [0.7e-3, 0.5e-3])


def test_missing_folder_is_told(tmp_path):
    with refusal("missing", "nowhere"):
        write_gaps(periodic_grating(0.01, period=1e-3), tmp_path / "nowhere" / "texture.csv")


# what is read


@pytest.mark.parametrize(
    ("content", "depth"),
    [
        ("position,width\n0,3e-4\n0.001,0.0002\n", DEPTH),
        ("position,width\n0,3e-4\n0.001,0.0002", DEPTH),
        ("position_mm,width_mm\n0,0.3\n1,0.2\n", DEPTH),
        ("position_mm,width_um\n0,300\n1,200\n", DEPTH),
        ("width_um,depth_um,position_um\n300,20,0\n200,20,1000\n", 20e-6),
        ("position,width,depth\n0,3e-4,2e-5\n0.001,0.0002,20e-6\n", 20e-6),
        ("\ufeffposition,width\r\n0,3e-4\r\n\r\n0.001,0.0002\r\n", DEPTH),
        ("position,width\r0,3e-4\r0.001,0.0002\r", DEPTH),
        ("# etched in copper, 2014\n\nposition,width\n0,3e-4\n  # broken here\n0.001,0.0002\n", DEPTH),
        ("\ufeff# by the manufacturer\nposition,width\n0,3e-4\n0.001,0.0002\n", DEPTH),
        (' position , width\n 0,\t3e-4\n"0.001","0.0002"\n', DEPTH),
    ],
    ids=[
        "metres",
        "no last newline",
        "mm",
        "mm and µm",
        "another order",
        "depth",
        "BOM, CRLF, blank line",
        "CR",
        "comments",
        "comment behind a BOM",
        "spaces and quotes",
    ],
)
def test_one_texture_has_many_spellings(tmp_path, content, depth):
    texture = read_gaps(written(tmp_path, content))
    assert_same_bits(texture, Gaps(position=np.array([0, 1e-3]), width=np.array([3e-4, 2e-4]), depth=depth))


# what is refused


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", ("too-few", "texture.csv")),
        ("\ufeff\r\n# nothing\r\n", ("too-few", "texture.csv")),
        ("position,width\n", ("too-few", "texture.csv")),
        ("0,3e-4\n0.001,2e-4\n", ("unknown", "texture.csv, line 1")),
        ("position;width\n0;3e-4\n", ("format", "texture.csv, line 1")),
        ("position,widht\n0,3e-4\n", ("unknown", "texture.csv, line 1")),
        ("Position,width\n0,3e-4\n", ("unknown", "texture.csv, line 1")),
        ("position [mm],width\n0,3e-4\n", ("unknown", "texture.csv, line 1")),
        ("position,width,depht\n0,3e-4,1e-5\n", ("unknown", "texture.csv, line 1")),
        ("position,width,\n0,3e-4,\n", ("unknown", "texture.csv, line 1")),
        ("position\n0\n", ("missing", "texture.csv, line 1")),
        ("# me\nwidth,depth\n3e-4,1e-5\n", ("missing", "texture.csv, line 2")),
        ("position,width,width\n0,3e-4,3e-4\n", ("missing", "texture.csv, line 1")),
        ("position,width,width_mm\n0,3e-4,0.3\n", ("missing", "texture.csv, line 1")),
        ("position,width\n0,3e-4\n1e-3\n", ("shape", "texture.csv, line 3")),
        ("position,width\n# two\n0,3e-4,\n", ("shape", "texture.csv, line 3")),
        ("position,width\n0,3e-4\nposition,width\n1e-3,3e-4\n", ("format", "texture.csv, line 3, position")),
        ("position,width\n0,wide\n", ("format", "texture.csv, line 2, width")),
        ("position,width\n0,\n", ("format", "texture.csv, line 2, width")),
        ("position,width\n1_0,1e-4\n", ("format", "texture.csv, line 2, position")),
        ("position,width\nnan,1e-4\n", ("format", "texture.csv, line 2, position")),
        ("position,width\n0,-inf\n", ("format", "texture.csv, line 2, width")),
        ("position,width\n0,1e999\n", ("format", "texture.csv, line 2, width")),
        ("position,width\n0,0\n", ("range", "texture.csv, line 2, width")),
        ("position,width_mm\n0,-0.3\n", ("range", "texture.csv, line 2, width")),
        ("position,width\n1e-3,3e-4\n0,3e-4\n", ("range", "texture.csv, line 3, position")),
        ("position,width\n0,3e-4\n\n0,3e-4\n", ("range", "texture.csv, line 4, position")),
        ("position,width\n0,3e-4\n2e-4,3e-4\n", ("range", "texture.csv, line 3, position")),
        ("position,width\n0,0.03125\n0.03125,1e-4\n", ("range", "texture.csv, line 3, position")),
        ("position,width\n0,0.3\n1,0.2\n", ("range", "texture.csv, line 2, width")),
        ("position,width\n0,3e-4\n35,3e-4\n", ("range", "texture.csv, line 3, position")),
        ("position,width,depth\n0,3e-4,35\n", ("range", "texture.csv, line 2, depth")),
        ("position,width,depth\n0,3e-4,0\n", ("range", "texture.csv, line 2, depth")),
        ("position,width,depth\n0,3e-4,1e-5\n1,3e-4,2e-5\n", ("range", "texture.csv, line 3, depth")),
        (b"\xff\xd8\xff\xe0\x00\x10", ("format", "texture.csv")),
        ("position,width\n0,3e-4\n".encode("utf-16"), ("format", "texture.csv")),
        ("position,width\n0,3e-4\n".encode("utf-16-le"), ("unknown", "texture.csv, line 1")),
        ("position,width\n0," + "1" * 200_000, ("format", "texture.csv")),
        (bytes(1000), ("unknown", "texture.csv, line 1")),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path, content, message):
    with refusal(*message) as refused:
        read_gaps(written(tmp_path, content))
    assert "texture.csv" in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1
    assert len(str(refused.value)) < 300 + len(str(tmp_path))


@pytest.mark.parametrize("name", ["absent.csv", "."])
def test_what_is_no_file_is_refused(tmp_path, name):
    with refusal("missing"):
        read_gaps(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read all")
def test_forbidden_file_is_refused(tmp_path):
    path = written(tmp_path, "position,width\n0,3e-4\n")
    path.chmod(0)
    with refusal("format", "texture.csv") as caught:
        read_gaps(path)
    assert caught.value.rule.startswith("could not be read")


CELLS = st.sampled_from(["0", "1e-3", "-1", "nan", "1e308", "-1e-320", "", " ", '"', "#", "\0", "1_0", "٣", "\u2028"])
WORDS = st.sampled_from(["position", "width", "depth", "position_mm", "width_um", "depth_um", "wdth"])
LINES = st.lists(st.lists(CELLS | st.floats().map(repr), max_size=4).map(",".join), max_size=5)
TABLES = st.builds(lambda header, lines: "\n".join([",".join(header), *lines]), st.lists(WORDS, max_size=4), LINES)


@same_folder
@given(st.binary() | st.text().map(str.encode) | TABLES.map(str.encode))
def test_any_file_is_a_texture_or_refused_in_one_line(tmp_path, content):
    path, refusal = written(tmp_path, content), None
    try:
        texture = read_gaps(path)
    except InputError as error:
        refusal = str(error)
    if refusal is None:
        write_gaps(texture, path)
        assert_same_bits(read_gaps(path), texture)
    else:
        assert refusal.startswith(str(path))
        assert len(refusal.splitlines()) == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("Position_mm,Width_mm\n1,0.3\n", ("unknown", "texture.csv, line 1")),
        (
            "position;width\n0.001;0.0003\n",
            ("format", "texture.csv, line 1"),
        ),
    ],
)
def test_headers_of_other_habits_are_known_for_gaps_and_told_what_to_write(tmp_path, content, message):
    path = written(tmp_path, content)
    assert holds_gaps(path)
    with refusal(*message):
        read_gaps(path)
