"""Pictures that commands draw."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from cyclopts import Parameter

from vibrissa.errors import FormatError, MissingError

CLOCK = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}  # is left out


class Figure(Protocol):
    """What a figure's ``draw`` gives."""

    def savefig(self, path: Path, /, *, metadata: dict[str, None]) -> None:
        """Write it to a path, with the metadata given."""


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """A picture of the results; one that cannot be written is refused at once, before any work.

    Attributes
    ----------
    picture : Path, optional
        Draw the results (PNG, PDF or SVG).
    """

    picture: Path | None = None

    def __post_init__(self) -> None:
        if self.picture is not None:
            refuse_picture(self.picture)

    def draw(self, figure: str, *inputs: Any, **settings: Any) -> None:
        """Compute, draw and write a figure, if a picture is asked for.

        Parameters
        ----------
        figure : str
            Module of :mod:`vibrissa.figures`: ``others.surround``.
        inputs, settings
            Of its ``compute``.
        """
        if self.picture is not None:
            module = import_module(f"vibrissa.figures.{figure}")
            write_picture(module.draw(module.compute(*inputs, **settings)), self.picture)


NO_PICTURE = PictureOptions()


def refuse_picture(path: Path, option: str = "--picture") -> None:
    """Refuse, before any work, a picture of a kind that is not drawn or cannot be written.

    Parameters
    ----------
    path : Path
        The picture.
    option : str
        That names it, for the message.

    Raises
    ------
    InputError
        If its name or its folder will not do.
    """
    if path.suffix not in CLOCK:
        raise FormatError(option, f"must end in {', '.join(CLOCK)}", str(path))
    if not path.absolute().parent.is_dir():
        raise MissingError(option, "must lie in an existing folder", str(path), "make it, or choose another")


def write_picture(figure: Figure, path: Path) -> None:
    """Write a figure, whole or not at all, without the time of day in it.

    Parameters
    ----------
    figure : Figure
        Drawn.
    path : Path
        Picture of a kind that :func:`refuse_picture` lets pass.
    """
    from vibrissa.files import written_whole

    with written_whole(path) as temporary:
        figure.savefig(temporary, metadata=CLOCK[path.suffix])
