"""Prediction against measurement over all sweeps of a study: on all cores, resumed where it stopped."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.figures.canvas import spread
from vibrissa.mechanics.across.comparison import MODES, compare_sweeps, found_scan, predicted_envelopes
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.netcdf import load
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Progress
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.store.result_store import StoredWork, SweepRow, finished, made_of, path_of
from vibrissa.study.sweeps.phase_jitter import jittered
from vibrissa.study.sweeps.sweeps import FOLDER, read_series
from vibrissa.sweep.engine import Engine
from vibrissa.texture.io import read_gaps
from vibrissa.texture.shuffled import shuffled
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    import xarray as xr

Textures = Callable[[int], Gaps]

_FIRST_NEW = 1_000_000  # number of a laboratory's first grating that no sweep has scanned
_SHARED = ("largest_lag", "pseudo_textures", "vibrissa_version")


def new_gratings(source: Laboratory | Textures, numbers: Sequence[int], count: int) -> list[Gaps]:
    """Gratings that were not scanned, of the statistics of those that were.

    Parameters
    ----------
    source : Laboratory or callable
        A laboratory draws new ones; of a user's textures, number → Gaps, each in turn is shuffled.
    numbers : sequence of int
        The textures that were scanned; only of a user's.
    count : int
        How many are wanted.

    Returns
    -------
    list of Gaps
        None where no texture is known.
    """
    if isinstance(source, Laboratory):
        return [source.grating(_FIRST_NEW + number) for number in range(count)]
    if not numbers:
        return []
    known, rng = [source(number) for number in numbers], np.random.default_rng(0)
    return [shuffled(known[k % len(known)], rng) for k in range(count)]


def textures_of(table: str | Path, sweeps: xr.Dataset) -> Textures:
    """Give the textures that a user's table names, by their numbers in the table of sweeps.

    Parameters
    ----------
    table : path
        The user's table.
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    callable
        Number → Gaps.
    """
    folder, names = Path(table).parent, json.loads(sweeps.attrs["textures"])
    return lambda number: read_gaps(folder / names[number])


def compare_all(
    sweeps: xr.Dataset,
    out: Path,
    gratings: Sequence[Gaps],
    *,
    engine: Engine | None,
    progress: Progress,
    stage: str = "comparison",
    own: Textures | None = None,
) -> xr.Dataset | None:
    """Hold the prediction of every accepted sweep against its measurement.

    Parameters
    ----------
    sweeps : Dataset
        The table of sweeps.
    out : Path
        Its folder; each sweep's result is kept in a file of ``comparison``.
    gratings : sequence of Gaps
        From :func:`new_gratings`.
    engine, progress, stage
        Who does the work; called with (stage, done, total).
    own : callable, optional
        Number → Gaps. The true motion is taken instead of the measured one, and the prediction is made anew from the
        posture and resonance of the table.

    Returns
    -------
    Dataset or None
        See :func:`vibrissa.mechanics.across.comparison.compare_sweeps`; None if no sweep has a prediction.
    """
    import xarray as xr

    if not np.isfinite(sweeps.mode_rms_model.values).any():
        return None
    numbers = sweeps.sweep.values.tolist()
    jobs = [_job(sweeps.isel(sweep=[i]), out, list(gratings), own) for i in range(len(numbers))]
    rows = finished(jobs, out / "comparison", stage, engine, progress)
    rows = [row.assign_coords(sweep=[number]) for row, number in zip(rows, numbers, strict=True)]
    whole = xr.concat(rows, "sweep", combine_attrs="drop")
    addresses = xr.Variable("sweep", [job.address for job in jobs], dict(sweeps.address.attrs))
    return whole.assign(address=addresses).assign_attrs({name: rows[0].attrs[name] for name in _SHARED})


def _job(row: xr.Dataset, out: Path, gratings: list[Gaps], own: Textures | None) -> StoredWork:
    series = path_of(out.absolute() / FOLDER, str(row.address.values[0]))
    drawn = [hashlib.sha256(np.concatenate([one.position, one.width]).tobytes()).hexdigest() for one in gratings]
    kind = {} if own is None else {"own": True}
    of = made_of(comparison_of=str(row.address.values[0]), gratings=drawn, **kind)
    texture = None if own is None else own(int(row.texture.values[0]))
    return StoredWork({}, partial(_compared, row.assign_coords(sweep=[0]), series, gratings, texture), of)


def _compared(row: xr.Dataset, series: Path, gratings: list[Gaps], texture: Gaps | None) -> tuple[SweepRow, xr.Dataset]:
    def measured(_: int) -> xr.Dataset:
        found = load(series)
        return found if texture is None else _own_series(row.isel(sweep=0), found, texture)

    return {}, compare_sweeps(row, measured, gratings)


def _own_series(row: xr.Dataset, series: xr.Dataset, texture: Gaps) -> xr.Dataset:
    """Envelopes of the true motion, and of the prediction for the true posture and resonance."""
    if "mode_displacement_true" not in series:
        return series
    whisker, posture, scan = found_scan(row)
    true = series.mode_displacement_true.values[:MODES]
    predicted = predicted_envelopes(whisker, posture, scan, [texture], series.time.values)[0]
    return dataset(
        mode=np.arange(1, MODES + 1),
        time=series.time.values,
        envelope=whisker.length * analytic_envelope(true)[0],
        envelope_model=whisker.length * predicted,
    )


def jitter_of(sweeps: xr.Dataset, out: Path, textures: Textures, count: int, progress: Progress) -> xr.Dataset | None:
    """What jitter of the tip does to the correlation, in some sweeps spread over the table.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.
    out : Path
        Folder of the results.
    textures : callable
        Number → Gaps.
    count : int
        How many sweeps are disturbed.
    progress : callable
        Called with (stage, done, total).

    Returns
    -------
    Dataset or None
        See :func:`vibrissa.study.sweeps.phase_jitter.jittered`; None if no sweep has a texture that its posture can
        cross.
    """
    able = np.flatnonzero(sweeps.accepted.values.astype(bool) & (sweeps.texture.values >= 0))
    chosen = spread(able, count) if len(able) else able
    predictions: list[Prediction] = []
    for i in chosen.tolist():
        one = sweeps.isel(sweep=i)
        whisker, posture, scan = found_scan(one)
        try:
            predictions.append(predict(whisker, posture, textures(int(one.texture)), scan, n_modes=1))
        except (InputError, ConvergenceError):
            continue
    if not predictions:
        return None
    time = read_series(out, int(sweeps.sweep[chosen[0]])).time.values
    return jittered(predictions, time, rng=np.random.default_rng(0), progress=progress)
