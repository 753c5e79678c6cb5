"""Choose the fast tests: as many as fit the budget, the quickest first; the others are named in ``slow.txt``.

python3 run.py test --junitxml=times.xml && .venv/bin/python tests/choose_fast.py times.xml
python3 run.py test --fast --junitxml=times.xml && .venv/bin/python tests/choose_fast.py times.xml

on a machine that does nothing else; the second line more than once, since what several tests share counts for the first
that runs. A test that was not run keeps its place.
"""

import sys
import xml.etree.ElementTree
from collections import Counter
from itertools import accumulate
from pathlib import Path

BUDGET = 60.0  # [s] of one core
ROOT = Path(__file__).parents[1]
SLOW = Path(__file__).with_name("slow.txt")


def times(report):
    """Seconds that each test took, of all its parameters together, by its name."""
    taken = Counter()
    for case in xml.etree.ElementTree.parse(report).iter("testcase"):
        place = case.get("classname").replace(".", "/")
        taken[f"{place}.py::{case.get('name').partition('[')[0]}"] += float(case.get("time"))
    return taken


def slow(taken, before=()):
    """Names of the tests beyond the budget, and of those that were slow before and were not run."""
    ordered = sorted(taken, key=lambda name: (taken[name], name))
    fit = sum(total <= BUDGET for total in accumulate(taken[name] for name in ordered))
    return sorted({*ordered[fit:], *(set(before) - set(taken))})


if __name__ == "__main__":
    names = slow(times(sys.argv[1]), SLOW.read_text().split())
    SLOW.write_text("".join(f"{name}\n" for name in names))
