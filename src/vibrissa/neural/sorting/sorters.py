"""From raw traces to units, through the sorters of SpikeInterface, and how right they are where the truth is known."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.errors import PackageError, TooFewError, install
from vibrissa.neural.io.formats.foreign import one_line
from vibrissa.neural.io.formats.traces import part
from vibrissa.neural.io.tables.inputs import require_session_clock
from vibrissa.neural.io.tables.spikes import table_of_trains
from vibrissa.neural.sorting.compiled import keep_compiled
from vibrissa.neural.sorting.quality import unit_quality
from vibrissa.neural.sorting.waveform_groups import groups_of_units
from vibrissa.quantities import dataset

DEFAULT = "spykingcircus2"
LEAST_CLUSTER = 20  # spikes of a unit that `simple` finds, as of spykingcircus2; its own 5 splits units
OF_ONE = "simple"  # of one channel, on which the others merge units: docs/howto-sorting.md
COINCIDENT = 0.4e-3  # [s] spikes closer than this are the same spike
SPIKES = (300.0, 6000.0)  # [Hz] band in which waveforms are taken
BEFORE, AFTER = 1e-3, 2e-3  # [s] of a waveform about its trough


def sorters() -> list[str]:
    """Names of the sorters that run here."""
    with one_line("sorters", "could not be listed"):
        return [str(name) for name in part("sorters").installed_sorters()]


def sort(traces: Any, sorter: str | None = None, *, seed: int = 0, workers: int = 1) -> xr.Dataset:
    """Sort the spikes of a recording.

    Parameters
    ----------
    traces : spikeinterface.BaseRecording
        From :func:`vibrissa.neural.io.formats.traces.open_traces`.
    sorter : str, optional
        One of :func:`sorters`; by default spykingcircus2, and simple for one channel.
    seed : int
        Of sorters that draw numbers.
    workers : int
        Processes.

    Returns
    -------
    Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table` on the session's clock; ``unit_electrode`` (from
        0, in the order of the channels), ``snr_mean``, ``unit_waveform`` [V] of that electrode, 300 to 6,000 Hz, where
        the gain is known, ``waveform_groups`` (:mod:`vibrissa.neural.sorting.waveform_groups`), and the variables of
        :func:`vibrissa.neural.sorting.quality.unit_quality`, among them ``merged``.

    Raises
    ------
    InputError
        If the sorter is not installed, fails, or finds no unit.
    """
    here = sorters()
    if sorter is None:
        sorter = OF_ONE if traces.get_num_channels() == 1 else DEFAULT
    if sorter not in here:
        remedy = f"here are {', '.join(here)}" if here else install("sorting")
        raise PackageError(f"sorter {sorter}", "must be installed with what it needs", None, remedy)
    keep_compiled()
    quiet = io.StringIO()
    with (
        TemporaryDirectory() as folder,
        one_line("the recording", f"could not be sorted by {sorter}"),
        redirect_stdout(quiet),
        redirect_stderr(quiet),
    ):
        wishes = _parameters(sorter, seed, workers, Path(folder) / "cache")
        found = part("sorters").run_sorter(sorter, traces, folder=Path(folder) / "sorted", **wishes)
        if not len(found.unit_ids):
            raise TooFewError("the recording", f"must have units that {sorter} finds", "none", "try another sorter")
        return labelled(traces, found, {"sorter": sorter, "sorter_seed": seed})


def _parameters(sorter: str, seed: int, workers: int, cache: Path) -> dict[str, Any]:
    """Parameters that the sorter has, by its own names; it caches on disk, as shared memory would stay behind."""
    known = part("sorters").get_default_sorter_params(sorter)
    wishes = {
        "seed": seed,
        "n_jobs": workers,
        "job_kwargs": {"n_jobs": workers, "progress_bar": False},
        "cache_preprocessing": {"mode": "folder", "folder": cache},
        "cache_preprocessing_mode": "folder",
        **({"clusterer_kwargs": {"min_cluster_size": LEAST_CLUSTER}} if sorter == OF_ONE else {}),
    }
    return {name: value for name, value in wishes.items() if name in known}


def labelled(traces: Any, found: Any, attrs: dict[str, Any]) -> xr.Dataset:
    """Units with their spikes, where they are seen, and how good they are.

    Parameters
    ----------
    traces : spikeinterface.BaseRecording
        The recording.
    found : spikeinterface.BaseSorting
        Its units.
    attrs : dict
        ``sorter`` and ``sorter_seed``.

    Returns
    -------
    Dataset
        As :func:`sort` gives it.
    """
    rate, duration = float(traces.get_sampling_frequency()), float(traces.get_total_duration())
    trains = [found.get_unit_spike_train(unit) / rate for unit in found.unit_ids]
    names = [str(unit) for unit in found.unit_ids]
    about = {"sampling_rate": rate, "duration": duration, "channels": int(traces.get_num_channels()), **attrs}
    table = table_of_trains(trains, names, about)
    table = table.assign(_seen(traces, found, int(attrs["sorter_seed"])).data_vars)
    quality = unit_quality(table, duration).drop_vars("unit_name")
    return table.merge(quality, combine_attrs="override")


def _seen(traces: Any, found: Any, seed: int) -> xr.Dataset:
    """Electrode at which each unit is largest, its mean waveform there, over the noise, and groups of waveforms."""
    core, rate = part("core"), traces.get_sampling_frequency()
    band = part("preprocessing").bandpass_filter(traces, *SPIKES, dtype="float32")
    jobs = {"n_jobs": 1, "progress_bar": False}
    before, after = (int(span * rate) for span in (BEFORE, AFTER))
    spikes, units = found.to_spike_vector(), found.unit_ids
    shapes = core.estimate_templates(band, spikes, units, before, after, return_in_uV=False, **jobs)
    noise = core.get_noise_levels(band, return_in_uV=False, random_slices_kwargs={"seed": seed}, **jobs)
    best, every = np.ptp(shapes, axis=1).argmax(axis=1), np.arange(len(units))
    shape = np.asarray(shapes[every, :, best], float)
    volts = {}
    if traces.has_scaleable_traces():
        volts = {"unit_waveform": 1e-6 * traces.get_channel_gains()[best][:, None] * shape}
    groups = groups_of_units(band, spikes, best, (before, after), seed)
    ratio = np.ptp(shape, axis=1) / noise[best].astype(float)
    return dataset(unit_electrode=best, snr_mean=ratio, waveform_groups=groups, **volts)


def accuracy(found: xr.Dataset, truth: xr.Dataset, *, coincident: float = COINCIDENT) -> xr.Dataset:
    """Sorted units against the truth: which is which, and how many spikes are found, missed and wrongly found.

    Parameters
    ----------
    found, truth : Dataset
        Tables of :func:`vibrissa.neural.io.tables.spikes.spike_table` on one session's clock; the former has its
        ``sampling_rate``.
    coincident : float
        Spikes closer than this are the same [s].

    Returns
    -------
    Dataset
        ``true_spikes``, ``matched_unit``, ``sorting_accuracy``, ``sorting_recall``, ``sorting_precision`` (true_unit)
        and ``units_unmatched``; ``true_snr`` where the truth has ``snr_mean``. A unit
        that is not found has recall and accuracy 0, and NaN as precision.

    Raises
    ------
    InputError
        If a table has no unit, or is in trials.
    """
    rate = float(found.attrs["sampling_rate"])
    sortings = [numbered(table, rate) for table in (found, truth)]
    with one_line("truth", "could not be compared"):
        compared = part("comparison").compare_sorter_to_ground_truth(
            sortings[1], sortings[0], exhaustive_gt=True, delta_time=1e3 * coincident
        )
        score, match = compared.get_performance(), compared.hungarian_match_12
    columns = {name: score[name].to_numpy(float) for name in ("accuracy", "recall", "precision")}
    best = [str(found.unit_name.values[int(one)]) if one != -1 else "" for one in match.to_numpy()]
    missed = np.array([not one for one in best])
    columns["precision"] = np.where(missed, np.nan, columns["precision"])
    snr = {"true_snr": truth.snr_mean.values} if "snr_mean" in truth else {}
    return dataset(
        {"coincident": coincident},
        **snr,
        true_unit=truth.unit_name.values,
        true_spikes=np.bincount(truth.spike_unit.values, minlength=truth.sizes["unit"]),
        matched_unit=np.array(best, str),
        units_unmatched=found.sizes["unit"] - int((~missed).sum()),
        **{f"sorting_{name}": values for name, values in columns.items()},
    )


def numbered(table: xr.Dataset, rate: float) -> Any:
    """SpikeInterface's form of a table of spikes on the session's clock, units numbered from 0.

    Parameters
    ----------
    table : Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`.
    rate : float
        Samples per second [Hz].

    Returns
    -------
    spikeinterface.NumpySorting
        Samples of each unit.

    Raises
    ------
    InputError
        If the spikes are in trials.
    """
    require_session_clock(table)
    samples = np.round(table.spike_time.values * rate).astype(int)
    order = np.argsort(samples, kind="stable")
    return part("core").NumpySorting.from_samples_and_labels(
        [samples[order]], [table.spike_unit.values[order]], rate, unit_ids=np.arange(table.sizes["unit"])
    )
