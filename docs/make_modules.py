"""List every module of the package by room, with the first sentence of its docstring, in docs/modules.md.

python docs/make_modules.py
"""

import ast
from pathlib import Path

from make_layers import layers

DOCS = Path(__file__).parent
SOURCE = DOCS.parent / "src" / "vibrissa"
HEAD = """# Every module, room by room

From the bottom up: a room imports only from rooms above it on this page. What each module offers is on the pages of the
[API](api.rst).

*Made from the modules' own docstrings by `docs/make_modules.py`.*
"""


def page():
    """Give the page, from the lowest room to the command line."""
    rooms = [room for row in reversed(layers()) for room in row if not room.startswith("_")]
    return HEAD + "".join(section(SOURCE / room, 2) for room in rooms)


def section(place, depth):
    """Give a room or sub-room: what it is, its modules, then its sub-rooms."""
    if not place.is_dir():
        return f"\n## {place.name}\n\n{sentence(place.with_suffix('.py'))}\n"
    title = place.relative_to(SOURCE).as_posix()
    modules = [path for path in sorted(place.glob("*.py")) if not path.name.startswith("_")]
    lines = "".join(f"- `{path.stem}` — {sentence(path)}\n" for path in modules)
    rooms = [path.parent for path in sorted(place.glob("*/__init__.py"))]
    text = f"\n{'#' * depth} {title}\n\n{sentence(place / '__init__.py')}\n" + ("\n" + lines if lines else "")
    return text + "".join(section(room, depth + 1) for room in rooms)


def sentence(path):
    """Give the first paragraph of a module's docstring, in Markdown."""
    first = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))).partition("\n\n")[0]
    return " ".join(first.split()).replace("``", "`").replace("<", "&lt;")


if __name__ == "__main__":
    (DOCS / "modules.md").write_text(page(), encoding="utf-8")
