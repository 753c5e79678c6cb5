"""The stimulus as the units meet it: its envelope, and the bins in which rate and envelope are compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.signal import butter, sosfiltfilt

from vibrissa.arrays import Array, Mask, Window
from vibrissa.errors import ConflictError, RangeError, TooFewError, require_not_negative, require_positive
from vibrissa.limits import require_bins
from vibrissa.neural.coupling.envelope_coupling import bin_means
from vibrissa.neural.coupling.threshold_linear import BinnedDrive
from vibrissa.neural.io.tables.stimuli import Presented, mean_frequency, presented
from vibrissa.signals.envelope import analytic_envelope

EDGE_PERIODS = 3  # of the carrier, left out at both ends: there the analytic signal knows one side only
LONGEST = 0.03  # [s] latency that is searched
JOINED = "trials_joined"  # attribute: number of equally long trials that lie end to end in one presentation


@dataclass(frozen=True, kw_only=True)
class Presentation:
    """Envelope of the stimulus, and the bins it is compared in.

    Attributes
    ----------
    time, envelope : (T,) arrays
        Times [s] and envelope, in the unit of the stimulus [m].
    edges : (K + 1,) array
        Edges of the bins [s].
    rate_valid, envelope_valid : (K,) arrays of bool
        Bins after the onset, of every trial where several are joined; bins away from the ends of the record.
    edge : float
        Time left out at both ends of the record [s].
    carrier : (T,) array
        What the envelope is of: the displacement less its mean, or its band [m]; 0 where the stimulus is an envelope.
    frequency : float
        Mean frequency of the carrier, weighted by power [Hz]; NaN where the stimulus is an envelope.
    known : (K,) array of bool
        Bins in which the envelope is known throughout; all unless the stimulus is an envelope with holes.
    """

    time: Array
    envelope: Array
    edges: Array
    rate_valid: Mask
    envelope_valid: Mask
    edge: float
    carrier: Array
    frequency: float
    known: Mask

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
        (its mean frequency, weighted by power) are left out. A stimulus that is an envelope is taken as it is.

        Parameters
        ----------
        stimulus : Dataset
            ``time`` and ``point_displacement``, or what :func:`vibrissa.neural.io.tables.stimuli.presented` takes.
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
        shown = presented(stimulus)
        time = shown.time
        step = (time[-1] - time[0]) / (time.size - 1)
        start, stop = window or (time[0], time[-1] + step)
        slack, end = step * (1 + 1e-6), time[-1] + step  # a trial begins and ends within a step of its samples
        if start < time[0] - slack or stop > end + slack:
            raise RangeError("window", f"must lie within the stimulus, {time[0]:g} to {end:g} s", (start, stop))
        require_bins(stop - start, bin_width)
        envelope, carrier, frequency, holes = enveloped(shown, band, step)
        edge = edge_of(frequency)
        n_bins = int(np.floor((stop - start) / bin_width + 1e-6))
        edges: Array = start + bin_width * np.arange(n_bins + 1, dtype=float)
        starts, stops = edges[:-1], edges[1:]
        in_trial = np.arange(n_bins) % (n_bins // int(stimulus.attrs.get(JOINED, 1)))
        near = 1e-6 * bin_width
        first, last = time[0] + edge, time[-1] + step - edge
        lost = np.append(0, np.cumsum(holes))[np.searchsorted(time, edges - near)]
        known = np.diff(lost) == 0
        presentation = cls(
            time=time,
            envelope=envelope,
            edges=edges,
            rate_valid=in_trial * bin_width >= skip - near,
            envelope_valid=(starts >= first - near) & (stops <= last + near) & known,
            edge=edge,
            carrier=carrier,
            frequency=frequency,
            known=known,
        )
        if (left := int(np.sum(presentation.rate_valid & presentation.envelope_valid))) < 100:
            rule = f"must leave at least 100 bins of {bin_width:g} s after the first {skip:g} s, which are skipped"
            narrower = ", narrower bins: 0.01 for 10 ms" if bin_width >= 1 else ""
            longer = "longer stimulus" if window is None else "longer window"
            raise TooFewError("window" if window else "stimulus", rule, left, f"less skip, {longer}{narrower}")
        return presentation

    def binned(self) -> Array:
        """Envelope averaged over each bin [m]."""
        width, n = self.edges[1] - self.edges[0], len(self.edges) - 1
        return bin_means(self.time, self.envelope, start=float(self.edges[0]), n_bins=n, bin_width=float(width))

    def drive(self) -> BinnedDrive:
        """Envelope seen through the bins after the onset, at any latency up to 30 ms."""
        early = self.edges[:-1] - LONGEST >= self.time[0] + self.edge - 1e-9
        valid = self.rate_valid & self.envelope_valid & early
        for lag in range(1, int(np.ceil(LONGEST / (self.edges[1] - self.edges[0]))) + 1):
            valid[lag:] &= self.known[:-lag]
        seen = {"time": self.time, "envelope": self.envelope, "edges": self.edges}
        return BinnedDrive(**seen, valid=valid, latencies=(0.0, LONGEST))


@dataclass(frozen=True, kw_only=True)
class BinnedAnalysis:
    """Settings that all analyses of one stimulus share.

    Attributes
    ----------
    bin_width : float
        Width of the bins [s].
    skip : float
        Time left out at the start of the window, and of every trial where several are joined, while units adapt [s].
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


def edge_of(frequency: float) -> float:
    """Time left out at both ends of a record.

    Parameters
    ----------
    frequency : float
        Mean frequency of the carrier [Hz]; NaN of an envelope and 0 of a trial at rest, which have none.

    Returns
    -------
    float
        [s].
    """
    return EDGE_PERIODS / frequency if frequency > 0 else 0.0


def enveloped(shown: Presented, band: Window | None, step: float) -> tuple[Array, Array, float, Mask]:
    """Envelope of a stimulus; of one that is an envelope, the stimulus.

    Parameters
    ----------
    shown : Presented
        Of one channel.
    band : (float, float), optional
        Of the carrier [Hz].
    step : float
        Between samples [s].

    Returns
    -------
    envelope, carrier : (T,) arrays
        The envelope, 0 where it is not known, and what it is of.
    frequency : float
        Mean frequency of the carrier, weighted by power [Hz].
    holes : (T,) array of bool
        Where the envelope is not known.

    Raises
    ------
    InputError
        If the band is not one, or goes with an envelope.
    """
    if not shown.is_envelope:
        carrier = banded(shown.values, band, step)
        nowhere = np.zeros(carrier.size, bool)
        return analytic_envelope(carrier)[0], carrier, mean_frequency(carrier, step), nowhere
    if band is not None:
        raise ConflictError("band", "must go with a motion: an envelope has no carrier", band, "leave it out")
    holes = ~np.isfinite(shown.values)
    return np.where(holes, 0.0, shown.values), np.zeros(shown.time.size), np.nan, holes


def banded(displacement: Array, band: Window | None, step: float) -> Array:
    """A motion less its mean, or its part in a band.

    Parameters
    ----------
    displacement : (T,) array
        The motion, in any unit.
    band : (float, float), optional
        LOW and HIGH of the band [Hz]; all of it by default.
    step : float
        Between samples [s].

    Returns
    -------
    (T,) array
        In the unit of the motion.

    Raises
    ------
    InputError
        If the band does not lie below half the sampling rate.
    """
    if band is None:
        return displacement - displacement.mean()
    if not 0 < band[0] < band[1] < 0.5 / step:
        raise RangeError("band", f"must lie between 0 and {0.5 / step:g} Hz", band)
    return sosfiltfilt(butter(2, band, "bandpass", fs=1 / step, output="sos"), displacement)
