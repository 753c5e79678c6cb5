"""What one unit did, for a picture: rate beside envelope and fit, rate against envelope, correlogram, its own lags."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers
from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, binned_record
from vibrissa.neural.coupling.lack_of_fit import CLASSES, response_curve
from vibrissa.neural.coupling.nulls import BinnedRecord, Circular, circular_correlogram
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.coupling.response import UnitCounts
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge
from vibrissa.neural.coupling.tuning import predicted
from vibrissa.neural.io.tables.stimuli import in_unit_of
from vibrissa.quantities import dataset

REACH = 0.2  # [s] lags of the correlogram, at most
OWN_REACH, OWN_BIN = 0.05, 1e-3  # [s] lags after a spike of the unit, and their bins
CURVE = ("response_envelope", "response_rate", "response_rate_se", "response_rate_fitted")


@dataclass(frozen=True, kw_only=True)
class UnitViews:
    """Units that were analysed, and what they were analysed of.

    Attributes
    ----------
    units : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    spikes, stimulus : Dataset
        It was made of.
    how : EnvelopeAnalysis
        As the units were analysed.
    counts : UnitCounts
        Spikes in the bins.
    shown : Presentation
        The envelope and its bins.
    drive : BinnedDrive
        The envelope at any latency.
    record : BinnedRecord
        Rates and envelope.
    """

    units: xr.Dataset
    spikes: xr.Dataset
    stimulus: xr.Dataset
    how: EnvelopeAnalysis
    counts: UnitCounts
    shown: Presentation
    drive: BinnedDrive
    record: BinnedRecord

    @classmethod
    def of(cls, units: xr.Dataset, spikes: xr.Dataset, stimulus: xr.Dataset, how: EnvelopeAnalysis) -> UnitViews:
        """Count the spikes of all units once.

        Parameters
        ----------
        units, spikes, stimulus, how
            See the attributes.

        Returns
        -------
        UnitViews
            For :meth:`of_unit`.
        """
        shown = how.presentation(stimulus)
        counts = UnitCounts.of(spikes, int(units.attrs["n_trials"]), shown.edges, how.bin_width, partial=True)
        made: dict[str, Any] = {"counts": counts, "shown": shown, "record": binned_record(counts, shown)}
        return cls(units=units, spikes=spikes, stimulus=stimulus, how=how, drive=shown.drive(), **made)

    def of_unit(self, place: int) -> xr.Dataset:
        """What one unit did.

        Parameters
        ----------
        place : int
            Place of the unit in the table.

        Returns
        -------
        Dataset
            Its row of the table. With ``spike_time`` and ``spike_trial`` of the trials in which it was observed;
            ``firing_rate``, ``bin_envelope`` and ``predicted_rate`` (bin); the classes of the envelope, of units that
            are not fitted at the lag of the largest correlation; ``correlogram`` and, as attributes, ``chance_low``
            and ``chance_high`` (95 % of what a single shift or shuffle gives) and ``chance_level`` (exceeded by the
            largest over the lags tested in a share ``level``); ``autocorrelogram``, NaN where times are known to bins
            alone; ``unit_waveform`` where the spikes have it.
        """
        row, spikes = self.units.isel(unit=place), self._spikes(place)
        fitted = self._fitted(row)
        lags, correlogram, chance = self._correlogram(place)
        after, own = autocorrelogram(spikes.spike_time.values, spikes.spike_trial.values, float(self.shown.edges[-1]))
        binned = "counted_bin" in self.spikes.attrs
        about = {
            name: self.spikes.attrs[name] for name in ("counted_bin", "sampling_rate") if name in self.spikes.attrs
        }
        curve: dict[str, Any] = {name: one[None] for name, one in self._curve(row, place, fitted).items()}
        found = dataset(
            {**self.units.attrs, **about, **chance, "trials_observed": int(self.counts.observed[place].sum())},
            spike_time=spikes.spike_time.values,
            spike_trial=spikes.spike_trial.values,
            bin=self.shown.edges[:-1],
            firing_rate=self.record.rates[place],
            bin_envelope=self.record.envelope,
            predicted_rate=np.where(self.drive.valid, fitted, np.nan),
            correlogram_lag=lags,
            correlogram=correlogram,
            after_spike=after,
            autocorrelogram=np.full(after.size, np.nan) if binned else own,
            **curve,
        ).isel(unit=0)
        seen = self.spikes[["unit_waveform"]].isel(unit=place) if "unit_waveform" in self.spikes else xr.Dataset()
        row = row.drop_vars(CURVE, errors="ignore")
        return xr.merge([in_unit_of(found, self.stimulus), row, seen], combine_attrs="override")

    def _spikes(self, place: int) -> xr.Dataset:
        """Spikes of a unit within the bins, of the trials in which it was observed."""
        own = self.spikes[["spike_time", "spike_trial"]].isel(spike=self.counts.places[place])
        time, first, last = own.spike_time.values, self.shown.edges[0], self.shown.edges[-1]
        inside = (time >= first) & (time < last) & self.counts.observed[place][own.spike_trial.values]
        return own.isel(spike=np.flatnonzero(inside))

    def _fitted(self, row: xr.Dataset) -> Array:
        """Rate of the unit's fit in every bin [Hz]; NaN where there is none."""
        rate = np.full(len(self.shown.edges) - 1, np.nan)
        hinge = Hinge(*(float(row[name]) for name in Hinge._fields))
        if not np.isfinite(hinge.threshold):
            return rate
        if self.how.fit == "forward":
            rate[self.drive.valid] = predicted(self.drive, hinge)
            return rate
        before = np.roll(self.record.envelope, round(hinge.latency / self.how.bin_width))
        rate = hinge.baseline + hinge.slope * np.maximum(before - hinge.threshold, 0)
        # the table has the slope of the second segment alone
        return np.where(before < hinge.threshold, np.nan, rate) if self.how.first_segment == "free-first" else rate

    def _curve(self, row: xr.Dataset, place: int, fitted: Array) -> dict[str, Array]:
        """Classes of the envelope: those of the fit, else at the lag of the largest correlation."""
        if np.isfinite(row.response_envelope.values).all():
            return {name: row[name].values for name in CURVE}
        counts = self.counts.of_unit(place)
        if not len(counts):
            return {name: np.full(CLASSES, np.nan) for name in CURVE}
        known = [float(row[name]) for name in ("latency", "envelope_lag") if np.isfinite(row[name])]
        valid = self.drive.valid
        return response_curve(self.drive, counts[:, valid] / self.how.bin_width, [*known, 0.0][0], fitted[valid])

    def _correlogram(self, place: int) -> tuple[Array, Array, dict[str, float]]:
        """Lags [s], correlation at each, and what chance gives."""
        record, width = self.record, self.how.bin_width
        valid = record.rate_valid, record.envelope_valid
        every = circular_correlogram(record.rates[[place]], valid[0], record.envelope, valid[1])[0]
        reach = min(round(REACH / width), every.size // 4)
        lags: Array = np.arange(-reach, reach + 1)
        levels = dict.fromkeys(("chance_low", "chance_high", "chance_level"), np.nan)
        if np.isfinite(every[lags]).all():
            null = self.how.chance()
            largest = null.values(record, place, every, self.how.lags)
            single = every[null.shifts(every.size, self.how.lags)] if isinstance(null, Circular) else largest
            ends = (*np.nanquantile(single, [0.025, 0.975]), np.quantile(largest, 1 - self.how.level))
            levels = dict(zip(levels, map(float, ends), strict=True))
        return lags * width, every[lags], levels


def autocorrelogram(
    time: Array, trial: Integers, stop: float, *, reach: float = OWN_REACH, width: float = OWN_BIN
) -> tuple[Array, Array]:
    """Rate of a unit at each lag after its own spikes, over the spikes whose reach ends within the trial.

    Parameters
    ----------
    time, trial : (S,) arrays
        Times in the trial [s] and trials.
    stop : float
        End of the trials [s].
    reach, width : float
        Largest lag, and width of the bins [s].

    Returns
    -------
    lags : (L,) array
        Starts of the bins [s].
    rate : (L,) array
        [Hz]; far from 0 it is the unit's mean rate. NaN without such a spike.
    """
    order = np.lexsort((time, trial))
    time, trial = time[order], trial[order]
    edges: Array = width * np.arange(round(reach / width) + 1, dtype=float)
    counts, first = np.zeros(edges.size - 1), time <= stop - reach
    for step in range(1, time.size):
        gap = time[step:] - time[:-step]
        near = (trial[step:] == trial[:-step]) & (gap < reach)
        if not near.any():
            break
        counts += np.histogram(gap[near & first[:-step]] + 1e-9, edges)[0]
    return edges[:-1], counts / (first.sum() * width) if first.any() else np.full(counts.size, np.nan)
