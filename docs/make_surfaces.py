"""Draw three measured surfaces: as their files hold them, as the whisker meets them, and what it answers.

python docs/make_surfaces.py SURFACES [FOLDER]

SURFACES is a folder with the example files of SurfaceTopography that are named below.
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.figures.canvas import house_style, new_figure
from vibrissa.figures.colours import FITTED, LAND, MEASURED, PREDICTED, TRUTH
from vibrissa.mechanics.scan.relief_prediction import predict_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.io import read_height_profile
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.040, cone_angle=1.5e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
SCAN = Scan(speed=0.1, damping=0.11)
RATE, POINT, AFTER = 20e3, 0.6, 0.03  # [Hz], s of the point of the shaft that is drawn, [s] of ringing
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
    axes.set(title=title, xlabel="place [mm]", ylabel=f"height [{unit}]")
    return factor


def answer(axes, prediction):
    """Displacement of one point of the shaft from its place on level ground."""
    t = np.arange(0, prediction.end + AFTER, 1 / RATE)
    u = prediction.displacement(t, np.array([POINT]))[:, 0] * WHISKER.length
    factor, unit = scale(u)
    axes.plot(t * 1e3, u * factor, color=PREDICTED)
    distance = (1 - POINT) * WHISKER.length
    axes.set(title=f"shaft, {distance * 1e3:g} mm from its base", xlabel="time [ms]", ylabel=f"displacement [{unit}]")


@house_style
def draw(case):
    """Heights of the file with what is taken from them, and the relief."""
    path, where, how = case
    held, relief = read_height_profile(path, **where, **AS_HELD), read_height_profile(path, **where, **how)
    prediction = predict_relief(WHISKER, POSTURE, relief, SCAN)
    figure, ((left, middle, right),) = new_figure(9.6, 2.2, 1, 3)
    factor = panel(left, held, f"{path.name}: the file", color=MEASURED)
    if "part" in how:
        left.axvspan(*(1e3 * np.array(how["part"])), color=TRUTH, alpha=0.2, linewidth=0)
    if how["level"] == "line":
        line = np.polynomial.Polynomial.fit(held.position, held.height, 1)
        left.plot(held.position * 1e3, line(held.position) * factor, color=FITTED)
    touched = np.unique(prediction.episodes.place * WHISKER.length)
    touched = touched[(touched > 0) & (touched < relief.position[-1])]
    factor = panel(middle, relief, f"the whisker rests on {touched.size} places", color=LAND, linewidth=0.7)
    middle.plot(touched * 1e3, relief.at(touched) * factor, ".", color=PREDICTED, markersize=3)
    answer(right, prediction)
    return figure


if __name__ == "__main__":
    surfaces = Path(sys.argv[1])
    folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(__file__).parent
    for name, (where, how) in SURFACES.items():
        figure = draw((surfaces / name, where, how))
        figure.savefig(folder / f"surface-{name.partition('.')[0]}.png", metadata={"Software": None})
