"""The stimulus as the units meet it: its envelope, and the bins in which rate and envelope are compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.signal import butter, sosfiltfilt

from vibrissa.arrays import Array, Mask, Window
from vibrissa.errors import RangeError, TooFewError, require_not_negative, require_positive
from vibrissa.neural.coupling.envelope_coupling import bin_means
from vibrissa.neural.coupling.threshold_linear import BinnedDrive
from vibrissa.quantities import require
from vibrissa.signals.envelope import analytic_envelope

EDGE_PERIODS = 3  # of the carrier, left out at both ends: there the analytic signal knows one side only


@dataclass(frozen=True, kw_only=True)
class Presentation:
    """Envelope of the stimulus, and the bins it is compared in.

    Attributes
    ----------
    time, envelope : (T,) arrays
        Times [s] and envelope [m].
    edges : (K + 1,) array
        Edges of the bins [s].
    rate_valid, envelope_valid : (K,) arrays of bool
        Bins after the onset; bins away from the ends of the record.
    edge : float
        Time left out at both ends of the record [s].
    carrier : (T,) array
        What the envelope is of: the displacement less its mean, or its band [m].
    frequency : float
        Mean frequency of the carrier, weighted by power [Hz].
    """

    time: Array
    envelope: Array
    edges: Array
    rate_valid: Mask
    envelope_valid: Mask
    edge: float
    carrier: Array
    frequency: float

    @classmethod
    def of(
        cls,
        stimulus: xr.Dataset,
        *,
        bin_width: float = 0.01,
        skip: float = 1.0,
        window: Window | None = None,
        band: Window | None = None,
    ) -> Presentation:
        """Envelope of a stimulus, and its bins.

        The envelope is that of the displacement less its mean, or of its band. At both ends, 3 periods of the carrier
        (its mean frequency, weighted by power) are left out.

        Parameters
        ----------
        stimulus : Dataset
            ``time`` and ``point_displacement``.
        bin_width, skip, window, band
            As in :class:`vibrissa.neural.coupling.analysis.EnvelopeAnalysis`.

        Returns
        -------
        Presentation
            Envelope and bins.

        Raises
        ------
        InputError
            If the window leaves the stimulus, or less than 100 bins; if the band is not one.
        """
        require(stimulus, "time", "point_displacement")
        time, displacement = stimulus.time.values, stimulus.point_displacement.values
        step = (time[-1] - time[0]) / (time.size - 1)
        start, stop = window or (time[0], time[-1] + step)
        if start < time[0] - step / 2 or stop > time[-1] + 1.5 * step:
            raise RangeError("window", f"must lie within the stimulus, {time[0]:g} to {time[-1]:g} s", (start, stop))
        carrier = _banded(displacement, band, step)
        frequency = _mean_frequency(carrier, step)
        edge = EDGE_PERIODS / frequency
        n_bins = int(np.floor((stop - start) / bin_width + 1e-6))
        edges: Array = start + bin_width * np.arange(n_bins + 1, dtype=float)
        starts, stops = edges[:-1], edges[1:]
        near = 1e-6 * bin_width
        first, last = time[0] + edge, time[-1] + step - edge
        presentation = cls(
            time=time,
            envelope=analytic_envelope(carrier)[0],
            edges=edges,
            rate_valid=starts >= start + skip - near,
            envelope_valid=(starts >= first - near) & (stops <= last + near),
            edge=edge,
            carrier=carrier,
            frequency=frequency,
        )
        if np.sum(presentation.rate_valid & presentation.envelope_valid) < 100:
            rule = "must leave at least 100 bins after the skip"
            narrower = ", narrower bins: 0.01 for 10 ms" if bin_width >= 1 else ""
            raise TooFewError("window", rule, n_bins, f"less skip, longer window{narrower}")
        return presentation

    def binned(self) -> Array:
        """Envelope averaged over each bin [m]."""
        width, n = self.edges[1] - self.edges[0], len(self.edges) - 1
        return bin_means(self.time, self.envelope, start=float(self.edges[0]), n_bins=n, bin_width=float(width))

    def drive(self) -> BinnedDrive:
        """Envelope seen through the bins after the onset, at any latency up to 30 ms."""
        longest = 0.03
        early = self.edges[:-1] - longest >= self.time[0] + self.edge - 1e-9
        valid = self.rate_valid & self.envelope_valid & early
        seen = {"time": self.time, "envelope": self.envelope, "edges": self.edges}
        return BinnedDrive(**seen, valid=valid, latencies=(0.0, longest))


@dataclass(frozen=True, kw_only=True)
class BinnedAnalysis:
    """Settings that all analyses of one stimulus share.

    Attributes
    ----------
    bin_width : float
        Width of the bins [s].
    skip : float
        Time left out at the start of the window, while units adapt [s].
    window : (float, float), optional
        Part of the stimulus analysed [s]; the whole of it by default.
    band : (float, float), optional
        Band of the carrier [Hz]; the displacement as it is by default.
    """

    bin_width: float = 0.01
    skip: float = 1.0
    window: Window | None = None
    band: Window | None = None

    def __post_init__(self) -> None:
        require_positive("bin width", self.bin_width, "s")
        require_not_negative("skip", self.skip, "s")

    def presentation(self, stimulus: xr.Dataset) -> Presentation:
        """Envelope of a stimulus in these bins; see :meth:`Presentation.of`.

        Parameters
        ----------
        stimulus : Dataset
            ``time`` and ``point_displacement``.

        Returns
        -------
        Presentation
            Envelope and bins.
        """
        cut = {"bin_width": self.bin_width, "skip": self.skip}
        return Presentation.of(stimulus, **cut, window=self.window, band=self.band)


def _banded(displacement: Array, band: Window | None, step: float) -> Array:
    if band is None:
        return displacement - displacement.mean()
    if not 0 < band[0] < band[1] < 0.5 / step:
        raise RangeError("band", f"must lie between 0 and {0.5 / step:g} Hz", band)
    return sosfiltfilt(butter(2, band, "bandpass", fs=1 / step, output="sos"), displacement)


def _mean_frequency(signal: Array, step: float) -> float:
    """Mean frequency [Hz], weighted by power."""
    power = np.abs(np.fft.rfft(signal * np.hanning(signal.size))) ** 2
    return float(np.fft.rfftfreq(signal.size, step) @ power / power.sum())
