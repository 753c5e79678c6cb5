"""The parts of a study: each a chain of stages, and several at a time where nothing of one is needed by another."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from dataclasses import replace
from functools import partial
from threading import Event

from vibrissa.quantities.kinds import Progress
from vibrissa.study.spec.settings import Study
from vibrissa.study.stages.stage import Stage
from vibrissa.study.stages.stages import STAGES
from vibrissa.study.store.outcome import noting
from vibrissa.study.store.run_state import Run
from vibrissa.sweep.processes import Crew
from vibrissa.sweep.stops import time_to_end

Chain = list[Stage]


def do_parts(run: Run) -> None:
    """Do every stage that a study asks for, those of a part in the order of ``STAGES``.

    Parts that need nothing of each other are done at the same time, each in a thread, where there are processes for
    the work that comes by the many; else one after the other. Each sees the results of the parts that it comes after,
    and no others, so that the results do not depend on which is done first. A stage is passed over where its inputs
    were not made, or its part failed.

    Parameters
    ----------
    run : Run
        Takes the results, and the reasons of failures, in the order of ``STAGES``.

    Raises
    ------
    InputError
        If the only part of the study fails.
    """
    chains = parts_of(run.study)
    crew = None if run.engine is None else run.engine.crew
    done = _in_order(run, chains) if crew is None or len(chains) == 1 else _at_once(run, chains, crew)
    for one in done:
        run.results |= one.results
        run.failed |= one.failed


def parts_of(study: Study) -> dict[str, Chain]:
    """Stages that a study asks for, by their part; a stage of no part is one of its own.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    dict of list of Stage
        In the order of ``STAGES``.
    """
    chains: dict[str, Chain] = {}
    for stage in STAGES:
        if stage.asked(study):
            chains.setdefault(stage.part or stage.name, []).append(stage)
    return chains


def _in_order(run: Run, chains: Mapping[str, Chain]) -> list[Run]:
    done: dict[str, Run] = {}
    for name, chain in chains.items():
        done[name] = _do(run, chain, [done[part] for part in _before(chain) if part in done])
    return list(done.values())


def _at_once(run: Run, chains: Mapping[str, Chain], crew: Crew) -> list[Run]:
    """Every part in a thread, which waits for those before it; what ends one, or this thread, ends all."""
    ended, futures = Event(), dict[str, Future[Run]]()
    run = replace(run, progress=_until(ended, run.progress))
    threads = ThreadPoolExecutor(len(chains))
    try:
        for name, chain in chains.items():
            before = [futures[part] for part in _before(chain) if part in futures]
            futures[name] = threads.submit(_do_after, run, chain, before)
        for one in wait(futures.values(), return_when=FIRST_EXCEPTION).done:
            one.result()
    except BaseException as error:
        ended.set()
        crew.end()
        wait(futures.values(), time_to_end(error))
        raise
    finally:
        threads.shutdown(wait=False)
    return [one.result() for one in futures.values()]


def _before(chain: Chain) -> list[str]:
    """Parts that a chain comes after."""
    return list(dict.fromkeys(part for stage in chain for part in stage.after))


def _until(ended: Event, progress: Progress) -> Progress:
    """Report progress, and interrupt the thread that reports once all has ended."""

    def report(stage: str, done: int, total: int) -> None:
        if ended.is_set():
            raise KeyboardInterrupt
        progress(stage, done, total)

    return report


def _do_after(run: Run, chain: Chain, before: Iterable[Future[Run]]) -> Run:
    return _do(run, chain, [one.result() for one in before])


def _do(run: Run, chain: Chain, before: Iterable[Run]) -> Run:
    """Do the stages of one part; gives a run with the results that these need and make."""
    own = replace(run, results={}, failed={})
    for one in before:
        own.results |= one.results
        own.modelled = one.modelled or own.modelled
    for stage in chain:
        if stage.part in own.failed or not set(stage.inputs) <= own.results.keys():
            continue
        work = partial(stage.function, own)
        attempt = noting(own.failed) if stage.follows else own.attempt
        own.results |= attempt(stage.part, work) if stage.part else work()
    return own
