"""List every option of the command line with its meaning, its form and its verbs, in docs/options.md.

python docs/make_options.py
"""

import types
from collections import defaultdict
from pathlib import Path
from typing import Annotated, Literal, Union, get_args, get_origin

from cyclopts import Parameter

from vibrissa.cli import app
from vibrissa.cli.shared.words.glossary import GLOSSARY, SHARES
from vibrissa.cli.shared.words.refusals import argument_for
from vibrissa.cli.shared.words.units import DIMENSIONS

DOCS = Path(__file__).parent
HEAD = """# Every option

An option has one name and one meaning in all commands. A quantity is a number with its unit, `40mm`, `70deg`,
`100mm/s`, `95um` (or `95µm`), `2kHz`, `10ms`; a bare number is in SI units. Where the package takes a share of the
length L of the nontruncated cone, a bare number is that share, and a length is divided by L, so a whisker must be given
(`--whisker.length` or `--atlas`). A map takes `FIRST:LAST:HOW-MANY` or a list with commas, `45deg:80deg:7`.

The last column is the argument's name in Python, and the key in a study file where it has one.

*Made from the glossary by `docs/make_options.py`.*
"""
TABLE = """
| option | meaning | written | commands | in Python |
|---|---|---|---|---|
"""
ROOMS = {  # of the commands that have an option
    "mechanics": "Whiskers, surfaces and sensors",
    "movies": "Movies",
    "spikes": "Spikes",
    "studies": "Studies",
    "several": "Commands of several kinds",
}
PLAIN = {float: "number", int: "count", str: "text", bool: "flag", Path: "file"}


def options():
    """Give the kinds that every option has, by verb."""
    found = defaultdict(dict)
    for verb in sorted(name for name in app if not name.startswith("-")):
        for argument in app[verb].assemble_argument_collection():
            if not argument.children:
                for name in {argument.name, *(set(argument.names) & set(GLOSSARY))}:
                    found[name][verb] = kind(argument.field_info.annotation)
    return found


def kind(hint):
    """Give the glossary's kind of an annotation; of a list or a tuple that of what it holds."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        readers = (one.converter for one in inner[1:] if isinstance(one, Parameter))
        ours = (getattr(reader, "kind", None) for reader in readers)
        return next(filter(None, ours), None) or kind(inner[0])
    if origin in (list, tuple, Union, types.UnionType):
        return kind(next(one for one in inner if one is not type(None)))
    return "choice" if origin is Literal else PLAIN[hint]


def page():
    """Give the page: a table for each kind of command, in the order of the glossary."""
    found = options()
    parts = {room: [name for name in GLOSSARY if room_of(found[name]) == room] for room in ROOMS}
    return HEAD + "".join(
        f"\n## {ROOMS[room]}\n{TABLE}" + "".join(line(name, sorted(found[name])) for name in names)
        for room, names in parts.items()
    )


def room_of(verbs):
    """Give the kind of the commands that have an option; "several" if they are of more than one."""
    rooms = {app[verb].default_command.__module__.split(".")[2] for verb in verbs}
    return rooms.pop() if len(rooms) == 1 else "several"


def line(name, verbs):
    """Give one line of the table."""
    one = GLOSSARY[name]
    form = "" if one.kind in ("flag", "choice") and not one.example else f"`{one.example}`"
    if name in SHARES:
        form = f"`{SHARES[name]}` over L, or {form}"
    elif one.kind in DIMENSIONS:
        form += f" ({DIMENSIONS[one.kind].unit})"
    cells = (f"`{name}`", one.meaning, form, ", ".join(verbs), f"`{argument_for(name)}`")
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"


if __name__ == "__main__":
    (DOCS / "options.md").write_text(page(), encoding="utf-8")
