"""The stages of many sweeps: the table, prediction against measurement, the gain, and one sweep to be shown."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.mechanics.across.gain import gain_table
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Datasets
from vibrissa.study.movie.apparatus import apparatus
from vibrissa.study.movie.backward import analyse, still_of
from vibrissa.study.movie.resting import shown_posture
from vibrissa.study.paper.mode_shares import mode_shares
from vibrissa.study.paper.paper_columns import MODELLED, OWNED, own_sweeps, truth_of
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.spec.parts import every_by_modes
from vibrissa.study.spec.recorded_sweeps import read_sweeps
from vibrissa.study.sweeps.compared import Textures, compare_all, jitter_of, new_gratings, textures_of
from vibrissa.study.sweeps.laboratory import plan
from vibrissa.study.sweeps.recorded_sweeps import known_sweep, since_start
from vibrissa.study.sweeps.repeats import repeats_of, true_repeats
from vibrissa.study.sweeps.sweep_analysis import SweepFacts
from vibrissa.study.sweeps.sweep_verdict import sweep_verdict
from vibrissa.study.sweeps.sweeps import run_laboratory, run_recorded
from vibrissa.study.sweeps.virtual_sweep import filmed_sweep, known_whisker
from vibrissa.whisker import DAMPING

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.spec.settings import Study
    from vibrissa.study.store.run_state import Run
    from vibrissa.whisker import Whisker


def run_sweeps(run: Run) -> Datasets:
    """Run the laboratory, or the table of recorded sweeps, of a study; stored sweeps are reused.

    Parameters
    ----------
    run : Run
        Its study has ``laboratory`` or ``sweeps``; ``modelled`` is set if any was accepted.

    Returns
    -------
    dict of Datasets
        ``sweeps``; if any was accepted ``mode_shares`` and, of a laboratory, ``sweep_verdict``.

    Raises
    ------
    InputError
        If the table is bad, or the laboratory finds no posture.
    """
    source = run.study.laboratory
    if source is not None:
        sweeps = run_laboratory(source, run.out, engine=run.engine, progress=run.progress)
    else:
        sweeps = run_recorded(_table(run.study), run.out, engine=run.engine, progress=run.progress)
    if not sweeps.accepted.values.any():
        return {"sweeps": sweeps}
    run.modelled = _modelled(run.study, _shown(sweeps))
    verdict = {} if source is None else {"sweep_verdict": sweep_verdict(sweeps)}
    return {"sweeps": sweeps, "mode_shares": mode_shares(sweeps), **verdict, **_sweeps_of_model(run)}


def _sweeps_of_model(run: Run) -> Datasets:
    """The table of the same sweeps, or of every n-th, with the paper's model as the truth."""
    if not every_by_modes(run.study):
        return {}
    name, every = f"sweeps{MODELLED}", every_by_modes(run.study)
    how: dict[str, Any] = {"engine": run.engine, "progress": run.progress, "every": every, "name": name}
    return {name: run_laboratory(_by_modes(run.study), run.out, **how)}


def _by_modes(study: Study) -> Laboratory:
    if study.laboratory is None:
        raise ValueError("there is no laboratory")
    return replace(study.laboratory, truth="modes")


def compare_with_prediction(run: Run) -> Datasets:
    """Hold the prediction of every sweep against its measurement: ``comparison``, where a texture is known.

    Parameters
    ----------
    run : Run
        Its sweeps are analysed.

    Returns
    -------
    dict of Datasets
        The results named above.

    Raises
    ------
    InputError
        If a comparison cannot be made.
    """
    sweeps, how = run.results["sweeps"], run.study.comparison
    known = sorted({int(number) for number in sweeps.texture.values[sweeps.accepted.values] if number >= 0})
    gratings = new_gratings(run.study.laboratory or _textures(run), known, how.gratings)
    staff: dict[str, Any] = {"engine": run.engine, "progress": run.progress}
    found = _if_made("comparison", compare_all(sweeps, run.out, gratings, **staff))
    if truth_of(sweeps) != "rod":
        return found
    stage, of_rod = "comparison, the rod itself", own_sweeps(sweeps)
    own = compare_all(of_rod, run.out, gratings, **staff, stage=stage, own=_textures(run))
    found |= _if_made(f"comparison{OWNED}", own)
    if (model := run.results.get(f"sweeps{MODELLED}")) is not None:
        held = compare_all(model, run.out, gratings, **staff, stage="comparison, the paper's model")
        found |= _if_made(f"comparison{MODELLED}", held)
    return found


def find_gain(run: Run) -> Datasets:
    """Tabulate what sets the gain: ``gain``.

    Parameters
    ----------
    run : Run
        Its sweeps are analysed.

    Returns
    -------
    dict of Datasets
        The results named above.
    """
    return {"gain": gain_table(run.results["sweeps"])}


def disturb_tip(run: Run) -> Datasets:
    """Disturb the predictions of some sweeps by jitter of the tip: ``jitter``, where a texture is known.

    Parameters
    ----------
    run : Run
        Its sweeps are analysed.

    Returns
    -------
    dict of Datasets
        The results named above.
    """
    count = run.study.comparison.jitter
    return _if_made("jitter", jitter_of(run.results["sweeps"], run.out, _textures(run), count, run.progress))


def repeat_sweeps(run: Run) -> Datasets:
    """Film some sweeps of a laboratory again and again: ``repeats``.

    Parameters
    ----------
    run : Run
        Its sweeps are analysed.

    Returns
    -------
    dict of Datasets
        The results named above.

    Raises
    ------
    InputError
        If a sweep cannot be run again.
    """
    source, count = run.study.laboratory, run.study.comparison.repeats
    if source is None:
        return {}
    rest: tuple[Any, ...] = (run.results["sweeps"], count, run.out, run.engine, run.progress)
    found = _if_made("repeats", repeats_of(source, *rest))
    if "repeats" in found and source.truth == "rod":
        found[f"repeats{OWNED}"] = true_repeats(found["repeats"])
    if every_by_modes(run.study):
        found |= _if_made(f"repeats{MODELLED}", repeats_of(_by_modes(run.study), *rest))
    return found


def _if_made(name: str, data: xr.Dataset | None) -> Datasets:
    return {} if data is None else {name: data}


def _table(study: Study) -> Path:
    return study.folder / str(study.sweeps)


def _textures(run: Run) -> Textures:
    source = run.study.laboratory
    return source.grating if source is not None else textures_of(_table(run.study), run.results["sweeps"])


def _shown(sweeps: xr.Dataset) -> xr.Dataset:
    """The sweep that the figures show: of the accepted ones that with the (lower) median contact."""
    usable = np.flatnonzero(sweeps.accepted.values)
    contact = sweeps.contact.values[usable]
    return sweeps.isel(sweep=usable[np.argsort(contact, kind="stable")[(contact.size - 1) // 2]])


def _modelled(study: Study, row: xr.Dataset) -> tuple[Whisker, Posture, Scan]:
    """What the figures of the model are made for: whisker, posture and scan of a sweep, as they were found."""
    source, number = study.laboratory, int(row.sweep)
    whisker = read_sweeps(_table(study))[number].whisker if source is None else known_whisker(source, number)
    posture = Posture(contact=float(row.contact), base_angle=float(row.base_angle))
    return whisker, posture, Scan(speed=float(row.scan_speed), damping=DAMPING)


def show_sweep(run: Run) -> Datasets:
    """Track and analyse one sweep again, for the figures: of the accepted ones that with the (lower) median contact.

    Parameters
    ----------
    run : Run
        Its sweeps are analysed.

    Returns
    -------
    dict of Datasets
        ``profile``, ``posture``, ``modal``, ``resonance_white``, ``spectra_white``; ``still`` where there is a movie;
        ``apparatus`` of a laboratory.
    """
    run.progress("one sweep shown", 0, 0)
    row = _shown(run.results["sweeps"])
    number, source = int(row.sweep), run.study.laboratory
    results, known, met = _virtual(source, number) if source is not None else _recorded(_table(run.study), number)
    whisker, one = known.whisker, results["profile"].isel(whisker=0)
    results |= analyse(one, whisker, float(row.contact))
    true = float(row.contact_true) if "contact_true" in row else np.nan
    scan = Scan(speed=known.scan_speed, damping=DAMPING)
    how: dict[str, Any] = {"substrate": known.substrate, "friction": known.friction, "texture": known.texture}
    return results | shown_posture(met, whisker, **how, scan=scan, true=true, about={"sweep": number})


def _virtual(laboratory: Laboratory, number: int) -> tuple[Datasets, SweepFacts, xr.Dataset]:
    """Results of one sweep, what is known of it, and its profile in the time of the texture."""
    filmed = filmed_sweep(laboratory, plan(laboratory)[0][number])
    rows, columns = filmed.image.shape
    still = dataset(image_row=np.arange(rows), image_column=np.arange(columns), image=filmed.image)
    results = {"profile": filmed.profile.expand_dims("whisker"), "still": still}
    results["apparatus"] = apparatus(filmed.motion.prediction, filmed.film, filmed.scene)
    return results, filmed.known, filmed.profile


def _recorded(table: Path, number: int) -> tuple[Datasets, SweepFacts, xr.Dataset]:
    entry = read_sweeps(table)[number]
    profile, known = known_sweep(entry)
    results = {"profile": profile.expand_dims("whisker")}
    if entry.movie is not None:
        results["still"] = still_of(entry.folder / entry.movie)
    return results, known, since_start(profile, entry)
