"""A movie that is being corrected: edits one after the other, undone and redone, and the names that they lead to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import InputError, MissingError
from vibrissa.video.correct.decisions import (
    GONE,
    Decisions,
    Linked,
    Lying,
    overlaid,
    pieces_of_names,
    undecided,
)
from vibrissa.video.correct.edits import Edit, LinePoint
from vibrissa.video.correct.line_tracklets import line_tracklets
from vibrissa.video.correct.moves import Board, moved
from vibrissa.video.correct.relinking import (
    Chains,
    chains_of,
    linked_names,
    relinked,
    sampled,
    settled_again,
    still_said,
)
from vibrissa.video.link.identities import Names, names_of
from vibrissa.video.link.whisker_linking import Linking, WhiskerMark


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
    """Chains and names of the linker after a number of edits, decisions, and those not yet given to the linker."""

    chains: Chains
    linked: Linked
    decisions: Decisions
    named: Named
    due: dict[int, int]


class Correction:
    """Edits of a linked movie.

    An edit holds at once; :meth:`settle` then links the lines about it again. Decisions by hand hold over the linker's.

    Parameters
    ----------
    linking : Linking
        The movie's lines, linked.
    said : Linked, optional
        Names that the lines had before, in the numbers of the linking; they hold until an edit changes what the linking
        says of a line.
    """

    def __init__(self, linking: Linking, said: Linked | None = None) -> None:
        self.linking = linking
        pieces = linking.pieces
        self.lying = Lying(pieces.frame, linking.lines.reach, line_tracklets(linking))
        chains, decisions = chains_of(linking), undecided(pieces.frame.size)
        self._undecided = [linked_names(linking, one) for one in (chains, settled_again(chains))]
        self._said = linked = said or self._undecided[0]
        self._moments = [_Moment(chains, linked, decisions, self._names(chains, linked, decisions), {})]
        self._edits: list[Edit] = []
        self._done = 0

    @property
    def edits(self) -> list[Edit]:
        """Edits that hold, in the order in which they were made."""
        return self._edits[: self._done]

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
        self.settle()
        now = self._moments[self._done]
        named = now.named
        board = Board(named.whiskers, named.whisker, named.piece, now.decisions, self.lying, self.segment_at)
        decisions, said = moved(board, edit)
        changed = np.flatnonzero(decisions.held != now.decisions.held)
        due = sampled(self.lying.frame, decisions.held, changed)
        names = self._names(now.chains, now.linked, decisions)
        self._moments[self._done + 1 :] = [_Moment(now.chains, now.linked, decisions, names, due)]
        self._edits[self._done :] = [edit]
        self._done += 1
        return said[0].upper() + said[1:]

    def settle(self) -> int:
        """Link the lines about the last edit again.

        Returns
        -------
        int
            Number of lines whose name changed by that.
        """
        now = self._moments[self._done]
        if not now.due:
            return 0
        chains = relinked(self.linking, now.chains, now.due)
        linked = still_said(linked_names(self.linking, chains), self._undecided, self._said)
        named = self._names(chains, linked, now.decisions)
        self._moments[self._done] = _Moment(chains, linked, now.decisions, named, {})
        return int(np.count_nonzero(named.whisker != now.named.whisker))

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
        self.settle()

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
        try:
            return self.linking.nearest(WhiskerMark(*point, 0))
        except InputError as error:
            raise error.renamed("point") from None

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

    def linked(self) -> list[Names]:
        """Names by the linker in each pad, after all edits, as its whiskers are numbered there."""
        self.settle()
        return [names_of(one, self.linking.lever(pad)) for pad, one in enumerate(self.chains.solutions)]

    @property
    def chains(self) -> Chains:
        """Chains of the linker, after all edits that it has heard of."""
        return self._moments[self._done].chains

    def _names(self, chains: Chains, linked: Linked, decisions: Decisions) -> Named:
        """Names by the linker, with the decisions over them."""
        whisker, other, sure = overlaid(linked, decisions, self.lying)
        count = max(len(chains.roster), int(decisions.held.max(initial=-1)) + 1)
        piece = pieces_of_names(whisker, decisions, self.lying)
        return Named(count, whisker, other, sure, piece, decisions.held == GONE)
