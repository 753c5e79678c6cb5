"""A Dask cluster over TCP, of real processes: same results, deaths of workers, and one line where it is no cluster."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from engine_tasks import place, refuse_three, slow_square
from refusals import refusal

from vibrissa.sweep import cluster
from vibrissa.sweep.engine import Engine, each
from vibrissa.sweep.gratings import Gratings
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.maps import sweep
from vibrissa.whisker import Whisker

pytest.importorskip("distributed", reason="the extra cluster is not installed: pip install 'vibrissa[cluster]'")
from distributed import Client
from distributed.comm.core import CommClosedError

HERE = Path(__file__).parents[1] / "helpers"
START = [sys.executable, "-W", "ignore", "-m"]


class Processes:
    """Processes of a cluster, on a free port of this machine; in a folder of their own."""

    def __init__(self, folder):
        with socket.socket() as one:
            one.bind(("127.0.0.1", 0))
            self.port = one.getsockname()[1]
        self.folder, self.all = folder, []
        self.address, self.file = f"tcp://127.0.0.1:{self.port}", folder / "scheduler.json"

    def start(self, *words, path=HERE):
        """Start a part of distributed; its modules are looked for in ``path`` first."""
        with open(self.folder / f"{len(self.all)}.log", "w") as log:
            patience = {"DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "5s"}  # of the scheduler with silent workers
            how = {
                "env": os.environ | patience | {"PYTHONPATH": str(path)},
                "cwd": self.folder,
                "stdout": log,
                "stderr": log,
            }
            self.all.append(subprocess.Popen([*START, f"distributed.cli.{words[0]}", *words[1:]], **how))
        return self.all[-1]

    def scheduler(self):
        where = ("--host", "127.0.0.1", "--port", str(self.port), "--scheduler-file", str(self.file))
        one = self.start("dask_scheduler", *where, "--no-dashboard")
        wait_for(self.file.exists)
        return one

    def worker(self, **how):
        alone = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--memory-limit", "0")
        return self.start("dask_worker", self.address, *alone, **how)

    def end(self):
        for process in self.all:
            process.kill()
            process.wait()


def wait_for(condition):
    """Wait at most two minutes: a busy machine starts processes slowly."""
    end = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.fixture
def processes(tmp_path):
    made = Processes(tmp_path)
    yield made
    made.end()


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """Give a scheduler and a worker."""
    made = Processes(tmp_path_factory.mktemp("cluster"))
    made.scheduler()
    made.worker()
    yield made
    made.end()


def client_of(address):
    """A client of the tests themselves."""
    return Client(address, timeout=60, set_as_default=False)


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT", 1.0)
    monkeypatch.setattr(cluster, "WORKERS", 1.0)


def test_a_map_is_that_of_this_process_to_the_last_bit(running):
    whisker, gratings = Whisker(length=0.04, cone_angle=1.5e-3), Gratings(seed=[0, 1], length=0.01)
    grid = Grid(contact=[0.12, 0.2, 0.3], base_angle=[0.8, 1.2, 1.42], speed=[0.1])
    schedulers, told = ("synchronous", running.address, str(running.file)), []
    one, *others = (
        sweep(
            whisker,
            gratings,
            grid,
            Measure(quantity="rms"),
            engine=Engine(scheduler=name),
            progress=lambda *words: told.append(words),
        )
        for name in schedulers
    )
    assert np.isfinite(one.mode_rms).any()
    assert all(one.identical(other) for other in others)
    assert sum(done == total > 0 for _, done, total in told) == 3


def test_work_is_done_elsewhere_in_order_and_its_error_comes_back(running):
    engine = Engine(scheduler=running.address)
    assert set(each(place, range(3), engine)) == {running.all[1].pid}
    assert each(refuse_three, [5, 1, 4], engine) == [5, 1, 4]
    with pytest.raises(ValueError, match="three is refused"):
        each(refuse_three, range(5), engine)


def test_nothing_to_do_needs_no_cluster():
    assert each(refuse_three, [], Engine(scheduler="tcp://127.0.0.1:1")) == []


@pytest.mark.parametrize("when", ["nthreads", "submit"])
def test_a_scheduler_lost_before_the_client_knows_is_told_as_such(when):
    def lost(*_, **__):
        raise CommClosedError("reset by peer")

    class Client:
        status = "running"

        def nthreads(self, **_):
            return {"worker": 1}

    setattr(Client, when, lost)

    with refusal("machine", "scheduler x", value="it was lost"):
        cluster._Flow(Client(), abs, [1], print, "tcp://x").run()


def test_the_work_of_a_killed_worker_is_done_by_another_and_a_lost_scheduler_is_one_line(processes, capfd):
    scheduler, first, told = processes.scheduler(), processes.worker(), []

    def tell(done, _):
        told.append(done)
        if done == 2:
            processes.worker()
            first.kill()

    engine = Engine(scheduler=processes.address)
    assert each(slow_square, range(12), engine, tell) == [number**2 for number in range(12)]
    assert told == list(range(1, 13))
    capfd.readouterr()

    with refusal("machine", f"scheduler {processes.address}", "it was lost") as error:
        each(slow_square, range(1000), engine, lambda done, _: done == 2 and scheduler.kill())
    assert error.value.rule == "must stay alive"
    assert error.value.remedy.startswith("start it and its workers again")
    assert capfd.readouterr() == ("", "")  # no log of connections lost


def test_ctrl_c_ends_it_soon_and_leaves_the_workers_to_others(running):
    code = "from engine_tasks import slow_square; from vibrissa.sweep.engine import Engine, each\n"
    code += f"each(slow_square, range(1000), Engine(scheduler={running.address!r}), lambda *d: print(*d, flush=True))"
    command, env = [sys.executable, "-c", code], os.environ | {"PYTHONPATH": str(HERE)}
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        run.stdout.readline()
        run.send_signal(signal.SIGINT)
        _, err = run.communicate(timeout=60)
    assert run.returncode == -signal.SIGINT
    assert err.rstrip().endswith("KeyboardInterrupt")
    assert "distributed" not in err.partition("Traceback")[0]
    assert each(refuse_three, [1, 2], Engine(scheduler=running.address)) == [1, 2]


def test_an_address_where_no_scheduler_answers_is_one_line(impatient, processes):
    with refusal("format"):
        each(refuse_three, [1], Engine(scheduler=processes.address))


SPEAKERS = {
    "silent": [],
    "HTTP": [b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n", None],
    "SSH": [b"SSH-2.0-OpenSSH_9.2p1 Debian-2\r\n"],
    "noise": [bytes(range(256)) * 400],
    "zeros": [bytes(4096)],
    "slow": [b"\0"] * 5,
    "closing": [None],
}


@contextmanager
def speaking(parts):
    """A port at which each caller is told some bytes, a second apart; None closes the line."""

    def tell(line):
        with line, suppress(OSError):
            for part in parts:
                if part is None:
                    return
                line.sendall(part)
                time.sleep(1)
            time.sleep(20)

    def listen():
        with suppress(OSError):
            while True:
                threading.Thread(target=tell, args=(server.accept()[0],), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=listen, daemon=True).start()
        yield f"127.0.0.1:{server.getsockname()[1]}"


@pytest.mark.parametrize("parts", SPEAKERS.values(), ids=SPEAKERS)
@pytest.mark.parametrize("scheme", ["tcp", "tls", "file"])
def test_a_port_where_another_service_listens_is_one_line(impatient, tmp_path, capfd, scheme, parts):
    with speaking(parts) as place:
        address = f"{scheme}://{place}"
        if scheme == "file":
            (tmp_path / "scheduler.json").write_text(json.dumps({"address": f"tcp://{place}"}))
            address = str(tmp_path / "scheduler.json")
        with refusal("format", "scheduler.json" if scheme == "file" else address):
            each(refuse_three, [1], Engine(scheduler=address))
    assert capfd.readouterr() == ("", "")


def test_the_port_of_a_worker_is_no_scheduler(impatient, running):
    with client_of(running.address) as client:
        worker = next(iter(client.scheduler_info()["workers"]))
    with refusal("format", worker):
        each(refuse_three, [1], Engine(scheduler=worker))


def test_a_frozen_worker_is_given_up_by_the_scheduler_and_its_work_done_elsewhere(monkeypatch, processes):
    monkeypatch.setattr(cluster, "WORKERS", 4.0)
    processes.scheduler()
    frozen, _ = processes.worker(), processes.worker()
    with client_of(processes.address) as client:
        client.wait_for_workers(2, timeout=120)
    frozen.send_signal(signal.SIGSTOP)
    assert each(slow_square, range(12), Engine(scheduler=processes.address)) == [number**2 for number in range(12)]


def test_a_frozen_scheduler_is_one_line(monkeypatch, processes, capfd):
    monkeypatch.setattr(cluster, "WORKERS", 4.0)
    scheduler, _ = processes.scheduler(), processes.worker()
    with client_of(processes.address) as client:
        client.wait_for_workers(1, timeout=120)
    engine = Engine(scheduler=processes.address)
    with refusal("machine", f"scheduler {processes.address}", "it was lost"):
        each(slow_square, range(1000), engine, lambda done, _: done == 2 and scheduler.send_signal(signal.SIGSTOP))
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("content", [None, "", "[]", json.dumps({"address": None})])
def test_a_file_that_tells_no_scheduler_is_one_line(impatient, tmp_path, content):
    if content is not None:
        (tmp_path / "scheduler.json").write_text(content)
    with refusal("format", "scheduler.json"):
        each(refuse_three, [1], Engine(scheduler=str(tmp_path / "scheduler.json")))


def test_no_workers_and_workers_of_another_version_are_one_line(monkeypatch, processes, tmp_path, vibrissa):
    processes.scheduler()
    monkeypatch.setattr(cluster, "WORKERS", 0.5)
    engine = Engine(scheduler=processes.address)
    with refusal("input", value="none within 0.5 s"):
        each(refuse_three, [1], engine)

    monkeypatch.undo()
    other = tmp_path / "other/vibrissa/sweep"
    other.mkdir(parents=True)
    for name, text in (("__init__.py", ""), ("sweep/__init__.py", ""), ("sweep/cluster.py", "version = '0.0.1'.title")):
        (other.parent / name).write_text(text)
    processes.worker(path=other.parents[1])
    with refusal("unknown", value="0.0.1"):
        each(refuse_three, [1], engine)
