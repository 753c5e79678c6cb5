"""Bits flipped in the stored results of a finished study: python benchmarks/stored_flips.py FOLDER [--flips 300].

FOLDER is one that ``vibrissa run`` wrote. One bit of its datasets, of all bits alike, takes the other value; then
the dataset is read. ``found``: reading ends with a line that names the file; ``harmless``: it holds what it held;
``unseen``: it holds something else, and nothing was said.
"""

from __future__ import annotations

import argparse
import random
import tempfile
from collections import Counter
from pathlib import Path

from vibrissa.errors import InputError
from vibrissa.netcdf import load


def flipped(path: Path, copy: Path, chance: random.Random) -> str:
    """What reading a copy with one bit flipped comes to."""
    content = bytearray(path.read_bytes())
    content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    copy.write_bytes(content)
    try:
        found = load(copy)
    except InputError as error:
        return "found" if str(copy) in str(error) else "unseen"
    return "harmless" if found.identical(load(path)) else "unseen"


def main() -> None:
    """Print the counts."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("folder", type=Path)
    asked.add_argument("--flips", type=int, default=300)
    asked.add_argument("--seed", type=int, default=0)
    given = asked.parse_args()
    paths, chance = sorted(given.folder.rglob("*.nc")), random.Random(given.seed)
    sizes = [path.stat().st_size for path in paths]
    with tempfile.TemporaryDirectory() as folder:
        chosen = chance.choices(paths, sizes, k=given.flips)
        print(dict(Counter(flipped(path, Path(folder) / path.name, chance) for path in chosen)))


if __name__ == "__main__":
    main()
