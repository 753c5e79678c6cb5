"""Simulated raw recordings of known truth, through SpikeInterface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.errors import MissingError, RangeError
from vibrissa.files import written_whole
from vibrissa.neural.io.formats.foreign import one_line
from vibrissa.neural.io.formats.traces import RawFormat, part
from vibrissa.neural.io.tables.spike_csv import write_csv
from vibrissa.neural.io.tables.spikes import table_of_trains
from vibrissa.neural.sorting.sorters import numbered

RATE, PITCH, STEP = 30e3, 20e-6, 0.2e-6  # [Hz], [m] between electrodes, [V] of a sample
NOISE = 12.0  # [µV] standard deviation
SOMATA = {"margin_um": 5.0, "minimum_z": 10.0, "maximum_z": 30.0, "minimum_distance": 20}  # [µm]
SHANK = {"num_columns": 1, "xpitch": 20, "ypitch": 1e6 * PITCH, "contact_shapes": "circle"}
FIRING = {"firing_rates": (5.0, 15.0), "refractory_period_ms": 4.0}  # where no spikes are given
AFTER = 0.5  # [s] of noise after the last spike that is given
LONGEST, MOST_UNITS, CHANNELS = 600.0, 60, (1, 64)


def generate(
    folder: str | Path,
    *,
    seed: int = 0,
    duration: float = 20.0,
    channels: int = 8,
    units: int = 6,
    spikes: xr.Dataset | None = None,
) -> tuple[Path, RawFormat, xr.Dataset]:
    """Write a simulated recording of known truth: ``recording.dat``, ``truth.csv``.

    Waveforms of dipoles about one straight shank, 20 µm between electrodes, in noise of 12 µV, as
    ``spikeinterface.core.generate_ground_truth_recording`` makes them; 30 kHz, 5 to 15 spikes/s. The somata lie 10 to
    30 µm before the shank: most units are 5 to 25 times above the noise, as the paper's, and some drown in it.

    Parameters
    ----------
    folder : path
        An existing folder.
    seed, duration, channels, units
        Of the recording; duration in seconds.
    spikes : Dataset, optional
        Spikes to be seen in it instead, on the session's clock (:func:`vibrissa.neural.io.tables.spikes.spike_table`);
        they set duration and units.

    Returns
    -------
    path, format, truth
        The file of samples, how it is written, and its spikes on the session's clock; ``snr_mean`` (unit) is the true
        one, peak-to-peak over the noise's standard deviation.

    Raises
    ------
    InputError
        If a number is out of reach, SpikeInterface is not installed, or the folder is not there.
    """
    firing: dict[str, Any] = {"num_units": units, "generate_sorting_kwargs": FIRING}
    names = [f"true {k + 1}" for k in range(units)]
    if spikes is not None:
        firing = {"sorting": numbered(spikes, RATE)}
        names, duration = spikes.unit_name.values.tolist(), float(spikes.spike_time.max()) + AFTER
    _refuse(duration, channels, len(names))
    folder = Path(folder)
    if not folder.is_dir():
        raise MissingError(str(folder), "must be an existing folder", remedy="make it, or choose another")
    with one_line("recording", "could not be generated"):
        traces, sorting = _traces(duration, channels, seed, firing)
        ratio = np.ptp(traces.templates, axis=1).max(axis=1).astype(float) / NOISE
        samples = np.round(traces.get_traces() / (1e6 * STEP)).clip(-32768, 32767).astype("<i2")
    trains = [sorting.get_unit_spike_train(unit) / RATE for unit in sorting.unit_ids]
    truth = table_of_trains(trains, names, {}, snr_mean=ratio)
    with written_whole(folder / "recording.dat") as temporary:
        samples.tofile(temporary)
    write_csv(truth, folder / "truth.csv")
    return folder / "recording.dat", RawFormat(sampling_rate=RATE, channels=channels, gain=STEP, pitch=PITCH), truth


def _refuse(duration: float, channels: int, units: int) -> None:
    """Refuse what would not be a recording, or not end."""
    for name, value, low, high in (
        ("duration", duration, 5, LONGEST),
        ("channels", channels, *CHANNELS),
        ("units", units, 1, MOST_UNITS),
    ):
        if not low <= value <= high:
            raise RangeError(name, f"must be from {low} to {high:g}", value)


def _traces(duration: float, channels: int, seed: int, firing: dict[str, Any]) -> Any:
    """Recording and its spikes."""
    return part("core").generate_ground_truth_recording(
        durations=[duration],
        sampling_frequency=RATE,
        num_channels=channels,
        generate_probe_kwargs={**SHANK, "contact_shape_params": {"radius": 6}},
        noise_kwargs={"noise_levels": NOISE, "strategy": "on_the_fly"},
        generate_unit_locations_kwargs=SOMATA,
        seed=seed,
        **firing,
    )
