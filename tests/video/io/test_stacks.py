"""TIFF stacks of several axes: refused with their axes; one axis of times or planes is a movie."""

import numpy as np
import pytest
import tifffile

from vibrissa.errors import FormatError, ShapeError
from vibrissa.video.io.movie import open_movie, read_blocks


def frames(*shape: int) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 255, (*shape, 12, 16)).astype(np.uint8)


@pytest.mark.parametrize(
    ("axes", "shape", "found"),
    [
        ("TZYX", (3, 2), "3 times × 2 planes"),
        ("TCYX", (3, 2), "3 times × 2 channels"),
        ("CYX", (3,), "3 channels"),
        ("TZCYX", (2, 3, 2), "2 times × 3 planes × 2 channels"),
    ],
)
@pytest.mark.parametrize("kind", ["imagej", "ome"])
def test_several_axes_are_refused_with_their_names(tmp_path, kind, axes, shape, found):
    path = tmp_path / ("s.ome.tif" if kind == "ome" else "s.tif")
    tifffile.imwrite(path, frames(*shape), metadata={"axes": axes}, **{kind: True})
    with pytest.raises(ShapeError, match=rf"must have frames along one axis, of times, got {found}; save"):
        open_movie(path)


def test_a_stack_of_a_plain_array_of_four_dimensions_is_refused(tmp_path):
    tifffile.imwrite(tmp_path / "s.tif", frames(3, 2))
    with pytest.raises(ShapeError, match=r"3 of axis . × 2 of axis ."):
        open_movie(tmp_path / "s.tif")


@pytest.mark.parametrize("axes", ["TYX", "ZYX"])
@pytest.mark.parametrize("kind", ["imagej", "ome"])
def test_one_axis_is_a_movie(tmp_path, kind, axes):
    path, made = tmp_path / ("s.ome.tif" if kind == "ome" else "s.tif"), frames(5)
    tifffile.imwrite(path, made, metadata={"axes": axes}, **{kind: True})
    np.testing.assert_array_equal(np.concatenate(list(read_blocks(path))), made)


def test_several_series_of_ome_are_refused(tmp_path):
    path = tmp_path / "s.ome.tif"
    with tifffile.TiffWriter(path, ome=True) as writer:
        for _ in range(2):
            writer.write(frames(3), metadata={"axes": "TYX"})
    with pytest.raises(ShapeError, match="must have one series of images, got 2 of OME"):
        open_movie(path)


def test_pages_of_voxels_are_refused(tmp_path):
    path = tmp_path / "s.tif"
    tifffile.imwrite(
        path, np.zeros((3, 32, 32), np.uint8), volumetric=True, tile=(16, 16, 16), photometric="minisblack"
    )
    with pytest.raises(ShapeError, match=r"must have pages of rows and columns alone, got \(3, 32, 32\)"):
        open_movie(path)


def test_a_page_that_decodes_to_another_shape_is_refused(tmp_path, monkeypatch):
    """Tifffile gives an empty array for some damaged tags; all pages alike, they would be frames without a pixel."""
    path = tmp_path / "s.tif"
    tifffile.imwrite(path, frames(4), compression="zlib", photometric="minisblack", metadata=None)
    monkeypatch.setattr(tifffile.TiffPage, "asarray", lambda page: np.zeros(0, np.uint8))
    monkeypatch.setattr(tifffile.TiffFrame, "asarray", lambda page: np.zeros(0, np.uint8))
    with pytest.raises(FormatError, match=r"its shape is \(0,\), not \(12, 16\)"):
        list(read_blocks(path))
