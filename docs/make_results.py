"""Write the tables of docs/results.md from a folder of results: truth and found, and paper | here | same?.

python docs/make_results.py FOLDER
"""

import sys
from pathlib import Path

from vibrissa.files import written_whole
from vibrissa.netcdf import load
from vibrissa.study.paper.paper_numbers import compare, headings, html_rows

DOCS = Path(__file__).parent


def line(*cells):
    """One line of a table."""
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |\n"


def truth(verdict):
    """Truth and found over the sweeps."""
    text = line("quantity", "median error", "SD over sweeps", "95 % intervals that hold the truth", "sweeps")
    text += line(*["---"] * 5)
    for i in range(verdict.sizes["entry"]):
        name, unit = str(verdict.quantity.values[i]), str(verdict.error_unit.values[i])
        median, spread = (float(verdict[f"error_{end}"][i]) for end in ("median", "spread"))
        covered = f"{100 * float(verdict.covered[i]):.0f} %"
        if unit == "1":
            errors = f"{100 * median:+.3f} %", f"{100 * spread:.2f} %"
        else:
            errors = f"{median:+.5f} {unit}", f"{spread:.5f} {unit}"
        text += line(name, *errors, covered, int(verdict.entry_count[i]))
    return text


def paper(results):
    """Every number of the paper beside the number found here."""
    rows = compare(results)
    heads = ["paper", "Fig.", *headings(rows), "origin"]
    text = line(*heads) + line(*["---"] * len(heads))
    for row in html_rows(rows):
        cells = (f"{one['here']} **{one['verdict']}**" if one["verdict"] else "" for one in row["columns"])
        text += line(row["paper"], row["figure"], *cells, row["origin"])
    return text


if __name__ == "__main__":
    results = {path.stem: load(path) for path in sorted(Path(sys.argv[1]).glob("*.nc"))}
    for name, text in (("truth", truth(results["sweep_verdict"])), ("paper", paper(results))):
        with written_whole(DOCS / f"results-{name}.txt") as temporary:
            temporary.write_text(text, encoding="utf-8")
