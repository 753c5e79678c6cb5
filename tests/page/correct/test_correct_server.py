"""The page to correct tracks, without a browser: what the server gives, keeps and refuses; files in and out."""

import http.client
import json
import struct
import urllib.error
import urllib.parse
import urllib.request
from threading import Thread
from types import SimpleNamespace

import numpy as np
import pytest
from corrected_pad import make_pad, served_pad
from refusals import refusal

from vibrissa.errors import MachineError
from vibrissa.netcdf import load, save
from vibrissa.page.correct.correcting import correct_on_page
from vibrissa.video.correct.edit_file import read_edits
from vibrissa.video.correct.opening import open_tracks

FRAMES = 120


@pytest.fixture(scope="module")
def pad(tmp_path_factory):
    return make_pad(tmp_path_factory.mktemp("pad"), FRAMES)


@pytest.fixture
def page(pad, tmp_path):
    with served_pad(pad, tmp_path / "out.nc") as served:
        yield served
    served.edits.unlink(missing_ok=True)


def unpacked(content):
    (length,) = struct.unpack_from("<I", content)
    facts = json.loads(content[4 : 4 + length])
    place, arrays = 4 + length, {}
    for name, shape in facts.pop("arrays"):
        count = int(np.prod(shape))
        arrays[name] = np.frombuffer(content, "<f4", count, place)
        place += 4 * count
    assert place == len(content)
    return facts, arrays


def get(page, place):
    with urllib.request.urlopen(page.root + place) as reply:
        return reply.read()


def post(page, place, values):
    body = values if isinstance(values, bytes) else json.dumps(values).encode()
    try:
        origin = "/".join(page.root.split("/")[:3])
        with urllib.request.urlopen(urllib.request.Request(page.root + place, body, {"Origin": origin})) as reply:
            return reply.status, reply.read()
    except urllib.error.HTTPError as error:
        return error.code, json.loads(error.read())["error"]


def line_of(arrays, whisker, frame):
    """Line of a whisker in a frame, or soon after."""
    return int(np.flatnonzero((arrays["whisker"] == whisker) & (arrays["frame"] >= frame))[0])


def test_lines_frames_and_files_are_given(page, pad):
    facts, arrays = unpacked(get(page, "lines"))
    segments = load(pad.segments)
    assert (facts["frames"], facts["whiskers"], facts["edits"]) == (FRAMES, 6, 0)
    np.testing.assert_array_equal(arrays["frame"], segments.segment_frame.values)
    for s in (0, 400):  # a thinned line ends where the whole one does
        size = np.diff(np.append(segments.segment_start.values, segments.sizes["point"]))
        ends = segments.segment_start.values[s] + np.array([0, size[s] - 1])
        drawn = int(arrays["start"][s]), int(arrays["start"][s + 1]) - 1
        shown = sorted(arrays["column"][list(drawn)].tolist())
        np.testing.assert_allclose(shown, sorted(segments.column.values[ends]), atol=1e-3)
    image = np.frombuffer(get(page, "frame/7"), np.uint8)
    assert image.size == 640 * 480
    assert set(np.unique(image)) == {90, 190}
    for name in ("", "correct.js", "correct.css", "messages.js"):
        assert get(page, name)


def test_an_edit_holds_at_once_and_the_file_has_it(page):
    _, arrays = unpacked(get(page, "lines"))
    line = line_of(arrays, 2, 60)
    code, content = post(page, "edit", {"do": "name", "at": line, "whisker": 4})
    facts, edited = unpacked(content)
    assert (code, facts["edits"]) == (200, 1)
    assert facts["said"].startswith("The piece of whisker 2")
    assert edited["whisker"][line] == 4
    assert [one.do for one in read_edits(page.edits, page.opened.movie)] == ["name"]
    facts, undone = unpacked(post(page, "undo", {})[1])
    assert facts["said"].startswith("Undone: the piece of whisker 2")
    assert (facts["edits"], facts["undone"]) == (0, 1)
    np.testing.assert_array_equal(undone["whisker"], arrays["whisker"])
    assert read_edits(page.edits, page.opened.movie) == []
    _, again = unpacked(post(page, "redo", {})[1])
    np.testing.assert_array_equal(again["whisker"], edited["whisker"])


def test_an_answer_says_which_whisker_was_only_called_otherwise(page):
    asked = [("edit", {"do": "call", "whisker": 3, "label": "C2"}), ("undo", {}), ("redo", {})]
    facts = [unpacked(post(page, *one)[1])[0] for one in asked]
    assert [(one["did"], one["called"]) for one in facts] == [("edit", 3), ("undo", 3), ("redo", 3)]
    named = {"do": "name", "at": line_of(unpacked(get(page, "lines"))[1], 2, 60), "whisker": 4}
    assert unpacked(post(page, "edit", named)[1])[0]["called"] is None


BAD = [
    ("edit", {"do": "name", "at": -1, "whisker": 1}, 422, "at must be a line"),
    ("edit", {"do": "name", "at": 1.5, "whisker": 1}, 422, "at must be a line"),
    ("edit", {"do": "name", "at": 10**9, "whisker": 1}, 422, "at must be a line"),
    ("edit", {"do": "name", "at": 5, "whisker": 99}, 422, "whisker must be one of"),
    ("edit", {"do": "paint"}, 422, "edit, do must be one of"),
    ("edit", {}, 422, "edit, do must be one of"),
    ("undo", {}, 422, "undo must follow an edit"),
    ("redo", {}, 422, "redo must follow an undo"),
    ("fly", {}, 422, "request must be one of"),
    ("edit", b"{", 400, "what is sent must be JSON"),
    ("edit", b"[1]", 400, "what is sent must be an object"),
    ("edit", b"[" * 3000, 400, "what is sent must be JSON"),
]


@pytest.mark.parametrize(("place", "values", "code", "line"), BAD)
def test_what_cannot_be_is_one_line_and_nothing_is_written(page, place, values, code, line):
    found, error = post(page, place, values)
    assert found == code
    assert error.startswith(line)
    assert "\n" not in error
    assert not page.edits.exists()


def test_frames_beyond_the_end_and_strangers(page):
    for place in ("frame/120", "frame/-1", "frame/x", "../pyproject.toml", "secret"):
        with pytest.raises(urllib.error.HTTPError):
            get(page, place)
    address = urllib.parse.urlparse(page.root)
    line = http.client.HTTPConnection(address.hostname, address.port)
    own = address.netloc
    for path, headers in (
        ("/", {"Host": own}),
        (address.path, {"Host": "evil.example"}),
        (address.path, {"Host": own, "Origin": "http://evil.example"}),
        (address.path, {"Host": own, "Origin": "null"}),
    ):
        for method in ("GET", "POST"):
            line.request(method, path, headers=headers)
            reply = line.getresponse()
            reply.read()
            assert reply.status == 404, (path, headers)
    headers = {"Host": own, "Origin": f"http://{own}", "Content-Length": str(1 << 30)}
    line.request("POST", address.path + "edit", headers=headers)
    assert line.getresponse().status == 400
    line.close()


def test_the_profile_that_is_saved_has_the_names_by_hand(page, pad):
    """A whisker that is deleted is gone; nodes of the others are where they were."""
    before = load(pad.profile)
    _, arrays = unpacked(get(page, "lines"))
    post(page, "edit", {"do": "delete", "at": line_of(arrays, 3, 60), "whole": True})
    post(page, "edit", {"do": "swap", "frame": 0, "whiskers": [0, 5]})
    code, said = post(page, "save", {})
    assert code == 200
    assert str(page.out) in said.decode()
    assert said.decode().endswith("; whisker 4 is 3 in it, 5 is 4 in it")
    after = load(page.out)
    assert after.sizes["whisker"] == 5
    assert json.loads(after.attrs["identities"]) == [0, 1, 2, 4, 5]
    assert after.attrs["edits"] == 2
    for old, new in ((1, 1), (5, 0), (0, 4)):
        both = np.isfinite(before.x.values[old, :, :8]) & np.isfinite(after.x.values[new, :, :8])
        assert both.mean() > 0.6
        off = np.abs(before.x.values[old, :, :8] - after.x.values[new, :, :8])[both]
        assert np.median(off) < 1e-5


def test_correcting_again_starts_from_the_edits(page, pad, tmp_path):
    _, arrays = unpacked(get(page, "lines"))
    post(page, "edit", {"do": "name", "at": line_of(arrays, 2, 60), "whisker": 4})
    _, edited = unpacked(post(page, "edit", {"do": "split", "at": line_of(arrays, 1, 50)})[1])
    with served_pad(pad, tmp_path / "again.nc") as again:
        facts, arrays = unpacked(get(again, "lines"))
        assert facts["edits"] == 2
        assert any("2 edits" in line for line in again.said)
        np.testing.assert_array_equal(arrays["whisker"], edited["whisker"])
        np.testing.assert_array_equal(arrays["piece"], edited["piece"])


def test_the_verb_makes_edits_again_without_a_page(page, pad, tmp_path, vibrissa):
    _, arrays = unpacked(get(page, "lines"))
    post(page, "edit", {"do": "delete", "at": line_of(arrays, 3, 60), "whole": True})
    out = tmp_path / "verb.nc"
    words = ("correct", pad.profile, pad.movie, "--segments", pad.segments, "--no-page")
    code, _, err = vibrissa(*words, "--out", out)
    assert code == 0, err
    assert load(out).sizes["whisker"] == 5
    assert "1 edit of" in err
    post(page, "undo", {})
    code, _, err = vibrissa(*words, "--out", out)
    assert code == 0, err
    assert "there are no edits to make again" in err
    code, _, err = vibrissa(*words, "--edits", tmp_path / "none.json", "--out", out)
    assert code == 2
    assert "--edits must be an existing file with --no-page" in err
    code, _, err = vibrissa(*words, "--out", pad.profile)
    assert code == 2
    assert len(err.strip().splitlines()) == 1
    assert "--out must not be the profile" in err


def test_files_that_do_not_belong_together_are_refused(pad, tmp_path):
    def opened(**other):
        files = {"profile": pad.profile, "movie": pad.movie, "segments": pad.segments} | other
        open_tracks(**files, edits=tmp_path / "none.json", tell=print, progress=lambda *_: None)

    lines = load(pad.segments)
    far = tmp_path / "far.nc"
    save(lines.assign(column=lines.column + 500.0), far)
    with refusal("conflict", "segments"):
        opened(segments=far)
    other = tmp_path / "other.nc"
    save(lines.assign_attrs(typical_width=2.0, width=int(lines.width) + 2), other)
    with refusal("conflict", "segments"):
        opened(segments=other)
    late = tmp_path / "late.nc"
    save(lines.assign(segment_frame=lines.segment_frame + 100), late)
    with refusal("conflict", "segments"):
        opened(segments=late)
    with refusal("missing"):
        opened(segments=pad.profile)
    with refusal("missing"):
        opened(profile=pad.segments)
    with refusal("format"):
        opened(segments=pad.movie)


def test_an_edit_that_cannot_be_written_is_not_made(page, monkeypatch):
    """The disk is full: names stay, and what can be undone stays too."""
    facts, arrays = unpacked(get(page, "lines"))

    def refused(*_):
        raise MachineError("edits.json", "could not be written (No space left on device)")

    monkeypatch.setattr("vibrissa.page.correct.session.write_edits", refused)
    status, said = post(page, "edit", {"do": "delete", "at": line_of(arrays, 2, 20)})
    assert status != 200
    assert "No space left" in said
    after, same = unpacked(get(page, "lines"))
    assert after["edits"] == facts["edits"] == 0
    np.testing.assert_array_equal(same["whisker"], arrays["whisker"])


def call(whisker, label):
    return {"do": "call", "whisker": whisker, "label": label}


def test_two_programs_do_not_overwrite_the_edits_of_each_other(page, pad, tmp_path):
    with served_pad(pad, tmp_path / "other.nc") as other:
        for k in range(3):
            assert post(page, "edit", call(k, f"A{k}"))[0] == 200
        for place, values in (("edit", call(5, "B5")), ("save", {})):
            code, error = post(other, place, values)
            assert code == 422
            assert error.startswith(
                f"{page.edits} must hold the edits that this page last read or wrote, 0 edits, got 3"
            )
        assert unpacked(get(other, "lines"))[0]["edits"] == 0  # it answers, and what was refused is not made
        assert not other.out.exists()
        assert [one.label for one in read_edits(page.edits, page.opened.movie)] == ["A0", "A1", "A2"]
        assert post(page, "edit", call(3, "A3"))[0] == 200
    with served_pad(pad, tmp_path / "other.nc") as other:  # with what the first has written, the second goes on
        assert post(other, "undo", {})[0] == 200
        assert post(page, "undo", {})[0] == 422


def test_points_of_a_file_by_hand_are_no_edits_of_another_program(pad, tmp_path):
    """The file rounds places to a hundredth of a pixel."""
    with served_pad(pad, tmp_path / "out.nc") as page:
        _, arrays = unpacked(get(page, "lines"))
        post(page, "edit", {"do": "split", "at": line_of(arrays, 1, 50)})
        values = json.loads(page.edits.read_text())
    values["edits"][0]["at"][1] += 0.00123
    page.edits.write_text(json.dumps(values))
    with served_pad(pad, tmp_path / "out.nc") as again:
        assert post(again, "edit", call(2, "C2"))[0] == 200
        assert post(again, "edit", call(3, "C3"))[0] == 200
    again.edits.unlink()


def test_the_page_and_the_terminal_say_which_edits_the_saved_profile_lacks(page):
    moves = [("edit", call(1, "C1")), ("undo", {}), ("redo", {}), ("save", {}), ("edit", call(2, "C2")), ("undo", {})]
    found = []
    for move in moves:
        assert post(page, *move)[0] == 200
        found.append(unpacked(get(page, "lines"))[0]["unsaved"])
    assert found == [True, False, True, False, True, False]
    assert unpacked(post(page, "edit", call(2, "D2"))[1])[0]["unsaved"]


@pytest.mark.parametrize(
    ("moves", "line"),
    [
        ([], "no corrected profile was saved"),
        ([("edit", call(1, "C1")), ("save", {})], "the corrected profile is OUT"),
        ([("save", {}), ("edit", call(1, "C1"))], "the corrected profile is OUT, with other edits than those kept"),
    ],
)
def test_the_terminal_says_what_the_saved_profile_holds(page, pad, tmp_path, moves, line):
    out, said = tmp_path / "terminal.nc", []

    def hands(address):
        for place, values in [*moves, ("end", {})]:
            assert post(SimpleNamespace(root=address), place, values)[0] == 200

    def tell(text):
        if text.startswith("correct on the page"):
            said.append(Thread(target=hands, args=(text.split()[4],)))
            said[-1].start()

    last = correct_on_page(page.opened, pad.movie, page.edits, out, tell=tell, browser=False)
    said[0].join()
    assert last.startswith(line.replace("OUT", str(out)))
