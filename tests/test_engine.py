"""Engines of this machine: order, progress, errors and the death of a process."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from engine_tasks import die, die_once, place, refuse_three, square
from vibrissa.errors import InputError
from vibrissa.sweep.engine import LOCAL, Engine, each

HERE = Path(__file__).parent


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


def test_one_worker_works_in_this_process():
    assert set(each(place, range(2), Engine(scheduler="processes", workers=1))) == {os.getpid()}


def test_a_killed_process_costs_nothing_but_time(tmp_path):
    told, items = [], [(number, tmp_path / "mark") for number in range(6)]
    found = each(die_once, items, Engine(scheduler="processes", workers=2), lambda *words: told.append(words))
    assert (tmp_path / "mark").exists()
    assert found == [0, 1, 4, 9, 16, 25]
    assert told == [(done, 6) for done in range(1, 7)]


def test_processes_that_die_again_and_again_are_one_line():
    with pytest.raises(InputError, match=r"worker processes must stay alive, got .*killed 3 times in a row.*--workers"):
        each(die, [2, 2, 2], Engine(scheduler="processes", workers=2))


PARENT = """
import sys
sys.path.insert(0, {here!r})
from engine_tasks import place
from vibrissa.sweep.engine import Engine, each
if __name__ == "__main__":
    each(place, range(2000), Engine(scheduler="processes", workers=2), lambda *done: print(*done, flush=True))
"""


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_processes_end_with_the_one_that_started_them(tmp_path, end):
    (tmp_path / "parent.py").write_text(PARENT.format(here=str(HERE)))
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
    with pytest.raises(InputError, match="scheduler must be one of threads, processes, synchronous, tcp://HOST:PORT"):
        Engine(scheduler=scheduler)


@pytest.mark.parametrize("workers", [0, -1, 10_001])
def test_workers_are_counted_from_one(workers):
    with pytest.raises(InputError, match="workers must lie between 1 and 10000"):
        Engine(workers=workers)
