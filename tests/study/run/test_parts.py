"""Parts of a study: what each waits for and sees, and what ends them, one after the other or at the same time."""

import threading

import numpy as np
import pytest

from vibrissa.errors import InputError, MachineError
from vibrissa.quantities import dataset
from vibrissa.study.run import parts
from vibrissa.study.spec.settings import read_study
from vibrissa.study.stages.stage import Stage
from vibrissa.study.stages.stages import STAGES
from vibrissa.study.store.run_state import Run
from vibrissa.sweep.engine import Engine, staffed

HELP = 60  # [s] in which another thread does what is waited for


def made(number):
    return dataset(mode=np.array([number]))


def stage(name, function, **more):
    return Stage(name, lambda _: True, function, (), part=more.pop("part", name), **more)


def seeing(number, *names):
    """A stage that makes one dataset, and holds what it sees."""

    def work(run):
        assert set(run.results) == set(names)
        return {"profile": made(number)}

    return work


@pytest.fixture(params=["processes", "synchronous"])
def run(request, tmp_path):
    """Of the built-in study; with processes at hand its parts may be done at the same time."""
    with staffed(Engine(scheduler=request.param, workers=2)) as engine:
        yield Run(read_study(), tmp_path, tmp_path, engine)


def test_a_part_sees_what_it_comes_after_and_the_last_of_the_table_counts(run, monkeypatch):
    one = stage("one", lambda _: {"sweeps": made(1)})
    two = stage("two", seeing(2, "sweeps"), after=("one",))
    three, four = stage("three", seeing(3)), stage("four", seeing(4, "profile"), part="three")
    monkeypatch.setattr(parts, "STAGES", (one, two, three, four))
    parts.do_parts(run)
    assert {name: int(data.mode[0]) for name, data in run.results.items()} == {"sweeps": 1, "profile": 4}


def test_reasons_come_in_the_order_of_the_table(run, monkeypatch):
    def refuse(_):
        raise InputError("thing", "must not be")

    last = stage("last", lambda _: {"sweeps": made(1)})
    skipped = stage("skipped", seeing(1), part="one", inputs=("sweeps",))
    monkeypatch.setattr(parts, "STAGES", (stage("one", refuse), skipped, stage("two", refuse), last))
    parts.do_parts(run)
    assert list(run.failed) == ["one", "two"]
    assert list(run.results) == ["sweeps"]


def test_parts_that_need_nothing_of_each_other_are_at_work_at_once(tmp_path, monkeypatch):
    both = threading.Barrier(2)

    def meet(_):
        both.wait(timeout=HELP)
        return {}

    monkeypatch.setattr(parts, "STAGES", (stage("one", meet), stage("two", meet)))
    with staffed(Engine(workers=2)) as engine:
        parts.do_parts(Run(read_study(), tmp_path, tmp_path, engine))


def test_what_the_machine_refuses_ends_every_part(tmp_path, monkeypatch):
    at_work, heard = threading.Event(), []

    def refuse(_):
        at_work.wait(timeout=HELP)
        raise MachineError("disk", "must not be full")

    def go_on(run):
        at_work.set()
        for step in range(100 * HELP):
            heard.append(step)
            run.progress("two", step, 0)
            threading.Event().wait(0.01)
        return {}

    monkeypatch.setattr(parts, "STAGES", (stage("one", refuse), stage("two", go_on)))
    with pytest.raises(MachineError), staffed(Engine(workers=2)) as engine:
        parts.do_parts(Run(read_study(), tmp_path, tmp_path, engine))
    assert len(heard) < 100 * HELP


def test_parts_come_after_parts_of_the_table_above_them():
    place = {}
    for number, one in enumerate(STAGES):
        place.setdefault(one.part or one.name, number)
        assert all(place[part] < number for part in one.after)
