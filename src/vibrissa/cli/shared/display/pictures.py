"""Pictures that commands draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import MaybeOut, tell
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError

if TYPE_CHECKING:
    from vibrissa.study.neurons.neurons import Analysed

KINDS = (".png", ".pdf", ".svg", ".html")
MOST_PAGES = 100


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """A picture of the results; one that cannot be written is refused at once, before any work.

    Attributes
    ----------
    picture : Path, optional
        Draw the results (.png, .pdf, .svg, or .html with the caption as text).
    """

    picture: MaybeOut = None

    def __post_init__(self) -> None:
        if self.picture is not None:
            refuse_picture(self.picture)

    def draw(self, figure: str, *inputs: Any, **settings: Any) -> None:
        """Compute, draw and write a figure, if a picture is named.

        Parameters
        ----------
        figure : str
            Module of :mod:`vibrissa.figures`: ``spikes.surround``.
        inputs, settings
            Of its ``compute``.
        """
        if self.picture is not None:
            module = import_module(f"vibrissa.figures.{figure}")
            write_picture(module.draw(module.compute(*inputs, **settings)), self.picture)


NO_PICTURE = PictureOptions()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PagesOptions:
    """Pages of units; a picture that cannot be written is refused at once, before any work.

    Attributes
    ----------
    picture : Path, optional
        Draw the population, a table that can be sorted, and a page for each unit: .html, .pdf (without the table), or a
        folder. A .png or .svg holds the population, or the unit of --unit-page.
    unit_page : list of str, optional
        Unit that has a page in the picture, instead of those that pass the test and correlate most; once for each.
    most_pages : int
        Largest number of units that have a page in the picture.
    """

    picture: MaybeOut = None
    unit_page: list[str] | None = None
    most_pages: int = MOST_PAGES

    def __post_init__(self) -> None:
        if self.picture is not None:
            refuse_picture(self.picture, folder=True)
        elif self.unit_page:
            raise ConflictError("--unit-page", "must go with --picture", self.unit_page[0])
        if self.most_pages < 0:
            raise RangeError("--most-pages", "must be zero or positive", self.most_pages)

    def draw_units(self, found: Analysed, remarks: Sequence[str]) -> None:
        """Draw population and units, if a picture is named, and say what is not drawn.

        Parameters
        ----------
        found : Analysed
            From :func:`vibrissa.study.neurons.neurons.analyse_neurons`.
        remarks : sequence of str
            What a reader should know of them.
        """
        if self.picture is None:
            return
        from vibrissa.study.report.unit_pages import write_unit_pages

        with progress_bars() as progress:
            left_out = write_unit_pages(
                found,
                self.picture,
                named=self.unit_page or (),
                most=self.most_pages,
                remarks=remarks,
                progress=progress,
            )
        tell(*filter(None, [in_options(left_out)]))


NO_PAGES = PagesOptions()


def refuse_picture(path: Path, option: str = "--picture", *, folder: bool = False) -> None:
    """Refuse, before any work, a picture of a kind that is not drawn or cannot be written.

    Parameters
    ----------
    path : Path
        The picture.
    option : str
        That names it, for the message.
    folder : bool
        Whether it may be a folder of pages.

    Raises
    ------
    InputError
        If its name or its folder will not do.
    """
    if not (path.suffix in KINDS or (folder and not path.suffix)):
        kinds = ", ".join(KINDS) + (", or be a folder" if folder else "")
        raise FormatError(option, f"must end in {kinds}", str(path))
    if not path.absolute().parent.is_dir():
        raise MissingError(option, "must lie in an existing folder", str(path), "make it, or choose another")
    if path.exists() and path.is_dir() == bool(path.suffix):
        raise MissingError(option, "must name a file that can be written", str(path), "choose another name")


def write_picture(figure: Any, path: Path) -> None:
    """Write a figure of matplotlib, whole or not at all.

    Parameters
    ----------
    figure : Figure
        Drawn.
    path : Path
        Picture of a kind that :func:`refuse_picture` lets pass.
    """
    from vibrissa.study.report.pages import write_picture as write

    write(figure, path)
