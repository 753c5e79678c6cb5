"""The file of edits: what is written is read, and what does not fit is refused in one line."""

import json

import pytest
from refusals import refusal

from vibrissa.video.correct.edit_file import EditedMovie, edit_path, read_edits, write_edits
from vibrissa.video.correct.edits import Edit, LinePoint

MOVIE = EditedMovie("pad.mkv", 100, 640, 480)
AT, TO = LinePoint(3, 10.25, 20.5), LinePoint(99, 0.0, 479.0)
EDITS = [
    Edit(do="name", at=AT, whisker=3),
    Edit(do="name", at=AT, whisker=0, whole=True),
    Edit(do="mark", at=AT, whisker=12),
    Edit(do="join", at=AT, to=TO),
    Edit(do="split", at=TO),
    Edit(do="delete", at=AT, whole=True),
    Edit(do="delete", at=AT, alone=True),
    Edit(do="swap", frame=50, whiskers=(2, 1)),
    Edit(do="call", whisker=3, label="Ä 2"),
    Edit(do="call", whisker=3, label=""),
]


@pytest.fixture
def file(tmp_path):
    path = edit_path(tmp_path / "profile.nc")
    write_edits(path, MOVIE, EDITS)
    return path


def test_what_is_written_is_read(file):
    assert file.name == "profile.edits.json"
    assert read_edits(file, MOVIE) == EDITS
    assert read_edits(file, MOVIE._replace(name="renamed.mkv")) == EDITS
    write_edits(file, MOVIE, [])
    assert read_edits(file, MOVIE) == []
    assert [one.name for one in file.parent.iterdir()] == [file.name]


def test_edits_of_another_movie_are_refused(file):
    for other in ({"frames": 99}, {"width": 320}, {"height": 481}):
        with refusal("conflict", str(file)):
            read_edits(file, MOVIE._replace(**other))


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "1", '"edits"', "{}", '{"format": "vibrissa edits"}', b"\xff\xfe\x00", "[" * 2000]
)
def test_junk_is_refused(file, text):
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with refusal("format", str(file)):
        read_edits(file, MOVIE)


BAD = [
    ("format", 3),
    ("unknown", {"do": "paint"}),
    ("unknown", {"do": ["name"]}),
    ("missing", {"do": "name", "at": [3, 1, 1]}),
    ("unknown", {"do": "split", "at": [3, 1, 1], "whisker": 2}),
    ("unknown", {"do": "split", "at": [3, 1, 1], "whole": True}),
    ("format", {"do": "delete", "at": [3, 1, 1], "whole": 1}),
    ("format", {"do": "delete", "at": [3, 1, 1], "alone": "yes"}),
    ("conflict", {"do": "delete", "at": [3, 1, 1], "alone": True, "whole": True}),
    ("unknown", {"do": "name", "at": [3, 1, 1], "whisker": 1, "alone": True}),
    ("missing", {"do": "call", "whisker": 1}),
    *(("format", {"do": "call", "whisker": 1, "label": bad}) for bad in ("+", "12", "whisker 3", "a\nb", 41 * "a", 2)),
    *(("format", {"do": "call", "whisker": 1, "label": bad}) for bad in ("nan", "1e0", "-Inf", "1_0", "whisker NaN")),
    ("format", {"do": "split", "at": [3, 1]}),
    ("format", {"do": "split", "at": [3, 1, float("nan")]}),
    ("format", {"do": "split", "at": [3, "1", 1]}),
    ("format", {"do": "split", "at": [3, True, 2]}),
    ("format", {"do": "split", "at": [3, 1, False]}),
    ("range", {"do": "split", "at": [3.5, 1, 1]}),
    ("range", {"do": "split", "at": [-1, 1, 1]}),
    ("range", {"do": "mark", "at": [3, 1, 1], "whisker": True}),
    ("range", {"do": "mark", "at": [3, 1, 1], "whisker": -1}),
    ("format", {"do": "swap", "frame": 3, "whiskers": [1, 1]}),
    ("format", {"do": "swap", "frame": 3, "whiskers": 1}),
    ("format", {"do": "split", "at": [100, 1, 1]}),
    ("format", {"do": "swap", "frame": 100, "whiskers": [0, 1]}),
]


@pytest.mark.parametrize(("code", "edit"), BAD)
def test_a_bad_edit_is_refused_by_its_number(file, code, edit):
    values = json.loads(file.read_text())
    values["edits"][2] = edit
    file.write_text(json.dumps(values))
    with refusal(code) as caught:
        read_edits(file, MOVIE)
    assert "edit 3" in str(caught.value)


def test_a_file_of_a_later_version_and_one_that_is_missing(file):
    values = json.loads(file.read_text())
    file.write_text(json.dumps(values | {"version": 3}))
    with refusal("format", str(file), "3"):
        read_edits(file, MOVIE)
    file.unlink()
    with refusal("missing", str(file)):
        read_edits(file, MOVIE)
