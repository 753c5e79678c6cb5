"""To look at tracking: a movie with the tracked nodes over its frames, and a sheet of a few frames."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import MissingError, RangeError
from vibrissa.figures.canvas import house_style, new_figure, round_length, whisker_names
from vibrissa.figures.colours import ON_PICTURE as COLOURS
from vibrissa.figures.colours import rgb
from vibrissa.figures.others.text_strip import LETTER, text_strip
from vibrissa.quantities import dataset
from vibrissa.quantities import measured as measured_nodes
from vibrissa.signals.frame_numbers import frame_numbers
from vibrissa.video.io.colour import write_colour

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Blocks = Iterable[NDArray[Any]]
Picture = NDArray[np.uint8]

WIDE = 640  # pixels a frame is magnified to, at least, by a whole factor
INSET = 40  # side of the part that is magnified [px]
FEW = len(COLOURS)  # whiskers up to which each has its colour; more are named at their lines
BOX = {"facecolor": "black", "alpha": 0.6, "pad": 1, "edgecolor": "none"}  # behind text on a picture
AT_TIP: dict[str, Any] = {"ha": "center", "va": "center", "color": "white", "fontsize": 8}  # look of a name there


def evenly(first: int, last: int, most: int) -> list[int]:
    """At most ``most`` numbers of frames, evenly from the first to the last.

    Parameters
    ----------
    first : int
        First frame.
    last : int
        Last frame.
    most : int
        How many at most.

    Returns
    -------
    list of int
        Rising.

    Raises
    ------
    InputError
        If the range is empty, or fewer than one is wanted.
    """
    if not 0 <= first <= last:
        raise RangeError("frames", "must be a first one from 0 on, and a last one not before it", (first, last))
    if most < 1:
        raise RangeError("most", "must be at least 1", most)
    return [int(k) for k in np.linspace(first, last, min(most, last - first + 1)).round()]


def write_preview(path: str | Path, blocks: Blocks, profile: xr.Dataset, frames: Sequence[int] | None = None) -> int:
    """Write the overlay movie, H.264 in MP4 or MKV, whole or not at all.

    Parameters
    ----------
    path : path
        File to write.
    blocks, profile, frames
        As in :func:`overlay`; 500 frames, evenly, by default.

    Returns
    -------
    int
        Number of frames written.
    """
    chosen = evenly(0, profile.sizes["time"] - 1, 500) if frames is None else frames
    return write_colour(path, overlay(blocks, profile, chosen))


def overlay(blocks: Blocks, profile: xr.Dataset, frames: Sequence[int]) -> Iterator[Picture]:
    """Frames of a movie with what was tracked in them.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays
        The movie, from the first frame of the profile on.
    profile : Dataset
        From :func:`vibrissa.video.tracking.track`, in the frame ``image``.
    frames : sequence of int
        Which frames of the profile, rising, from 0.

    Yields
    ------
    (height, width, 3) array
        Frame in grey, measured nodes in colour, names at the tips where colours repeat; below it the number of the
        frame, its time and the whiskers that are lost, with the reason.

    Raises
    ------
    InputError
        If the movie ends before the last of the frames.
    """
    (columns, rows), names = seen(profile), whisker_names(profile)
    lost = json.loads(profile.attrs.get("lost", "[]")) or [[]] * len(names)
    low, span, numbers = 0.0, 0.0, frame_numbers(profile)
    for index, (_, image) in zip(frames, chosen_frames(blocks, _places(profile, frames)), strict=True):
        if not span:
            low, span = float(image.min()), max(float(np.ptp(image)), 1.0)
        size = max(1, -(-WIDE // image.shape[1]))
        grey = np.clip((image.astype(np.float32) - low) * (255 / span), 0, 255).astype(np.uint8)
        picture = np.repeat(np.repeat(np.repeat(grey[..., None], 3, axis=2), size, axis=0), size, axis=1)
        for w in range(len(columns)):
            _dots(picture, columns[w, index], rows[w, index], size, rgb(w))
        for w in range(len(columns) if len(columns) > FEW else 0):
            _name(picture, columns[w, index], rows[w, index], size, names[w], rgb(w))
        title = f"frame {numbers[index]}   {float(profile.time[index]):.4f} s"
        yield np.concatenate([picture, *_captions(index, title, names, lost, picture.shape[1])])


def _places(profile: xr.Dataset, frames: Sequence[int]) -> list[int]:
    """Places of frames of a profile in its movie, from its first on: a selected part may leave frames out."""
    numbers = frame_numbers(profile)
    return [int(one) for one in numbers[list(frames)] - numbers.min()]


def chosen_frames(blocks: Blocks, frames: Sequence[int]) -> Iterator[tuple[int, NDArray[Any]]]:
    """Number and image of some frames of a movie, rising.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays
        The movie, from its first frame.
    frames : sequence of int
        Numbers of the frames, rising.

    Yields
    ------
    int, (height, width) array
        Number and image.

    Raises
    ------
    InputError
        If the movie ends before the last of them.
    """
    wanted, start = list(map(int, frames)), 0
    for block in blocks:
        while wanted and wanted[0] < start + len(block):
            yield wanted[0], block[wanted[0] - start]
            wanted.pop(0)
        start += len(block)
        if not wanted:
            return
    raise MissingError("movie", f"must have the frame {wanted[0]} that was tracked", f"{start} frames")


def seen(profile: xr.Dataset) -> tuple[Array, Array]:
    """Columns and rows of the measured nodes (whisker, time, node) [px]; NaN where none was measured.

    Parameters
    ----------
    profile : Dataset
        Nodes of the tracked whiskers.

    Returns
    -------
    columns, rows : arrays
        [px].
    """
    measured = measured_nodes(profile)
    pixel = profile.attrs["pixel_size"]
    return tuple(np.where(measured, profile[name].values / pixel, np.nan) for name in ("x", "y"))  # type: ignore[return-value]


def _dots(picture: Picture, columns: Array, rows: Array, size: int, ink: Any) -> None:
    """Squares of 3 × 3 pixels on the nodes; the whisker stays in sight between them."""
    ok = np.isfinite(columns)
    # the centre of the first pixel is (0, 0)
    at = np.array([np.floor((values[ok] + 0.5) * size) for values in (rows, columns)], int)
    for step in product((-1, 0, 1), repeat=2):
        r, c = at + np.array(step)[:, None]
        inside = (r >= 0) & (c >= 0) & (r < len(picture)) & (c < picture.shape[1])
        picture[r[inside], c[inside]] = ink


def _name(picture: Picture, columns: Array, rows: Array, size: int, name: str, ink: Any) -> None:
    """Name of a whisker at its tip, inside the picture."""
    ok = np.flatnonzero(np.isfinite(columns))
    if not ok.size:
        return
    text = name.removeprefix("whisker ")
    label = text_strip(text, LETTER * len(text) + 10, tuple(ink))
    tip = np.array([rows[ok[-1]], columns[ok[-1]]]) * size
    room = np.subtract(picture.shape[:2], label.shape[:2])
    top, left = np.clip(tip - np.array(label.shape[:2]) / 2, 0, np.maximum(room, 0)).astype(int)
    part = picture[top : top + label.shape[0], left : left + label.shape[1]]
    part[...] = label[: part.shape[0], : part.shape[1]]


def _captions(index: int, title: str, names: list[str], lost: list[Any], width: int) -> list[Picture]:
    """A strip of text for the frame, and one for each whisker, so that the size stays."""
    strips = [text_strip(title, width, (255, 255, 255))]
    for w, name in enumerate(names):
        reason = next((why for first, last, why in lost[w] if first <= index <= last), None)
        strips.append(text_strip(f"{name}: lost, {reason}" if reason else f"{name}: followed", width, tuple(rgb(w))))
    return strips


def compute(blocks: Blocks, profile: xr.Dataset, frames: Sequence[int] | None = None) -> xr.Dataset:
    """Images and measured centrelines of a few frames.

    Parameters
    ----------
    blocks, profile, frames
        As in :func:`overlay`, frames in any order; six, evenly, by default.

    Returns
    -------
    Dataset
        ``image`` (time, image_row, image_column), ``line_column`` and ``line_row`` (time, whisker, node) [pixels].
    """
    chosen = evenly(0, profile.sizes["time"] - 1, 6) if frames is None else list(frames)
    places, numbers = _places(profile, chosen), frame_numbers(profile)[chosen].tolist()
    pictures = dict(chosen_frames(blocks, sorted(set(places))))
    images = np.stack([pictures[place] for place in places])
    columns, rows = (np.moveaxis(values[:, chosen], 0, 1) for values in seen(profile))
    attrs = {"names": json.dumps(whisker_names(profile)), "frames": json.dumps(numbers)}
    attrs["pixel_size"] = profile.attrs["pixel_size"]
    when = {"time": profile.time.values[chosen]}
    row, column = map(np.arange, images.shape[1:])
    stills = dataset(attrs, lead=("time",), **when, image_row=row, image_column=column, image=images)
    named = when | {"whisker": profile.whisker.values}
    lines = dataset(lead=("time", "whisker"), **named, line_column=columns, line_row=rows)
    return stills.merge(lines, combine_attrs="override")


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Sheet of frames with their centrelines, in columns and rows of pixels, and a scale bar in the first.

    A part of each frame is magnified, with the nodes; more than six whiskers are named at their tips instead.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    few = data.sizes["whisker"] <= FEW
    most, wide = (3, 3.4) if few else (2, 5.1)
    count, across = data.sizes["time"], min(most, data.sizes["time"])
    down = -(-count // across)
    shape = data.sizes["image_row"] / data.sizes["image_column"]
    figure, axes = new_figure(wide * across, (wide * shape + 0.35) * down + 0.4, down, across)
    names, frames = json.loads(data.attrs["names"]), json.loads(data.attrs["frames"])
    span = {"vmin": float(data.image.values.min()), "vmax": float(data.image.values.max())}
    for panel in axes.flat[count:]:
        panel.set_axis_off()
    for k, panel in enumerate(axes.flat[:count]):
        title = f"frame {frames[k]}, {float(data.time[k]):.4f} s"
        if few:
            _panel(panel, data.isel(time=k), names, span)
        else:
            shown = _named_panel(panel, data.isel(time=k), names, span)
            title += f": {shown} of {len(names)} whiskers"
        panel.set_title(title)
        panel.set(xlim=(-0.5, data.sizes["image_column"] - 0.5), ylim=(data.sizes["image_row"] - 0.5, -0.5))
        panel.tick_params(labelsize=5, length=2, labelleft=k % across == 0, labelbottom=k + across >= count)
    axes.flat[0].set_ylabel("row [px]", fontsize=6)
    axes.flat[count - 1].set_xlabel("column [px]", fontsize=6)
    _scale_bar(axes.flat[0], data)
    if few:
        figure.legend(axes.flat[0].lines[: len(names)], names, loc="outside lower center", ncols=min(6, len(names)))
    return figure


def _named_panel(panel: Any, data: xr.Dataset, names: list[str], span: dict[str, float]) -> int:
    """A frame whose whiskers are named at their tips; how many are seen."""
    columns, rows = data.line_column.values, data.line_row.values
    panel.imshow(data.image.values, **span)
    seen = np.flatnonzero(np.isfinite(columns).any(axis=1))
    for w in seen:
        ink = COLOURS[w % len(COLOURS)]
        panel.plot(columns[w], rows[w], color=ink, lw=0.8)
        tip = np.flatnonzero(np.isfinite(columns[w]))[-1]
        look = AT_TIP | {"bbox": BOX | {"edgecolor": ink}}
        panel.text(columns[w, tip], rows[w, tip], names[w].removeprefix("whisker "), clip_on=True, **look)
    return int(seen.size)


def _panel(panel: Any, data: xr.Dataset, names: list[str], span: dict[str, float]) -> None:
    image, columns, rows = data.image.values, data.line_column.values, data.line_row.values
    panel.imshow(image, **span)
    for w in range(len(columns)):
        panel.plot(columns[w], rows[w], color=COLOURS[w % len(COLOURS)], lw=1.0)
    measured = np.flatnonzero(np.isfinite(columns).any(axis=1))
    for k, w in enumerate(sorted(set(range(len(columns))) - {*measured.tolist()})):
        look = {"color": COLOURS[w % len(COLOURS)], "va": "top", "bbox": BOX}
        panel.text(0.02, 0.98 - 0.09 * k, f"{names[w]} not seen", transform=panel.transAxes, **look)
    if len(measured):
        _inset(panel, data, int(measured[0]), span)


def _inset(panel: Any, data: xr.Dataset, whisker: int, span: dict[str, float]) -> None:
    """The middle of a whisker magnified, in the corner farthest from the whiskers."""
    columns, rows = data.line_column.values, data.line_row.values
    nodes = np.flatnonzero(np.isfinite(columns[whisker]))
    c, r = columns[whisker, nodes[len(nodes) // 2]], rows[whisker, nodes[len(nodes) // 2]]
    size = data.sizes["image_column"], data.sizes["image_row"]
    corners = [(0.02, 0.02), (0.63, 0.02), (0.02, 0.60), (0.63, 0.60)]  # of a box of 0.35 × 0.38
    middles = [((x + 0.175) * size[0], (1 - y - 0.19) * size[1]) for x, y in corners]
    ok = np.isfinite(columns)
    room = [np.hypot(columns[ok] - x, rows[ok] - y).min() for x, y in middles]
    inset = panel.inset_axes([*corners[int(np.argmax(room))], 0.35, 0.38])
    inset.imshow(data.image.values, **span)
    for w in range(len(columns)):
        inset.plot(columns[w], rows[w], ".", color=COLOURS[w % len(COLOURS)], ms=3)
    half = INSET / 2
    inset.set(xlim=(c - half, c + half), ylim=(r + half, r - half), xticks=[], yticks=[])
    for side in inset.spines.values():
        side.set(visible=True, color="white")
    panel.plot(c + half * np.array([-1, 1, 1, -1, -1]), r + half * np.array([-1, -1, 1, 1, -1]), "w-")


def _scale_bar(panel: Any, data: xr.Dataset) -> None:
    """A bar of a round length near a quarter of the width, at the bottom."""
    length = round_length(data.sizes["image_column"] * data.attrs["pixel_size"] / 4)
    pixels = length / data.attrs["pixel_size"]
    left, row = 0.5 * (data.sizes["image_column"] - pixels), 0.96 * data.sizes["image_row"]
    for ink, thick in (("black", 4.5), ("white", 2.5)):
        panel.plot([left, left + pixels], [row, row], color=ink, lw=thick, solid_capstyle="butt")
    panel.text(left + pixels / 2, row - 6, f"{1e3 * length:g} mm", color="white", ha="center", va="bottom", bbox=BOX)
