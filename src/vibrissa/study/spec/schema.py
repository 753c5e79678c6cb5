"""The JSON Schema of a study file, by which an editor completes keys, shows what they mean and marks mistakes."""

from __future__ import annotations

import importlib
import inspect
import re
import typing
from typing import Any

from vibrissa.study.spec.checked import HIDDEN, keys_of, parts_of
from vibrissa.study.spec.settings import Study

DRAFT = "http://json-schema.org/draft-07/schema#"  # the one that every editor reads
TITLE = "Study of vibrissa"

_ROLE = re.compile(r":\w+:`~?([\w.]+)`")
_ENTRY = re.compile(r"^(?P<names>\w+(?:, \w+)*)(?: : .*)?$")


def study_schema() -> dict[str, Any]:
    """Schema of a study file: every key with its type, its default, and what its docstring says, units included.

    Returns
    -------
    dict
        JSON Schema, draft 7. An unknown key is an error, as it is to
        :func:`vibrissa.study.spec.settings.read_study`; only the latter checks keys against one another.
    """
    from pydantic import TypeAdapter

    made = TypeAdapter(Study).json_schema(ref_template="#/definitions/{model}")
    kinds = {kind.__name__: kind for kind in _kinds(Study)}
    parts = {name: _part(table, kinds[name]) for name, table in made.pop("$defs").items()}
    return {"$schema": DRAFT, **_part(made, Study), "title": TITLE, "definitions": parts}


def _kinds(cls: type) -> set[type]:
    """The dataclass and every one that its fields hold."""
    hints = typing.get_type_hints(cls)
    inner = (kind for key in keys_of(cls) for kind in parts_of(hints[key])[0])
    return {cls}.union(*map(_kinds, inner))


def _part(made: dict[str, Any], kind: type) -> dict[str, Any]:
    """Schema of one table of a file."""
    meant = described(kind)
    keys = {name: made["properties"][name] for name in keys_of(kind)}
    properties = {name: {"description": meant[name], **_value(value)} for name, value in keys.items()}
    needed = [name for name in made.get("required", []) if name not in HIDDEN]
    schema = {"description": _plain((inspect.getdoc(kind) or "").partition("\n\n")[0]), "type": "object"}
    return schema | {"properties": properties, "additionalProperties": False} | ({"required": needed} if needed else {})


def _value(made: Any) -> Any:
    """Schema of one value, as TOML has it: what may be absent is left out and never null; a tuple is a list."""
    if not isinstance(made, dict):
        return made
    schema = {key: _value(value) for key, value in made.items() if key not in ("title", "anyOf", "prefixItems")}
    if schema.get("default", ...) is None:
        del schema["default"]
    if "prefixItems" in made:
        schema |= {"items": [_value(one) for one in made["prefixItems"]]}
    some = [_value(one) for one in made.get("anyOf", []) if one != {"type": "null"}]
    if len(some) == 1 and "$ref" in some[0]:
        return schema | {"allOf": some}  # beside a bare $ref draft 7 sees nothing else
    if "$ref" in schema:
        return {"allOf": [{"$ref": schema.pop("$ref")}], **schema}
    return schema | (some[0] if len(some) == 1 else {"anyOf": some} if some else {})


def described(kind: Any) -> dict[str, str]:
    """What a docstring says of each attribute or parameter, in plain text.

    Parameters
    ----------
    kind : class or function
        With a section *Attributes* or *Parameters*. Where an attribute says "See" and names a function, the
        text is that of the function's parameters.

    Returns
    -------
    dict of str
        By attribute.
    """
    meanings: dict[str, str] = {}
    for names, text in _entries(inspect.getdoc(kind) or ""):
        meanings |= dict.fromkeys(names, _plain(text))
        if text.startswith("See ") and (role := _ROLE.search(text)):
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


def _plain(text: str) -> str:
    return _ROLE.sub(r"\1", " ".join(text.split())).replace("``", "")


def _named(path: str) -> Any:
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(module), name)
