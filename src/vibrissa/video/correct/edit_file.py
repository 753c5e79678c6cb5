"""File of the edits of a movie (JSON), beside its profile."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from vibrissa.errors import ConflictError, FormatError
from vibrissa.files import existing, written_whole
from vibrissa.video.correct.edits import Edit, edit_of, plain_edit

FORMAT, VERSION = "vibrissa edits", 2
COUNTED = 1  # version in which frames of a tracked part counted from its first


class EditedMovie(NamedTuple):
    """The movie that edits belong to: name of its file, number and size of its frames [px]."""

    name: str
    frames: int
    width: int
    height: int


def edit_path(profile: str | Path) -> Path:
    """Name of the file of edits beside a profile.

    Parameters
    ----------
    profile : path
        The profile.

    Returns
    -------
    Path
        The same name with .edits.json.
    """
    return Path(profile).with_suffix(".edits.json")


def write_edits(path: str | Path, movie: EditedMovie, edits: Sequence[Edit]) -> None:
    """Write the edits of a movie, whole or not at all.

    Parameters
    ----------
    path : path
        File to write.
    movie : EditedMovie
        The movie.
    edits : sequence of Edit
        In the order in which they were made.
    """
    head = {"format": FORMAT, "version": VERSION, "movie": movie._asdict()}
    lines = ",\n".join("  " + json.dumps(plain_edit(one)) for one in edits)
    body = f"[\n{lines}\n ]" if edits else "[]"
    text = json.dumps(head, ensure_ascii=False)[:-1] + f',\n "edits": {body}}}\n'
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def require_known(path: str | Path, movie: EditedMovie, edits: Sequence[Edit]) -> None:
    """Refuse a file that holds other edits than those that are known; one that is missing holds nothing to lose.

    Parameters
    ----------
    path : path
        File of :func:`write_edits`.
    movie : EditedMovie
        The movie.
    edits : sequence of Edit
        That were read from it or written to it last.

    Raises
    ------
    InputError
        If another program has written to it.
    """
    found = read_edits(path, movie) if Path(path).exists() else edits
    if [plain_edit(one) for one in found] != [plain_edit(one) for one in edits]:
        rule = f"must hold the edits that this page last read or wrote, {len(edits)} edit{'s' * (len(edits) != 1)}"
        remedy = "another program has written to it: end this page, and start `correct` again"
        raise ConflictError(str(path), rule, len(found), remedy)


def read_edits(path: str | Path, movie: EditedMovie, first: int = 0) -> list[Edit]:
    """Edits of a movie.

    Parameters
    ----------
    path : path
        File of :func:`write_edits`.
    movie : EditedMovie
        The movie that they must belong to; its name may have changed.
    first : int
        First frame of the lines, where a part of the movie was tracked.

    Returns
    -------
    list of Edit
        In the order in which they were made.

    Raises
    ------
    InputError
        If the file is missing, is no such file, belongs to a movie of another size, or an edit is bad.
    """
    try:
        values: Any = json.loads(existing(path).read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FormatError(str(path), "must be a file of edits (JSON)", remedy=str(error)) from error
    if not isinstance(values, dict) or values.get("format") != FORMAT or not isinstance(values.get("edits"), list):
        raise FormatError(str(path), f"must be a file of edits, with format {FORMAT!r}, movie and edits")
    _refuse_version(path, values.get("version"), first)
    _refuse_other_movie(path, values.get("movie"), movie)
    edits = [edit_of(one, f"{path}, edit {number}") for number, one in enumerate(values["edits"], 1)]
    for number, one in enumerate(edits, 1):
        last = max([one.frame or 0, *(point.frame for point in (one.at, one.to) if point is not None)])
        if last >= movie.frames:
            rule = f"must be in the movie of {movie.frames} frames"
            raise FormatError(f"{path}, edit {number}, frame", rule, last)
    return edits


def _refuse_version(path: str | Path, version: object, first: int) -> None:
    """Refuse edits of a later program, and those that were made on the pictures of other frames."""
    if version not in (COUNTED, VERSION):
        raise FormatError(str(path), f"must have version {VERSION}", version, "update vibrissa")
    if version == COUNTED and first:
        rule = f"must have version {VERSION}: lines were on pictures {first} frames too early when it was made"
        raise FormatError(str(path), rule, version, "correct again, with another file of edits")


def _refuse_other_movie(path: str | Path, given: object, movie: EditedMovie) -> None:
    """Refuse edits of a movie with other frames."""
    sizes = ("frames", "width", "height")
    known = given if isinstance(given, dict) else {}
    if any(known.get(name) != getattr(movie, name) for name in sizes):
        mine = f"{movie.frames} frames of {movie.width} × {movie.height} pixels"
        theirs = f"{known.get('name')!r} with {known.get('frames')} of {known.get('width')} × {known.get('height')}"
        remedy = "give the movie that was corrected, or another file of edits"
        raise ConflictError(str(path), f"must be of this movie, {mine}", theirs, remedy)
