"""One kill of each kind, in real processes over TCP: worker, scheduler, run; the files are those of no kill.

Twenty kills of whole studies: ``benchmarks/kills.py``.
"""

import importlib.util
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from failing_tasks import naps

from vibrissa.study.store.result_store import finish
from vibrissa.sweep.engine import Engine

pytest.importorskip("distributed", reason="the extra cluster is not installed: pip install 'vibrissa[cluster]'")

HERE = Path(__file__).parents[2] / "helpers"
JOBS, PAUSE = 60, 0.1
RUN = """
import sys
from pathlib import Path
from failing_tasks import naps
from vibrissa.errors import InputError
from vibrissa.files import held
from vibrissa.study.store.result_store import finish
from vibrissa.sweep.engine import Engine

sys.path.insert(0, {here!r})
out = Path(sys.argv[1])
try:
    with held(out):
        finish(naps({jobs}, {pause}), out / "sweeps", "naps", Engine(scheduler=sys.argv[2]))
except InputError as error:
    sys.exit(f"one line: {{error}}")
"""


@pytest.fixture(scope="module")
def kills():
    place = HERE.parents[1] / "benchmarks" / "kills.py"
    spec = importlib.util.spec_from_file_location("kills", place)
    module = importlib.util.module_from_spec(spec)
    sys.modules["kills"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["kills"]


@pytest.fixture
def cluster(kills, tmp_path):
    made = kills.Cluster(tmp_path, str(HERE))
    yield made
    made.end()


def at_work(folder, run, count):
    """Wait until there are so many results; a run that ended before, as there were no workers yet, begins again."""
    deadline = time.monotonic() + 300
    while len(list((folder.place / "sweeps").glob("[!.]*.nc"))) < count and time.monotonic() < deadline:
        if run.poll() is not None:
            run = folder.run()
        time.sleep(0.02)
    return run


def test_whatever_is_killed_the_files_are_those_of_no_kill(kills, cluster, tmp_path, monkeypatch):
    finish(naps(JOBS), tmp_path / "undisturbed" / "sweeps", "naps", Engine(scheduler="synchronous"))
    (tmp_path / "run.py").write_text(RUN.format(here=str(HERE), jobs=JOBS, pause=PAUSE))
    monkeypatch.setenv("PYTHONPATH", str(HERE))
    command = [sys.executable, "-W", "ignore", tmp_path / "run.py"]
    folder = kills.Folder(tmp_path / "out", cluster, lambda *words: [*command, *words], np.random.default_rng(0), 0.0)
    known = kills.results(tmp_path / "undisturbed")
    watch = kills.Watch(folder.place, known)
    thread = kills.threading.Thread(target=watch.look)
    thread.start()
    try:
        run, told = folder.run(), {}
        for count, kind in ((5, "worker"), (15, "scheduler"), (30, "run")):
            run = at_work(folder, run, count)
            assert run.poll() is None
            told[kind] = folder.kill(kind, run)
            run = run if run.poll() is None else folder.run()
        at_work(folder, run, JOBS).wait(timeout=300)
    finally:
        watch.done = True
        thread.join()
    assert folder.run().wait(timeout=300) == 0  # nothing is left to do
    folder.close()
    assert told["worker"] == "went on"
    assert told["scheduler"].startswith("1: 1 lines, one line: scheduler tcp://127.0.0.1:")
    assert kills.results(folder.place) == known
    assert len(watch.seen) == JOBS
    assert not watch.wrong
    assert [path.name for path in (*folder.place.rglob(".*"), *tmp_path.glob(".*"))] == []
