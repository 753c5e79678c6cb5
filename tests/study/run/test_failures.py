"""What goes wrong about a run: full disks, unreadable files, two runs in one folder, signals at any moment."""

import errno
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from failing_tasks import naps
from refusals import refusal

from vibrissa.errors import MachineError
from vibrissa.files import held
from vibrissa.study.store import result_store
from vibrissa.study.store.result_store import StoredWork, do, finish, kept_row, made_of
from vibrissa.study.sweeps.sweeps import run_recorded
from vibrissa.sweep import cluster
from vibrissa.sweep.engine import Engine

HERE = Path(__file__).parents[2] / "helpers"
ALONE = Engine(scheduler="synchronous")


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Files of eight jobs that nothing disturbed."""
    folder = tmp_path_factory.mktemp("undisturbed")
    finish(naps(8), folder, "naps", ALONE)
    return contents(folder)


def test_a_stop_leaves_no_file_half_written(tmp_path):
    def stop(_, done, __):
        if done == 2:
            (tmp_path / "naps" / ".half.1.part.nc").write_bytes(b"CDF")  # a worker killed as it writes
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        finish(naps(4), tmp_path / "naps", "naps", ALONE, stop)
    assert len(contents(tmp_path / "naps")) == 2
    assert not list((tmp_path / "naps").glob(".*"))


# A full disk


def test_a_full_disk_is_one_line_and_what_was_done_is_kept(tmp_path, monkeypatch, undisturbed):
    write, written = Path.write_bytes, []

    def full(self, data):
        if len(written) == 3:
            write(self, data[:100])
            raise OSError(errno.ENOSPC, "No space left on device")
        written.append(write(self, data))

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        with refusal("machine") as told:
            finish(naps(8), tmp_path / "naps", "naps", ALONE)
    assert Path(told.value.quantity).name in undisturbed
    kept = contents(tmp_path / "naps")
    assert len(kept) == 3
    assert all(undisturbed[name] == content for name, content in kept.items())
    finish(naps(8), tmp_path / "naps", "naps", ALONE)
    assert contents(tmp_path / "naps") == undisturbed


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 100 kB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", place]
    if os.geteuid() != 0 or subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("only root may mount a small disk")
    yield place
    subprocess.run(["umount", place], check=True)


def test_a_disk_that_is_full_indeed_goes_on_when_there_is_space(small_disk, undisturbed):
    ballast = small_disk / "ballast"
    ballast.write_bytes(bytes(100 * 1024 - 3 * len(next(iter(undisturbed.values()))) - 12_000))
    with refusal("machine") as told:
        finish(naps(8), small_disk / "naps", "naps", ALONE)
    assert Path(told.value.quantity).name in undisturbed
    kept = contents(small_disk / "naps")
    assert 1 <= len(kept) < 8
    assert all(undisturbed[name] == content for name, content in kept.items())
    ballast.unlink()
    subprocess.run(["mount", "-o", "remount,size=2m", small_disk], check=True)
    finish(naps(8), small_disk / "naps", "naps", ALONE)
    assert contents(small_disk / "naps") == undisturbed


def fails_once(kind, mark):
    if not mark.exists():
        mark.touch()
        raise kind
    return {}, None


def test_where_nobody_can_work_nothing_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT", 0.5)
    (tmp_path / "mine").mkdir()
    for place in ("new", "mine"):
        with refusal("machine", "no file.json"):
            finish(naps(8), tmp_path / place / "sweeps", "naps", Engine(scheduler=str(tmp_path / "no file.json")))
    assert [path.relative_to(tmp_path) for path in tmp_path.rglob("*")] == [Path("mine")]


@pytest.mark.parametrize(
    "kind",
    [
        OSError(errno.ENOSPC, "No space left on device"),
        OSError(errno.EIO, "Input/output error"),
        OSError(errno.ESTALE, "Stale file handle"),
        OSError(errno.ETIMEDOUT, "Connection timed out"),
        MemoryError(),
        MachineError("x", "was lost"),
    ],
)
def test_what_may_pass_is_not_kept_as_a_result(tmp_path, kind):
    job = StoredWork({}, partial(fails_once, kind, tmp_path / "mark"), made_of(once=1))
    with refusal("machine"):
        do(job, tmp_path)
    assert kept_row(tmp_path, job.address) is None


# Files that cannot be read


def test_unreadable_files_are_told_in_their_rows_and_the_rest_goes_on(tmp_path):
    """A movie of noise, a track that is cut off and one that is not there; mended, they are looked at anew."""
    (tmp_path / "movie.avi").write_bytes(np.random.default_rng(1).bytes(3000))
    (tmp_path / "cut.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(50))
    (tmp_path / "sweeps.csv").write_text(
        "movie,track,animal,whisker,texture,scan_speed,pixel_size,frame_rate,seed\n"
        "movie.avi,,a,C1,unknown,0.1,1e-4,500,10 10\n"
        ",cut.nc,a,C1,unknown,0.1,,,\n"
        ",absent.nc,a,C1,unknown,0.1,,,\n"
    )
    table = run_recorded(tmp_path / "sweeps.csv", tmp_path, engine=ALONE)
    assert not table.accepted.any()
    for name, reason in zip(("movie.avi", "cut.nc", "absent.nc"), table.rejected.values, strict=True):
        assert name in reason
        assert "\n" not in reason
    (tmp_path / "absent.nc").write_bytes(b"no track either")
    again = run_recorded(tmp_path / "sweeps.csv", tmp_path, engine=ALONE)
    assert (again.address.values != table.address.values).tolist() == [False, False, True]


# Two runs in one folder


def test_a_second_run_in_a_folder_is_refused_at_once_and_leaves_the_first_alone(vibrissa, tmp_path):
    (tmp_path / "study.toml").write_text('name = "x"\n[laboratory]\nanimals = 1\n')
    with held(tmp_path / "out") as work:
        (work / "half.nc").write_bytes(b"of the first")
        code, out, err = vibrissa("run", tmp_path / "study.toml", "--out", tmp_path / "out")
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert f"must not be in use, got process {os.getpid()} on" in err
        assert (work / "half.nc").read_bytes() == b"of the first"
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


HOLDER = """
import sys, time
from vibrissa.files import held
with held(sys.argv[1]) as work:
    (work / "half.nc").write_bytes(b"half")
    print("held", flush=True)
    time.sleep(600)
"""


def test_a_folder_whose_run_was_killed_is_free(tmp_path):
    with subprocess.Popen([sys.executable, "-c", HOLDER, tmp_path / "out"], stdout=subprocess.PIPE) as first:
        first.stdout.readline()
        with refusal("conflict", "out"), held(tmp_path / "out"):
            pass
        first.kill()
    with held(tmp_path / "out") as work:
        assert list(work.iterdir()) == []
    assert list(tmp_path.iterdir()) == []


# Signals

RUN = """
import sys
sys.path.insert(0, {here!r})

if __name__ == "__main__":  # the workers, which read this file too, need none of it
    from failing_tasks import naps
    from vibrissa import cli
    from vibrissa.files import held
    from vibrissa.study.run import study
    from vibrissa.study.store.result_store import finish

    def run_study(_, out, *, engine, progress, **more):
        with held(out):
            finish(naps(10_000, 0.02), out.absolute() / "sweeps", "sweeps", engine, progress)

    study.run_study = run_study
    sys.argv = ["vibrissa", "run", "--scheduler", "processes", "--workers", "2", "--out", {out!r}]
    cli.main()
"""


def started(tmp_path, wait_for, on_ctrl_c=signal.SIG_DFL):
    """A run in a session of its own, as a terminal's is; and a wait until there is what tells how far it is."""

    def in_a_terminal():  # even where the tests themselves are run under nohup
        signal.signal(signal.SIGINT, on_ctrl_c)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)

    (tmp_path / "run.py").write_text(RUN.format(here=str(HERE), out=str(tmp_path / "out")))
    run = subprocess.Popen(
        [sys.executable, tmp_path / "run.py"],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=in_a_terminal,
    )
    deadline = time.monotonic() + 300
    while run.poll() is None and time.monotonic() < deadline and len(list(tmp_path.glob(wait_for))) < 1:
        time.sleep(0.01)
    return run


def twice(run, number):
    """Send a signal and, while the run stops, again."""
    for _ in range(20):
        os.killpg(run.pid, number)
        time.sleep(0.02)
        if run.poll() is not None:
            return


def of_session(number):
    """Processes of a session that are there and no zombies."""
    found = []
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session = place.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(session) == number and state != "Z":
            found.append(int(place.parent.name))
    return found


def ended(run):
    """Wait until no process of the run is left; those that are, after 60 s."""
    deadline = time.monotonic() + 60
    while (left := of_session(run.pid)) and time.monotonic() < deadline:
        time.sleep(0.05)
    for number in left:
        os.kill(number, signal.SIGKILL)
    return left


needs_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not tell processes")


@needs_proc
@pytest.mark.parametrize(
    ("wait_for", "send", "code"),
    [
        ("out/sweeps/[!.]*.nc", lambda run: run.send_signal(signal.SIGTERM), 143),
        ("out/sweeps/[!.]*.nc", lambda run: os.killpg(run.pid, signal.SIGTERM), 143),
        ("out/sweeps/[!.]*.nc", lambda run: os.killpg(run.pid, signal.SIGINT), 130),
        ("out/sweeps", lambda run: os.killpg(run.pid, signal.SIGINT), 130),  # while the workers start
        ("out/sweeps/[!.]*.nc", lambda run: twice(run, signal.SIGINT), 130),
        ("out/sweeps/[!.]*.nc", lambda run: os.killpg(run.pid, signal.SIGHUP), 129),
    ],
    ids=["batch system", "batch system, all", "terminal", "terminal, early", "twice", "terminal closed"],
)
def test_a_stop_is_clean_and_the_run_goes_on_later(tmp_path, wait_for, send, code):
    run = started(tmp_path, wait_for)
    send(run)
    _, err = run.communicate(timeout=120)
    assert run.returncode == code, err
    line = (
        f"vibrissa: stopped; finished work is kept in {tmp_path / 'out'}, and the same command continues from there\n"
    )
    *stages, last = err.splitlines(keepends=True)
    assert last == line
    assert all(one.startswith("vibrissa: 0:0") for one in stages)
    assert ended(run) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "run.py"]
    kept = {path.name for path in (tmp_path / "out" / "sweeps").iterdir()}
    assert not [name for name in kept if name.startswith(".")]
    first = naps(40)
    rows = [result_store.kept_row(tmp_path / "out" / "sweeps", job.address) for job in first]
    done = [row["run"] for row in rows if row is not None]
    assert len(kept) <= 40 or len(done) == 40
    told = []
    finish(first, tmp_path / "out" / "sweeps", "naps", ALONE, lambda *words: told.append(words[1]))
    assert told[0] == len(done)


@needs_proc
def test_a_run_under_nohup_goes_on_at_ctrl_c_and_is_stopped_by_a_batch_system(tmp_path):
    run = started(tmp_path, "out/sweeps/[!.]*.nc", signal.SIG_IGN)
    os.killpg(run.pid, signal.SIGINT)
    with pytest.raises(subprocess.TimeoutExpired):
        run.wait(timeout=1)
    run.terminate()
    _, err = run.communicate(timeout=120)
    stopped = [line for line in err.splitlines() if "stopped" in line]  # after a line for each stage that had begun
    assert (run.returncode, stopped) == (143, err.splitlines()[-1:]), err
    assert ended(run) == []


@needs_proc
def test_the_processes_of_a_killed_run_end_soon(tmp_path):
    run = started(tmp_path, "out/sweeps/[!.]*.nc")
    run.kill()
    run.communicate(timeout=60)
    assert ended(run) == []
    with held(tmp_path / "out"):
        pass
