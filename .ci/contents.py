"""Compare wheels with the files of the package: python contents.py WHEEL AGAIN, names on stdin, each ended by NUL."""

import sys
import zipfile


def contents(path):
    """Read every file of a wheel."""
    with zipfile.ZipFile(path) as wheel:
        return {name: wheel.read(name) for name in wheel.namelist()}


wheel, again = map(contents, sys.argv[1:])
assert wheel == again, "the wheel of the source distribution differs"
given = [name for name in sys.stdin.read().split("\0") if name]
kept = {name.removeprefix("src/") if name.startswith("src/") else f"vibrissa/data/{name}": name for name in given}
about = {name for name in wheel if name.startswith("vibrissa-")}
assert wheel.keys() - about == kept.keys(), (wheel.keys() - about) ^ kept.keys()
for name, path in kept.items():
    with open(path, "rb") as file:
        assert wheel[name] == file.read(), name
assert "vibrissa/py.typed" in wheel
assert sum(name.endswith("licenses/LICENSE") for name in about) == 1
print(f"wheel: {len(kept)} files of the package and its examples, its licence; the same from the source distribution")
