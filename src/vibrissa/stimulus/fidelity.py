"""Commanded against measured motion of the stimulator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.signal import coherence, correlate, correlation_lags, welch

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, ShapeError, TooFewError, UnknownError, require_positive
from vibrissa.quantities import dataset
from vibrissa.signals.correlation import lagged_correlation
from vibrissa.signals.even_times import even_rate
from vibrissa.stimulus.band import Band
from vibrissa.stimulus.export import read_command
from vibrissa.stimulus.waveform import PointMotion, read_motion

_AS_GOOD = 0.1  # of what the largest correlation leaves unexplained: peaks so little lower are as large
_LEAST_POWER = 1e-6  # of all, in the samples that overlap at a lag: below it r is that of rounding
PRINTED = 0.991  # r between command and motion, in the Methods of the paper


def compare(
    commanded: Array,
    measured: Array,
    sampling_rate: float,
    *,
    band: Band | None = None,
    longest_lag: float = 0.05,
    resolution: float = 2.0,
) -> xr.Dataset:
    """Fidelity of the stimulator: its motion against its command.

    Parameters
    ----------
    commanded, measured : (T,) arrays
        On one grid [m]; any zero, which is taken away.
    sampling_rate : float
        [Hz].
    band : Band, optional
        Frequencies of the coherence.
    longest_lag : float
        Searched to either side [s].
    resolution : float
        Of the coherence [Hz].

    Returns
    -------
    Dataset
        ``replay_correlation``, Pearson's r as recorded, and ``replay_correlation_aligned`` at ``replay_lag`` [s],
        positive where the motion comes after the command; ``replay_gain``, least squares at that lag; ``replay_error``,
        rms of motion − command as recorded [m]; ``replay_residual``, rms after lag and gain [m]; ``replay_coherence``
        (coherence_frequency) and its mean over the band, weighted by the command's power.

    Raises
    ------
    InputError
        If lengths differ, samples are not measured, one does not move, the record is short, or the resolution too
        coarse for the band.
    """
    band = band or Band()
    c, m = _centred(commanded, measured, sampling_rate, longest_lag, resolution)
    lag, fine, best = _lag(c, m, round(longest_lag * sampling_rate))
    reach = len(c) - abs(lag)
    early, late = c[max(-lag, 0) :][:reach], m[max(lag, 0) :][:reach]
    gain = float(early @ late / (early @ early))
    segment = min(round(sampling_rate / resolution), len(c) // 4)
    frequency, shared = coherence(c, m, sampling_rate, nperseg=segment)
    use = (frequency >= max(band.low, frequency[1])) & (frequency <= band.high)
    if not use.any():
        rule = f"must leave a frequency within the band, {band.low:g} to {band.high:g} Hz"
        raise RangeError("resolution", rule, f"{resolution:g} Hz", f"at most {band.high:g} Hz, in a record as long")
    weight = welch(c, sampling_rate, nperseg=segment)[1][use]  # of the same segments: lines between bins count
    return dataset(
        {"printed_correlation": PRINTED, "printed_in": "Boubenec 2014, Methods, command against actual motion"},
        replay_correlation=float(c @ m / np.sqrt((c @ c) * (m @ m))),
        replay_correlation_aligned=best,
        replay_lag=fine / sampling_rate,
        replay_gain=gain,
        replay_error=float(np.sqrt(np.mean((m - c) ** 2))),
        replay_residual=float(np.sqrt(np.mean((late - gain * early) ** 2))),
        coherence_frequency=frequency[use],
        replay_coherence=shared[use],
        replay_coherence_mean=float(np.average(shared[use], weights=weight)),
    )


def _centred(
    commanded: Array, measured: Array, rate: float, longest_lag: float, resolution: float
) -> tuple[Array, Array]:
    for name, value in (("sampling_rate", rate), ("longest_lag", longest_lag), ("resolution", resolution)):
        require_positive(name, value)
    if commanded.shape != measured.shape or commanded.ndim != 1:
        shapes = f"{commanded.shape}, {measured.shape}"
        raise ShapeError("commanded and measured", "must be one record each, of equal length", shapes)
    if len(commanded) < 4 * longest_lag * rate + 16:
        rule = f"must last at least {4 * longest_lag + 16 / rate:g} s"
        raise TooFewError("record", rule, f"{len(commanded) / rate:g} s")
    for name, signal in (("commanded", commanded), ("measured", measured)):
        if not np.all(np.isfinite(signal)):
            raise RangeError(name, "must be finite", f"{np.sum(~np.isfinite(signal))} samples not measured")
        if np.ptp(signal) == 0:
            raise RangeError(name, "must move", "a constant")
    return commanded - commanded.mean(), measured - measured.mean()


def _lag(c: Array, m: Array, longest: int) -> tuple[int, float, float]:
    """Lag of the best correlation: whole samples, refined by a parabola, and r there."""
    lags = correlation_lags(len(m), len(c))
    near = np.abs(lags) <= longest
    whole = _shortest(lags[near], _pearson(correlate(m, c, method="fft")[near], m, c, lags[near]))
    reach = len(c) - abs(whole)
    _, r = lagged_correlation(m[max(whole, 0) :][:reach], c[max(-whole, 0) :][:reach], 1)
    bend = r[0] - 2 * r[1] + r[2]
    shift = 0.5 * (r[0] - r[2]) / bend if bend < 0 else 0.0
    return whole, whole + float(np.clip(shift, -1, 1)), float(r[1])


def _shortest(lags: Integers, r: Array) -> int:
    """The lag of the largest correlation; of a motion that repeats, with peaks that are as large, the shortest."""
    least = r.max() - _AS_GOOD * (1 - r.max() ** 2) - 1e-9
    peaks = np.flatnonzero((r >= least) & (r >= np.append(r[1:], -1)) & (r >= np.append(-1, r[:-1])))
    return int(lags[peaks[np.argmin(np.abs(lags[peaks]))]])


def _pearson(products: Array, m: Array, c: Array, lags: Integers) -> Array:
    """Pearson's r at each lag of m behind c from Σ m c over the samples that overlap; −1 where hardly any power is."""
    reach = len(m) - np.abs(lags)
    sums, powers = [], []
    for one, start in ((m, np.maximum(lags, 0)), (c, np.maximum(-lags, 0))):
        total, power = (np.concatenate([[0.0], np.cumsum(values)]) for values in (one, one**2))
        sums.append(total[start + reach] - total[start])
        powers.append((power[start + reach] - power[start] - sums[-1] ** 2 / reach) / power[-1])
    known = np.minimum(*powers) > _LEAST_POWER
    scale = np.sqrt(np.where(known, powers[0] * powers[1], 1.0) * (m @ m) * (c @ c))
    return np.where(known, (products - sums[0] * sums[1] / reach) / scale, -1.0)


def compare_file(data: xr.Dataset, path: str | Path, whisker: str) -> xr.Dataset:
    """Command of one whisker against its motion in a file, over the time both last; as :func:`compare`.

    Parameters
    ----------
    data : Dataset
        With ``command`` (whisker, time).
    path : path
        Text (``.csv``) with the columns time,displacement, its times from the first sample of the command on (that of
        the ramp, if there is one), at any even rate (brought to the command's by a cubic spline); or a file of all
        whiskers, as a command is written, its times on the command's clock.
    whisker : str
        The whisker that was measured.

    Returns
    -------
    Dataset
        As :func:`compare`.

    Raises
    ------
    InputError
        If the whisker is in neither; as :func:`compare` and the readers.
    """
    names = data["whisker"].values.tolist()
    if whisker not in names:
        raise UnknownError("measured whisker", f"must be one of {', '.join(names)}", whisker)
    rate = even_rate(data["time"].to_numpy(), "command")
    motion, begins = _measured(path, whisker, float(data["time"][0]))
    first = max(0, int(np.ceil(begins * rate - 1e-6)))
    last = min(data.sizes["time"], int((begins + motion.duration) * rate + 1e-6) + 1)
    if last - first < 2:
        command = f"{float(data['time'][0]):g} to {float(data['time'][-1]):g} s"
        rule = f"must have been measured during the command, {command}"
        start = float(data["time"][0]) + begins
        raise RangeError(str(path), rule, f"a record from {start:g} s on", "put both on one clock, from one onset")
    commanded = data["command"].sel(whisker=whisker).to_numpy()[first:last]
    measured = _at(motion, np.arange(first, last) / rate - begins)
    corners = {"low": data.attrs["filter_low"], "high": data.attrs["filter_high"]} if "filter_low" in data.attrs else {}
    return compare(commanded, measured, rate, band=Band(**corners)).assign_attrs(measured_whisker=whisker)


def _at(motion: PointMotion, time: Array) -> Array:
    """Displacement at times since its first sample; its own samples where the times are theirs."""
    places = time * motion.sampling_rate
    samples = np.round(places)
    if np.abs(places - samples).max() < 1e-6:
        return motion.displacement[samples.astype(np.int64)]
    grid = np.arange(len(motion.displacement)) / motion.sampling_rate
    return np.asarray(CubicSpline(grid, motion.displacement)(time))


def _measured(path: str | Path, whisker: str, start: float) -> tuple[PointMotion, float]:
    """Motion in a file, and how long after the command's first sample, at ``start``, its own is [s]."""
    if Path(path).suffix.lower() == ".csv" and not Path(f"{path}.json").is_file():
        motion = read_motion(path)
        return motion, motion.start
    found = read_command(path)
    if whisker not in found["whisker"].values.tolist():
        raise UnknownError(str(path), f"must hold the whisker {whisker}")
    rate = even_rate(found["time"].to_numpy(), str(path))
    moved = found["command"].sel(whisker=whisker).to_numpy()
    return PointMotion(displacement=moved, sampling_rate=rate, source=str(path)), float(found["time"][0]) - start
