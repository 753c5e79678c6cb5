"""Levels in the unit of a stimulus, ``42um``, ``16dB``, ``0.1au``, and rates per level, ``0.25/s/um``, ``25/s/dB``."""

from __future__ import annotations

import re
from typing import Annotated

from vibrissa.cli.shared.words.glossary import GLOSSARY
from vibrissa.cli.shared.words.units import in_si, reader
from vibrissa.errors import ConflictError
from vibrissa.tables.quantity import number
from vibrissa.tables.units import in_si as of_stimulus
from vibrissa.tables.units import is_unit

_TYPED = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(/\s*s\s*/|Hz\s*/)?\s*([^\s\d/]+)\s*")


class Level(str):
    """A level of a stimulus, or a rate per level, as typed; it has a number once the unit of the stimulus is known."""

    def of(self, unit: str, option: str) -> float:
        """The number, in the unit of a stimulus.

        Parameters
        ----------
        unit : str
            SI unit of the stimulus, or ``dB`` or ``a.u.``.
        option : str
            As in the glossary.

        Returns
        -------
        float
            In the unit, or per second and unit.

        Raises
        ------
        InputError
            If it was typed in another unit, or without one where metres are hardly meant.
        """
        value, own = _parsed(self, option)
        if own is None:
            return in_si(self, option, GLOSSARY[option].kind) if unit == "m" else value
        if own != unit:
            raise ConflictError(option, f"must be of the stimulus, which is in {unit}", repr(str(self)))
        return value


def _parsed(text: str, option: str) -> tuple[float, str | None]:
    """The number in SI and the SI unit of the level; of a bare number, which is in that of the stimulus, None."""
    bare, kind = number(text), GLOSSARY[option].kind
    if bare is not None:
        return bare, None
    typed = _TYPED.fullmatch(text)
    if typed and (typed[2] is not None) == (kind == "slope") and is_unit(typed[3]):
        size, unit = of_stimulus(1.0, typed[3])
        if unit != "m":
            return float(typed[1]) / size if kind == "slope" else float(typed[1]) * size, unit
    return in_si(text, option, kind), "m"


def _read(text: str, option: str) -> Level:
    _parsed(text, option)  # what is no level is refused before any file is read
    return Level(text)


LevelOption = Annotated[Level, reader(_read, "length")]
RiseOption = Annotated[Level, reader(_read, "slope")]
