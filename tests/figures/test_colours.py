"""One colour has one meaning: every figure takes its colours from the one table."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from vibrissa.figures import colours

FIGURES = Path(colours.__file__).parent
STRAY = re.compile(r"""["'](?:#[0-9A-Fa-f]{6}|C\d|tab:\w+)["']""")
MEANINGS = (colours.MEASURED, colours.FITTED, colours.PREDICTED, colours.SINGLE, colours.MULTI, *colours.KINDS)


def strays(text):
    """Colours of a source that are written out."""
    return [found for line in text.splitlines() if "color" in line or "COLOUR" in line for found in STRAY.findall(line)]


@pytest.mark.parametrize("path", sorted(FIGURES.rglob("*.py")), ids=lambda path: path.stem)
def test_a_figure_writes_no_colour_of_its_own(path):
    if path.name != "colours.py":
        assert strays(path.read_text(encoding="utf-8")) == []


def test_a_stray_colour_is_found():
    assert strays('axis.plot(x, color="#0072B2")\nCOLOURS = ("C3", "tab:red")') == ['"#0072B2"', '"C3"', '"tab:red"']


def test_lines_without_a_colour_take_those_of_kinds():
    style = (FIGURES / "style.mplstyle").read_text(encoding="utf-8")
    assert re.findall(r'"([0-9A-F]{6})"', style) == [one.lstrip("#") for one in colours.KINDS]


def test_no_two_meanings_look_alike():
    rgb = [np.array(to_rgb(one)) for one in MEANINGS]
    assert min(np.linalg.norm(a - b) for a, b in combinations(rgb, 2)) > 0.2
