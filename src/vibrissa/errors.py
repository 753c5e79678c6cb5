"""The two ways a call can fail: bad input, or a solver that does not arrive."""

from __future__ import annotations

import shlex
import sys


class InputError(ValueError):
    """Bad input, told in one line: the thing, the rule, the value and the remedy.

    Parameters
    ----------
    thing : str
        What the user gave, by the name the user knows (``Whisker.length``, a file, a key).
    rule : str
        The rule it breaks, as a verb phrase: "must be positive".
    value : object, optional
        What was found; left out of the message where there is nothing to show.
    remedy : str, optional
        What to do about it.

    Attributes
    ----------
    thing, said : str
        What the line is about, and what it says of it.
    """

    def __init__(self, thing: str, rule: str, value: object = None, remedy: str = "") -> None:
        got = "" if value is None else f", got {value}"
        cure = f"; {remedy}" if remedy else ""
        self.thing, self.said = thing.replace("\n", " "), f"{rule}{got}{cure}".replace("\n", " ")
        super().__init__(f"{self.thing} {self.said}")

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str]]:
        """Rebuild it in another process, to which a worker sends it."""
        return type(self), (self.thing, self.said)


class MachineError(InputError):
    """What the machine refuses, not the input: a full disk, a lost scheduler. The whole stops, and can go on later."""


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
        self._told = problem, residual, iterations, remedy
        super().__init__(f"{problem} did not converge: residual {residual:.3g} after {iterations} iterations{cure}")

    def __reduce__(self) -> tuple[type[ConvergenceError], tuple[str, float, int, str]]:
        """Rebuild it in another process, to which a worker sends it."""
        return type(self), self._told


def install(extra: str) -> str:
    """Remedy where a package of an extra is missing: the command that installs it beside the Vibrissa that runs.

    Parameters
    ----------
    extra : str
        One of those of ``pyproject.toml``: ``page``, ``surface``, …
    """
    return f"{shlex.quote(sys.executable)} -m pip install 'vibrissa[{extra}]'"
