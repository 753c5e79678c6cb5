"""Engines of this machine: order, progress, errors and the death of a process."""

import os
import re
import signal
import subprocess
import sys
import time
from multiprocessing.context import SpawnProcess
from pathlib import Path

import pytest
from engine_tasks import die, die_once, freeze, freeze_once, place, refuse_oddly, refuse_three, square
from refusals import refusal

from vibrissa.sweep import frozen
from vibrissa.sweep.engine import LOCAL, Engine, each, staffed

HERE = Path(__file__).parents[1] / "helpers"
MORE_THAN_A_PIPE_HOLDS = 1_000_000  # [bytes]


@pytest.fixture(params=LOCAL)
def engine(request):
    return Engine(scheduler=request.param, workers=2)


def test_results_come_in_order_and_every_one_is_told(engine):
    told = []
    assert each(square, range(7), engine, lambda *words: told.append(words)) == [0, 1, 4, 9, 16, 25, 36]
    assert told == [(done, 7) for done in range(1, 8)]


def test_nothing_to_do_is_done(engine):
    assert each(square, [], engine) == []


@pytest.mark.parametrize("scheduler", ["threads", "synchronous"])
def test_an_error_of_the_work_is_raised_as_it_is(scheduler):
    with pytest.raises(ValueError, match="three is refused"):
        each(refuse_three, range(6), Engine(scheduler=scheduler, workers=2))


def test_processes_share_the_work_and_raise_its_error():
    engine = Engine(scheduler="processes", workers=2)
    assert len(set(each(place, range(12), engine)) - {os.getpid()}) == 2
    with pytest.raises(ValueError, match="three is refused"):
        each(refuse_three, range(6), engine)


def test_a_crew_stays_from_one_piece_of_work_to_the_next_and_ends_with_them():
    with staffed(Engine(scheduler="processes", workers=2)) as engine:
        first = set(each(place, range(12), engine))
        assert set(each(place, range(12), engine)) == first
    assert len(first) == 2
    assert not any(alive(one) for one in first)


def test_a_crew_outlives_the_death_of_one_that_waits_and_an_error_of_the_work():
    with staffed(Engine(scheduler="processes", workers=2)) as engine:
        killed = each(place, range(12), engine)[0]
        os.kill(killed, signal.SIGKILL)
        assert each(square, range(7), engine) == [0, 1, 4, 9, 16, 25, 36]
        with pytest.raises(ValueError, match="three is refused"):
            each(refuse_three, range(6), engine)
        assert killed not in each(place, range(12), engine)


@pytest.mark.parametrize("scheduler", ["threads", "synchronous"])
def test_other_engines_need_no_crew(scheduler):
    with staffed(Engine(scheduler=scheduler, workers=2)) as engine:
        assert engine == Engine(scheduler=scheduler, workers=2)


def test_one_worker_works_in_this_process():
    assert set(each(place, range(2), Engine(scheduler="processes", workers=1))) == {os.getpid()}


def test_an_error_that_cannot_be_sent_is_raised_by_its_words():
    with pytest.raises(RuntimeError, match=r"^UnsendableError: refused \d$"):
        each(refuse_oddly, range(6), Engine(scheduler="processes", workers=2))


@pytest.mark.parametrize("size", [0, MORE_THAN_A_PIPE_HOLDS])
def test_a_killed_process_costs_nothing_but_time(tmp_path, size):
    told, items = [], [(number, tmp_path / "mark", bytes(size)) for number in range(6)]
    found = each(die_once, items, Engine(scheduler="processes", workers=2), lambda *words: told.append(words))
    assert (tmp_path / "mark").exists()
    assert found == [0, 1, 4, 9, 16, 25]
    assert told == [(done, 6) for done in range(1, 7)]


def test_processes_that_die_again_and_again_are_one_line():
    with refusal("machine", "the worker processes") as caught:
        each(die, [2, 2, 2], Engine(scheduler="processes", workers=2))
    assert re.fullmatch(r"the death of 3 at the same task, number [12] of 3", caught.value.value)  # either may be first


needs_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not tell processes")


@needs_proc
@pytest.mark.parametrize("size", [0, MORE_THAN_A_PIPE_HOLDS])
def test_a_frozen_process_is_given_up_and_its_task_done_elsewhere(tmp_path, monkeypatch, size):
    monkeypatch.setattr(frozen, "FROZEN", 4.0)
    items = [(number, tmp_path / "mark", bytes(size)) for number in range(6)]
    with staffed(Engine(scheduler="processes", workers=2)) as engine:
        crew = set(each(place, range(12), engine))
        assert each(freeze_once, items, engine) == [0, 1, 4, 9, 16, 25]
        given_up = int((tmp_path / "mark").read_text())
        assert given_up in crew
        assert not alive(given_up)


@needs_proc
def test_a_process_that_is_frozen_while_it_has_nothing_to_do_is_given_up_with_its_next_task(monkeypatch):
    monkeypatch.setattr(frozen, "FROZEN", 4.0)
    with staffed(Engine(scheduler="processes", workers=2)) as engine:
        still = each(place, range(12), engine)[0]
        os.kill(still, signal.SIGSTOP)
        items = [bytes(MORE_THAN_A_PIPE_HOLDS)] * 6  # the pipe to it is full before it could take one
        assert still not in each(place, items, engine)


@needs_proc
def test_a_task_at_which_every_process_freezes_is_one_line(monkeypatch):
    monkeypatch.setattr(frozen, "FROZEN", 2.0)
    with refusal("machine", "the worker processes") as caught:
        each(freeze, [2, 2], Engine(scheduler="processes", workers=2))
    assert caught.value.value.startswith("the standstill (2 s without processor time) of 3 at the same task, number ")
    assert caught.value.remedy.startswith("does a disk not answer?")


def test_only_time_without_processor_time_while_this_process_looks_counts(monkeypatch):
    clock, spent = iter([0.0, 1.0, 1000.0, 1001.0, 1002.0, 1003.0]), {1: 5, 2: 5}
    monkeypatch.setattr(frozen, "monotonic", lambda: next(clock))
    monkeypatch.setattr(frozen, "processor_time", spent.get)
    monkeypatch.setattr(frozen, "FROZEN", 3.5)
    still = frozen.Stillness()
    assert still.look([1, 2]) == []
    assert still.look([1, 2]) == []  # all were frozen together: two seconds of it count
    spent[2] = 6
    assert still.look([1, 2]) == []
    assert still.look([1, 2]) == [1]
    assert still.look([2, 3]) == []  # nothing is known of the third


PARENT = """
import sys
sys.path.insert(0, {here!r})
if __name__ == "__main__":
    from engine_tasks import place
    from vibrissa.sweep.engine import Engine, each

    engine = Engine(scheduler="processes", workers=2)
    each(place, [bytes({size})] * 2000, engine, lambda *done: print(*done, flush=True))
"""


def test_ctrl_c_while_a_process_starts_ends_that_one_too(monkeypatch):
    started, start = [], SpawnProcess.start

    def stop_and_start(process):
        signal.raise_signal(signal.SIGINT)
        start(process)
        started.append(process)

    monkeypatch.setattr(SpawnProcess, "start", stop_and_start)
    with pytest.raises(KeyboardInterrupt):
        each(place, range(6), Engine(scheduler="processes", workers=2))
    assert [process.is_alive() for process in started] == [False]


@pytest.mark.parametrize("size", [0, MORE_THAN_A_PIPE_HOLDS])
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_processes_end_with_the_one_that_started_them(tmp_path, end, size):
    (tmp_path / "parent.py").write_text(PARENT.format(here=str(HERE), size=size))
    parent = subprocess.Popen(
        [sys.executable, tmp_path / "parent.py"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    with parent:
        parent.stdout.readline()  # at work
        children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children")
        if not children.exists():
            parent.kill()
            pytest.skip("this system does not tell the children of a process")
        workers = [int(word) for word in children.read_text().split()]
        parent.send_signal(end)
        assert parent.wait(timeout=60) != 0
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and any(alive(worker) for worker in workers):
        time.sleep(0.1)
    assert len(workers) >= 2
    assert not any(alive(worker) for worker in workers)


def alive(pid):
    """Whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize("scheduler", ["cluster", "tcp://", "tcp://host", "http://host:80", "tcp://a b:1", "SLURM"])
def test_what_is_no_scheduler_is_refused(scheduler):
    with refusal("unknown", "scheduler"):
        Engine(scheduler=scheduler)


@pytest.mark.parametrize("workers", [0, -1, 10_001])
def test_workers_are_counted_from_one(workers):
    with refusal("range", "workers"):
        Engine(workers=workers)
