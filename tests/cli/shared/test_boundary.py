"""Whatever goes wrong behind a command is one line, and an exit code."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vibrissa import limits
from vibrissa.errors import ConvergenceError, RangeError


def deep():
    return deep()


def unsolved():
    raise ConvergenceError("Eq. 1", 0.1, 30)


FAULTS = [
    (lambda: np.zeros(1 << 62, "i1"), 2, "too little memory"),
    (deep, 2, "nested too deeply"),
    (lambda: Path("/").read_bytes(), 2, "/: the system refuses: Is a directory"),
    (lambda: {}["absent"], 1, "a fault of vibrissa: KeyError, 'absent' at test_boundary.py:"),
    (unsolved, 2, "Eq. 1 did not converge"),
]


@pytest.mark.parametrize(("fault", "code", "line"), FAULTS)
def test_every_failure_of_a_verb_is_one_line(vibrissa, monkeypatch, fault, code, line):
    monkeypatch.setattr("vibrissa.cli.app", lambda *_, **__: fault())
    found, out, err = vibrissa("atlas")
    assert (found, out) == (code, "")
    assert err.startswith("vibrissa: ")
    assert line in err
    assert len(err.splitlines()) == 1
    with pytest.raises(Exception) as shown:  # noqa: PT011
        vibrissa("atlas", "--debug")
    assert {"test_boundary.py", "boundary.py", "pathlib.py", "pathlib"} & set(shown.traceback[-1].path.parts)


def run(*words, stdout=subprocess.PIPE):
    command = [sys.executable, "-c", "from vibrissa.cli import main; main()", *words]
    done = subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=100, check=False)
    return done.returncode, done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_disk_behind_the_output_is_one_line():
    with open("/dev/full", "w") as full:
        code, err = run("atlas", stdout=full)
    assert (code, err) == (2, "vibrissa: the system refuses: No space left on device\n")


def test_bad_input_is_shown_whole_with_debug(vibrissa):
    assert vibrissa("show", "absent.nc")[0] == 2
    with pytest.raises(Exception, match=r"absent\.nc"):
        vibrissa("show", "absent.nc", "--debug")


def test_limits_are_of_the_machine_its_container_or_the_environment(monkeypatch):
    assert 1e8 < limits.machine_memory() < 1e15
    monkeypatch.setenv(limits.VARIABLE, "3")
    assert limits.machine_memory() == 3e9
    limits.require_memory("frames", 10, 1.5e9)
    with pytest.raises(RangeError, match=r"frames must fit into 1\.5 GB .* got 10, which need 1\.6 GB"):
        limits.require_memory("frames", 10, 1.6e9)
    for wrong in ("much", "-1", "nan", "inf"):
        monkeypatch.setenv(limits.VARIABLE, wrong)
        with pytest.raises(ValueError, match="positive number of gigabytes"):
            limits.machine_memory()


@pytest.mark.parametrize(
    ("groups", "file"),
    [
        ("0::/slurm/job_7/step_0\n", "slurm/job_7/memory.max"),
        ("9:name=systemd:/\n4:cpu,memory:/slurm/job_7/step_0\n0::/\n", "memory/slurm/job_7/memory.limit_in_bytes"),
        ("0::/\n", "memory.max"),
    ],
)
def test_the_limit_of_a_batch_job_is_found(tmp_path, monkeypatch, groups, file):
    """That of any group which the process is in: of the job, though the step within it has none."""
    (tmp_path / "mine").write_text(groups)
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_text("12345678\n")
    (tmp_path / "slurm" / "job_7" / "step_0").mkdir(parents=True, exist_ok=True)
    (tmp_path / "slurm" / "job_7" / "step_0" / "memory.max").write_text("max\n")
    monkeypatch.setattr(limits, "_CGROUPS", str(tmp_path))
    monkeypatch.setattr(limits, "_MINE", str(tmp_path / "mine"))
    monkeypatch.delenv(limits.VARIABLE, raising=False)
    assert limits.machine_memory() == 12345678


@pytest.mark.skipif(sys.platform != "linux", reason="a cap on memory is set on Linux")
def test_memory_beyond_the_machine_fails_as_an_allocation():
    code = "from vibrissa.limits import cap_memory; cap_memory()\nimport numpy as np\nnp.ones(int(3e8))"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, env={"VIBRISSA_MEMORY": "1"}, check=False)
    assert "MemoryError" in done.stderr
