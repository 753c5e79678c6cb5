"""What the docstring of a part of a study says of its keys: their meaning and their units."""

from __future__ import annotations

import importlib
import inspect
import re
from typing import Any

_ROLE = re.compile(r":\w+:`~?([\w.]+)`")
_ENTRY = re.compile(r"^(?P<names>\w+(?:, \w+)*)(?: : .*)?$")
_UNIT = re.compile(r"\[(m|s|Hz|rad|m/s|Pa|kg/m³|1/\(s m\))\]")


def described(kind: Any) -> dict[str, str]:
    """What a docstring says of each attribute or parameter, in plain text.

    Parameters
    ----------
    kind : class or function
        With a section *Attributes* or *Parameters*. Where an attribute says "See" or "As in" and names one, the
        text is that of the function's parameters.

    Returns
    -------
    dict of str
        By attribute.
    """
    meanings: dict[str, str] = {}
    for names, text in _entries(inspect.getdoc(kind) or ""):
        meanings |= dict.fromkeys(names, plain(text))
        if text.startswith(("See ", "As in ")) and (role := _ROLE.search(text)):
            meanings |= {name: more for name, more in described(_named(role[1])).items() if name in names}
    return meanings


def _entries(doc: str) -> list[tuple[list[str], str]]:
    """Names and text of each entry of the docstring's section."""
    parts = re.split(r"^(?:Attributes|Parameters)\n-+\n", doc, maxsplit=1, flags=re.MULTILINE)
    lines = re.split(r"^\w+\n-+$", parts[1], maxsplit=1, flags=re.MULTILINE)[0].splitlines() if len(parts) > 1 else []
    entries: list[tuple[list[str], str]] = []
    for line in lines:
        if line[:1].strip() and (head := _ENTRY.match(line)):
            entries.append((head["names"].split(", "), ""))
        elif line.strip():
            names, text = entries[-1]
            entries[-1] = names, f"{text} {line.strip()}".strip()
    return entries


def plain(text: str) -> str:
    """Text of a docstring without its markup.

    Parameters
    ----------
    text : str
        As written.

    Returns
    -------
    str
        On one line.
    """
    return _ROLE.sub(r"\1", " ".join(text.split())).replace("``", "")


def _named(path: str) -> Any:
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(module), name)


def units_of(kind: Any, key: str) -> list[str]:
    """SI units that a docstring states for an attribute.

    Parameters
    ----------
    kind, key
        Class, and the attribute.

    Returns
    -------
    list of str
        ``["m"]``; several where one sentence describes attributes of several; empty of a pure number.
    """
    return _UNIT.findall(described(kind).get(key, ""))
