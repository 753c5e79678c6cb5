"""How the contact advances along a texture while the posture changes, and what it then imposes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, RangeError
from vibrissa.mechanics.vibration.dynamics import Drive
from vibrissa.mechanics.whisking.panels import first_above, fit, panel_nodes, panels, powers
from vibrissa.mechanics.whisking.path_table import PathTable
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

SLOW_TERMS, TERMS = 6, 12  # of the polynomials of what follows the posture alone, and of what follows d too
_MERGED = 1e-12  # [s] borders nearer than this are one


@dataclass(frozen=True)
class Meetings:
    """When the gaps that the path reaches are met.

    Attributes
    ----------
    start, jump, back : (J,) arrays
        Times t₁, t₂, t₃ [s]: the far edge takes the contact along; the contact jumps; it is back on the flat. Infinite
        where the path ends before.
    """

    start: Array
    jump: Array
    back: Array


@dataclass(frozen=True)
class Advance:
    """A contact that advances along a texture.

    Attributes
    ----------
    whisker, path, texture
        What is held how, over what.
    speed : float
        Speed v of the base over the ground [m/s].
    table : PathTable
        What depends on the posture.
    slow : Drive
        Its rows that change with the posture alone, of time.
    """

    whisker: Whisker
    path: PosturePath
    texture: Gaps
    speed: float
    table: PathTable
    slow: Drive

    @classmethod
    def along(
        cls, whisker: Whisker, path: PosturePath, texture: Gaps, speed: float, table: PathTable, panel: float
    ) -> Self:
        """Prepare, with panels no longer than ``panel`` [s].

        Parameters
        ----------
        whisker, path, texture
            What is held how, over what.
        speed : float
            v [m/s].
        table : PathTable
            What depends on the posture.
        panel : float
            Longest panel [s].

        Returns
        -------
        Advance
            The contact's way.

        Raises
        ------
        InputError
            If the tip comes off the ground or the contact does not advance, with the time; if a gap lies before.
        """
        slow = fit(lambda t: table.slow_at(path.spline(t)), panels(path.time, panel), SLOW_TERMS)
        advance = cls(whisker, path, texture, speed, table, slow)
        advance._check()
        return advance

    @property
    def borders(self) -> Array:
        """Borders of the panels on which the posture is polynomial [s]."""
        return np.append(self.slow.time, self.path.time[-1])

    def _check(self) -> None:
        t, rows, tip = panel_nodes(self.borders, SLOW_TERMS).ravel(), self.table.rows, self.whisker.tip
        contact = self.slow(t)[rows.contact][0]
        if (off := contact < tip).any():
            i = int(off.argmax())
            rule = f"must not come to lie beyond the whisker's tip at {tip:.4g}, which then leaves the ground"
            raise RangeError(f"contact at {t[i]:.4g} s", rule, f"{contact[i]:.4g}")
        pace = self.pace(t)
        if (halt := pace <= 0).any():
            i = int(halt.argmax())
            rule = "must advance along the texture (dragging towards the base is not modelled)"
            remedy = "scan faster or move the base more slowly"
            raise FormatError(f"contact at {t[i]:.4g} s", rule, f"{pace[i]:.3g} m/s", remedy)
        begin, end = self.travel(self.path.time[[0, -1]])
        first = self.texture.position[0]
        if first <= begin:
            remedy = "move the texture on"
            raise RangeError(
                "first gap", f"must lie beyond x = {begin:.4g} m, where the path starts", f"{first:.4g} m", remedy
            )
        if first >= end:
            rule, remedy = f"must be reached before the path ends, at x = {end:.4g} m", "make the path longer"
            raise RangeError("first gap", rule, f"{first:.4g} m", remedy)

    def travel(self, t: Array) -> Array:
        """Place X(t) = v t − L [D(t) − D(start)] of the contact's ground on the texture [m], (T,), at any times.

        Parameters
        ----------
        t : (T,) array
            Times [s], in any order.

        Returns
        -------
        (T,) array
            X [m].
        """
        order, rows = np.argsort(t, kind="stable"), self.table.rows
        distance = np.empty_like(t)
        distance[order] = self.slow(t[order])[rows.distance][0]
        return self.speed * t - self.whisker.length * (distance - self.slow.before[rows.distance][0])

    def pace(self, t: Array) -> Array:
        """Speed dX/dt of the contact along the texture [m/s], (T,).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (T,) array
            [m/s].
        """
        return np.asarray(self.speed - self.whisker.length * self.slow.rate(t)[self.table.rows.distance][0])

    def rates(self, damping: float, t: Array) -> dict[str, Any]:
        """Rates of frequency and gain beside the ringing, as ``condition`` of a slow prediction holds them.

        Parameters
        ----------
        damping : float
            Damping ratio ζ.
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        dict of (T,) arrays
            ``time`` [s], ``frequency_rate``, ``gain_rate``, ``mode_mixing`` and ``ring_down_change`` [1].
        """
        slow, rows = self.slow, self.table.rows
        now, rate = slow(t), np.abs(slow.rate(t))
        omega = now[rows.kappa] / self.whisker.timescale
        frequency, gain = rate[rows.kappa] / now[rows.kappa], rate[rows.c] / np.abs(now[rows.c])
        mixing = rate[rows.contact] * now[rows.mixing] * self.whisker.timescale
        with np.errstate(divide="ignore", invalid="ignore"):
            blur = np.maximum(frequency[0], gain[0]) / (damping * omega[0])
        return {
            "time": t,
            "frequency_rate": (frequency / omega).max(axis=0),
            "gain_rate": (gain / omega).max(axis=0),
            "mode_mixing": mixing.max(axis=0),
            "ring_down_change": np.nan_to_num(blur, nan=0.0, posinf=np.inf),
        }

    @cached_property
    def meetings(self) -> Meetings:
        """When the gaps are met: X = x_j; X = x_j + L d₂, of the posture at that moment; X = x_j + λ_j."""
        begin, end = self.path.time[[0, -1]]
        met = self.texture.position < self.travel(np.array([end]))
        position, width = self.texture.position[met], self.texture.width[met]
        length, last = self.whisker.length, np.full(position.size, end)

        def beyond(t: Array) -> Array:
            return self.travel(t) - position - length * self.table.deepest(self.path.spline(t), width / length)

        start = first_above(lambda t: self.travel(t) - position, np.full(position.size, begin), last)
        back = first_above(lambda t: self.travel(t) - position - width, start, last)
        return Meetings(start, first_above(beyond, start, np.minimum(back, end)), back)

    def _edge(self, t: Array) -> Array:
        """Place on the texture of the edge that holds the contact [m], (T,); NaN on the lands."""
        met = self.meetings
        if not met.start.size:
            return np.full(t.shape, np.nan)
        gap = np.searchsorted(met.start, t, side="right") - 1
        edge = self.texture.position[gap] + np.where(t >= met.jump[gap], self.texture.width[gap], 0.0)
        return np.where((gap >= 0) & (t < met.back[gap]), edge, np.nan)

    def excursion(self, t: Array) -> Array:
        """d(t) over L, (T,); 0 on the lands.

        Parameters
        ----------
        t : (T,) array
            Times [s].

        Returns
        -------
        (T,) array
            d over L.
        """
        return np.nan_to_num(self.travel(t) - self._edge(t)) / self.whisker.length

    def _events(self) -> Array:
        """Times of the gaps, and those at which d passes from one piece of the response to the next."""
        met, end = self.meetings, self.path.time[-1]
        n = len(met.start)
        times = [met.start, met.jump, met.back]
        for border in self.table.borders[1:-1] * self.whisker.length:
            rising = border > 0
            low, high = (met.start, met.jump) if rising else (met.jump, met.back)
            low, high = np.minimum(low, end), np.minimum(high, end)
            goal = self.texture.position[:n] + (0.0 if rising else self.texture.width[:n]) + border
            t = first_above(lambda t, goal=goal: self.travel(t) - goal, low, high)  # type: ignore[misc]
            times.append(t[t > low])
        found = np.concatenate(times)
        return found[found < end]

    @cached_property
    def drive(self) -> Drive:
        """Everything quasi-static as polynomials of time, from border to border.

        Rows as in :class:`vibrissa.mechanics.quasi_static.response.Response`.
        """
        borders = np.sort(np.concatenate([self.borders, self._events()]))
        borders = np.append(borders[:-1][np.diff(borders) > _MERGED], borders[-1])
        middle, t = (borders[1:] + borders[:-1]) / 2, panel_nodes(borders, TERMS).ravel()
        edge = self._edge(middle)
        d = np.nan_to_num(self.travel(t) - np.repeat(edge, TERMS)) / self.whisker.length
        piece = np.repeat(self.table.piece(self.excursion(middle)), TERMS)
        n = self.table.n_modes
        values = self.table.respond(self.path.spline(t), d, piece).reshape(-1, len(middle), TERMS)
        values[:n, np.isnan(edge)] = 0.0
        coefficients = powers(values, borders)
        return Drive(borders[:-1], coefficients, np.concatenate([np.zeros(n), coefficients[n:, 0, 0]]))
