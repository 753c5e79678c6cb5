"""Refusals of the package in the words of the command line: an argument is an option, a quantity has its unit."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence

from vibrissa.cli.shared.words.glossary import GLOSSARY
from vibrissa.cli.shared.words.units import DIMENSIONS, has_larger_unit, in_si, option_of, written
from vibrissa.errors import InputError, RangeError
from vibrissa.tables.quantity import QUANTITY, number

_ARGUMENT = re.compile(r"`(\w+)(?:=([^`]*))?`")  # as the package writes them: `workers`, `level='line'`
_NAME = re.compile(r"(?:[A-Z]\w*\.)?[a-z][\w ]*(?:\[0\])?")
_SAYS_THE_UNIT = re.compile(r"^give it (in [^\s:]+(: .*)?|over L: .* / whisker.length .*)$")  # for Python
_SAYS_THE_SHARE = re.compile(r"^give (it over L: [\d.]+ for |a contact above )")


def option_for(name: str, taken: Collection[str]) -> str | None:
    """The option of a verb that gives an argument of the package.

    Parameters
    ----------
    name : str
        ``base_angle``, ``Posture.base_angle``, ``number of modes``.
    taken : collection of str
        Options that the verb takes.

    Returns
    -------
    str or None
        ``--base-angle``; None if the verb has none for it.
    """
    if not _NAME.fullmatch(name):  # a file, a line of it
        return None
    last = name.rpartition(".")[2].removesuffix("[0]").replace(" ", "_")
    own = option_of("--" + last.replace("_", "-"))
    candidates = [option for option in GLOSSARY if name in GLOSSARY[option].arguments]
    candidates += [own, *(option for option in GLOSSARY if last in GLOSSARY[option].arguments)]
    return next((option for option in candidates if option in taken), None)


def argument_for(option: str) -> str:
    """The argument of the package that an option gives.

    Parameters
    ----------
    option : str
        As in the glossary.

    Returns
    -------
    str
        ``base_angle`` of ``--base-angle``.
    """
    known = GLOSSARY[option].arguments
    return known[0].rpartition(".")[2] if known else option.removeprefix("--").rpartition(".")[2].replace("-", "_")


def as_typed(error: InputError, taken: Collection[str], words: Sequence[str]) -> InputError:
    """A refusal of the package in the words of the command line.

    Parameters
    ----------
    error : InputError
        As the package raised it.
    taken : collection of str
        Options that the verb takes.
    words : sequence of str
        The command line.

    Returns
    -------
    InputError
        The quantity, and what the remedy names, by their options; a quantity typed without a unit as it may be meant.
    """
    names = [name if name in taken else option_for(name, taken) for name in error.quantity.split(", ")]
    quantity = ", ".join(map(str, names)) if all(names) else error.quantity
    option = names[0] if len(names) == 1 else None
    rule, remedy, value = in_options(error.rule, taken), in_options(error.remedy, taken), error.value
    if option is not None and isinstance(error, RangeError):
        typed = _value_of(option, words)
        remedy = _with_unit(option, typed, remedy)
        one = " " not in GLOSSARY[option].example  # of two values the message has both
        value = typed if one and (_same(typed, value) or _has_unit(typed)) else value
    return type(error)(quantity, rule, value, remedy)


def in_options(text: str, taken: Collection[str] = GLOSSARY) -> str:
    """A line of the package in which arguments, such as `workers`, are named as options.

    Parameters
    ----------
    text : str
        The line.
    taken : collection of str
        Options that the verb takes; all by default.

    Returns
    -------
    str
        The line; an argument that no option gives stays.
    """
    return _ARGUMENT.sub(lambda found: _typed(found, taken), text)


def _typed(found: re.Match[str], taken: Collection[str]) -> str:
    elsewhere = (option for option, one in GLOSSARY.items() if found[1] in one.arguments)
    option = option_for(found[1], taken) or next(elsewhere, None)
    if option is None:
        return found[0]
    return option if found[2] is None else " ".join([option, found[2].strip("'[]")])


def _with_unit(option: str, typed: str, remedy: str) -> str:
    """The remedy, with the quantity as it may have been meant where a bare number was typed."""
    if _has_unit(typed) and _SAYS_THE_UNIT.match(remedy):
        return ""
    *rest, last = re.split(r"([:,])", typed)
    count = [last] if rest and rest[-1] == ":" and len(rest) > 3 else []  # of FIRST:LAST:HOW-MANY
    parts = rest if count else [*rest, last]
    values = [number(part) for part in parts[::2]]
    kind = GLOSSARY[option].kind
    dimensional = kind in (*DIMENSIONS, "over length")
    two = " " in GLOSSARY[option].example  # values, of which one was read here
    alike = _like_the_example(option, values) or (kind in DIMENSIONS and has_larger_unit(option))
    settled = two or not alike or "write --" in remedy or _SAYS_THE_SHARE.match(remedy)
    if not dimensional or settled or not all(one is not None and 0 < one < math.inf for one in values):
        return remedy
    units = [written(option, part).partition(" ")[2] for part in parts[::2]]
    if kind in DIMENSIONS and [in_si(one, option, kind) for one in units] == values:
        return remedy  # the unit is that of a bare number
    parts[::2] = units
    meant = f"write {option} {''.join([*parts, *count])}, if that is meant"
    return meant if not remedy or _SAYS_THE_UNIT.match(remedy) else f"{remedy}; {meant}"


def _like_the_example(option: str, values: Sequence[float | None]) -> bool:
    """Whether numbers are of the size of an option's example, in its unit."""
    example = QUANTITY.fullmatch(GLOSSARY[option].example)
    return example is None or max(filter(None, values), default=0.0) > 0.1 * float(example[1])


def _has_unit(typed: str) -> bool:
    """Whether a quantity was typed with its unit, so that no other one is meant."""
    return number(typed) is None and QUANTITY.fullmatch(typed) is not None


def _value_of(option: str, words: Sequence[str]) -> str:
    """What was typed for an option, the last time; nothing if it was not typed."""
    found = ""
    for k, word in enumerate(words):
        name, equals, value = word.partition("=")
        if option_of(name) == option:
            found = value if equals else words[k + 1] if k + 1 < len(words) else ""
    return found


def _same(typed: str, value: str | None) -> bool:
    """Whether the value in a message is the number that was typed, printed otherwise."""
    return value is not None and number(typed) is not None and number(typed) == number(value)
