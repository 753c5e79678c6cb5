"""A number as the paper prints it, and the rule by which a number found here agrees with it."""

from __future__ import annotations

import tomllib
from importlib import resources
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import stdtrit

from vibrissa.stats import LEVEL, RANGES, Scale, significant, wilson_interval
from vibrissa.study.paper.sweep_measures import MeasuredNumber

Kind = Literal["setting", "mean", "share", "value", "range", "bound", "p"]
Origin = Literal["put in", "recovered", "result"]
Verdict = Literal["same", "differs", "cannot tell", "put in", "not comparable", "not measured"]

WHISKERS = 13  # the paper's: where it counts sweeps, these are its independent draws
SESSIONS = 15  # the same, where it counts units
NEURAL = ("8", "9")  # figures of neurons
AGREEMENT = 0.5  # of the paper's number: what is the same lies within that, as far as both intervals reach
FEWEST_DRAWS = 4  # below these the spread between draws is itself uncertain sixfold (95 %, χ²)
ENOUGH_CASES = 85  # Fisher's z: a correlation of 0.3 is significant in four tests of five

with resources.files("vibrissa.data").joinpath("paper_rule.toml").open("rb") as _text:
    _NUMBERS = {"FEWEST_DRAWS": FEWEST_DRAWS, "LEVEL": LEVEL, "ENOUGH_CASES": ENOUGH_CASES}
    RULE = tuple((name, text.format(**_NUMBERS)) for name, text in tomllib.load(_text).items())


class PaperNumber(NamedTuple):
    """A number as the paper prints it, in SI units.

    ``low`` and ``high`` are the ends of a range, or of what rounds to the printed value; NaN where there are none.
    ``direction`` is 1 where an effect is said to rise, −1 where it falls, else NaN. ``origin`` says how the number
    enters virtual sweeps; ``reading`` what else the paper says of it; ``why`` that it cannot be compared, and the
    reason. ``scale`` is that of ``vibrissa.stats.jackknife_interval``, whose range no interval leaves.
    """

    id: str
    figure: str
    text: str
    kind: Kind
    value: float
    sd: float
    n: float
    low: float
    high: float
    unit: str
    origin: Origin
    reading: str
    why: str
    direction: float
    scale: Scale

    @property
    def is_neural(self) -> bool:
        """Whether it is one of neurons and the stimulator, not of sweeps."""
        return self.figure in NEURAL

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the number; NaN where none can be stated."""
        if self.kind == "mean":
            draws = min(self.n, SESSIONS if self.is_neural else WHISKERS)
            half = float(stdtrit(draws - 1, 0.975)) * self.sd / np.sqrt(draws)
            least, most = RANGES[self.scale]
            return max(self.value - half, least), min(self.value + half, most)
        if self.kind == "share":
            return wilson_interval(round(self.value * self.n), round(self.n))
        return self.low, self.high


def verdict(number: PaperNumber, here: MeasuredNumber) -> tuple[Verdict, str]:
    """Whether a number found here is the paper's, by ``RULE``, and what must be known of that.

    Parameters
    ----------
    number : PaperNumber
        Of the paper.
    here : MeasuredNumber
        What was found, a finite value.

    Returns
    -------
    verdict : {"same", "differs", "cannot tell"}
        By ``RULE``.
    why : str
        Why there is no verdict, and the note of the number found.
    """
    of = {"p": _of_effect, "bound": _of_bound}.get(number.kind, _of_interval)
    found, why = of(number, here)
    return found, "; ".join(part for part in (why, here.note) if part)


def _of_effect(number: PaperNumber, here: MeasuredNumber) -> tuple[Verdict, str]:
    """By p-values and the direction of the effect."""
    found = bool(significant(here.value))
    if not found and not here.n >= ENOUGH_CASES:
        cases = "units" if number.is_neural else "sweeps"
        return "cannot tell", f"not significant, in fewer than {ENOUGH_CASES} {cases}"
    same = found == bool(significant(number.value)) and not number.direction * here.slope < 0
    return ("same" if same else "differs"), ""


def _of_bound(number: PaperNumber, here: MeasuredNumber) -> tuple[Verdict, str]:
    """By whether the interval, or a value that has none, lies within the bound."""
    if np.isnan(here.low) and here.draws < 2:
        return "cannot tell", _no_interval(number, here)
    low, high = np.where(np.isnan(number.interval), (-np.inf, np.inf), number.interval)
    least, most = (here.value, here.value) if np.isnan(here.low) else (here.low, here.high)
    if low <= least and most <= high:
        return "same", ""
    return ("differs", "") if most < low or high < least else ("cannot tell", "the interval holds the bound")


def _of_interval(number: PaperNumber, here: MeasuredNumber) -> tuple[Verdict, str]:
    """By whether the two intervals overlap, and how far they reach from the paper's number, or range."""
    low, high = number.interval
    if np.isnan(here.low):
        return "cannot tell", _no_interval(number, here)
    if here.low > high or low > here.high:
        return "differs", ""
    if here.draws < FEWEST_DRAWS:
        return "cannot tell", f"an interval of {here.draws:.0f} draws, fewer than {FEWEST_DRAWS}"
    least, most = (low, high) if number.kind == "range" else (number.value, number.value)
    size = abs(least + most) / 2
    for whose, a, b in (("paper's own interval", low, high), ("interval here", here.low, here.high)):
        reach = max(least - a, b - most)
        if reach > AGREEMENT * size * (1 + 1e-9):
            return "cannot tell", f"the {whose} reaches {reach / size:.2g} of the paper's number away from it"
    return "same", ""


def _no_interval(number: PaperNumber, here: MeasuredNumber) -> str:
    if here.draws >= 2:
        return "no interval: the number lies at the end of its range"
    return f"no interval: fewer than two {'sessions' if number.is_neural else 'whiskers'}"
