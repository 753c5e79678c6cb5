"""The option ``--movie`` of the whole whisker, which `gap`, `scan` and `whisking` take with ``--model rod``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import MaybeOut, tell
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.errors import ConflictError, FormatError, MissingError

if TYPE_CHECKING:
    from vibrissa.mechanics.rod.film import RodFilm

MovieFile = Annotated[
    MaybeOut,
    Parameter(
        help="Movie of the shaft over the ground, its contacts coloured by their state, the moment below (.mp4, .mkv); "
        "with --model rod only."
    ),
]
_SUFFIXES = (".mp4", ".mkv")


def refuse_movie(movie: Path | None, model: str) -> None:
    """Refuse, before any work, a movie that cannot be written, or one of a model that has none.

    Parameters
    ----------
    movie : Path, optional
        The file.
    model : str
        As chosen.

    Raises
    ------
    InputError
        If its name, its folder or the model will not do.
    """
    if movie is None:
        return
    if model != "rod":
        raise ConflictError("--movie", "must go with --model rod", str(movie))
    if movie.suffix not in _SUFFIXES:
        raise FormatError("--movie", f"must end in {' or '.join(_SUFFIXES)}", str(movie))
    if not movie.absolute().parent.is_dir():
        raise MissingError("--movie", "must lie in an existing folder", str(movie), "make it, or choose another")


def film_rate(lasting: float, rate: float) -> float:
    """Records per second that a movie needs: no more than those of the data.

    Parameters
    ----------
    lasting : float
        Of the motion [s].
    rate : float
        Samples per second of the data [Hz].

    Returns
    -------
    float
        [Hz].
    """
    wanted = max(1000.0, 1200.0 / max(lasting, 1e-3))
    return rate / max(1, int(rate / wanted))  # a part of it, so that the steps in time are the same


def write_film(movie: Path | None, film: Callable[[], RodFilm]) -> None:
    """Write the movie, if one is named.

    Parameters
    ----------
    movie : Path, optional
        The file.
    film : callable
        Gives what it shows.
    """
    if movie is None:
        return
    from vibrissa.figures.others.rod_movie import slowed, write_movie

    with progress_bars() as progress:
        progress("the whole whisker, for the movie", 0, 0)
        shown = film()
        count = write_movie(movie, shown, lambda done, of_all: progress("movie", done, of_all))
    factor = slowed(shown)
    pace = "at its own pace" if factor == 1 else f"slowed {factor:g} times"
    tell(f"the movie is {movie}: {count} frames, {pace}")
