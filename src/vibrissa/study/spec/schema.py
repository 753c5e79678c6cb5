"""The JSON Schema of a study file, by which an editor completes keys, shows what they mean and marks mistakes."""

from __future__ import annotations

import inspect
import typing
from typing import Any

from vibrissa.study.spec.checked import HIDDEN, keys_of, parts_of
from vibrissa.study.spec.described import described, plain, units_of
from vibrissa.study.spec.settings import Study
from vibrissa.tables.quantity import QUANTITY

DRAFT = "http://json-schema.org/draft-07/schema#"  # the one that every editor reads
TITLE = "Study of vibrissa"
WITH_UNIT = f"^{QUANTITY.pattern}$"


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
    values = {name: _quantity(_value(one)) if units_of(kind, name) else _value(one) for name, one in keys.items()}
    properties = {name: {"description": meant[name], **value} for name, value in values.items()}
    needed = [name for name in made.get("required", []) if name not in HIDDEN]
    schema = {"description": plain((inspect.getdoc(kind) or "").partition("\n\n")[0]), "type": "object"}
    return schema | {"properties": properties, "additionalProperties": False} | ({"required": needed} if needed else {})


def _quantity(made: Any) -> Any:
    """Schema of numbers, each of which may be text with its unit instead."""
    if isinstance(made, list):
        return [_quantity(one) for one in made]
    if not isinstance(made, dict):
        return made
    if made.get("type") == "number":
        rest = {key: value for key, value in made.items() if key in ("default", "description")}
        number = {key: value for key, value in made.items() if key not in rest}
        return rest | {"anyOf": [number, {"type": "string", "pattern": WITH_UNIT}]}
    return {key: value if key == "default" else _quantity(value) for key, value in made.items()}


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
