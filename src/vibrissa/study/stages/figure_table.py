"""The figures of ``STAGES`` in the order of their numbers: which of them some results serve."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from typing import NamedTuple

from vibrissa.errors import UnknownError
from vibrissa.study.spec.settings import Study
from vibrissa.study.stages.stage import FigureEntry
from vibrissa.study.stages.stages import STAGES


def _place(entry: FigureEntry) -> tuple[int, str]:
    """Place of a figure: by its number, panels A–B before those without letters, E after them."""
    digits = re.match(r"\d*", entry.number)
    number = digits[0] if digits else ""
    return int(number or 0), entry.number.removeprefix(number) or "c"


FIGURES = tuple(sorted((entry for stage in STAGES for entry in stage.figures), key=_place))
ABSENT = {output.name: output.absent for stage in STAGES for output in stage.outputs if output.absent}


class Served(NamedTuple):
    """A figure that some results serve: its entry, heading, and the end of the names of its results (``_2`` or "")."""

    entry: FigureEntry
    heading: str
    end: str


def numbers() -> list[str]:
    """Numbers of the figures, in their order."""
    return list(dict.fromkeys(entry.number for entry in FIGURES))


def entries(number: str) -> list[FigureEntry]:
    """Figures of one number.

    Parameters
    ----------
    number : str
        One of :func:`numbers`.

    Returns
    -------
    list of FigureEntry
        In the order of the stages.

    Raises
    ------
    InputError
        If no figure has it.
    """
    found = [entry for entry in FIGURES if entry.number == number]
    if not found:
        known = sorted(numbers(), key=lambda one: not one[0].isdigit())
        raise UnknownError("figure", f"must be one of {', '.join(known)}", number)
    return found


def missing(entry: FigureEntry, names: Collection[str]) -> str:
    """Why a figure cannot be made of results of these names; "" if it can.

    Parameters
    ----------
    entry : FigureEntry
        The figure.
    names : collection of str
        Names of results.

    Returns
    -------
    str
        Reasons.
    """
    return "; ".join(dict.fromkeys(ABSENT.get(name, f"no {name}") for name in entry.needs if name not in names))


def best_entry(number: str, names: Collection[str]) -> FigureEntry:
    """Figure of this number that these results serve, else the first of the number.

    Parameters
    ----------
    number : str
        One of :func:`numbers`.
    names : collection of str
        Names of results.

    Returns
    -------
    FigureEntry
        One.

    Raises
    ------
    InputError
        If no figure has this number.
    """
    found = entries(number)
    return next((entry for entry in found if not missing(entry, names)), found[0])


def ends_of(entry: FigureEntry, names: Collection[str]) -> list[str]:
    """Ends of the names of numbered results that serve a figure: _1, _2 ….

    Parameters
    ----------
    entry : FigureEntry
        The figure; none if it has one heading only.
    names : collection of str
        Names of results.

    Returns
    -------
    list of str
        By number.
    """
    first = entry.needs[0]
    found = [name.removeprefix(first) for name in names if entry.each and re.fullmatch(rf"{first}_\d+", name)]
    whole = [end for end in found if all(need + end in names for need in entry.needs)]
    return sorted(whole, key=lambda end: int(end.removeprefix("_")))


def served(names: Collection[str], label: Callable[[str], str]) -> Iterator[Served]:
    """Every figure that results of these names serve, in their order; of several entries of a number the first.

    Parameters
    ----------
    names : collection of str
        Names of results.
    label : callable
        End of a name → what that recording, or signal, is called.

    Yields
    ------
    Served
        One figure.
    """
    for number in numbers():
        entry = best_entry(number, names)
        if not missing(entry, names):
            yield Served(entry, entry.heading, "")
        for other in entries(number):
            yield from (Served(other, other.each.format(label=label(other.needs[0] + end)), end)
                        for end in ends_of(other, names))  # fmt: skip


def left_out(study: Study, names: Collection[str]) -> list[tuple[str, str]]:
    """Number and reason of each figure of a study's parts that cannot be made of its results, the optional ones aside.

    Parameters
    ----------
    study : Study
        Of one without any movie or sweeps, their figures are not missed.
    names : collection of str
        Names of results.

    Returns
    -------
    list of (str, str)
        In the order of the numbers.
    """
    parts = {stage.part for stage in STAGES if stage.asked(study)}
    filmed = bool(parts & {"movie", "sweeps"})
    asked = {entry.number for stage in STAGES if filmed or stage.part in parts for entry in stage.figures}
    best = [best_entry(number, names) for number in numbers() if number in asked]
    reasons = [(entry.number, missing(entry, names)) for entry in best if not entry.optional]
    made = {one.entry.number for one in served(names, str)}
    return [(number, reason) for number, reason in reasons if reason and number not in made]


def figures_of(study: Study, names: Collection[str]) -> list[tuple[FigureEntry, str]]:
    """Entry and heading of each figure that a study comes to.

    Parameters
    ----------
    study : Study
        Gives recordings and signals their labels.
    names : collection of str
        Names of the datasets that it comes to.

    Returns
    -------
    list of (FigureEntry, str)
        In the order of the numbers.
    """

    def label(name: str) -> str:
        parts = study.base_signal if name.startswith("base_signal") else study.neural
        return parts[int(name.rpartition("_")[2]) - 1].label

    return [(one.entry, one.heading) for one in served(names, label)]
