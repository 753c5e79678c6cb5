"""State of the page's controls, checked: numbers in their bounds, choices among the known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from reprlib import repr as short
from typing import Any

import numpy as np

from vibrissa.errors import RangeError, UnknownError, did_you_mean
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
from vibrissa.page.panel.controls import CONTROLS, Control
from vibrissa.tables.text import as_number
from vibrissa.whisker import Whisker, atlas_whisker

LONGEST_TEXT = 80  # characters of one value

_at_height = lru_cache(64)(Posture.at_height)  # asked for several times in one answer


@dataclass(frozen=True, kw_only=True)
class Choice:
    """One texture, as its controls say; all lengths [m], see :mod:`vibrissa.page.panel.controls`."""

    kind: str
    seed: int
    length: float
    period: float
    duty: float
    depth: float
    rms: float
    amplitude: float
    file: str


@dataclass(frozen=True)
class PageState:
    """Everything that is set on the page.

    Attributes
    ----------
    values : dict
        By the names of ``vibrissa.page.panel.controls.CONTROLS``: numbers in SI, or words.
    """

    values: dict[str, float | str]

    @property
    def whisker(self) -> Whisker:
        """The measured whisker, or the one of own numbers."""
        name = str(self.values["whisker"])
        if name != "own":
            return atlas_whisker(name)
        numbers = ("length", "cone_angle", "tip", "youngs_modulus", "density")
        return Whisker(**{one: self.number(one) for one in numbers})

    @property
    def posture(self) -> Posture:
        """The posture, by H or by ε.

        Raises
        ------
        InputError
            If H is out of reach.
        """
        angle, friction = self.number("base_angle"), self.number("friction")
        if self.values["hold"] == "contact":
            return Posture(contact=self.number("contact"), base_angle=angle, friction=friction)
        length, height = self.whisker.length, self.number("height")
        top = length * np.sin(angle)  # reached as ε → 0
        if not height < top:
            rule, remedy = f"must lie below L sin θ_b, {top * 1e3:.4g} mm", "lower H or raise θ_b"
            raise RangeError("Posture, Distance H (height)", rule, f"{height * 1e3:.4g} mm", remedy)
        return _at_height(height / length, angle, friction)

    @property
    def scan(self) -> Scan:
        """Speed and damping."""
        return Scan(speed=self.number("speed"), damping=self.number("damping"))

    @property
    def whole(self) -> bool:
        """Whether the whole whisker is wanted, as a rod."""
        return self.values["model"] == "rod"

    @property
    def unit(self) -> ThresholdLinearUnit:
        """The simulated neuron."""
        return ThresholdLinearUnit(
            threshold=self.number("threshold"), slope=self.number("slope"), baseline=self.number("baseline")
        )

    def texture(self, letter: str) -> Choice:
        """One of the two textures.

        Parameters
        ----------
        letter : {"a", "b"}
            Which.

        Returns
        -------
        Choice
            As its controls say.
        """
        named: dict[str, Any] = {name: self.values[f"{letter}.{name}"] for name in Choice.__annotations__}
        return Choice(**named | {"seed": int(named["seed"])})

    def number(self, name: str) -> float:
        """One number.

        Parameters
        ----------
        name : str
            Of a control.

        Returns
        -------
        float
            In SI.
        """
        return float(self.values[name])


def read_state(given: Mapping[str, Any]) -> PageState:
    """Check the values that the page, or an address, gives; the others take their defaults.

    Parameters
    ----------
    given : mapping
        Values by name: numbers [SI], numbers written out, or words.

    Returns
    -------
    PageState
        All values.

    Raises
    ------
    InputError
        If a control is unknown, or a value is no number or choice of it, or out of its bounds.
    """
    for name in given:
        if name not in CONTROLS:
            raise UnknownError(
                f"control {short(name)}", "is unknown", remedy=did_you_mean(str(name)[:LONGEST_TEXT], CONTROLS)
            )
    return PageState({name: _checked(name, one, given.get(name, one.default)) for name, one in CONTROLS.items()})


def _checked(name: str, control: Control, value: Any) -> float | str:
    if control.choices:
        if isinstance(value, str) and value in control.choices:
            return value
        known = f"it knows {short(', '.join(control.choices))}"
        cure = did_you_mean(str(value)[:LONGEST_TEXT], control.choices, known, cutoff=0.4)
        raise UnknownError(_thing(name, control), "must be one of its choices", short(value), cure)
    if isinstance(control.default, str):
        if not isinstance(value, str) or len(value) > LONGEST_TEXT or not all(c.isalnum() for c in value):
            raise UnknownError(_thing(name, control), "must be the key of a dropped file", short(value))
        return value
    return _bounded(name, control, value)


def _bounded(name: str, control: Control, value: Any) -> float:
    number = _as_float(value)
    if not control.low <= number <= control.high or (control.whole and number != round(number)):
        low, high = control.low * control.scale, control.high * control.scale
        kind = "be a whole number" if control.whole else "lie"
        rule = f"must {kind} between {low:.10g} and {high:.10g} {control.unit}".rstrip()
        found = f"{number * control.scale:.6g} {control.unit}".rstrip() if np.isfinite(number) else short(value)
        raise RangeError(_thing(name, control), rule, found)
    return number


def _as_float(value: Any) -> float:
    """The number that is given or written out; NaN for anything else."""
    if isinstance(value, str):
        return as_number(value) if len(value) <= LONGEST_TEXT else np.nan
    try:
        return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else np.nan
    except OverflowError:
        return np.nan


def _thing(name: str, control: Control) -> str:
    return f"{control.group}, {control.label} ({name})"
