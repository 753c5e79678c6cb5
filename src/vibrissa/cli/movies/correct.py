"""The verb `correct`: names of linked whiskers corrected by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from vibrissa.cli.shared.display.output import MaybeOut, refuse_out, tell
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.errors import MissingError


def correct(
    profile: Path,
    movie: Path,
    *,
    segments: Path | None = None,
    edits: Path | None = None,
    polarity: Literal["dark", "bright"] = "dark",
    page: bool = True,
    browser: bool = True,
    out: MaybeOut = None,
) -> None:
    """Correct by hand which line is which whisker, on a local page: join, split, swap, name, delete, mark.

    Every edit is kept in a file beside PROFILE, from which correcting continues the next time.

    Parameters
    ----------
    profile
        Tracked profiles (NetCDF).
    movie
        Their movie.
    segments
        Lines of all frames: NetCDF, .whiskers of WHISK or HDF5 of WhiskiWrap. Those that PROFILE names by default; else
        they are found in MOVIE, and kept beside PROFILE.
    edits
        File of the edits (JSON); PROFILE's name with .edits.json by default.
    polarity
        Whiskers darker or brighter than the background, where lines are found.
    page
        Correct on a local page; with --no-page the edits of the file are made again, and --out is written.
    browser
        Open the page in the browser.
    out
        Corrected profile to write (NetCDF); PROFILE's name with -corrected.nc by default.
    """
    from vibrissa.page.correct.correcting import correct_on_page, write_corrected
    from vibrissa.video.correct.edit_file import edit_path
    from vibrissa.video.correct.opening import open_tracks

    if not page and edits is not None and not edits.exists():
        raise MissingError("--edits", "must be an existing file with --no-page", str(edits))
    out, edits = out or profile.with_name(f"{profile.stem}-corrected.nc"), edits or edit_path(profile)
    refuse_out(out)
    with progress_bars() as progress:
        opened = open_tracks(
            profile, movie, segments=segments, edits=edits, polarity=polarity, tell=tell, progress=progress
        )
    if not page:
        if not opened.correction.edits:
            tell(f"there are no edits to make again: no {edits}, or none in it")
        tell(write_corrected(opened, out))
        return
    said = correct_on_page(opened, movie, edits, out, tell=tell, browser=browser)
    count = len(opened.correction.edits)
    tell(f"{count} edit{'s' * (count != 1)} in {edits}" if edits.exists() else "nothing was done by hand")
    tell(said)
