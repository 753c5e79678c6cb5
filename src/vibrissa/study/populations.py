"""The neural half of a study: a simulated population, recorded neurons, and what their results are called."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.errors import InputError
from vibrissa.files import load
from vibrissa.study.cortex import Cortex, analyse_block, command_of, gathered, stimulated
from vibrissa.study.neurons import neuron_results
from vibrissa.study.outcome import Attempt, plainly
from vibrissa.study.store import Job, Progress, finish, made_of, path_of

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.settings import Study
    from vibrissa.sweep.engine import Engine

FOLDER = "cortex"  # of the results of each whisker
_KEEPING = ("row", "made_of", "address")  # attributes of a kept file, not of what it holds


def populations_of(
    study: Study,
    out: Path,
    engine: Engine | None = None,
    progress: Progress | None = None,
    attempt: Attempt = plainly,
) -> dict[str, xr.Dataset]:
    """Units of a study and, where the names are free, those that Figure 8 shows.

    Parameters
    ----------
    study : Study
        With a ``cortex``, with ``neural``, or with neither.
    out : Path
        Folder of the results: the units of each whisker of a simulated population are kept in its ``cortex``.
    engine, progress
        As in :func:`vibrissa.study.study.run_study`.
    attempt : callable, optional
        How each part is done; see :func:`vibrissa.study.outcome.attempting`.

    Returns
    -------
    dict of Datasets
        ``units`` of the cortex, with ``spikes``, ``response``, ``motion`` and ``unit``; these four are left out where
        the study has a [recording], whose neuron is then the one of Figure 8. The same names of a recording that is all
        the study has of neurons; otherwise those of the n-th of ``neural`` end in _n.

    Raises
    ------
    InputError
        If a part cannot be done.
    """
    results: dict[str, xr.Dataset] = {}
    if study.cortex is not None:
        found = attempt("cortex", partial(kept_cortex, study.cortex, out, engine, progress))
        results |= {name: data for name, data in found.items() if study.recording is None or name == "units"}
    alone = study.cortex is None and study.recording is None and len(study.neural) == 1
    for number, neurons in enumerate(study.neural, 1):
        if progress is not None:
            progress("recorded neurons", number, len(study.neural))
        end = "" if alone else f"_{number}"
        found = attempt(f"recording {number}", partial(neuron_results, neurons, study.folder, progress))
        results |= {name + end: data for name, data in found.items()}
    return results


def kept_cortex(
    cortex: Cortex, out: Path, engine: Engine | None = None, progress: Progress | None = None
) -> dict[str, xr.Dataset]:
    """A simulated population, whisker by whisker: what is in the folder already is not done again.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.
    out, engine, progress
        As in :func:`populations_of`.

    Returns
    -------
    dict of Datasets
        See :func:`vibrissa.study.cortex.gathered`.

    Raises
    ------
    InputError
        If the stimulator cannot play the motion, or the folder cannot be written.
    """
    command_of(cortex)  # what is wrong with it is told at once, not by each whisker
    jobs = [
        Job({"whisker": whisker}, partial(_block, cortex, whisker), made_of(cortex=asdict(cortex), whisker=whisker))
        for whisker in stimulated(cortex)
    ]
    rows = finish(jobs, out / FOLDER, "simulated units, by whisker", engine, progress)
    if wrong := [row["rejected"] for row in rows if not row["accepted"]]:
        raise InputError("[cortex]", f"could not be analysed ({wrong[0]})")
    blocks = [load(path_of(out / FOLDER, row["address"])) for row in rows]
    for block in blocks:
        block.attrs = {name: value for name, value in block.attrs.items() if name not in _KEEPING}
    return gathered(cortex, blocks)


def _block(cortex: Cortex, whisker: int) -> tuple[dict[str, Any], xr.Dataset]:
    return {}, analyse_block(cortex, whisker)
