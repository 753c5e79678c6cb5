"""Files dropped on the page: read as `scan` reads them, refused in one line by the name they were dropped by."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from vibrissa.page.incoming.upload_cache import KEPT, LARGEST, UploadCache

EXAMPLES = Path(__file__).parents[2] / "examples"
UNREADABLE = "format" if find_spec("SurfaceTopography") else "package"
GAPS = b"position_mm,width_um\n1,300\n2,250\n"


@pytest.fixture(scope="module")
def uploads():
    """One for tests that do not count what is kept: each has a process of its own that reads."""
    return UploadCache()


def test_gaps_and_heights_are_kept_under_their_key(uploads):
    key, _ = uploads.put("gaps.csv", GAPS, {})
    np.testing.assert_allclose(uploads.get(key).width, [3e-4, 2.5e-4])
    key, notes = uploads.put("ridges.csv", (EXAMPLES / "ridges.csv").read_bytes(), {})
    assert uploads.get(key).height.size > 10
    assert notes


def test_what_a_file_leaves_open_is_asked_for_and_settled(uploads):
    bare = b"".join(b"%g %g\n" % (x, 0.01 * np.sin(5 * x)) for x in np.arange(0, 5, 0.01))
    with refusal("missing", "bare.txt"):
        uploads.put("bare.txt", bare, {})
    key, _ = uploads.put("bare.txt", bare, {"x_unit": "mm", "z_unit": "mm"})
    assert uploads.get(key).position[-1] == pytest.approx(4.99e-3)
    flipped, _ = uploads.put("bare.txt", bare, {"x_unit": "mm", "z_unit": "mm", "flip": "1"})
    assert flipped != key
    np.testing.assert_allclose(uploads.get(flipped).height, uploads.get(key).height[::-1], atol=1e-15)


@pytest.mark.parametrize(
    ("content", "fields"),
    [
        (b"", ("range", "my texture.csv", "0")),
        (b"\x00\xff" * 100, (UNREADABLE, "my texture.csv")),
        (b"position_mm,width_um\n1,nan\n", ("format", "my texture.csv, line 2, width_um", "'nan'")),
        (b"position_mm,width_um\n", ("too-few", "my texture.csv", "an empty texture")),
        (b"<html>", (UNREADABLE, "my texture.csv")),
        (b"\x93NUMPY\x01", (UNREADABLE, "my texture.csv")),
    ],
)
def test_a_bad_file_is_one_line_with_its_name_and_no_place_of_this_machine(uploads, content, fields):
    with refusal(*fields) as told:
        uploads.put("my texture.csv", content, {})
    assert str(told.value).startswith("my texture.csv")
    assert "/" not in str(told.value).replace("I/O", "")


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "C:\\boot\\gaps.csv", "/etc/shadow", "a\x00b\n.csv", "x" * 9999, ""]
)
def test_a_name_is_no_path(uploads, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    key, _ = uploads.put(name, GAPS, {})
    assert uploads.get(key).width.size == 2
    assert not list(tmp_path.iterdir())
    with refusal("range") as told:
        uploads.put(name, b"", {})
    assert "/" not in str(told.value)
    assert "\\" not in str(told.value)


def test_too_large_a_file_is_refused_unread():
    with refusal("range", "large.csv"):
        UploadCache().put("large.csv", bytes(LARGEST + 1), {})


def test_the_last_files_are_kept():
    uploads = UploadCache()
    keys = [uploads.put(f"{i}.csv", GAPS, {})[0] for i in range(KEPT + 1)]
    with refusal("missing", "texture"):
        uploads.get(keys[0])
    assert uploads.get(keys[1]).width.size == 2


def test_a_file_that_is_dropped_or_looked_at_again_is_kept_longest():
    cache = UploadCache()
    first, second, *_ = [cache.put(f"{k}.csv", GAPS, {})[0] for k in range(KEPT)]
    cache.put("0.csv", GAPS, {})
    cache.get(second)
    for k in range(KEPT - 2):
        cache.put(f"new {k}.csv", GAPS, {})
    for key in (first, second):
        np.testing.assert_allclose(cache.get(key).width, [3e-4, 2.5e-4])
