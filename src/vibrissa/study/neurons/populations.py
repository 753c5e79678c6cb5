"""The neural half of a study: a simulated population, recorded neurons, and what their results are called."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.quantities.kinds import Datasets, Progress
from vibrissa.study.neurons.cortex import analyse_block, command_of, gathered, stimulated
from vibrissa.study.neurons.neurons import neuron_results
from vibrissa.study.neurons.shown_unit import EXAMPLES
from vibrissa.study.spec.cortex import Cortex
from vibrissa.study.store.result_store import StoredWork, finished, made_of

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.spec.settings import Study
    from vibrissa.study.store.run_state import Run
    from vibrissa.sweep.engine import Engine

FOLDER = "cortex"  # of the results of each whisker
_KEEPING = ("row", "made_of", "address")  # attributes of a kept file, not of what it holds


def prepare_stimulator(run: Run) -> Datasets:
    """Compute the command of the stimulator; no dataset, since every whisker's units read it from memory.

    Parameters
    ----------
    run : Run
        Its study has a cortex.

    Returns
    -------
    dict of Datasets
        Empty.

    Raises
    ------
    InputError
        If the stimulator cannot play the motion.
    """
    run.progress("stimulator", 0, 0)
    if run.study.cortex is not None:
        command_of(run.study.cortex)
    return {}


def simulated_results(run: Run) -> Datasets:
    """Simulate and analyse the population of a study.

    Parameters
    ----------
    run : Run
        Its study has a cortex. The units of each whisker are kept in ``cortex`` of its folder of results.

    Returns
    -------
    dict of Datasets
        ``units`` and ``unit_examples``; ``spikes``, ``response``, ``motion`` and ``unit`` of the one that Figure 8
        shows, unless the study has a [recording], whose neuron is then that of Figure 8.

    Raises
    ------
    InputError
        If the stimulator cannot play the motion, or the folder cannot be written.
    """
    if run.study.cortex is None:
        return {}
    found = kept_cortex(run.study.cortex, run.out, run.engine, run.progress)
    return {name: data for name, data in found.items() if run.study.recording is None or name in ("units", EXAMPLES)}


def recorded_results(run: Run) -> Datasets:
    """Analyse the recordings of a study; one that fails leaves the others.

    Parameters
    ----------
    run : Run
        The run.

    Returns
    -------
    dict of Datasets
        As :func:`vibrissa.study.neurons.neurons.neuron_results`, each name with the end of :func:`ends_of_recordings`.
    """
    recordings, results = run.study.neural, Datasets()
    for number, (neurons, end) in enumerate(zip(recordings, ends_of_recordings(run.study), strict=True), 1):
        run.progress("recorded neurons", number - 1, len(recordings))
        work = partial(neuron_results, neurons, run.study.folder, run.progress)
        results |= {name + end: data for name, data in run.attempt(f"recording {number}", work).items()}
    return results


def ends_of_recordings(study: Study) -> list[str]:
    """End of the names of each recording's results: none for the only neurons of a study, else _1, _2 ….

    Parameters
    ----------
    study : Study
        With any number of recordings.

    Returns
    -------
    list of str
        One for each recording.
    """
    if study.cortex is None and study.recording is None and len(study.neural) == 1:
        return [""]
    return [f"_{number}" for number in range(1, len(study.neural) + 1)]


def kept_cortex(
    cortex: Cortex, out: Path, engine: Engine | None = None, progress: Progress | None = None
) -> dict[str, xr.Dataset]:
    """Analyse a simulated population, whisker by whisker; stored results are reused.

    Parameters
    ----------
    cortex : Cortex
        The virtual session.
    out, engine, progress
        As in :class:`vibrissa.study.store.run_state.Run`.

    Returns
    -------
    dict of Datasets
        See :func:`vibrissa.study.neurons.cortex.gathered`.

    Raises
    ------
    InputError
        If the stimulator cannot play the motion, or the folder cannot be written.
    """
    command_of(cortex)  # what is wrong with it is reported at once, not by each whisker
    of = asdict(cortex)
    jobs = [
        StoredWork({"whisker": whisker}, partial(_block, cortex, whisker), made_of(cortex=of, whisker=whisker))
        for whisker in stimulated(cortex)
    ]
    blocks = finished(jobs, out / FOLDER, "simulated units, by whisker", engine, progress)
    for block in blocks:
        block.attrs = {name: value for name, value in block.attrs.items() if name not in _KEEPING}
    return gathered(cortex, blocks)


def _block(cortex: Cortex, whisker: int) -> tuple[dict[str, Any], xr.Dataset]:
    return {}, analyse_block(cortex, whisker)
