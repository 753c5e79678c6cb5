"""Pictures as files: one figure as PNG, SVG, PDF or HTML; several as pages of HTML or PDF, or of a folder."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Sequence
from hashlib import sha256
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

from vibrissa import __version__
from vibrissa.figures.canvas import caption_of
from vibrissa.files import written_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CLOCK: dict[str, Any] = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}  # left out
_LETTERS, _LINE = 16.5, 0.14  # letters of 8 points in an inch; height of a line [inch]
FINE = 200  # dots per inch of what is drawn as pixels within vectors
_NUMBERED = re.compile(r' id="[A-Za-z][\w.]*_\d{1,4}"')  # names of matplotlib's groups, the same in every figure
_CLIP = re.compile(r'<clipPath id="(\w+)">(.*?)</clipPath>', re.DOTALL)
_CLIPPED = re.compile(r"\bp[0-9a-f]{10}\b")
_PLAIN = {"Date": None, "Creator": None}
INDEX = "index.html"


class FigurePage(NamedTuple):
    """A figure in HTML.

    Attributes
    ----------
    name : str
        By which links lead to it; empty of a figure alone.
    heading, caption : str
        Its words, not in the picture.
    svg : str
        The picture.
    """

    name: str
    heading: str
    caption: str
    svg: str


def write_picture(figure: Figure, path: Path) -> None:
    """Write a figure, whole or not at all, without the time of day in it.

    Its caption is text below it in HTML and PDF; a PNG or SVG has it in its metadata.

    Parameters
    ----------
    figure : Figure
        Drawn; written as HTML it loses its title, which becomes text of the page.
    path : Path
        Ends in .png, .svg, .pdf or .html.
    """
    if path.suffix == ".html":
        page = page_of(figure, "")
        return _write(path, title=page.heading or path.stem, shown=[page])
    kind, words = path.suffix[1:], caption_of(figure)
    about = CLOCK[kind] if kind == "pdf" or not words else CLOCK[kind] | {"Description": words}
    with written_whole(path) as temporary:
        (_with_caption(figure) if kind == "pdf" else figure).savefig(temporary, metadata=about)


def page_of(figure: Figure, name: str) -> FigurePage:
    """Figure as SVG, its title and caption apart.

    Parameters
    ----------
    figure : Figure
        Drawn; its title is taken out of it.
    name : str
        Of the page.

    Returns
    -------
    FigurePage
        Whose texts are not escaped yet, but for those in the SVG.
    """
    heading = figure.get_suptitle()
    if heading:
        figure.suptitle("")
    return FigurePage(name, heading, caption_of(figure), svg_of(figure))


def svg_of(figure: Figure) -> str:
    """SVG of a figure for use within a page: its letters are text, and equal figures give equal bytes.

    Parameters
    ----------
    figure : Figure
        Drawn.

    Returns
    -------
    str
        From ``<svg`` on, without names that another figure of the page has as well.
    """
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    buffer = io.StringIO()
    figure.set_dpi(FINE)
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "vibrissa"}):  # drawn once: savefig does it twice
        FigureCanvasSVG(figure).print_svg(buffer, metadata=_PLAIN)  # type: ignore[no-untyped-call]
    text = buffer.getvalue()
    return _named_clips(_NUMBERED.sub("", text[text.index("<svg") :]))


def _named_clips(svg: str) -> str:
    """SVG whose clips are named by the rectangles as printed; by unrounded ones, equal figures differ now and then."""
    names = {name: f"p{sha256(inner.encode()).hexdigest()[:10]}" for name, inner in _CLIP.findall(svg)}
    return _CLIPPED.sub(lambda found: names.get(found[0], found[0]), svg)


def write_pdf(path: Path, figures: Iterable[Figure]) -> None:
    """Write figures as pages of one PDF.

    Parameters
    ----------
    path : Path
        The file.
    figures : iterable of Figure
        Each is drawn when it is its turn.
    """
    from matplotlib.backends.backend_pdf import PdfPages

    with written_whole(path) as temporary, PdfPages(temporary, metadata=CLOCK["pdf"]) as pdf:
        for figure in figures:
            pdf.savefig(_with_caption(figure), dpi=FINE)


def _with_caption(figure: Figure) -> Figure:
    """The figure made taller, with its caption as text below the panels."""
    words = fill(caption_of(figure), int(_LETTERS * figure.get_figwidth()))
    if words:
        figure.set_figheight(figure.get_figheight() + _LINE * (2 + words.count("\n")))
        figure.supxlabel(words, x=0.01, ha="left", fontsize=8, parse_math=False)
    return figure


def write_html(
    path: Path, table: dict[str, Any], first: FigurePage, pages: Iterable[FigurePage], remarks: Sequence[str]
) -> None:
    """Write one page of HTML: what is to be said, the first figure, the table, and the others below.

    Parameters
    ----------
    path : Path
        The file.
    table : dict
        From :func:`vibrissa.study.report.unit_table.unit_table`, its links to the names of the pages.
    first, pages
        The figures.
    remarks : sequence of str
        Lines at the top.
    """
    _write(path, title=first.heading, first=first, table=table, shown=pages, remarks=remarks, below=True)


def write_folder(
    folder: Path, table: dict[str, Any], first: FigurePage, pages: Iterable[FigurePage], remarks: Sequence[str]
) -> None:
    """Write the same as a folder: ``index.html``, and a file for each page; pages of an earlier run are removed.

    Parameters
    ----------
    folder : Path
        Is made, if it is not there.
    table : dict
        Its links to the files of the pages.
    first, pages, remarks
        As in :func:`write_html`.
    """
    folder.mkdir(exist_ok=True)
    for old in folder.glob("unit-*.html"):
        old.unlink()
    for page in pages:
        _write(folder / f"{page.name}.html", title=page.heading, shown=[page], back=INDEX)
    _write(folder / INDEX, title=first.heading, first=first, table=table, remarks=remarks)


def _write(path: Path, **words: Any) -> None:
    """One file of HTML, written as it is drawn."""
    from jinja2 import Environment, PackageLoader, select_autoescape

    environment = Environment(loader=PackageLoader("vibrissa.study"), autoescape=select_autoescape())
    with written_whole(path) as temporary:
        stream = environment.get_template("pages.html").stream(version=__version__, **words)
        stream.dump(str(temporary), encoding="utf-8")
