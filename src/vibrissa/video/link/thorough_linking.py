"""Lines linked, cut where they go over from one whisker to another, and linked again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.video.link.agreement import CutLinking, best_and_others
from vibrissa.video.link.courses.cut_lines import cut_lines, cut_segments
from vibrissa.video.link.courses.doubtful_lines import doubtful_lines
from vibrissa.video.link.courses.parts import without_parts
from vibrissa.video.link.further_whiskers import name_further_whiskers
from vibrissa.video.link.pad.pieces import pieces_of
from vibrissa.video.link.still_whiskers import without_still
from vibrissa.video.link.whisker_linking import Linking, link_again, link_named, linkings

if TYPE_CHECKING:
    import xarray as xr

IDENTIFIED = "segment_whisker", "segment_other", "segment_probability"  # what is said of each line


def link_thoroughly(segments: xr.Dataset) -> tuple[xr.Dataset, Linking]:
    """Link the lines of a movie to whiskers, whatever lines a finder made of whiskers that cross.

    Where whiskers cross at a small angle, a line may begin as the one and end as the other. Lines are cut first where
    another line's end would go on more smoothly as their further part. Once whiskers are known, their courses show
    where lines go over: they are cut there, pieces of one whisker are put together, and all are linked again. What then
    has a separate name though it goes on as another whisker's lines do is no whisker. All this is done from three
    starts, the last step in two ways. Of these six linkings that is kept in which most points probably have the right
    name; each of its lines then has the name on which most of the six agree. Lines that have none are looked through
    for whiskers that all six have left out, see :mod:`vibrissa.video.link.further_whiskers`. In the end what
    does not swing with its pad has no name.

    Parameters
    ----------
    segments : Dataset
        ``segments``, as of :func:`vibrissa.video.link.whisker_linking.link_segments`; frames may count from its
        attribute ``first_frame``.

    Returns
    -------
    Dataset, Linking
        The lines after cutting, of the same points without those of short pieces; and their linking.

    Raises
    ------
    InputError
        If there are no lines.
    """
    doubtful = cut_segments(segments, doubtful_lines(pieces_of(counted_from_start(segments))))
    tries = [one for first in linkings(counted_from_start(doubtful)) for one in _cut_and_linked(doubtful, first)]
    each = [one for _, one in tries]
    best = best_and_others(each, doubtful.sizes["point"])
    name_further_whiskers(each[best].linking)
    without_still(each[best].linking)
    return tries[best][0], each[best].linking


def _cut_and_linked(segments: xr.Dataset, first: Linking) -> list[tuple[xr.Dataset, CutLinking]]:
    """Lines cut by the courses of whiskers that are known, and linked again."""
    if not first.whiskers:
        return [(segments, CutLinking(first, np.arange(segments.sizes["point"])))]
    cut = cut_lines(first)
    lines = cut_segments(segments, cut)
    return [(lines, CutLinking(without_parts(one), cut.points)) for one in link_again(counted_from_start(lines), first)]


def linked_before(segments: xr.Dataset) -> tuple[xr.Dataset, Linking]:
    """The linking of lines with the names that they have; lines without any are linked first.

    What several linkings agree on is in the names; another edit or mark does not ask them again.

    Parameters
    ----------
    segments : Dataset
        As of :func:`link_thoroughly`, perhaps with ``segment_whisker``.

    Returns
    -------
    Dataset, Linking
        Lines and their linking.
    """
    if "segment_whisker" not in segments or not (segments.segment_whisker.values >= 0).any():
        segments, linking = link_thoroughly(segments)
        identity = linking.identity()
        segments = segments.assign({name: identity[name] for name in IDENTIFIED})
    return segments, link_named(counted_from_start(segments))


def counted_from_start(segments: xr.Dataset) -> xr.Dataset:
    """Segments of a part of a movie whose frames count from the first that was searched, as linking takes them.

    Parameters
    ----------
    segments : Dataset
        ``segments``; its attribute ``first_frame`` is 0 if absent.

    Returns
    -------
    Dataset
        The same without that attribute.
    """
    frame = segments.segment_frame - int(segments.attrs.get("first_frame", 0))
    counted = segments.assign(segment_frame=frame.assign_attrs(segments.segment_frame.attrs))
    counted.attrs.pop("first_frame", None)
    return counted
