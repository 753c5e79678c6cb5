"""The two ways a call can fail: bad input, or a solver that does not converge."""

from __future__ import annotations

import math
import shlex
import sys
from collections.abc import Iterable
from difflib import get_close_matches


class InputError(ValueError):
    """Bad input, reported in one line: the quantity, the rule, the value and the remedy.

    Parameters
    ----------
    quantity : str
        What the user gave, by the name the user knows (``Whisker.length``, a file, a key).
    rule : str
        The rule it breaks, as a verb phrase: "must be positive".
    value : object, optional
        What was found; left out of the message where there is nothing to show.
    remedy : str, optional
        What to do about it.

    Attributes
    ----------
    code : str
        The kind of error, one for each class.
    quantity, rule, remedy : str
        As given, in one line each.
    value : str or None
        As printed.
    """

    code = "input"

    def __init__(self, quantity: str, rule: str, value: object = None, remedy: str = "") -> None:
        self.quantity, self.rule, self.remedy = (text.replace("\n", " ") for text in (quantity, rule, remedy))
        self.value = None if value is None else str(value).replace("\n", " ")
        got = "" if self.value is None else f", got {self.value}"
        cure = f"; {self.remedy}" if remedy else ""
        super().__init__(f"{self.quantity} {self.rule}{got}{cure}")

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str, str | None, str]]:
        """Rebuild it in another process, to which a worker sends it."""
        return type(self), (self.quantity, self.rule, self.value, self.remedy)

    def renamed(self, quantity: str) -> InputError:
        """The same error about a quantity that is known by another name here.

        Parameters
        ----------
        quantity : str
            The other name.

        Returns
        -------
        InputError
            Of the same class.
        """
        return type(self)(quantity, self.rule, self.value, self.remedy)

    def rewritten(self, old: str, new: str) -> InputError:
        """The same error with a text replaced in all fields.

        Parameters
        ----------
        old, new : str
            The text, and what replaces it.

        Returns
        -------
        InputError
            Of the same class.
        """
        quantity, rule, remedy = (text.replace(old, new) for text in (self.quantity, self.rule, self.remedy))
        return type(self)(quantity, rule, None if self.value is None else self.value.replace(old, new), remedy)


class MissingError(InputError):
    """Something that must be given, or must exist, does not."""

    code = "missing"


class UnknownError(InputError):
    """A name or a choice is not one of those that exist."""

    code = "unknown"


class RangeError(InputError):
    """A number is outside the range in which it has a meaning."""

    code = "range"


class FormatError(InputError):
    """A file or a text does not have the format it should have."""

    code = "format"


class ShapeError(InputError):
    """Arrays, columns or points differ in number from what they belong to."""

    code = "shape"


class TooFewError(InputError):
    """There are too few data to do what was asked."""

    code = "too-few"


class ConflictError(InputError):
    """Two inputs exclude each other, or one is given where it has no meaning."""

    code = "conflict"


class PackageError(InputError):
    """A package that an extra installs is absent."""

    code = "package"


class MachineError(InputError):
    """The machine refuses, not the input: a full disk, a lost scheduler. The run stops, and can be continued later."""

    code = "machine"


class ConvergenceError(RuntimeError):
    """A solver stopped before it met its tolerance.

    Parameters
    ----------
    problem : str
        What was being solved.
    residual : float
        The residual reached.
    iterations : int
        The iterations spent.
    remedy : str, optional
        What may help.
    """

    def __init__(self, problem: str, residual: float, iterations: int, remedy: str = "") -> None:
        cure = f"; {remedy}" if remedy else ""
        self._given = problem, residual, iterations, remedy
        super().__init__(f"{problem} did not converge: residual {residual:.3g} after {iterations} iterations{cure}")

    def __reduce__(self) -> tuple[type[ConvergenceError], tuple[str, float, int, str]]:
        """Rebuild it in another process, to which a worker sends it."""
        return type(self), self._given


def give_in(unit: str, value: float, other: str, factor: float) -> str:
    """Remedy where a number was likely meant in another unit.

    Parameters
    ----------
    unit : str
        That is taken.
    value : float
        As given.
    other : str
        The unit that was likely meant.
    factor : float
        Of the other in the first.

    Returns
    -------
    str
        One line, which the command line replaces by its own.

    Examples
    --------
    >>> give_in("m", 40, "mm", 1e-3)
    'give it in m: 0.04 for 40 mm'
    """
    return f"give it in {unit}: {value * factor:.5g} for {value:g} {other}"


def give_share(value: float) -> str:
    """Remedy where a share of the whisker's length L is taken, and a length was given.

    Parameters
    ----------
    value : float
        As given, perhaps in mm.

    Returns
    -------
    str
        One line, which the command line replaces by its own.
    """
    return f"give it over L: {value / 1e3:.5g} / whisker.length for {value:g} mm"


def require_positive(quantity: str, value: float | None, unit: str = "") -> None:
    """Refuse a number that is not positive and finite.

    Parameters
    ----------
    quantity : str
        Its name in the message.
    value : float or None
        The number; None, not given, passes.
    unit : str
        Its unit in the message.

    Raises
    ------
    InputError
        If it is zero, negative, infinite or NaN.
    """
    if value is not None and not 0 < value < math.inf:
        raise RangeError(quantity, f"must be positive ({unit})" if unit else "must be positive", value)


def require_not_negative(quantity: str, value: float | None, unit: str = "") -> None:
    """Refuse a number that is negative or not finite.

    Parameters
    ----------
    quantity, value, unit
        As in :func:`require_positive`.

    Raises
    ------
    InputError
        If it is negative, infinite or NaN.
    """
    if value is not None and not 0 <= value < math.inf:
        raise RangeError(quantity, f"must be zero or positive ({unit})" if unit else "must be zero or positive", value)


def require_fraction(quantity: str, value: float) -> None:
    """Refuse a number that does not lie between 0 and 1, neither of them included.

    Parameters
    ----------
    quantity : str
        Its name in the message.
    value : float
        The number.

    Raises
    ------
    InputError
        If it lies outside.
    """
    if not 0 < value < 1:
        raise RangeError(quantity, "must lie between 0 and 1", value)


def nearest(name: str, known: Iterable[str], *, cutoff: float = 0.6, most: int = 1) -> list[str]:
    """Known names that an unknown one resembles, the most similar first.

    Parameters
    ----------
    name : str
        As given.
    known : iterable of str
        Names that would be understood.
    cutoff : float
        Least similarity, from 0 to 1.
    most : int
        Names returned at most.

    Returns
    -------
    list of str
        Empty if none is similar enough.
    """
    return get_close_matches(name, list(known), n=most, cutoff=cutoff)


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "", *, cutoff: float = 0.6, most: int = 1) -> str:
    """Remedy where a name is unknown: those it resembles.

    Parameters
    ----------
    name, known, cutoff, most
        As in :func:`nearest`.
    otherwise : str
        Remedy if none is similar enough.

    Returns
    -------
    str
        "did you mean …?", or ``otherwise``.
    """
    near = nearest(name, known, cutoff=cutoff, most=most)
    return f"did you mean {', '.join(near)}?" if near else otherwise


def install(extra: str) -> str:
    """Remedy where a package of an extra is missing: the command that installs it beside the Vibrissa that runs.

    Parameters
    ----------
    extra : str
        One of those of ``pyproject.toml``: ``page``, ``surface``, …

    Returns
    -------
    str
        The command, in one line.
    """
    return f"{shlex.quote(sys.executable)} -m pip install 'vibrissa[{extra}]'"
