"""Make the package's tables of measured rat whiskers from the table of Belli et al.

Run as ``python docs/make_atlas.py belli2016-519-rat-whiskers.csv``; Hartmann's resonances
(``hartmann2003_table2_resonance.csv``, ``hartmann2003_C1_modes.csv``) are looked for beside it. Writes
``atlas.csv`` (one line per position on the snout) and ``hartmann2003.csv`` (one line per whisker), in SI units,
to six digits, into ``src/vibrissa/data``.

A line of the source is one whisker: row 1–5 (A–E), column 0 (the Greek arc) or more, base and tip diameter [mm], arc
length [mm]. The cone needs the tip's diameter, which 122 of the 519 have: base radius b and tip radius a over the arc
length S give the cone angle α = (b − a)/S (printed, rounded, as Slope_R), the nontruncated length L = b/α and the tip's
position a/b. Arc length and base diameter are averaged over all whiskers of a position (``n``), the tip's diameter and
the cone over those with a tip (``n_cone``). Standard deviations are across whiskers (n − 1), pooled over animals,
strains and studies; NaN where fewer than two were measured.
"""

import csv
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

GREEK = {1: "alpha", 2: "beta", 3: "gamma", 4: "delta"}
STUDIES = {
    1: "Neimark 2003",
    2: "Voges 2012",
    3: "Ibrahim 1975",
    4: "Hartmann 2003",
    5: "Kan 2013",
    6: "Birdwell 2007",
    7: "Belli 2017 (2)",
    8: "Belli 2017 (1)",
}
SOURCE = "doi 10.1152/jn.00054.2016"
ALL = ("arc_length", "base_diameter")
CONE = ("length", "cone_angle", "tip_diameter", "tip")
DATA = Path(__file__).parents[1] / "src" / "vibrissa" / "data"


def read(path):
    """Lines of a CSV file as dictionaries."""
    with open(path, encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file))


def geometry(line):
    """One whisker of the source in SI units; what needs the tip is NaN where the tip was not measured."""
    base, tip, arc = (float(line[name]) * 1e-3 for name in ("D_Base", "D_Tip", "S_Total"))
    angle = (base - tip) / 2 / arc
    row, column = int(line["Row"]), int(line["Col"])
    return {
        "name": f"{'ABCDE'[row - 1]}{column}" if column else GREEK[row],
        "row": row,
        "column": column,
        "study": int(line["DatasetID"]),
        "arc_length": arc,
        "base_diameter": base,
        "tip_diameter": tip,
        "cone_angle": angle,
        "length": base / 2 / angle,
        "tip": tip / base,
    }


def number(value):
    """A number to six digits."""
    return format(float(value), ".6g")


def moments(name, values):
    """Mean and standard deviation (n − 1) of the measured values, NaN where there are too few."""
    measured = [value for value in values if not np.isnan(value)]
    mean = np.mean(measured) if measured else np.nan
    sd = np.std(measured, ddof=1) if len(measured) > 1 else np.nan
    return {name: number(mean), f"{name}_sd": number(sd)}


def position(group):
    """The atlas' line for the whiskers of one position."""
    line = {name: group[0][name] for name in ("name", "row", "column")}
    line["n"] = len(group)
    for name in ALL:
        line |= moments(name, [whisker[name] for whisker in group])
    line["n_cone"] = sum(not np.isnan(whisker["tip"]) for whisker in group)
    for name in CONE:
        line |= moments(name, [whisker[name] for whisker in group])
    studies = sorted({whisker["study"] for whisker in group})
    line["source"] = "; ".join([STUDIES[study] for study in studies] + [SOURCE])
    return line


def isolated(whisker, folder):
    """One of Hartmann's whiskers with the resonances measured on it, NaN where there are none."""
    line = {name: whisker[name] for name in ("name", "row", "column")}
    line |= {name: number(whisker[name]) for name in (*ALL, *CONE)}
    bench = {entry["whisker"]: entry for entry in read(folder / "hartmann2003_table2_resonance.csv")}
    found = bench.get(whisker["name"], {})
    modes = {entry["mode"]: entry["measured_Hz"] for entry in read(folder / "hartmann2003_C1_modes.csv")}
    modes = modes if whisker["name"] == "C1" else {"1": found.get("f1_vibration_Hz", "nan")}
    for mode in "123":
        line[f"frequency_{mode}"] = modes.get(mode, "nan")
    line["frequency_impulse"] = found.get("f1_impulse_Hz", "nan")
    line["damping"] = found.get("zeta_vibration", "nan")
    line["damping_impulse"] = found.get("zeta_impulse", "nan")
    return line


def write(path, lines):
    """Write dictionaries as CSV."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, lines[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(lines)


def main(source):
    """Make both tables."""
    positions = defaultdict(list)
    for line in read(source):
        whisker = geometry(line)
        positions[whisker["row"], whisker["column"]].append(whisker)
    write(DATA / "atlas.csv", [position(positions[place]) for place in sorted(positions)])
    hartmann = [w for place in sorted(positions) for w in positions[place] if w["study"] == 4]
    write(DATA / "hartmann2003.csv", [isolated(whisker, source.parent) for whisker in hartmann])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
