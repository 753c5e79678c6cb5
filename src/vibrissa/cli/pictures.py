"""Pictures that commands draw."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Protocol

from cyclopts import Parameter

from vibrissa.errors import InputError

Picture = Annotated[Path | None, Parameter(help="Draw the results (PNG, PDF or SVG).")]


class Figure(Protocol):
    """What a figure's ``draw`` gives."""

    def savefig(self, path: Path, /, *, metadata: dict[str, None]) -> None:
        """Write it."""


KINDS = (".png", ".pdf", ".svg")


def refuse_picture(path: Path | None, option: str = "--picture") -> None:
    """Refuse, before any work, a picture of a kind that is not drawn or cannot be written, by its option's name."""
    if path is None:
        return
    if path.suffix not in KINDS:
        raise InputError(option, f"must end in {', '.join(KINDS)}", str(path))
    if not path.absolute().parent.is_dir():
        raise InputError(option, "must lie in an existing folder", str(path), "make it, or choose another")


def write_picture(figure: Figure, path: Path) -> None:
    """Write a figure, whole or not at all, without the time of day in it."""
    from vibrissa.files import written_whole

    clock = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    with written_whole(path) as temporary:
        figure.savefig(temporary, metadata=clock[path.suffix])
