"""A measured profile on its way to a relief: units, stretch, direction, holes, tilt."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError, TooFewError
from vibrissa.tables.units import to_si, units_of
from vibrissa.texture.relief import SHORTEST as SMALLEST

SHORTEST_SCAN = 0.3e-3  # [m] a mean gap of the paper; at 0.1 m/s a third of one period of the first resonance
ALIKE = 0.5  # correlation of neighbouring heights of a wave with six points to its length; white noise has none
_ROUNDING = 1e-6  # of the length or the range of heights, by which zeros may be off
_SPEED = 0.1  # [m/s] the paper's, as an example


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A profile as its file holds it.

    Attributes
    ----------
    name : str
        The file, and the line of it, for messages.
    position : (N,) array
        Places in the order of the file [``x_unit``].
    height : (N,) array
        Heights [``z_unit``]; NaN where nothing was measured.
    x_unit, z_unit : str or None
        Units that the file states.
    zero : bool
        Whether the file's zeros of place and height are those of a relief; an instrument's mean nothing.
    notes : tuple of str
        What to know of the measurement.
    """

    name: str
    position: Array
    height: Array
    x_unit: str | None = "m"
    z_unit: str | None = "m"
    zero: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        lost = ~np.isfinite(self.position)
        if lost.any() or self.position.size < 2:
            found = f"none at point {int(np.argmax(lost)) + 1}" if lost.any() else f"{self.position.size} points"
            raise TooFewError(self.name, "must have two points or more, each with its position", found)
        endless = np.isinf(self.height)
        if endless.any():
            point = int(np.argmax(endless))
            remedy = "nan, or an empty cell, is a height that was not measured"
            raise FormatError(
                self.name, "must have finite heights", f"{self.height[point]} at point {point + 1}", remedy
            )

    def in_metres(self, x_unit: str | None = None, z_unit: str | None = None) -> Measured:
        """Places and heights in metres, by the units of the file or, where it states none, by those given.

        Parameters
        ----------
        x_unit, z_unit : str, optional
            Units of places and heights: m, mm, um or nm.

        Returns
        -------
        Measured
            The same profile [m].

        Raises
        ------
        InputError
            If a unit is stated twice, not at all, or unknown.
        """
        x = _metres(self.name, self.position, "x_unit", self.x_unit, x_unit)
        z = _metres(self.name, self.height, "z_unit", self.z_unit, z_unit)
        return replace(self, position=x, height=z, x_unit="m", z_unit="m")

    def part(self, start: float, end: float) -> Measured:
        """Keep the points from ``start`` to ``end`` [m], counted from the first point; the kept part begins at 0.

        Parameters
        ----------
        start, end : float
            Distances from the first point [m].

        Returns
        -------
        Measured
            The points between.

        Raises
        ------
        InputError
            If fewer than two points lie there, or it begins or ends more than a step beyond them.
        """
        along = (self.position - self.position[0]) * self._sense()
        inside = (along >= start) & (along <= end)
        longest, step = float(along.max()), float(np.ptp(along)) / (along.size - 1)
        if np.count_nonzero(inside) < 2 or start < along.min() - step or end > longest + step:
            rule = f"must hold the asked part, {start:g} m to {end:g} m from its first point"
            meant_mm = 10 * longest < end <= 1e3 * longest
            remedy = f"`part` is in metres: {1e-3 * end:g} for {end:g} mm" if meant_mm else ""
            remedy = "the smaller distance first" if start >= end else remedy
            raise FormatError(self.name, rule, f"a length of {longest:.4g} m", remedy)
        position = self.position[inside]
        return replace(self, position=position - position[0], height=self.height[inside])

    def flipped(self) -> Measured:
        """Give the profile as it is met from the other end; the last point of the file is at 0."""
        away = (self.position[-1] - self.position)[::-1] * self._sense()
        return replace(self, position=away, height=self.height[::-1])

    def _sense(self) -> int:
        """1 where positions ascend through the file, −1 where they descend."""
        return 1 if self.position[-1] >= self.position[0] else -1

    def filled(self) -> Measured:
        """Straight lines across the holes; unmeasured ends are left out."""
        good = np.isfinite(self.height)
        ends = np.flatnonzero(good)[[0, -1]]
        inside = slice(ends[0], ends[1] + 1)
        x, z = self.position[inside], self.height[inside].copy()
        hole = np.isnan(z)
        z[hole] = np.interp(x[hole], self.position[good], self.height[good])
        return replace(self, position=x, height=z)

    def levelled(self) -> Measured:
        """Take the line of least squares away; the mean height becomes 0."""
        return replace(self, height=self.height - np.polynomial.Polynomial(self.line())(self.position))

    def line(self) -> Array:
        """Height at x = 0 [m] and slope of the line of least squares, each point weighing the stretch around it."""
        step = np.diff(self.position)
        weight = np.concatenate([[0.0], step]) + np.concatenate([step, [0.0]])
        x0, z0 = np.average(self.position, weights=weight), np.average(self.height, weights=weight)
        x, z = self.position - x0, self.height - z0
        slope = (weight * x * z).sum() / (weight * x**2).sum()
        return np.array([z0 - slope * x0, slope])

    def zeroed(self) -> Measured:
        """Count heights from their mean along the profile, and places from the first, unless zero is the file's own."""
        if self.zero:
            return self
        line = self.line()
        mean = line[0] + line[1] * (self.position[0] + self.position[-1]) / 2
        return replace(self, position=self.position - self.position[0], height=self.height - mean)

    def own_zeros(self) -> list[str]:
        """What the zeros of a table make of it, where they may be those of an instrument."""
        start, low, high = self.position[0] * 1e3, self.height.min() * 1e6, self.height.max() * 1e6
        if (np.diff(self.position) == 0).any():
            return []  # walls are drawn
        behind = ", behind the contact at time 0" if start < 0 else ""
        away = abs(self.position[0]) > _ROUNDING * np.ptp(self.position)
        found = [f"the first point lies at {start:.4g} mm{behind}"] if away else []
        if max(low, -high) > _ROUNDING * (high - low):
            found.append(f"the heights, {low:.4g} to {high:.4g} µm, do not reach the substrate line at 0")
        remedy = "to count from the first point and the mean height, subtract them in the table"
        return [f"zero is where the table has it: {'; '.join(found)}; {remedy}"] if found else []

    def refuse_short(self) -> None:
        """Refuse a profile too small for a whisker: shorter than one gap.

        Raises
        ------
        InputError
            If it is too short.
        """
        length = float(np.ptp(self.position))
        if not length >= SHORTEST_SCAN:
            raise TooFewError(self.name, TOO_SHORT, f"{length * 1e3:.4g} mm")

    def refuse_order(self) -> None:
        """Refuse unsorted places, descending ones (the other direction), and repeated ones in a measurement.

        Raises
        ------
        InputError
            At the first place that does not ascend.
        """
        step, rule = np.diff(self.position), "must have ascending positions"
        if (step < 0).all():
            remedy = "`flip` lets the last point of the file meet the contact first"
            raise RangeError(self.name, rule, "descending ones", remedy)
        wrong = (step < 0) | (step == 0) & (not self.zero)
        if wrong.any():
            first = int(np.argmax(wrong)) + 1
            found = f"{self.position[first]:.6g} m after {self.position[first - 1]:.6g} m at point {first + 1}"
            remedy = "sort the points; a wall, two heights at one place, needs a header such as position_mm,height_um"
            raise RangeError(self.name, rule, found, remedy)

    def refuse_unmeasured(self) -> None:
        """Refuse a profile that is holes for the most part: lines across them would be the texture.

        Raises
        ------
        InputError
            If holes are more than heights.
        """
        good = np.flatnonzero(np.isfinite(self.height))
        between = good[-1] - good[0] + 1 - good.size if good.size else 0
        if good.size < 2 or between > good.size:
            rule = "must have more heights than holes between them"
            raise RangeError(self.name, rule, f"{good.size} heights in {self.height.size} points")

    def refuse_holes(self) -> None:
        """Refuse points without height; say how many and how wide the widest hole between measured ones is.

        Raises
        ------
        InputError
            If any point has no height.
        """
        count, widest = np.count_nonzero(np.isnan(self.height)), self.widest_hole()
        if count:
            where = f"the widest hole {widest * 1e3:.3g} mm" if widest else "all at its ends"
            remedy = "`fill` draws straight lines across holes and leaves out unmeasured ends"
            rule = "must have a height at every point"
            raise FormatError(self.name, rule, f"none at {count} of {self.height.size}, {where}", remedy)

    def widest_hole(self) -> float:
        """Widest distance between measured neighbours that have unmeasured points between them [m], 0 if none has."""
        good = np.flatnonzero(np.isfinite(self.height))
        apart = np.abs(np.diff(self.position[good]))
        return float(apart[np.diff(good) > 1].max(initial=0.0))

    def refuse_tilt(self) -> None:
        """Refuse a profile whose fitted line rises by more than all that remains when it is taken away.

        Raises
        ------
        InputError
            If it rises by too much.
        """
        slope, rest = float(self.line()[1]), float(np.ptp(self.levelled().height))
        rise = abs(slope) * float(np.ptp(self.position))
        if rise > rest:
            rule = (
                "must be level: the line fitted to it must rise by no more than the heights about this line span, "
                f"{rest * 1e6:.3g} µm"
            )
            found = f"{rise * 1e6:.4g} µm ({slope * 1e3:.3g} mm per m)"
            raise FormatError(self.name, rule, found, "`level='line'` subtracts the line, `level='none'` keeps it")

    def sampling(self) -> list[str]:
        """How finely the profile is sampled, and whether its points follow one another.

        A table with a header whose points are not evenly spaced is taken for drawn, corner by corner.
        """
        steps = np.diff(self.position)
        span, step = float(np.ptp(self.position)), float(np.median(steps))
        if self.zero and np.ptp(steps) > 0.01 * step:
            return [f"{self.position.size} points over {span * 1e3:.4g} mm, straight lines between them"]
        notes = [f"{self.position.size} points over {span * 1e3:.4g} mm, one every {step * 1e6:.3g} µm"]
        if step > SMALLEST:
            notes.append(
                f"nothing finer than {2 * step * 1e6:.3g} µm is in the file, nor in what the whisker will feel; lines "
                f"between points give a frequency of their own, {_SPEED / step:.3g} Hz at {_SPEED * 1e3:g} mm/s"
            )
        z = self.levelled().height
        likeness = float((z[1:] * z[:-1]).sum() / max((z * z).sum(), np.finfo(float).tiny))
        if likeness < ALIKE and z.any():
            cause = "features finer than the sampling, or noise" + (" of the instrument" if not self.zero else "")
            notes.append(f"neighbouring heights correlate by {likeness:.2f} only: {cause}")
        return notes


TOO_SHORT = f"must be at least {SHORTEST_SCAN * 1e3:g} mm long, one gap: it is too small for a whisker"


def _metres(name: str, values: Array, option: str, stated: str | None, given: str | None) -> Array:
    """Lengths [m], by the unit that the file states or, where it states none, by the option."""
    if stated is not None and given is not None:
        raise ConflictError(name, f"states its unit, {stated}", f"{option} {given}", f"leave `{option}` out")
    unit = given if stated is None else stated
    if unit is None:
        raise MissingError(name, "must state its units", "none", f"give `{option}`, one of m, mm, um, nm")
    if given is not None and given not in units_of("m"):
        raise FormatError(option, "must be one of m, mm, um, nm", repr(given))
    if unit not in units_of("m"):
        raise FormatError(name, "must have lengths in m, mm, um or nm", repr(unit))
    return to_si(values, unit)
