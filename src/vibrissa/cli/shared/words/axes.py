"""Axes of a map at the command line: FIRST:LAST:HOW-MANY or a list with commas, with units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from vibrissa.cli.shared.words.units import Metres, in_si, length_of, reader, share
from vibrissa.errors import ShapeError
from vibrissa.tables.quantity import number

if TYPE_CHECKING:
    from vibrissa.whisker import Whisker

_MOST = 100_000  # numbers along one axis


class Axis:
    """Numbers along an axis, ascending; ``metres`` says that they are lengths, to be taken over L."""

    def __init__(self, values: list[float], *, metres: bool = False) -> None:
        self.values, self.metres = values, metres

    def __repr__(self) -> str:  # what the help shows as a default
        return ",".join(f"{value:g}" for value in self.values)


def values_of(axis: Axis, option: str, cone: Whisker | None = None) -> list[float]:
    """Numbers of an axis, as shares of L where lengths were typed.

    Parameters
    ----------
    axis, option, cone
        As in :func:`vibrissa.cli.shared.words.units.over_length`.

    Returns
    -------
    list of float
        Ascending.

    Raises
    ------
    InputError
        As :func:`vibrissa.cli.shared.words.units.over_length`.
    """
    return axis.values if not axis.metres else [value / length_of(option, cone) for value in axis.values]


def _axis(kind: str) -> Parameter:
    return reader(lambda text, option: axis_of(text, option, kind), kind)


def axis_of(text: str, option: str, kind: str) -> Axis:
    """Numbers of an axis, ascending, written FIRST:LAST:HOW-MANY, ends included, or as a list with commas.

    Parameters
    ----------
    text, option : str
        As typed, and the option as in the glossary.
    kind : str
        Of the numbers, as in the glossary.

    Returns
    -------
    Axis
        The numbers.

    Raises
    ------
    InputError
        If the text is neither, or has too few or too many numbers.
    """
    words = text.split(":") if ":" in text else text.split(",")
    ends = [_one(word, option, kind) for word in (words[:2] if ":" in text else words)]
    if len({isinstance(one, Metres) for one in ends}) > 1:
        raise ShapeError(option, "must be lengths, or shares of L, not both", repr(text))
    numbers = [one.value if isinstance(one, Metres) else one for one in ends]
    if ":" in text:
        numbers = _between(numbers, words, text, option)
    return Axis(sorted(numbers), metres=isinstance(ends[0], Metres))


def _one(word: str, option: str, kind: str) -> float | Metres:
    if kind == "over length":
        return share(word, option)
    if kind != "number":
        return in_si(word, option, kind)
    if (value := number(word)) is None:
        raise ShapeError(
            option, "must be FIRST:LAST:HOW-MANY or a list with commas", repr(word), f"for example {option} 0.1,0.2"
        )
    return value


def _between(ends: list[float], words: list[str], text: str, option: str) -> list[float]:
    import numpy as np

    if len(words) != 3 or not words[2].isdecimal():
        example = f"for example {option} 0.1:0.4:100 or {option} 0.1,0.2"
        raise ShapeError(option, "must be FIRST:LAST:HOW-MANY or a list with commas", repr(text), example)
    if not 2 <= int(words[2]) <= _MOST:
        raise ShapeError(option, f"must have 2 to {_MOST} numbers", repr(text))
    return np.linspace(ends[0], ends[1], int(words[2])).tolist()


AngleAxis = Annotated[Axis, _axis("angle")]
SpeedAxis = Annotated[Axis, _axis("speed")]
OverLengthAxis = Annotated[Axis, _axis("over length")]
NumberAxis = Annotated[Axis, _axis("number")]
