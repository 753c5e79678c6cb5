"""Whether whiskers are followed from frame to frame, or found in every frame and linked."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Literal, NamedTuple

from numpy.typing import NDArray

from vibrissa.errors import ConflictError, TooFewError
from vibrissa.quantities.kinds import Method
from vibrissa.video.find.finding import Side
from vibrissa.video.linked.held_whiskers import look
from vibrissa.video.profile.turning import Point, Region

Frames = NDArray[Any]


class Way(NamedTuple):
    """How a movie is tracked.

    Attributes
    ----------
    method : {"follow", "link"}
        Followed from the first frame on, or found in all frames and linked.
    reason : str
        Why.
    seeds : tuple of (column, row)
        Seeds that were found, of frame ``first``; empty if none were sought.
    base : {"left", "right", "top", "bottom"} or None
        Side of the bases, if it was found.
    first : int
        First frame that is tracked: those before it are bad.
    """

    method: Literal["follow", "link"]
    reason: str
    seeds: tuple[Point, ...] = ()
    base: Side | None = None
    first: int = 0


def choose_way(
    blocks: Callable[[], Iterable[Frames]],
    tracking: Method,
    *,
    following: Sequence[str] = (),
    linking: Sequence[str] = (),
    polarity: Literal["dark", "bright"] = "dark",
    base: Side | None = None,
    region: Region | None = None,
    start: int = 0,
) -> Way:
    """Choose the way of a movie, and find seeds where following needs some.

    Whiskers are linked where marks of any frame are given, and followed where seeds, or settings of following, are.
    With neither the movie decides: whiskers are followed if most of those in its first good frame keep their place.

    Parameters
    ----------
    blocks : callable
        Gives the blocks of the movie from the first frame that is tracked; not called if seeds or marks are given.
    tracking : {"auto", "follow", "link"}
        What was asked for.
    following, linking : sequence of str
        Names of what was given that only following takes, or only linking; of "seeds" or "whisking" no look is needed.
    polarity, base, region
        As of :func:`vibrissa.video.find.finding.find_whiskers`.
    start : int
        Number of the first frame of the blocks.

    Returns
    -------
    Way

    Raises
    ------
    InputError
        If what was given excludes the method or each other, or no whisker is found to be followed.
    """
    if linking and (following or tracking == "follow"):
        other = following[0] if following else "tracking 'follow'"
        raise ConflictError(linking[0], f"must not be given together with {other}", remedy="leave one of them out")
    if following and tracking == "link":
        raise ConflictError(following[0], "must be left out where whiskers are linked", remedy="mark them")
    if tracking == "link" or linking:
        return Way("link", "as asked for" if tracking == "link" else f"{linking[0]} given", first=start)
    asked = "as asked for" if tracking == "follow" else f"{following[0]} given" if following else ""
    if {"seeds", "whisking"} & set(following):
        return Way("follow", asked, first=start)
    seen = look(blocks, polarity=polarity, base=base, region=region)
    held, count, first = sum(seen.held), len(seen.held), start + seen.first
    if not asked and 2 * held <= count:
        what = f"{count - held} of {count} whiskers of frame {first} move away" if count else "none is seen at first"
        return Way("link", what, first=start)
    if seen.base is None or not seen.found:
        remedy = "give their seeds, or say whether they are dark or bright"
        raise TooFewError("whiskers", "must be seen in the first frame to be found", remedy=remedy)
    reason = asked or f"{held} of {count} whiskers of frame {first} keep their place"
    return Way("follow", reason, tuple(one.seed for one in seen.found), seen.base, first)
