"""Tracks that are opened, corrected on the page, and written."""

from __future__ import annotations

import json
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.netcdf import save
from vibrissa.page.correct.server import serve
from vibrissa.page.correct.session import CorrectionSession
from vibrissa.video.correct.corrected_profile import corrected_profile
from vibrissa.video.correct.opening import OpenedTracks, profile_numbers
from vibrissa.video.io.frame_store import FrameStore

if TYPE_CHECKING:
    import xarray as xr


def correct_on_page(
    opened: OpenedTracks, movie: Path, edits: Path, out: Path, *, tell: Callable[[str], None], browser: bool = True
) -> str:
    """Serve the page until it is ended.

    Parameters
    ----------
    opened : OpenedTracks
        What is corrected.
    movie : Path
        The movie.
    edits : Path
        File of the edits, written after each.
    out : Path
        Corrected profile to write (.nc), when it is saved on the page.
    tell : callable
        Called with a line to show: the page's address.
    browser : bool
        Open the page in the default browser.

    Returns
    -------
    str
        Which edits the corrected profile holds, in a line.
    """
    saved: list[str] = []

    def write() -> str:
        saved.append(write_corrected(opened, out))
        return saved[-1]

    frames = FrameStore(movie, opened.profile.attrs.get("drop_frames"))
    try:
        session = CorrectionSession(opened.correction, frames, opened.movie, edits, write, tracked(opened))
        serve(session, tell=tell, opened=webbrowser.open if browser else None)
    finally:
        frames.close()
    if not saved:
        return "no corrected profile was saved"
    other = ", with other edits than those kept; `correct` with --no-page writes these" if session.unsaved else ""
    return f"the corrected profile is {out}{other}"


def tracked(opened: OpenedTracks) -> dict[str, Any]:
    """What the page must know of the profile.

    Parameters
    ----------
    opened : OpenedTracks
        What is corrected.

    Returns
    -------
    dict
        ``numbers`` of the whiskers in the profile, by those in the linking; ``part``, first and last frame that were
        tracked.
    """
    attrs = opened.profile.attrs
    part = [int(attrs.get("first_frame", 0)), int(attrs.get("last_frame", opened.movie.frames - 1))]
    numbers = profile_numbers(opened.profile, opened.numbers, opened.correction.linking.whiskers)
    return {"numbers": numbers.tolist(), "part": part}


def write_corrected(opened: OpenedTracks, out: Path) -> str:
    """Write the corrected profile.

    Parameters
    ----------
    opened : OpenedTracks
        With its edits.
    out : Path
        File to write (.nc).

    Returns
    -------
    str
        A line that says so.
    """
    data = corrected_profile(opened)
    save(data, out)
    return f"The corrected profile of {data.sizes['whisker']} whiskers is in {out}{_numbers(opened, data)}"


def _numbers(opened: OpenedTracks, data: xr.Dataset) -> str:
    """Whiskers that have another number in the profile than on the page, and those that it leaves out."""
    correction = opened.correction
    first = profile_numbers(opened.profile, opened.numbers, correction.linking.whiskers).tolist()
    kept, every = json.loads(data.attrs["identities"]), np.unique(correction.named.whisker)
    shown = {int(n): first[n] if n < len(first) else int(n) for n in every if n >= 0}
    other = [f"{shown[n]} is {k} in it" for k, n in enumerate(kept) if shown[n] != k]
    out = sorted(shown[n] for n in set(shown) - set(kept))
    left = [f"{', '.join(map(str, out))} left out, as no name is sure enough"] if out else []
    return "".join(f"; {one}" for one in [*([f"whisker {', '.join(other)}"] if other else []), *left])
