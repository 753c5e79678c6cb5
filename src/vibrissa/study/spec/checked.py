"""A table as TOML gives it, against the dataclass it is meant for: what is wrong with it, in one line."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Callable, Iterable, Iterator
from reprlib import repr as short
from typing import Any

from vibrissa.errors import FormatError, RangeError, UnknownError, did_you_mean
from vibrissa.study.spec.described import described, units_of
from vibrissa.tables.quantity import QUANTITY, converted, number
from vibrissa.whisker import DAMPING

HIDDEN = frozenset({"folder"})  # fields that no file gives

_RULES = {  # what pydantic calls an error, and what we say
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text, in quotes",
    "tuple_type": "must be a list, in [ ]",
    "missing": "must be given",
}
_USUAL = {"scan.damping": f"`vibrissa scan` takes {DAMPING}"}  # values of keys that a study must state


def validated(kind: type, table: dict[str, Any], source: str, under: tuple[str, ...] = ()) -> Any:
    """What a table says, or the first thing that is wrong with it.

    Numbers are numbers: one in quotes is refused, and so is a fraction where a whole number is meant.

    Parameters
    ----------
    kind : type
        The dataclass.
    table : dict
        As TOML gives it.
    source : str
        Names the file in errors.
    under : (str, ...)
        Place of the table in the file.

    Returns
    -------
    object
        Of that dataclass.

    Raises
    ------
    InputError
        Names the place, the rule and the value.
    """
    from pydantic import TypeAdapter, ValidationError
    from pydantic_core import to_json

    try:
        # as JSON, for only there does "strict" take a list for a tuple, as TOML has it
        return TypeAdapter(kind).validate_json(to_json(table, inf_nan_mode="constants"), strict=True)
    except ValidationError as error:
        first, *more = error.errors()
        place = _place(under, first["loc"])
        rules = dict.fromkeys(_rule(one) for one in (first, *more) if _place(under, one["loc"]) == place)
        if list(rules) == [_RULES["missing"]]:
            raise FormatError(f"{source}: {place}", _RULES["missing"], remedy=_USUAL.get(place, "")) from error
        got = "" if first["type"] in ("missing", "value_error") else f", not {short(first['input'])}"
        raise FormatError(f"{source}: {place or 'study'}", f"is not valid ({' or '.join(rules)}{got})") from error


def _place(under: tuple[str, ...], found: tuple[int | str, ...]) -> str:
    """Place in the file; pydantic also names the member of a union that it tried, which no file has."""
    return ".".join(str(one) for one in (*under, *found) if isinstance(one, int) or one.isidentifier())


def _rule(error: Any) -> str:
    kind, context = error["type"], error.get("ctx", {})
    if "error" in context:
        return str(context["error"])
    return f"must be {context['expected']}" if kind == "literal_error" else str(_RULES.get(kind, error["msg"]))


def refuse_outside(part: Any, names: Iterable[str], rule: str, holds: Callable[[Any], bool]) -> None:
    """Refuse a setting that breaks a rule.

    Parameters
    ----------
    part : dataclass
        Whose settings they are.
    names : iterable of str
        Fields that are checked.
    rule : str
        In words.
    holds : callable
        Value → whether it keeps the rule; not for NaN.

    Raises
    ------
    InputError
        Names the first such setting.
    """
    for name in names:
        if not holds(value := getattr(part, name)):
            raise RangeError(f"{type(part).__name__}.{name}", rule, value)


def checked_table(cls: Any, table: dict[str, Any], source: str) -> dict[str, Any]:
    """Refuse a key that no field has, at any depth, and give quantities that have their unit in SI.

    Parameters
    ----------
    cls : dataclass
        What the table is meant for.
    table : dict
        As TOML gives it.
    source : str
        Names the file in errors.

    Returns
    -------
    dict
        The same table, with ``"95 um"`` as 9.5e-5 where the docstring of the field states a unit.

    Raises
    ------
    InputError
        At the first such key, with the nearest right one, or the part that has it; where a part is no table, or a list
        of parts no list; or where a quantity has the unit of another kind.
    """
    return _checked_part(cls, table, source, (), dict(_sections(cls, ())))


def _checked_part(
    cls: Any, table: dict[str, Any], source: str, under: tuple[str, ...], all_parts: dict[Any, Any]
) -> dict[str, Any]:
    made: dict[str, Any] = {}
    where = f"{source}: [{'.'.join(under)}]" if under else source
    hints = typing.get_type_hints(cls)
    for key, value in table.items():
        if key not in keys_of(cls):
            raise UnknownError(f"{where}: key {key!r}", "is unknown", remedy=_cure(key, cls, under, all_parts))
        if key.endswith("seed") and isinstance(value, int) and value < 0:
            raise RangeError(f"{where}: {key}", "must be 0 or a positive whole number", value)
        kinds, many = parts_of(hints[key])
        if not kinds:
            made[key] = _in_si(cls, key, value, where) if "float" in str(hints[key]) else value
            continue
        written = ".".join((*under, key))
        if many and not (isinstance(value, list) and all(isinstance(one, dict) for one in value)):
            raise FormatError(f"{where}: {key}", "must be a list of tables", short(value), f"written [[{written}]]")
        if not many and not isinstance(value, dict):
            raise FormatError(f"{where}: {key}", "must be a table", short(value), f"written [{written}]")
        parts = [_checked_part(_meant(kinds, one, f"{source}: [{written}]"), one, source, (*under, key), all_parts)
                 for one in (value if many else [value])]  # fmt: skip
        made[key] = parts if many else parts[0]
    return made


def _in_si(cls: Any, key: str, value: Any, where: str) -> Any:
    """A number that is text with its unit, in SI, and each one of a list; anything else stays as it is."""
    if isinstance(value, list):
        return [_in_si(cls, key, one, where) for one in value]
    with_unit = isinstance(value, str) and number(value) is None and QUANTITY.fullmatch(value)
    if not with_unit:
        return value
    if not (units := units_of(cls, key)):
        raise FormatError(f"{where}: {key}", "must be a number without a unit", short(value), described(cls)[key])
    found = [one for unit in units if (one := converted(value, unit)) is not None]
    if not found:
        raise FormatError(f"{where}: {key}", f"must be a number [{units[0]}], or have a unit like it", short(value))
    return found[0]


def _meant(kinds: list[Any], table: dict[str, Any], where: str) -> Any:
    """Which of several dataclasses a table is for: that of its ``model``, else the one that fits its keys best."""
    models = {kind.model: kind for kind in kinds if hasattr(kind, "model")}
    if models:
        name = table.get("model", kinds[0].model)
        if name not in models:
            known = ", ".join(models)
            raise UnknownError(
                f"{where}: model", f"must be one of {known}", short(name), did_you_mean(str(name), models)
            )
        return models[name]
    return max(kinds, key=lambda kind: (_needed(kind) <= table.keys(), len(set(keys_of(kind)) & table.keys())))


def _cure(key: str, cls: Any, under: tuple[str, ...], all_parts: dict[tuple[str, ...], list[str]]) -> str:
    """What was meant: a key like it, else the part that has it, else the key that is least unlike it."""
    known = keys_of(cls)
    if near := did_you_mean(key, known, cutoff=0.75):
        return near
    homes = [path for path, keys in all_parts.items() if key in keys]
    if homes and under not in homes:
        homes.sort(key=lambda path: (-sum(map(str.__eq__, path, under)), len(path)))
        return "it belongs in " + " or ".join(
            f"[{'.'.join(path)}]" if path else "the first lines" for path in homes[:2]
        )
    return did_you_mean(key, known, f"it knows {', '.join(known)}", cutoff=0.5)


def _needed(cls: Any) -> set[str]:
    fields = dataclasses.fields(cls)
    return {one.name for one in fields if one.default is one.default_factory is dataclasses.MISSING}


def keys_of(cls: Any) -> list[str]:
    """Keys that a file may give for a dataclass.

    Parameters
    ----------
    cls : dataclass
        Any.

    Returns
    -------
    list of str
        In the order of the fields.
    """
    return [field.name for field in dataclasses.fields(cls) if field.name not in HIDDEN]


def parts_of(hint: Any) -> tuple[list[Any], bool]:
    """Dataclasses that a field may hold, and whether it holds a list of them.

    Parameters
    ----------
    hint : type
        Of the field.

    Returns
    -------
    kinds : list of dataclasses
    many : bool
        Whether it holds a list of them.
    """
    if dataclasses.is_dataclass(hint):
        return [hint], False
    members = typing.get_args(hint)
    if typing.get_origin(hint) is tuple:
        return [one for one in members if dataclasses.is_dataclass(one)], True
    if typing.get_origin(hint) not in (types.UnionType, typing.Union):
        return [], False
    found = [parts_of(one) for one in members]
    return [kind for kinds, _ in found for kind in kinds], any(many for kinds, many in found if kinds)


def _sections(cls: Any, under: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], list[str]]]:
    """Every part of a file, its place and its keys; of two kinds for one part, the keys of both."""
    hints, keys = typing.get_type_hints(cls), keys_of(cls)
    yield under, keys
    for key in keys:
        kinds, _ = parts_of(hints[key])
        found = dict[tuple[str, ...], list[str]]()
        for kind in kinds:
            for path, some in _sections(kind, (*under, key)):
                found[path] = [*found.get(path, []), *some]
        yield from found.items()
