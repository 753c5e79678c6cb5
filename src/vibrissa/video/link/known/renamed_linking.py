"""A linking whose names are no longer those of the linker alone, as profiles are made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.quantities import dataset
from vibrissa.quantities.identity import SURE
from vibrissa.video.link.identities import ABSENT, REASONS, SHARED, UNSURE
from vibrissa.video.link.known.known_lines import LineNames
from vibrissa.video.link.whisker_linking import Linking

if TYPE_CHECKING:
    import xarray as xr


@dataclass
class RenamedLinking(Linking):
    """Linked lines with other names.

    Attributes
    ----------
    named : LineNames
        Names of all lines.
    count : int
        Number of whiskers, with those that were made by hand.
    """

    named: LineNames
    count: int

    @property
    def whiskers(self) -> int:
        """Number of whiskers, with those that were made by hand."""
        return self.count

    def identity(self) -> xr.Dataset:
        """Who each segment is, and what is known of each whisker in each frame.

        Returns
        -------
        Dataset
            ``identity``, as of :meth:`vibrissa.video.link.whisker_linking.Linking.identity`.
        """
        named, frames = self.named, self.pieces.frames
        main = _main_lines(self, named.whisker, self.count)
        seen = main >= 0
        chance = np.where(seen, named.sure[main], np.nan)
        reason = np.where(seen, np.where(chance >= SURE, 0, UNSURE), self._reasons())
        reason[seen & (named.other[main] >= 0)] = SHARED
        total = np.where(seen, chance, 0).sum(axis=1)
        return dataset(
            {"frames": frames, "reasons": "; ".join(f"{i} {r}" for i, r in enumerate(REASONS) if r)},
            segment_whisker=named.whisker,
            segment_other=named.other,
            segment_probability=named.sure,
            whisker_segment=main,
            whisker_probability=chance,
            lost_reason=reason,
            identity_probability=total / np.maximum(seen.sum(axis=1), 1),
        )

    def _reasons(self) -> Integers:
        """Why the linker lost each whisker, (whisker, frame); where it did not, the line was taken by hand."""
        out, first = np.full((self.count, self.pieces.frames), ABSENT), 0
        for one in self.names():
            out[first : first + len(one.reason)] = np.maximum(one.reason, ABSENT)
            first += len(one.reason)
        return out


def line_names(linking: Linking) -> LineNames:
    """Names of the lines of a linking."""
    identity = linking.identity()
    return LineNames(*(identity[f"segment_{word}"].values for word in ("whisker", "other", "probability")))


def with_names(linking: Linking, named: LineNames, count: int) -> RenamedLinking:
    """A linking with other names.

    Parameters
    ----------
    linking : Linking
        The movie.
    named : LineNames
        Names of all lines.
    count : int
        Number of whiskers, at least those of the linking.

    Returns
    -------
    RenamedLinking
        Of which profiles are made.
    """
    parts = linking.pieces, linking.pads, linking.lines, linking.solutions
    return RenamedLinking(
        *parts, named, count, size=linking.size, head=linking.head, motion=linking.motion, others=linking.others
    )


def _main_lines(linking: Linking, whisker: Integers, count: int) -> Integers:
    """Longest segment of each whisker in each frame (whisker, frame), −1 for none."""
    pieces = linking.pieces
    out = np.full((count, pieces.frames), -1)
    order = np.argsort(pieces.stop - pieces.start, kind="stable")
    mine = order[whisker[order] >= 0]
    out[whisker[mine], pieces.frame[mine]] = mine  # of several the last, the longest
    return out
