"""Draw three measured surfaces: as their files hold them, and as the whisker meets them.

python docs/make_surfaces.py SURFACES [FOLDER]

SURFACES is a folder with the example files of SurfaceTopography that are named below.
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.figures.canvas import FOUND, OTHER, TRUTH, house_style, new_figure
from vibrissa.texture.io import read_relief

AS_HELD = {"level": "none", "fill": True}
SURFACES = {
    "hfm-1.hfm": ({}, {"level": "line"}),
    "dektak-1.csv": ({}, {"level": "line"}),
    "sur-3.sur": ({"line": "x:255"}, {"part": (0.06, 0.09), "level": "none"}),
}


def scale(height):
    """Micrometres, or nanometres and millimetres where these read better."""
    span = np.ptp(height)
    return (1e3, "mm") if span > 1e-3 else (1e6, "µm") if span > 1e-6 else (1e9, "nm")


def panel(axes, relief, title, **look):
    """Height along the scan, in the unit that suits it."""
    factor, unit = scale(relief.height)
    axes.plot(relief.position * 1e3, relief.height * factor, **look)
    axes.set(title=title, xlabel="place (mm)", ylabel=f"height ({unit})")
    return factor


@house_style
def draw(case):
    """Heights of the file with what is taken from them, and the relief."""
    path, where, how = case
    held, relief = read_relief(path, **where, **AS_HELD), read_relief(path, **where, **how)
    figure, ((left, right),) = new_figure(7.2, 2.1, 1, 2)
    factor = panel(left, held, f"{path.name}: the file", color=TRUTH, linewidth=2)
    if "part" in how:
        left.axvspan(*(1e3 * np.array(how["part"])), color=OTHER, alpha=0.2, linewidth=0)
    if how["level"] == "line":
        line = np.polynomial.Polynomial.fit(held.position, held.height, 1)
        left.plot(held.position * 1e3, line(held.position) * factor, color=OTHER)
    panel(right, relief, "what the whisker meets", color=FOUND, linewidth=0.7)
    return figure


if __name__ == "__main__":
    surfaces = Path(sys.argv[1])
    folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(__file__).parent
    for name, (where, how) in SURFACES.items():
        figure = draw((surfaces / name, where, how))
        figure.savefig(folder / f"surface-{name.partition('.')[0]}.png", metadata={"Software": None})
