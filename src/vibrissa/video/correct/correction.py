"""A movie that is being corrected: edits one after the other, undone and redone, and the names that they lead to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import InputError, MissingError
from vibrissa.video.correct.decisions import (
    GONE,
    NOBODY,
    OPEN,
    Decisions,
    Lying,
    overlaid,
    pieces_of_names,
    undecided,
)
from vibrissa.video.correct.edits import Edit, LinePoint
from vibrissa.video.correct.line_tracklets import line_tracklets
from vibrissa.video.correct.moves import Board, moved
from vibrissa.video.link.known.known_lines import LineNames
from vibrissa.video.link.known.known_names import Chains, chains_of, names_with
from vibrissa.video.link.known.renamed_linking import RenamedLinking, line_names, with_names
from vibrissa.video.link.whisker_linking import Linking

SPREADS = "name", "mark", "join"  # edits of which the names about them hear


class Named(NamedTuple):
    """Names after the edits.

    Attributes
    ----------
    whiskers : int
        Number of whiskers.
    whisker, other : (S,) arrays of int
        Whisker of each segment, −1 for none; another one that runs along the same line, −1 for none.
    sure : (S,) array
        Probability that the segment is that whisker's; 1 where it was named by hand.
    piece : (S,) array of int
        Piece of each segment.
    gone : (S,) array of bool
        Lines that are no whisker by hand.
    """

    whiskers: int
    whisker: Integers
    other: Integers
    sure: Array
    piece: Integers
    gone: Mask


class _Moment(NamedTuple):
    """Whiskers, their names but for decisions, decisions, and the names after a number of edits."""

    chains: Chains
    linked: LineNames
    decisions: Decisions
    named: Named


class Correction:
    """Edits of a linked movie.

    An edit also puts right the names about it. Decisions by hand hold over all others.

    Parameters
    ----------
    linking : Linking
        The movie's lines, linked.
    said : LineNames, optional
        Names that the lines had before, in the numbers of the linking; those of the linking if not given.
    labels : dict, optional
        What whiskers were called before, by their numbers.
    """

    def __init__(
        self, linking: Linking, said: LineNames | None = None, labels: Mapping[int, str] | None = None
    ) -> None:
        self.linking, self._before = linking, dict(labels or {})
        pieces = linking.pieces
        self.lying = Lying(pieces.frame, linking.lines.reach, line_tracklets(linking))
        chains, decisions = chains_of(linking), undecided(pieces.frame.size)
        linked = said or line_names(linking)
        named = self._names(chains, linked, decisions)
        self._moments = [_Moment(chains, linked, decisions, named)]
        self._edits: list[Edit] = []
        self._said: list[str] = []
        self._done = 0

    @property
    def edits(self) -> list[Edit]:
        """Edits that hold, in the order in which they were made."""
        return self._edits[: self._done]

    @property
    def labels(self) -> dict[int, str]:
        """What whiskers are called, by their numbers."""
        given = {one.whisker: one.label for one in self.edits if one.whisker is not None and one.label is not None}
        return {whisker: label for whisker, label in (self._before | given).items() if label}

    @property
    def undone(self) -> int:
        """Number of edits that can be redone."""
        return len(self._edits) - self._done

    @property
    def named(self) -> Named:
        """Names now."""
        return self._moments[self._done].named

    def apply(self, edit: Edit) -> str:
        """Make an edit; what had been undone cannot be redone any more.

        Parameters
        ----------
        edit : Edit
            The edit.

        Returns
        -------
        str
            What it did.

        Raises
        ------
        InputError
            If no line is at a point of the edit, or it makes no sense; nothing is changed then.
        """
        now = self._moments[self._done]
        named = now.named
        board = (named.whiskers, named.whisker, named.piece, now.decisions, self.lying, self.segment_at, self.labels)
        decisions, said = moved(Board(*board), edit)
        chains, linked = now.chains, now.linked
        own = np.flatnonzero(decisions.held != now.decisions.held)
        mine = own[decisions.held[own] >= 0]
        if edit.do == "swap":
            linked = _swapped(linked, edit, self.lying)
        elif mine.size and edit.do in SPREADS and not edit.whole:
            chains, linked = self._heard(now, mine, int(decisions.held[mine[0]]))
        moment = _Moment(chains, linked, decisions, self._names(chains, linked, decisions))
        self._moments[self._done + 1 :] = [moment]
        self._edits[self._done :] = [edit]
        self._done += 1
        self._said[self._done - 1 :] = [said]
        return said[0].upper() + said[1:]

    def _heard(self, now: _Moment, lines: Integers, whisker: int) -> tuple[Chains, LineNames]:
        """Whiskers and names once the names about some lines have heard whose these are."""
        held = np.flatnonzero(now.decisions.held != OPEN)
        known = dict(zip(held.tolist(), np.maximum(now.decisions.held[held], NOBODY).tolist(), strict=True))
        names = LineNames(now.named.whisker, now.named.other, now.named.sure)
        return names_with(now.chains, names, lines, whisker, known)

    def undo(self) -> Edit:
        """Take the last edit back.

        Returns
        -------
        Edit
            The edit.

        Raises
        ------
        InputError
            If there is none.
        """
        if not self._done:
            raise MissingError("undo", "must follow an edit", remedy="nothing was done by hand")
        self._done -= 1
        return self._edits[self._done]

    def redo(self) -> Edit:
        """Make the edit again that was taken back last.

        Returns
        -------
        Edit
            The edit.

        Raises
        ------
        InputError
            If there is none.
        """
        if not self.undone:
            raise MissingError("redo", "must follow an undo", remedy="nothing was taken back")
        self._done += 1
        return self._edits[self._done - 1]

    def said(self, number: int) -> str:
        """What an edit did, by its number from 0, in one line."""
        return self._said[number]

    def apply_all(self, edits: Sequence[Edit], thing: str) -> None:
        """Make edits of a file again.

        Parameters
        ----------
        edits : sequence of Edit
            In their order.
        thing : str
            Name of the file, for errors.

        Raises
        ------
        InputError
            Names the first edit that cannot be made.
        """
        for number, edit in enumerate(edits, 1):
            try:
                self.apply(edit)
            except InputError as error:
                raise error.renamed(f"{thing}, edit {number}, {error.quantity}") from None

    def segment_at(self, point: LinePoint) -> int:
        """Segment that a point lies on.

        Parameters
        ----------
        point : LinePoint
            The point.

        Returns
        -------
        int
            The segment.

        Raises
        ------
        InputError
            If no line passes near it; the error says where the nearest one does.
        """
        return self.linking.nearest(*point)

    def point_on(self, segment: int) -> LinePoint:
        """A point by which a segment is found again: its middle one.

        Parameters
        ----------
        segment : int
            The segment.

        Returns
        -------
        LinePoint
            On no other line, if possible.
        """
        pieces = self.linking.pieces
        size = pieces.stop[segment] - pieces.start[segment]
        for share in (0.5, 0.7, 0.3, 0.9, 0.1):  # where another line crosses, another point is taken
            at = pieces.start[segment] + int(share * (size - 1))
            column, row = float(pieces.column[at]), float(pieces.row[at])
            point = LinePoint(int(pieces.frame[segment]), round(column, 2), round(row, 2))
            if self.segment_at(point) == segment:
                break
        return point

    def renamed(self) -> RenamedLinking:
        """The linking with the names after all edits, of which profiles are made."""
        named = self.named
        return with_names(self.linking, LineNames(named.whisker, named.other, named.sure), named.whiskers)

    def _names(self, chains: Chains, linked: LineNames, decisions: Decisions) -> Named:
        """Names by the linker, with the decisions over them."""
        whisker, other, sure = overlaid(linked, decisions, self.lying)
        count = max(len(chains.roster), int(decisions.held.max(initial=-1)) + 1)
        piece = pieces_of_names(whisker, decisions, self.lying)
        return Named(count, whisker, other, sure, piece, decisions.held == GONE)


def _swapped(linked: LineNames, edit: Edit, lying: Lying) -> LineNames:
    """Names of two whiskers exchanged from a frame on; how sure they are stays."""
    assert edit.whiskers is not None
    assert edit.frame is not None
    a, b = edit.whiskers
    later = lying.frame >= edit.frame
    table = np.arange(max(int(linked.whisker.max(initial=0)), int(linked.other.max(initial=0)), a, b) + 2)
    table[[a, b, -1]] = b, a, NOBODY
    name, other = (np.where(later, table[one], one) for one in (linked.whisker, linked.other))
    return LineNames(name, other, linked.sure)
