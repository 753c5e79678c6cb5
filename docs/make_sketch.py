"""Sketch of a whisker on a gap with the symbols of the pages: python docs/make_sketch.py [PICTURE]."""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Arc

import vibrissa as vb
from vibrissa.figures.colours import MEASURED

LENGTH = 40.0  # [mm]
DEPTH, GAP, FREE = 1.2, (0.0, 3.4), 8.0  # [mm]: of the gap, its edges from the contact, length of the free end


def shaft():
    """Place of the shaft at rest [mm], the contact at 0, 0, and its thickness in points."""
    rest = vb.profile(vb.Whisker(length=LENGTH * 1e-3, cone_angle=1.5e-3), vb.Posture(contact=0.29, base_angle=1.2))
    x, y = LENGTH * rest.profile_x.values, LENGTH * rest.profile_y.values
    return x - x[0], y, np.linspace(1.5, 5.0, x.size)


def draw(path):
    """Draw the sketch."""
    x, y, thick = shaft()
    figure, ax = plt.subplots(figsize=(7.2, 4.2), layout="constrained")
    near, far = GAP[1], GAP[0]
    for left, right in ((-14, far), (near, x[-1] + 6)):
        ax.fill_between([left, right], -3, 0, color="0.85", lw=0)
    ax.fill_between([far, near], -3, -DEPTH, color="0.85", lw=0)
    for k in range(x.size - 1):
        ax.plot(x[k : k + 2], y[k : k + 2], color=MEASURED, lw=thick[k], solid_capstyle="round")
    slope = np.arctan2(y[1] - y[0], x[1] - x[0])
    ax.plot([0, -FREE * np.cos(slope)], [0, 0.35], color=MEASURED, lw=1.2, ls=(0, (4, 2)))
    note(ax, x, y)
    ax.set(xlim=(-14, x[-1] + 7), ylim=(-4.6, y[-1] + 5), aspect="equal")
    ax.axis("off")
    figure.savefig(path, dpi=150)


def note(ax, x, y):
    """Write the symbols."""
    arrow = {"arrowstyle": "<->", "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
    top, right = y[-1], x[-1]
    ax.annotate("", (right + 3, 0), (right + 3, top), arrowprops=arrow)
    ax.text(right + 3.5, top / 2, "$H$", va="center")
    ax.plot([right, right + 4], [top, top], color="0.6", lw=0.6)
    ax.text(right - 0.8, top + 1.2, "base, held\n$s=1$", ha="right")
    ax.annotate(
        "contact $\\varepsilon$", (0, 0.1), (-2.5, 5.0), ha="center", arrowprops={"arrowstyle": "->", "lw": 0.8}
    )
    ax.text(-9, 1.0, "free end, tip", ha="center")
    ax.annotate("", (GAP[0], -2.0), (GAP[1], -2.0), arrowprops=arrow)
    ax.text(sum(GAP) / 2, -3.6, "gap, width $\\lambda$", ha="center")
    ax.text(GAP[0] - 0.4, -1.0, "far edge", ha="right", va="top", fontsize=9)
    ax.text(GAP[1] + 0.4, -1.0, "near edge", ha="left", va="top", fontsize=9)
    ax.annotate("", (-13, -2.4), (-8, -2.4), arrowprops={"arrowstyle": "->", "lw": 1.2})
    ax.text(-10.5, -3.9, "ground moves, $v$", ha="center")
    ax.plot([right, right - 6], [top, top], color="0.6", lw=0.6)
    ax.add_patch(Arc((right, top), 9, 9, theta1=180, theta2=180 + np.degrees(1.2), lw=0.8))
    ax.text(right - 5.2, top - 3.0, "$\\theta_b$", ha="right")


if __name__ == "__main__":
    draw(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "sketch.png")
