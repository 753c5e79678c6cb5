"""Quantities of the command line: ``40mm``, ``70deg``, ``100mm/s``; a bare number is SI, or over L where it says so.

A type for each dimension annotates an option.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from inspect import signature
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from cyclopts import Parameter, Token

from vibrissa.cli.shared.words.glossary import GLOSSARY, SHARES
from vibrissa.errors import FormatError, MissingError, RangeError
from vibrissa.tables.quantity import QUANTITY, converted, number

if TYPE_CHECKING:
    from vibrissa.whisker import Whisker


class Dimension(NamedTuple):
    """A dimension: the words for one quantity of it, and the SI unit."""

    words: str
    unit: str


DIMENSIONS = {
    "length": Dimension("a length", "m"),
    "angle": Dimension("an angle", "rad"),
    "speed": Dimension("a speed", "m/s"),
    "acceleration": Dimension("an acceleration", "m/s²"),
    "rate": Dimension("a frequency", "Hz"),
    "duration": Dimension("a time", "s"),
    "pressure": Dimension("a pressure", "Pa"),
    "density": Dimension("a density", "kg/m³"),
    "voltage": Dimension("a voltage", "V"),
    "slope": Dimension("a rate per length", "1/(s m)"),
}
FAR_BELOW = 0.01  # of the number in an example: a smaller one is likely in the next larger unit
LARGER = {"nm": "um", "um": "mm", "ms": "s", "mrad": "rad", "uN": "mN"}
_NEGATIVE = re.compile(r"-\.?\d")
_HAS_METAVAR = "metavar" in signature(Parameter).parameters  # of later versions of cyclopts
_METAVARS = {"over length": "share|length"}


class Metres:
    """A length that was typed where the package takes a share of L; ``value`` [m]."""

    def __init__(self, value: float) -> None:
        self.value = value


def written(option: str, text: str = "") -> str:
    """How a quantity of an option is written: the number that was typed, with the unit that is likely meant.

    Parameters
    ----------
    option : str
        As in the glossary.
    text : str
        As typed; a unit that it has is left out.

    Returns
    -------
    str
        ``--base-angle 70deg``.
    """
    example = _example(option)
    typed = QUANTITY.fullmatch(text)
    if example is None:
        return f"{option} {GLOSSARY[option].example}"
    value = typed[1] if typed else text if number(text) is not None else example[1]
    small = 0 < abs(float(value)) < FAR_BELOW * float(example[1])
    return f"{option} {value}{LARGER.get(example[2], example[2]) if small else example[2]}"


def has_larger_unit(option: str) -> bool:
    """Whether a small number of an option may be in a larger unit than its example, as 0.1 mm beside 95 µm.

    Parameters
    ----------
    option : str
        As in the glossary.

    Returns
    -------
    bool
        True if :func:`written` takes that unit for it.
    """
    example = _example(option)
    return example is not None and example[2] in LARGER


def _example(option: str) -> re.Match[str] | None:
    """Number and unit of the first quantity in an option's example."""
    return QUANTITY.fullmatch(GLOSSARY[option].example.split(":")[0].split(" ")[0])


def in_si(text: str, option: str, kind: str) -> float:
    """What was typed, in SI units.

    Parameters
    ----------
    text, option : str
        As typed, and the option as in the glossary.
    kind : str
        Key of ``DIMENSIONS``.

    Returns
    -------
    float
        In SI units.

    Raises
    ------
    InputError
        If the text is no number, has another dimension, or lacks a unit where SI is hardly meant.
    """
    words, unit = DIMENSIONS[kind]
    bare = number(text)
    if bare is not None:
        _refuse_unlikely(text, bare, option, unit)
        return bare
    value = converted(text, unit)
    if value is None:
        point = text.replace(",", ".")  # a decimal comma
        other = any(converted(text, si) is not None for _, si in DIMENSIONS.values())  # a quantity, of another kind
        likely = f"{option} {point}" if converted(point, unit) is not None else written(option, "" if other else text)
        raise FormatError(option, f"must be {words}", repr(text), f"write {likely}, or the number in {unit}")
    return value


def over_length(value: float | Metres, option: str, cone: Whisker | None) -> float:
    """A share of L, of a whisker whose length is known where a length was typed.

    Parameters
    ----------
    value : float or Metres
        What an option of the type ``OverLength`` gives.
    option : str
        For messages.
    cone : Whisker, optional
        Gives L.

    Returns
    -------
    float
        Over L.

    Raises
    ------
    InputError
        If it is a length and there is no whisker.
    """
    return value if not isinstance(value, Metres) else value.value / length_of(option, cone)


def length_of(option: str, cone: Whisker | None) -> float:
    """Length L of a whisker, for an option that was typed as a length.

    Parameters
    ----------
    option, cone
        As in :func:`over_length`.

    Returns
    -------
    float
        [m].

    Raises
    ------
    InputError
        If there is no whisker.
    """
    if cone is None:
        remedy = f"add --whisker.length 40mm or --atlas C2, or write {option} {SHARES[option]}"
        raise MissingError(option, "must be over L where no whisker is given", remedy=remedy)
    return cone.length


def _refuse_unlikely(text: str, value: float, option: str, unit: str) -> None:
    """Refuse a bare number that is hardly meant in SI units; what no unit mends is left to the package."""
    least, most = GLOSSARY[option].least, GLOSSARY[option].most
    if most is not None and most < value < math.inf:
        raise RangeError(option, f"must have its unit above {most:g} {unit}", text, f"write {written(option, text)}")
    if least is not None and 0 < value < least:
        raise RangeError(option, f"must have its unit below {least:g} {unit}", text, f"write {written(option, text)}")


Reader = Callable[[Any, Sequence[Token]], Any]


def reader(read: Callable[[str, str], Any], kind: str) -> Parameter:
    """Parameter of an option whose words a function reads; the kind is kept for the glossary's test.

    Parameters
    ----------
    read : callable
        Takes the word and the option.
    kind : str
        As in the glossary.

    Returns
    -------
    Parameter
        For ``Annotated``.
    """

    def convert(_: Any, tokens: Sequence[Token]) -> Any:
        return read(tokens[0].value.strip(), option_of(tokens[0].keyword or ""))

    convert.kind = kind  # type: ignore[attr-defined]
    named: dict[str, Any] = {"metavar": _METAVARS.get(kind, kind).upper()} if _HAS_METAVAR else {}
    return Parameter(converter=convert, accepts_keys=False, **named)


def with_negative(words: Sequence[str]) -> list[str]:
    """The command line with each negative value, such as ``-5mm``, marked: the parser would take it for an option.

    Parameters
    ----------
    words : sequence of str
        As typed.

    Returns
    -------
    list of str
        ``--node=-5mm`` for ``--node -5mm``; a later value of an option, as in ``--window -2s -1s``, behind a blank.
    """
    marked: list[str] = []
    for place, word in enumerate(words):
        if word == "--":  # what follows is no option
            return [*marked, *words[place:]]
        alone = marked and marked[-1].startswith("--") and "=" not in marked[-1]
        if alone and _NEGATIVE.match(word) and number(word) is None:
            marked[-1] = f"{marked[-1]}={word}"
        else:
            marked.append(f" {word}" if word.startswith("-") and QUANTITY.fullmatch(word) else word)
    return marked


def option_of(word: str) -> str:
    """The option as in the glossary, of a word that may have underscores.

    Parameters
    ----------
    word : str
        As typed.

    Returns
    -------
    str
        ``--base-angle``.
    """
    return word if word in GLOSSARY else word.replace("_", "-")


def _quantity(kind: str) -> Parameter:
    return reader(lambda text, option: in_si(text, option, kind), kind)


def share(text: str, option: str) -> float | Metres:
    """A share of L, or a length, as typed.

    Parameters
    ----------
    text, option : str
        As typed, and the option as in the glossary.

    Returns
    -------
    float or Metres
        The share, or the length.

    Raises
    ------
    InputError
        If the text is neither.
    """
    bare = number(text)
    if bare is not None:
        return bare
    value = converted(text, "m")
    if value is None:
        remedy = f"write {option} {SHARES[option]}, over L, or {written(option, text)}"
        raise FormatError(option, "must be a share of L, or a length", repr(text), remedy)
    return Metres(value)


Length = Annotated[float, _quantity("length")]
Angle = Annotated[float, _quantity("angle")]
Speed = Annotated[float, _quantity("speed")]
Acceleration = Annotated[float, _quantity("acceleration")]
Rate = Annotated[float, _quantity("rate")]
Duration = Annotated[float, _quantity("duration")]
Pressure = Annotated[float, _quantity("pressure")]
Density = Annotated[float, _quantity("density")]
Voltage = Annotated[float, _quantity("voltage")]
OverLength = Annotated[float | Metres, reader(share, "over length")]
