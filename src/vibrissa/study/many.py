"""A study of many sweeps: the table, prediction against measurement, the gain, and one sweep to be shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.gain import gain_table
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.stationary import fit_profile
from vibrissa.mechanics.superposition import Scan
from vibrissa.quantities import dataset
from vibrissa.study.apparatus import apparatus
from vibrissa.study.backward import analyse, still_of
from vibrissa.study.compared import compare_all, jitter_of, textures_of
from vibrissa.study.gratings import Textures, new_gratings
from vibrissa.study.laboratory import Laboratory, plan
from vibrissa.study.model_figures import model_results
from vibrissa.study.outcome import Attempt, plainly
from vibrissa.study.recorded_sweeps import profile_of, read_sweeps
from vibrissa.study.repeated import repeats_of
from vibrissa.study.store import Progress
from vibrissa.study.sweep_analysis import DAMPING, Line
from vibrissa.study.sweep_verdict import mode_shares, sweep_verdict
from vibrissa.study.sweeps import run_laboratory, run_recorded
from vibrissa.study.virtual_sweep import filmed_sweep
from vibrissa.sweep.engine import Engine

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.settings import Study
    from vibrissa.whisker import Whisker

Datasets = dict[str, "xr.Dataset"]


def many_sweeps(
    study: Study, out: Path, engine: Engine | None, progress: Progress, attempt: Attempt = plainly
) -> Datasets:
    """Run the laboratory or the table of a study; what was done before in ``out`` is kept.

    Parameters
    ----------
    study : Study
        With ``laboratory`` or ``sweeps``.
    out : Path
        Folder of the results; made if absent.
    engine, progress
        Who does the work; called with (stage, done, total).
    attempt : callable, optional
        How what follows from the sweeps is done; see :func:`vibrissa.study.outcome.noting`.

    Returns
    -------
    dict of Datasets
        ``sweeps``; ``comparison`` where a texture is known, ``gain``, ``jitter`` and ``repeats`` if asked for; of one
        sweep, for the figures, ``profile``, ``posture``, ``modal``, ``resonance_white``, ``spectra_white``, ``still``
        where there is a movie, and what the model says: ``gap``, ``gaps``, ``gain_map``.
    """
    source = study.laboratory
    if source is not None:
        sweeps = run_laboratory(source, out, engine=engine, progress=progress)
        textures: Textures = source.grating
    else:
        table = study.folder / str(study.sweeps)
        sweeps = run_recorded(table, out, engine=engine, progress=progress)
        textures = textures_of(table, sweeps)
    results = {"sweeps": sweeps}
    if not sweeps.accepted.values.any():
        return results
    results["mode_shares"] = mode_shares(sweeps)
    if source is not None:
        results["sweep_verdict"] = sweep_verdict(sweeps)
    for name, part in _parts(study, sweeps, textures, out, engine, progress):
        results |= attempt(name, part)
    progress("one sweep shown", 0, 0)
    return results | attempt("one sweep shown", partial(shown, study, sweeps))


def _parts(
    study: Study, sweeps: xr.Dataset, textures: Textures, out: Path, engine: Engine | None, progress: Progress
) -> Iterator[tuple[str, Callable[[], Datasets]]]:
    """What follows from the sweeps, by name."""
    how, source = study.comparison, study.laboratory

    def compared() -> Datasets:
        known = sorted({int(number) for number in sweeps.texture.values[sweeps.accepted.values] if number >= 0})
        gratings = new_gratings(source or textures, known, how.gratings)
        return _if_made("comparison", compare_all(sweeps, out, gratings, engine=engine, progress=progress))

    yield "comparison", compared
    yield "gain", lambda: {"gain": gain_table(sweeps)}
    if how.jitter:
        progress("jitter", 0, 0)
        yield "jitter", lambda: _if_made("jitter", jitter_of(sweeps, out, textures, how.jitter))
    if how.repeats and source is not None:
        yield "repeats", lambda: _if_made("repeats", repeats_of(source, sweeps, how.repeats, out, engine, progress))


def _if_made(name: str, data: xr.Dataset | None) -> Datasets:
    return {} if data is None else {name: data}


def shown(study: Study, sweeps: xr.Dataset) -> Datasets:
    """One sweep, the accepted one whose contact is nearest to the median: tracked again and laid open."""
    usable = np.flatnonzero(sweeps.accepted.values)
    contact = sweeps.contact.values[usable]
    row = sweeps.isel(sweep=usable[np.abs(contact - np.median(contact)).argmin()])
    number = int(row.sweep)
    if study.laboratory is not None:
        results, whisker, line = _virtual(study.laboratory, number)
    else:
        results, whisker, line = _recorded(study.folder / str(study.sweeps), number)
    one = results["profile"].isel(whisker=0)
    results |= analyse(one, whisker, float(row.contact))
    posture = Posture(contact=float(row.contact), base_angle=float(row.base_angle))
    results |= model_results(whisker, posture, Scan(speed=float(row.scan_speed), damping=DAMPING))
    true = float(row.contact_true) if "contact_true" in row else np.nan
    return results | posture_of(one, whisker, true, line, {"sweep": number})


def posture_of(
    profile: xr.Dataset,
    whisker: Whisker,
    true: float = np.nan,
    line: Line | None = None,
    about: dict[str, int] | None = None,
) -> Datasets:
    """``posture``, what the mean profile tells, with what Figure 1 needs beside it; nothing if no curve fits."""
    try:
        found = fit_profile(profile, whisker, substrate=line)
    except (InputError, ConvergenceError):  # too few nodes, or a curve that is none of Eq. 1
        return {}
    told = {"tip": whisker.tip, "cone_angle": whisker.cone_angle, "contact_true": true, **(about or {})}
    return {"posture": found.assign_attrs(told)}


def _virtual(laboratory: Laboratory, number: int) -> tuple[Datasets, Whisker, Line | None]:
    filmed = filmed_sweep(laboratory, plan(laboratory)[0][number])
    rows, columns = filmed.image.shape
    still = dataset(row=np.arange(rows), column=np.arange(columns), image=filmed.image)
    results = {"profile": filmed.profile.expand_dims("whisker"), "still": still}
    results["apparatus"] = apparatus(filmed.motion, filmed.film, filmed.scene)
    return results, filmed.known.whisker, filmed.known.substrate


def _recorded(table: Path, number: int) -> tuple[Datasets, Whisker, Line | None]:
    entry = read_sweeps(table)[number]
    profile, line = profile_of(entry)
    results = {"profile": profile.expand_dims("whisker")}
    if entry.movie is not None:
        results["still"] = still_of(entry.folder / entry.movie)
    return results, entry.whisker, line
