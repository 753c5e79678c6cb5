"""Signal to noise of the clusters of phy from the raw data that its ``params.py`` names, where they are at hand."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError
from vibrissa.neural.io.formats.phy import stated_rate
from vibrissa.quantities import dataset

BAND = (300.0, 6000.0)  # [Hz] of waveforms, as in sorting
SPAN = (0.4e-3, 0.8e-3)  # [s] of a waveform before and after its spike
MARGIN = 3e-3  # [s] on either side, so that the filter has settled
MOST = 200  # spikes of a unit that are looked at, evenly over the recording
STRETCHES = 20  # of the recording, from which the noise is taken
STRETCH = 0.05  # [s]
MOST_COUNT = 1 << 40  # channels, and bytes of a header
SAMPLES = ("int16", "uint16", "int32", "float32", "float64")


class PhyTraces(NamedTuple):
    """Raw data of a folder of phy.

    Attributes
    ----------
    samples : (T, C) array
        Mapped into memory, in steps of the converter.
    rate : float
        Samples per second [Hz].
    filtered : bool
        Whether they are high-pass filtered.
    """

    samples: NDArray[Any]
    rate: float
    filtered: bool

    def band(self, values: Array) -> Array:
        """Samples (…, T) in the band of waveforms."""
        low, high = BAND[0], min(BAND[1], 0.45 * self.rate)
        kind, edges = ("lowpass", high) if self.filtered else ("bandpass", (low, high))
        return np.asarray(sosfiltfilt(butter(2, edges, kind, fs=self.rate, output="sos"), values))


def phy_traces(folder: str | Path) -> PhyTraces | str:
    """Raw data named in ``params.py``, which is read, not run; or why there are none.

    Parameters
    ----------
    folder : path
        Of phy.

    Returns
    -------
    PhyTraces or str
        The samples, or a phrase.

    Raises
    ------
    InputError
        If the file is there and its size is no whole number of samples; names the line of ``params.py``.
    """
    params = Path(folder) / "params.py"
    given = _assigned(params)
    names = given.get("dat_path", ())
    names = [names] if isinstance(names, str) else list(names) if isinstance(names, list | tuple) else []
    if len(names) != 1:
        return f"params.py names {len(names) or 'no'} files of raw data, not one"
    path = Path(folder) / str(names[0])
    if not path.is_file():
        return f"the raw data that params.py names, {names[0]}, are not at hand"
    channels, offset, kind = _layout(params, given)
    size = path.stat().st_size - offset
    if size <= 0 or size % (channels * kind.itemsize):
        rule = f"must be whole samples of n_channels_dat = {channels} and dtype = {kind}, as params.py says"
        raise RangeError(str(path), rule, f"{size} bytes")
    samples = np.memmap(path, kind, "r", offset, (size // (channels * kind.itemsize), channels))
    return PhyTraces(samples, stated_rate(params), bool(given.get("hp_filtered", False)))


def _layout(path: Path, given: dict[str, Any]) -> tuple[int, int, np.dtype[Any]]:
    """Channels, bytes before the first sample, kind of the samples."""
    counts = {name: given.get(name, 0) for name in ("n_channels_dat", "offset")}
    for (name, value), least in zip(counts.items(), (1, 0), strict=True):
        if not isinstance(value, int) or not least <= value <= MOST_COUNT:
            raise RangeError(f"{path}, {name}", f"must be a whole number from {least}", repr(value)[:40])
    kind = str(given.get("dtype", "int16"))
    if kind not in SAMPLES:
        raise RangeError(f"{path}, dtype", f"must be one of {', '.join(SAMPLES)}", repr(kind)[:40])
    return counts["n_channels_dat"], counts["offset"], np.dtype(kind)


def _assigned(path: Path) -> dict[str, Any]:
    """Literal values that a file of assignments gives to names; it is not run."""
    found: dict[str, Any] = {}
    for line in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name):
            try:
                found[line.targets[0].id] = ast.literal_eval(line.value)
            except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):  # no literal: left to phy
                continue
    return found


def traced_snr(spikes: xr.Dataset, traces: PhyTraces) -> xr.Dataset:
    """Signal to noise of each unit by its smallest and by its mean waveform, on the channel where it is largest.

    Parameters
    ----------
    spikes : Dataset
        From :func:`vibrissa.neural.io.formats.phy.read_phy`.
    traces : PhyTraces
        The raw data.

    Returns
    -------
    Dataset
        ``snr_smallest`` and ``snr_mean`` (unit): peak-to-peak over the rms of the noise, which is that of the median of
        deviations in stretches of the recording; NaN for units without a whole waveform.
    """
    noise = _noise(traces)
    sample = np.round(spikes.spike_time.values * traces.rate).astype(int)
    unit = spikes.spike_unit.values
    each = [_heights(traces, np.sort(sample[unit == k]), noise) for k in range(spikes.sizes["unit"])]
    smallest, mean = np.array(each, float).reshape(-1, 2).T
    return dataset(snr_smallest=smallest, snr_mean=mean)


def _noise(traces: PhyTraces) -> Array:
    """Rms of the noise of each channel, spikes being rare: median of the deviations over 0.6745."""
    long = min(round(STRETCH * traces.rate), len(traces.samples))
    starts = np.unique(np.linspace(0, len(traces.samples) - long, STRETCHES).astype(int))
    seen = np.array([traces.band(np.asarray(traces.samples[at : at + long], float).T) for at in starts])
    centred = np.abs(seen - np.median(seen, axis=(0, 2), keepdims=True))
    return np.asarray(np.median(centred, axis=(0, 2)) / 0.6745)


def _heights(traces: PhyTraces, sample: Integers, noise: Array) -> tuple[float, float]:
    """Smallest and mean waveform of a unit, peak-to-peak over the noise of the channel where the mean is largest."""
    before, after = (round((span + MARGIN) * traces.rate) for span in SPAN)
    whole = sample[(sample >= before) & (sample + after <= len(traces.samples))]
    some = whole[np.unique(np.linspace(0, whole.size - 1, min(MOST, whole.size)).astype(int))]
    if not some.size:
        return np.nan, np.nan
    margin = round(MARGIN * traces.rate)
    pieces = (np.asarray(traces.samples[at - before : at + after], float).T for at in some)
    waves = np.array([traces.band(one)[:, margin:-margin] for one in pieces])
    heights = np.ptp(waves.mean(0), axis=1) / np.where(noise > 0, noise, np.inf)
    best = int(heights.argmax())
    return float(np.ptp(waves[:, best], axis=1).min() / noise[best]), float(heights[best])
