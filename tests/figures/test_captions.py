"""A caption is text beside its picture, wherever that goes, and never in it."""

import html
import sys
from pathlib import Path

import numpy as np
import pytest

from vibrissa.figures.canvas import add_caption, caption_of, key_above, new_figure
from vibrissa.quantities import dataset
from vibrissa.study.report.pages import write_picture

WORDS = "A, rate < 5 Hz at ε = 0.29; θ_b & more. B, $x$."


@pytest.fixture
def figure():
    drawn, axes = new_figure(3.0, 2.0)
    axes[0, 0].plot([0, 1], label="line")
    axes[0, 0].set_title("A  Title")
    key_above(axes[0, 0])
    return add_caption(drawn, dataset({"caption": WORDS}, time=np.arange(2.0)))


def test_the_caption_is_not_in_the_picture(figure):
    assert caption_of(figure) == WORDS
    assert figure.get_supxlabel() == ""
    assert WORDS not in [text.get_text() for text in figure.findobj(match=lambda one: hasattr(one, "get_text"))]


def test_png_and_svg_carry_it_and_the_pages_of_the_docs_read_it_there(figure, tmp_path):
    sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
    try:
        from pictured import caption
    finally:
        sys.path.pop(0)
    write_picture(figure, tmp_path / "one.png")
    assert caption(tmp_path / "one.png") == WORDS
    write_picture(figure, tmp_path / "one.svg")
    assert html.escape(WORDS, quote=False) in (tmp_path / "one.svg").read_text(encoding="utf-8")


def test_html_and_notebooks_have_it_below_the_picture(figure, tmp_path):
    shown = figure._repr_html_()
    assert shown.index("<img") < shown.index(f"<figcaption>{html.escape(WORDS)}</figcaption>")
    write_picture(figure, tmp_path / "one.html")
    page = html.unescape((tmp_path / "one.html").read_text(encoding="utf-8"))
    assert page.index("<svg") < page.index(WORDS)


def test_pdf_has_it_as_text_in_a_taller_page(figure, tmp_path):
    height = figure.get_figheight()
    write_picture(figure, tmp_path / "one.pdf")
    assert figure.get_figheight() > height
    assert figure.get_supxlabel().replace("\n", " ") == WORDS


def test_a_legend_lies_above_the_panel_and_below_the_title(figure):
    figure.draw_without_rendering()
    axis = figure.axes[0]
    legend, title = axis.get_legend().get_window_extent(), axis._left_title.get_window_extent()
    assert axis.get_window_extent().y1 <= legend.y0 + 1
    assert legend.y1 <= title.y0 + 2


def test_a_figure_without_a_caption_is_a_picture_alone():
    plain, _ = new_figure(1.0, 1.0)
    assert caption_of(plain) == ""
    assert plain._repr_html_() is None
