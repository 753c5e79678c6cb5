"""Run a study: its stages, then its report and provenance."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.files import held
from vibrissa.netcdf import save
from vibrissa.quantities.kinds import Datasets, Progress
from vibrissa.study.forward.surface import surface_lines
from vibrissa.study.movie.backward import followed
from vibrissa.study.report.headlines import headlines
from vibrissa.study.report.report import write_report
from vibrissa.study.report.report_neurons import tables_of, unit_lines
from vibrissa.study.report.summary import base_lines, sweep_lines
from vibrissa.study.run.parts import do_parts
from vibrissa.study.run.provenance import earlier_results, write_provenance
from vibrissa.study.spec.settings import Study
from vibrissa.study.store.outcome import not_analysed, not_fitted
from vibrissa.study.store.run_state import Run
from vibrissa.sweep.engine import Engine, staffed
from vibrissa.sweep.stops import without_stops
from vibrissa.sweep.threads import single_threaded

if TYPE_CHECKING:
    import xarray as xr


def run_study(
    study: Study, out: str | Path, *, engine: Engine | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Run a study and write its datasets (NetCDF), its movie if virtual, its verdict, its report and its provenance.

    Parameters
    ----------
    study : Study
        From :func:`vibrissa.study.spec.settings.read_study`.
    out : path
        Folder of the results; made if absent. What an earlier run made there is replaced, only once all went well. Many
        sweeps are kept one by one, in ``sweeps`` and ``comparison``: a run that was stopped goes on where it was.
    engine : Engine, optional
        Who does the work that comes by the many; a process per core by default.
    progress : callable, optional
        Called with (stage, done, total); total 0 where it is not known.

    Returns
    -------
    Dataset
        The verdict, truth against found; of many sweeps, a line for each; for a recorded movie, how far each whisker
        was followed; of units, how many are driven; of a surface alone, its modes and how far the model's assumptions
        hold; of base signals alone, their resonances. The attribute ``not_analysed`` (JSON) holds a line for each part,
        and each reason for which sweeps, could not be analysed, while the rest went on; ``headlines`` (JSON) the lines
        of :func:`vibrissa.study.report.headlines.headlines`.

    Raises
    ------
    InputError
        If an input is bad, the folder cannot be written, another run is at work in it, or it holds another study's
        results.
    """
    out = Path(out).absolute()
    with held(out) as work, single_threaded(), staffed(engine or Engine()) as engine:
        earlier = earlier_results(study, out)
        run = Run(study, work, out, engine, progress or (lambda *_: None))
        do_parts(run)
        results, lines = run.results, not_analysed(run.results, run.failed)
        for name, data in results.items():
            save(data, work / f"{name}.nc")
        write_report(study, results, work, out, lines, engine=engine, progress=run.progress)
        write_provenance(study, results, work, out)
        with without_stops():
            _put_in_place(work, out, earlier)
    words = {"not_analysed": lines, "not_fitted": not_fitted(results), "headlines": headlines(results)}
    return _summary(results).assign_attrs({name: json.dumps(one, ensure_ascii=False) for name, one in words.items()})


def _put_in_place(work: Path, out: Path, earlier: set[str]) -> None:
    """Move the results of this run where they belong, in place of those that an earlier one left."""
    out.mkdir(exist_ok=True)
    for name in earlier - {made.name for made in work.iterdir()}:
        (out / name).unlink(missing_ok=True)  # before the study was changed: figures must not mix the two
    for made in sorted(work.iterdir()):
        os.replace(made, out / made.name)


def _summary(results: Datasets) -> xr.Dataset:
    """Table that a run prints at its end: the first of these that exists."""
    if "verdict" in results:
        return results["verdict"]
    if "sweeps" in results:
        return sweep_lines(results["sweeps"], results.get("comparison"))
    if "profile" in results:
        return followed(results["profile"])
    if tables_of(results):
        return unit_lines(results)
    if "scan" in results:
        return surface_lines(results["scan"])
    return base_lines(results)
