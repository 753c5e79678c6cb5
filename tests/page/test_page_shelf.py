"""Files dropped on the page: read as `scan` reads them, refused in one line by the name they were dropped by."""

from pathlib import Path

import numpy as np
import pytest

from vibrissa.errors import InputError
from vibrissa.page.shelf import KEPT, LARGEST, Shelf

EXAMPLES = Path(__file__).parents[2] / "examples"
GAPS = b"position_mm,width_um\n1,300\n2,250\n"


def test_gaps_and_heights_are_kept_under_their_key():
    shelf = Shelf()
    key, _ = shelf.put("gaps.csv", GAPS, {})
    np.testing.assert_allclose(shelf.get(key).width, [3e-4, 2.5e-4])
    key, notes = shelf.put("ridges.csv", (EXAMPLES / "ridges.csv").read_bytes(), {})
    assert shelf.get(key).height.size > 10
    assert notes


def test_what_a_file_leaves_open_is_asked_for_and_settled():
    shelf, bare = Shelf(), b"".join(b"%g %g\n" % (x, 0.01 * np.sin(5 * x)) for x in np.arange(0, 5, 0.01))
    with pytest.raises(InputError, match=r"^bare\.txt must state its units"):
        shelf.put("bare.txt", bare, {})
    key, _ = shelf.put("bare.txt", bare, {"x_unit": "mm", "z_unit": "mm"})
    assert shelf.get(key).position[-1] == pytest.approx(4.99e-3)
    flipped, _ = shelf.put("bare.txt", bare, {"x_unit": "mm", "z_unit": "mm", "flip": "1"})
    assert flipped != key
    np.testing.assert_allclose(shelf.get(flipped).height, shelf.get(key).height[::-1], atol=1e-15)


@pytest.mark.parametrize(
    "content",
    [b"", b"\x00\xff" * 100, b"position_mm,width_um\n1,nan\n", b"position_mm,width_um\n", b"<html>", b"\x93NUMPY\x01"],
)
def test_a_bad_file_is_one_line_with_its_name_and_no_place_of_this_machine(content):
    with pytest.raises(InputError) as told:
        Shelf().put("my texture.csv", content, {})
    assert str(told.value).startswith("my texture.csv")
    assert "\n" not in str(told.value)
    assert "/" not in str(told.value).replace("I/O", "")


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "C:\\boot\\gaps.csv", "/etc/shadow", "a\x00b\n.csv", "x" * 9999, ""]
)
def test_a_name_is_no_path(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shelf = Shelf()
    key, _ = shelf.put(name, GAPS, {})
    assert shelf.get(key).width.size == 2
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError) as told:
        shelf.put(name, b"", {})
    assert "/" not in str(told.value)
    assert "\\" not in str(told.value)


def test_too_large_a_file_is_refused_unread():
    with pytest.raises(InputError, match="must have 1 to"):
        Shelf().put("large.csv", bytes(LARGEST + 1), {})


def test_the_last_files_are_kept():
    shelf = Shelf()
    keys = [shelf.put(f"{i}.csv", GAPS, {})[0] for i in range(KEPT + 1)]
    with pytest.raises(InputError, match="must be dropped on the page"):
        shelf.get(keys[0])
    assert shelf.get(keys[1]).width.size == 2
