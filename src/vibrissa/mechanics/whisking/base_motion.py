"""The motion of the base of a whole whisker at every step, from rest on."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.whisking.base_path import BasePath
from vibrissa.signals.even_times import whole_steps

_LEAD = 25e-3  # [s] in which the base comes to the rate at which its path begins
_STILL = 1e-6  # per second, of height over L and angle: a path that begins slower begins at rest


class BaseMotion:
    """The motion of a base on its path, after a lead in which it comes from rest to the path's first rate.

    Parameters
    ----------
    path : BasePath
        Of the base.
    speed : float
        Of travel beside the path's own [m/s].
    rate : float
        Records per second [Hz].

    Attributes
    ----------
    lead : int
        Records before the path begins.
    """

    def __init__(self, path: BasePath, speed: float, rate: float) -> None:
        self.path, self.speed, self.rate = path, speed, rate
        self.start, self.stop = float(path.time[0]), float(path.time[-1])
        begins = np.abs(path.spline(self.start, 1)[:2]).max()
        self.lead = int(np.ceil(_LEAD * rate)) if begins > _STILL else 1  # records before the path

    def grid(self, every: int) -> Array:
        """Times of the steps, the first before the lead.

        Parameters
        ----------
        every : int
            Steps for each record.

        Returns
        -------
        (T,) array
            [s].
        """
        count = self.lead + whole_steps(self.stop - self.start, self.rate)
        return self.start + (np.arange(count * every + 1) / every - self.lead) / self.rate

    def along(self, time: Array) -> tuple[Array, Array, Array]:
        """Height over L, angle [rad] and travel [m] at some times, their rates and accelerations.

        Parameters
        ----------
        time : (T,) array
            [s]; before the path the lead.

        Returns
        -------
        three (3, T) arrays
            The travel is 0 where the path begins.
        """
        inside = np.clip(time, self.start, self.stop)
        place, rate, faster = (self.path.spline(inside, order) for order in range(3))
        before = time < self.start
        place[:, before], rate[:, before], faster[:, before] = self._led(time[before])
        place[2] += self.speed * (time - self.start) - self.path.spline(self.start)[2]
        rate[2] += self.speed
        return place, rate, faster

    def _led(self, time: Array) -> tuple[Array, Array, Array]:
        """Before the path: from rest to its first rate, smoothly; the travel continues at its first rate."""
        lasting = self.lead / self.rate
        at, rate = (self.path.spline(self.start, order)[:, None] for order in range(2))
        tau = 1 + (time - self.start) / lasting
        place = at - lasting * rate * (0.5 - tau**3 + tau**4 / 2)
        speed, change = rate * (3 * tau**2 - 2 * tau**3), rate * 6 * tau * (1 - tau) / lasting
        place[2], speed[2], change[2] = at[2] + rate[2] * (time - self.start), rate[2, 0], 0.0
        return place, speed, change
