"""Write docs/validation/paper-truth.csv and paper-numbers.csv from a folder of results.

python docs/make_results.py FOLDER
"""

import csv
import sys
from pathlib import Path

from vibrissa.files import written_whole
from vibrissa.netcdf import load
from vibrissa.study.paper.paper_numbers import compare
from vibrissa.study.paper.paper_table import headings, html_rows

VALIDATION = Path(__file__).parent / "validation"


def truth(verdict):
    """Truth and found over the sweeps."""
    yield "quantity", "median error", "SD over sweeps", "95 % intervals that hold the truth", "sweeps"
    for i in range(verdict.sizes["entry"]):
        name, unit = str(verdict.quantity.values[i]), str(verdict.error_unit.values[i])
        median, spread = (float(verdict[f"error_{end}"][i]) for end in ("median", "spread"))
        covered = f"{100 * float(verdict.covered[i]):.0f} %"
        if unit == "1":
            errors = f"{100 * median:+.3f} %", f"{100 * spread:.2f} %"
        else:
            errors = f"{median:+.5f} {unit}", f"{spread:.5f} {unit}"
        yield name, *errors, covered, int(verdict.entry_count[i])


def paper(results):
    """Every number of the paper beside the number found here."""
    rows = compare(results)
    yield "paper", "Fig.", *headings(rows), "origin"
    for row in html_rows(rows):
        cells = (f"{one['here']} {one['verdict']}".strip() for one in row["columns"])
        yield row["paper"], row["figure"], *cells, row["origin"]


if __name__ == "__main__":
    results = {path.stem: load(path) for path in sorted(Path(sys.argv[1]).glob("*.nc"))}
    for name, rows in (("truth", truth(results["sweep_verdict"])), ("numbers", paper(results))):
        with written_whole(VALIDATION / f"paper-{name}.csv") as temporary, temporary.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)
