"""Seeds that the program found itself: those from which no whisker can be followed are left out."""

from __future__ import annotations

from collections.abc import Sequence

from vibrissa.errors import RangeError
from vibrissa.video.follow.following import REASONS, centrelines
from vibrissa.video.follow.reading import Reader, background_of
from vibrissa.video.follow.search import Search
from vibrissa.video.follow.starting import whisker_at
from vibrissa.video.kernel.band import Image

UNSEEN = "no whisker can be followed from it"


def unusable(image: Image, seeds: Sequence[tuple[float, float]], search: Search) -> dict[int, str]:
    """Seeds that cannot be followed from the first frame on.

    Parameters
    ----------
    image : (height, width) array of uint8 or uint16
        First frame.
    seeds : sequence of (column, row)
        Points on lines [px].
    search : Search
        How whiskers are sought.

    Returns
    -------
    dict
        The reason by the seed's place in the sequence.

    Raises
    ------
    InputError
        If the background holds the whiskers.
    """
    reader = Reader(image, background_of(search, image.shape), search)
    why: dict[int, str] = {}
    for k, seed in enumerate(seeds):
        try:
            whisker_at(reader, seed)
        except RangeError:
            why[k] = UNSEEN
    left = [k for k in range(len(seeds)) if k not in why]
    if left:
        (lines,) = centrelines([image[None]], seeds=[seeds[k] for k in left], search=search)
        why |= {k: REASONS[code] for k, code in zip(left, lines.reason[:, 0].tolist(), strict=True) if code}
    return why
