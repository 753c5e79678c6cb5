"""A linking whose names are those after all edits, as profiles are made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.quantities import dataset
from vibrissa.quantities.identity import SURE
from vibrissa.video.correct.correction import Correction
from vibrissa.video.link.identities import ABSENT, REASONS, SHARED, UNSURE
from vibrissa.video.link.whisker_linking import Linking

if TYPE_CHECKING:
    import xarray as xr


@dataclass
class CorrectedLinking(Linking):
    """Linked lines with the names of a correction.

    Attributes
    ----------
    correction : Correction
        Edits of the movie.
    """

    correction: Correction

    @property
    def whiskers(self) -> int:
        """Number of whiskers, with those that were made by hand."""
        return self.correction.named.whiskers

    def identity(self) -> xr.Dataset:
        """Who each segment is, and what is known of each whisker in each frame.

        Returns
        -------
        Dataset
            ``identity``, as of :meth:`vibrissa.video.link.whisker_linking.Linking.identity`; lines that were named by
            hand have the probability 1.
        """
        self.correction.settle()
        named, frames = self.correction.named, self.pieces.frames
        main = _main_lines(self, named.whisker, named.whiskers)
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
        correction = self.correction
        names = correction.linked()
        out = np.full((correction.named.whiskers, self.pieces.frames), ABSENT)
        for number, (pad, k) in enumerate(correction.chains.roster):
            if pad >= 0:
                out[number] = np.maximum(names[pad].reason[k], ABSENT)
        return out


def corrected_linking(correction: Correction) -> CorrectedLinking:
    """The linking of a correction, with its names.

    Parameters
    ----------
    correction : Correction
        Edits of the movie.

    Returns
    -------
    CorrectedLinking
        Of which profiles are made.
    """
    linking = correction.linking
    parts = linking.pieces, linking.pads, linking.lines, linking.solutions
    return CorrectedLinking(*parts, correction, head=linking.head)


def _main_lines(linking: Linking, whisker: Integers, count: int) -> Integers:
    """Longest segment of each whisker in each frame (whisker, frame), −1 for none."""
    pieces = linking.pieces
    out = np.full((count, pieces.frames), -1)
    order = np.argsort(pieces.stop - pieces.start, kind="stable")
    mine = order[whisker[order] >= 0]
    out[whisker[mine], pieces.frame[mine]] = mine  # of several the last, the longest
    return out
