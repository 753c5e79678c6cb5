"""All lines of a movie linked to whiskers that keep their names: the way in."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, TooFewError
from vibrissa.head_pose import HeadPose, head_of
from vibrissa.quantities import dataset
from vibrissa.video.link.agreed_names import Others, agreed
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.identities import REASONS, Names, names_of
from vibrissa.video.link.line_at import line_at
from vibrissa.video.link.names_by_base import named_by_base
from vibrissa.video.link.names_in_gaps import named_in_gaps
from vibrissa.video.link.pad.pad_finding import find_pads, pads_of_lines
from vibrissa.video.link.pad.pad_motion import motion_of
from vibrissa.video.link.pad.pads import Lines, Pad, lines_of
from vibrissa.video.link.pad.pieces import Pieces, novelty, pieces_of
from vibrissa.video.link.pad.placing import in_head, linking_size, resized
from vibrissa.video.link.pad_linking import link_pad, link_pad_again, link_pad_named, stretches

if TYPE_CHECKING:
    import xarray as xr


MOTIONS = 4  # times that the motion of the head is found: where it is known, more lines show it


@dataclass
class Linking:
    """A movie whose lines are linked; :meth:`identity` gives the result.

    Attributes
    ----------
    pieces : Pieces
        Segments of the movie.
    pads : list of Pad
        Pads, one for each side of the face.
    lines : Lines
        Segments in the coordinates of their pads.
    solutions : list of Solution
        Whiskers of each pad; they are numbered through over the pads.
    size : float
        At which lines are linked, over that in the image, see :func:`vibrissa.video.link.pad.placing.linking_size`.
    head : HeadPose, optional
        The head, where it is given.
    motion : HeadPose, optional
        In whose coordinates pads and lines are: of the head, or as the lines show it; those of the image if None.
    others : Others, optional
        What other linkings of the same lines say.
    """

    pieces: Pieces
    pads: list[Pad]
    lines: Lines
    solutions: list[Solution]
    size: float = field(kw_only=True)
    head: HeadPose | None = field(default=None, kw_only=True)
    motion: HeadPose | None = field(default=None, kw_only=True)
    others: Others | None = field(default=None, kw_only=True)

    @property
    def placed(self) -> Pieces:
        """Segments in the coordinates of the pads."""
        return resized(in_head(self.pieces, self.motion), self.size)

    @property
    def whiskers(self) -> int:
        """Number of whiskers found."""
        return sum(len(one.labels) for one in self.solutions)

    def names(self) -> list[Names]:
        """Names in each pad, as its whiskers are numbered there."""
        out, first = [], 0
        for n, one in enumerate(self.solutions):
            names, stop = names_of(one, self.lever(n)), first + len(one.labels)
            if self.others is not None:
                votes = self.others.votes[:, [*range(first, stop), -1]]
                names = agreed(names, one, Others(votes, self.others.linkings))
                names = named_in_gaps(named_by_base(names, one, self.base(n)), one)
            out.append(names)
            first = stop
        return out

    @property
    def right_length(self) -> float:
        """Points that probably have the right name, less those that probably have a wrong one."""
        points = self.pieces.stop - self.pieces.start
        each = ((2 * one.sure - 1) * points * (one.whisker >= 0) for one in self.names())
        return float(sum(one.sum() for one in each))

    def base(self, pad: int) -> Array:
        """Where each segment begins, along the radius of a pad and across it [px, at the size of linking] (S, 2)."""
        placed, one = self.placed, self.pads[pad]
        first = np.where(self.lines.turned, placed.stop - 1, placed.start)
        return np.stack(one.pixels(placed.column[first], placed.row[first]), axis=1)

    def lever(self, pad: int) -> Array:
        """How far whiskers of a pad move at the three radii."""
        return self.solutions[pad].lever

    def nearest(self, frame: int, column: float, row: float) -> int:
        """Segment that a point lies on.

        Parameters
        ----------
        frame : int
            Frame.
        column, row : float
            The point [px, of the movie as the user sees it].

        Returns
        -------
        int
            The segment.

        Raises
        ------
        InputError
            If no line passes near the point; the error says where the nearest one does.
        """
        pieces = self.pieces
        if not 0 <= frame < pieces.frames:
            raise RangeError("point", f"must be in the movie of {pieces.frames} frames", frame)
        value = f"frame {frame}, column {column:g}, row {row:g}"
        at = (frame, column, row)
        return line_at(pieces.frame, pieces.start, pieces.column, pieces.row, at, "point", value)

    def identity(self) -> xr.Dataset:
        """Who each segment is, and what is known of each whisker in each frame.

        Returns
        -------
        Dataset
            ``identity``: ``segment_whisker``, ``segment_other``, ``segment_probability`` (segment),
            ``whisker_segment``, ``whisker_probability``, ``lost_reason`` (whisker, time) and
            ``identity_probability`` (whisker). Attribute ``reasons``: what the numbers of ``lost_reason`` mean.
        """
        whisker, other = np.full((2, self.pieces.frame.size), -1)
        sure = np.zeros(whisker.size)
        main: list[Integers] = [np.zeros((0, self.pieces.frames), np.int64)]
        chance, reason, first = [np.zeros((0, self.pieces.frames))], [main[0]], 0
        for one in self.names():
            whisker = np.where(one.whisker >= 0, one.whisker + first, whisker)
            other = np.where(one.also >= 0, one.also + first, other)
            sure = np.where(one.whisker >= 0, one.sure, sure)
            main.append(one.main)
            chance.append(one.chance)
            reason.append(one.reason)
            first += len(one.main)
        chances = np.concatenate(chance)
        known = np.isfinite(chances)
        mean = np.where(known, chances, 0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
        return dataset(
            {"frames": self.pieces.frames, "reasons": "; ".join(f"{i} {r}" for i, r in enumerate(REASONS) if r)},
            segment_whisker=whisker,
            segment_other=other,
            segment_probability=sure,
            whisker_segment=np.concatenate(main),
            whisker_probability=chances,
            lost_reason=np.concatenate(reason),
            identity_probability=mean,
        )


def link_segments(segments: xr.Dataset) -> Linking:
    """Link the lines of all frames of a movie to whiskers.

    The base end of each line, the pads, their swing from frame to frame, and the number of whiskers are found from
    the lines. Whiskers of a pad are numbered by their angle. Of the :func:`linkings` from three starts, that is kept in
    which most points probably have the right name.

    Parameters
    ----------
    segments : Dataset
        ``segments``, see :mod:`vibrissa.quantities.segments`; with ``head_column``, ``head_row`` and ``head_angle``
        lines are linked in coordinates that move with the head.

    Returns
    -------
    Linking
        Whiskers found, and which segment is whose.

    Raises
    ------
    InputError
        If there are no lines.
    """
    return max(linkings(segments), key=lambda one: one.right_length)


def linkings(segments: xr.Dataset) -> list[Linking]:
    """The same from each of three starts: lines that are hard to link may have other names in one than in another.

    Parameters
    ----------
    segments : Dataset
        As of :func:`link_segments`.

    Returns
    -------
    list of Linking
        Of the same pads and lines.

    Raises
    ------
    InputError
        If there are no lines.
    """
    one = _unlinked(segments)
    each = [link_pad(one.pieces.frames, one.pieces.frame, one.lines, n, pad) for n, pad in enumerate(one.pads)]
    return [replace(one, solutions=list(solutions)) for solutions in zip(*each, strict=True)]


def _unlinked(segments: xr.Dataset) -> Linking:
    """Lines in the coordinates of their pads, of no whisker yet."""
    pieces, head = pieces_of(segments), head_of(segments)
    one = _unlinked_in(pieces, linking_size(pieces), head)
    for _ in range(MOTIONS if head is None else 0):
        motion = _motion(one)
        if motion is None:
            break
        one = _unlinked_in(pieces, one.size, motion)
    return replace(one, head=head)


def _motion(one: Linking) -> HeadPose | None:
    """Motion of the head in the image, as far as the lines show it."""
    placed, tracklet = one.placed, np.full(one.pieces.frame.size, -1)
    for n, pad in enumerate(one.pads):
        name = stretches(placed.frames, placed.frame, one.lines, n, pad).name
        tracklet = np.where(name >= 0, name + tracklet.max() + 1, tracklet)
    novel = novelty(resized(one.pieces, one.size))  # in the image, where edges stay
    found = motion_of(placed, one.lines, tracklet, novel, moves=one.motion is not None)
    if found is None:
        return None
    found = found._replace(column=found.column / one.size, row=found.row / one.size)
    return found if one.motion is None else one.motion.with_motion(found)


def _unlinked_in(pieces: Pieces, size: float, motion: HeadPose | None) -> Linking:
    """Lines of no whisker yet, in coordinates that move with the head."""
    placed = resized(in_head(pieces, motion), size)
    pads, pad, back = find_pads(placed)
    if (pad < 0).all():
        rule, remedy = (
            "must hold lines that lead away from one place",
            "search a region of the image with whiskers alone",
        )
        raise TooFewError("segments", rule, f"none of {pad.size}", remedy)
    return Linking(pieces, pads, lines_of(placed, pads, pad, back), [], size=size, motion=motion)


def link_again(segments: xr.Dataset, before: Linking) -> list[Linking]:
    """Link lines that have been changed since they were linked, from the whiskers that were found then.

    Parameters
    ----------
    segments : Dataset
        As of :func:`link_segments`, of the same movie and head.
    before : Linking
        Of the former lines; its pads are kept.

    Returns
    -------
    list of Linking
        Of these lines, two as of :func:`vibrissa.video.link.pad_linking.link_pad_again`.
    """
    pieces = pieces_of(segments)
    placed = resized(in_head(pieces, before.motion), before.size)
    lines = lines_of(placed, before.pads, *pads_of_lines(placed, before.pads))
    pads = enumerate(zip(before.pads, before.solutions, strict=True))
    each = [link_pad_again(pieces.frames, pieces.frame, lines, n, *one) for n, one in pads]
    return [replace(before, pieces=pieces, lines=lines, solutions=list(one)) for one in zip(*each, strict=True)]


def link_named(segments: xr.Dataset) -> Linking:
    """Linking of lines that have been linked before, with the whiskers that they have.

    Parameters
    ----------
    segments : Dataset
        As of :func:`link_segments`, with ``segment_whisker``.

    Returns
    -------
    Linking
        Whiskers in the order of their pads, as linking numbers them; a line of another pad than most of its
        whisker's has no name at first.
    """
    one = _unlinked(segments)
    frames, frame, pad = one.pieces.frames, one.pieces.frame, one.lines.pad
    whisker, solutions = segments.segment_whisker.values.astype(np.int64), []
    votes = np.zeros((int(whisker.max(initial=-1)) + 1, len(one.pads)))
    some = (whisker >= 0) & (pad >= 0)
    np.add.at(votes, (whisker[some], pad[some]), 1)
    home = np.append(votes.argmax(axis=1), -1)  # of whiskers, and of nobody
    for n, where in enumerate(one.pads):
        names = np.where((pad == n) & (home[whisker] == n), whisker, -1)
        solutions.append(link_pad_named(frames, frame, one.lines, n, where, names))
    return replace(one, solutions=solutions)
