"""What the glossary says of one option."""

from __future__ import annotations

from typing import NamedTuple


class Option(NamedTuple):
    """What an option means wherever it is taken.

    Attributes
    ----------
    kind : str
        Dimension (``length``, …, see ``vibrissa.cli.shared.words.units.DIMENSIONS``), ``over length`` (a share of L, or
        a length), or ``number``, ``count``, ``text``, ``choice``, ``flag``, ``file``, ``point``.
    meaning : str
        One sentence.
    example : str
        How it is written; of a quantity with the unit that is likely meant.
    least, most : float, optional
        A bare number must lie between them, else it must be written with its unit.
    arguments : tuple of str
        Names that the package has for it, besides its own with underscores.
    """

    kind: str
    meaning: str
    example: str = ""
    least: float | None = None
    most: float | None = None
    arguments: tuple[str, ...] = ()
