"""The stimulator's band: a Bessel filter, in its periodic steady state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.signal import bessel

from vibrissa.arrays import Array, Complex
from vibrissa.errors import RangeError, UnknownError

Norm = Literal["phase", "delay", "mag"]

RESONANCES = (69.0, 88.0, 89.0)  # [Hz] first resonances printed in Fig. 7A, about the upper edge of the band
_HIGHEST_ORDER = 10  # above it the sections of a 0.1 Hz corner at 20 kHz lose their digits


@dataclass(frozen=True, kw_only=True)
class Band:
    """Bessel band-pass of the stimulator.

    The paper gives the corners; order, norm and causality are not printed. The default is the reading that agrees
    with "the replayed stimulus was dominated by the fundamental resonant mode": corners of a bandwidth are at −3 dB,
    and the filter is applied once. Of a simulated whisker that rings at 88 Hz, 63 % of the power lies within 30 % of
    the resonance; 56 % after this filter, 42 % after it forwards and backwards, 35 % and 12 % with ``phase``.

    Attributes
    ----------
    low, high : float
        Corners [Hz].
    order : int
        Order of the low-pass prototype; the band-pass has twice as many poles.
    norm : {"phase", "delay", "mag"}
        What the corners mean, as in ``scipy.signal.bessel``: phase at its midpoint, unit delay of the prototype, or
        −3 dB.
    causal : bool
        Once forwards, with its delay; otherwise forwards and backwards: no delay, the gain squared.
    """

    low: float = 0.1
    high: float = 83.0
    order: int = 4
    norm: Norm = "mag"
    causal: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.low < self.high < np.inf:
            raise RangeError("band", "must have corners 0 < `low` < `high` (Hz)", f"{self.low:g}, {self.high:g}")
        if not (isinstance(self.order, int) and 1 <= self.order <= _HIGHEST_ORDER):
            raise RangeError("order", f"must be a whole number, 1 to {_HIGHEST_ORDER}", self.order)
        if self.norm not in get_args(Norm):
            raise UnknownError("norm", f"must be one of {', '.join(get_args(Norm))}", repr(self.norm))

    @property
    def description(self) -> str:
        """The filter in one line."""
        way = "causal, once forwards" if self.causal else "zero-phase, forwards and backwards (gain squared)"
        corners = f"{self.low:g}-{self.high:g} Hz"
        return f"Bessel band-pass {corners}, order {self.order}, norm {self.norm}, {way}, periodic steady state"

    def sections(self, sampling_rate: float) -> Array:
        """Second-order sections at a sampling rate [Hz]: (order, 6) array.

        In the form of two polynomials a corner of 0.1 Hz is unstable already at order 4 and 2 kHz.

        Parameters
        ----------
        sampling_rate : float
            [Hz].

        Returns
        -------
        (order, 6) array
            Coefficients of each section.

        Raises
        ------
        InputError
            If the rate is not above twice the band.
        """
        if not sampling_rate > 2 * self.high:
            raise RangeError("sampling_rate", f"must be above {2 * self.high:g} Hz, twice the band", sampling_rate)
        corners = [self.low, self.high]
        return bessel(self.order, corners, "bandpass", output="sos", norm=self.norm, fs=sampling_rate)

    def response(self, frequency: Array, sampling_rate: float) -> Complex:
        """Transfer function, unit out per unit in.

        Parameters
        ----------
        frequency : (F,) array
            [Hz], at most half the sampling rate.
        sampling_rate : float
            [Hz].

        Returns
        -------
        (F,) complex array
            H once forwards, |H|² forwards and backwards.
        """
        back = np.exp(-2j * np.pi * frequency / sampling_rate)  # z⁻¹
        once = np.ones(len(frequency), complex)
        for section in self.sections(sampling_rate):
            once *= np.polyval(section[2::-1], back) / np.polyval(section[:2:-1], back)
        return once if self.causal else np.abs(once) ** 2 + 0j

    def group_delay(self, frequency: Array, sampling_rate: float) -> Array:
        """Delay of the envelope −dφ/dω [s], (F,) array; 0 forwards and backwards.

        Parameters
        ----------
        frequency : (F,) array
            [Hz].
        sampling_rate : float
            [Hz].

        Returns
        -------
        (F,) array
            Delay [s].
        """
        if not self.causal:
            return np.zeros(len(frequency))
        step = 1e-3  # [Hz] far below the band's lower corner
        behind, ahead = (self.response(frequency + side, sampling_rate) for side in (-step, step))
        return -np.angle(ahead / behind) / (2 * np.pi * 2 * step)

    def filtered(self, loop: Array, sampling_rate: float) -> Array:
        """A loop after the filter, once the start has been forgotten.

        The 0.1 Hz corner remembers for about as long as the 10 s record lasts, so any start from rest would colour all
        of it. The stimulus is a loop, copied with circular shifts: its Fourier series times the transfer function is
        what the filter gives after endless repetition, without a transient.

        Parameters
        ----------
        loop : (T,) array
            One period, any unit.
        sampling_rate : float
            [Hz].

        Returns
        -------
        (T,) array
            One period, in the unit of the loop; its mean is 0.
        """
        frequency = np.fft.rfftfreq(len(loop), 1 / sampling_rate).astype(np.float64)
        gain = self.response(frequency, sampling_rate)
        gain[0] = 0  # exactly: round-off of the sections would leave 1e-8 of the mean
        return np.fft.irfft(np.fft.rfft(loop) * gain, len(loop))
