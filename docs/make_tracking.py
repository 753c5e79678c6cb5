"""Draw how well lines are placed over their contrast, from the folder of benchmarks/tracking_truth.py and whisk.py.

python docs/make_tracking.py FOLDER OUT.png
"""

import csv
import sys
from pathlib import Path

import numpy as np

from vibrissa.figures.canvas import house_style, new_figure

CONTRASTS = (110, 75, 45, 32, 24, 15)
LOOKS = {
    "matched": ("#0072B2", "o", "matched profile (default)"),
    "barycentre": ("#D55E00", "s", "five-pixel barycentre"),
    "matched, 17 columns": ("#56B4E9", "v", "matched, smoothed over 17 columns"),
    "WHISK": ("#009E73", "^", "WHISK 1.2.5, which sees 17 columns"),
}
MOST_LOST = 0.5  # share above which a cell is not drawn


def read(folder, end):
    """Rows of the six files of even contrast that are there, each with its contrast."""
    found = []
    for contrast in CONTRASTS:
        path = folder / f"contrast_{contrast}{end}"
        if path.is_file():
            found += [{"contrast": contrast, **row} for row in csv.DictReader(path.open())]
    return found


def cells(rows, by, name):
    """Contrast, and mean and standard error over seeds of one column of those found by one of them."""
    found = []
    for contrast in CONTRASTS:
        mine = [row for row in rows if row["contrast"] == contrast and row["by"] == by]
        if mine and (name == "bound" or np.mean([float(row["lost"]) for row in mine]) < MOST_LOST):
            values = np.array([float(row[name]) for row in mine])
            values = values[~np.isnan(values)]
            found.append((contrast, values.mean(), values.std(ddof=1) / np.sqrt(values.size)))
    return np.array(found).T


@house_style
def draw(rows):
    """Two panels: scatter in time against the bound, and 95 % of the errors."""
    figure, axes = new_figure(7.5, 4.2, 1, 2, sharex=True)
    titles = ("Scatter in time, median over columns", "95 % of the errors' magnitudes")
    for axis, name, times, title in zip(axes.flat, ("sd", "p95"), (1.0, 1.96), titles, strict=True):
        contrast, floor, _ = cells(rows, "matched", "bound")
        axis.plot(contrast, times * floor, "k--", label="least possible from one column (right: 1.96 times that)")
        for by, (colour, marker, named) in LOOKS.items():
            found = cells(rows, by, name)
            if found.size:
                axis.errorbar(*found[:2], found[2], color=colour, marker=marker, ms=4.5, label=named)
        axis.set(xscale="log", yscale="log", title=title, xlabel="contrast of the line [grey levels]")
        axis.set_xticks(CONTRASTS, [str(one) for one in CONTRASTS])
        axis.minorticks_off()
        ticks = [0.01, 0.02, 0.05, 0.1, 0.2] if times == 1 else [0.02, 0.05, 0.1, 0.2, 0.5]
        axis.set_yticks(ticks, [f"{one:g}" for one in ticks])
        axis.set_ylabel("SD [px]" if times == 1 else "error [px]")
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


if __name__ == "__main__":
    folder, out = map(Path, sys.argv[1:])
    draw([row for end in (".csv", ".smooth.csv", ".whisk.csv") for row in read(folder, end)]).savefig(
        out, metadata={"Software": None}
    )
