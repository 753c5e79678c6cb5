"""Set vibrissa up in .venv beside this file, then run it. Needs nothing but Python and git.

python3 run.py             the main job: vibrissa run
python3 run.py modes ...   any other command of vibrissa
python3 run.py test ...    every check; further words go to pytest
python3 run.py test --fast the fast tests alone, and no check of types
python3 run.py lock ...    write the locks anew; further words go to uv (--upgrade)
"""

import hashlib
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parent
PYPROJECT = ROOT / "pyproject.toml"
CORE = ROOT / "requirements.lock"  # what vibrissa needs, and what builds it
DEV = ROOT / "requirements-dev.lock"  # the same versions, the extras but sorting, and the tools
SORTING = ROOT / "requirements-sorting.lock"  # that extra, which needs an older zarr, and what tests it
LOCKED_FOR = "Python 3.11 to 3.14 on Linux, and on macOS 14 or newer with Apple silicon"
VENV = ROOT / ".venv"
BIN = VENV / "bin"
KEPT = ROOT / ".cache"  # what the libraries would otherwise keep in the home folder
CACHES = {"XDG_CACHE_HOME": str(KEPT), "MPLCONFIGDIR": str(KEPT / "matplotlib")}
UNREACHED = re.compile(r"connection broken|ConnectionPool|IncompleteRead|Temporary failure in name resolution")
EVERY = 10.0  # seconds from one line on the set-up to the next

FAST = ["-m", "not slow", "--durations=5", "--durations-min=3"]  # and which of them are slow all the same
QUICK_CHECKS = [["ruff", "format", "--check"], ["ruff", "check"], ["lint-imports", "--no-logo"]]
CHECKS = [*QUICK_CHECKS, ["mypy"]]


def main(words):
    """Do what the words say; with none, the main job."""
    check_python()
    if words[:1] == ["test"]:
        test(words[1:])
    elif words[:1] == ["lock"]:
        lock(words[1:])
    else:
        install(CORE)
        os.execv(BIN / "vibrissa", ["vibrissa", *(words or ["run"])])


def check_python():
    """Stop with a word where Python is too old, or lacks what makes an environment."""
    version = sys.version.split()[0]
    if os.name != "posix":
        sys.exit("run.py: vibrissa runs on Linux and macOS; on Windows, use WSL")
    if sys.version_info < (3, 11):  # noqa: UP036 (this file is read before pip can refuse)
        sys.exit(f"run.py: vibrissa needs Python 3.11 or newer; {sys.executable} is {version}")
    if not all(importlib.util.find_spec(name) for name in ("venv", "ensurepip")):
        sys.exit("run.py: this Python lacks venv; on Debian and Ubuntu: sudo apt install python3-venv")


def say(text):
    """Talk to the user on stderr: stdout belongs to the data."""
    print(f"run.py: {text}", file=sys.stderr, flush=True)


def install(requirements, compiled=True):
    """Install a lock, then the package itself, into .venv, and have its loops compiled, unless that is done already."""
    record = VENV / "installed"  # for which Python and place, then which locks; absent while at work
    place, *done = record.read_text().split() if record.is_file() else ["nowhere"]
    if place != here() or fingerprint(requirements) not in done:
        fetch(requirements, record, afresh=place != here())
    if compiled and not (VENV / "compiled").exists():
        compile_loops()


def fetch(requirements, record, afresh):
    """Install a lock and the package, in a new environment where the one that is there is another's."""
    count = sum(line[:1].isalnum() for line in requirements.read_text().splitlines())
    say(f"installing {requirements.name} into {VENV}, once: at most {count} packages, a minute or more")
    if afresh:
        succeed([sys.executable, "-m", "venv", "--clear", VENV])
    record.unlink(missing_ok=True)
    keep()
    with followed(count):
        pip("--require-hashes", "--only-binary=:all:", "-r", requirements)
    say("installing vibrissa itself")
    pip("--no-index", "--no-build-isolation", "--editable", ROOT)
    done = [CORE, DEV] if requirements == DEV else [CORE]
    record.write_text(" ".join([here(), *map(fingerprint, done)]))


def compile_loops():
    """Have the loops compiled that a first command would wait for; what fails here is compiled when it is needed."""
    say("compiling the loops of vibrissa, once: a minute or two; Ctrl-C leaves it to the commands that need them")
    (VENV / "compiled").touch()
    if subprocess.run([BIN / "python", "-m", "vibrissa.warm"], stdout=sys.stderr).returncode != 0:
        say("not all loops could be compiled; the commands that need them do it")


def keep():
    """Let the libraries in .venv keep their caches in this folder: Python runs this line at its start.

    It changes nothing where a user has set another place, or may not write into the folder.
    """
    line = f"os.access({str(ROOT)!a}, os.W_OK) and os.environ.update({CACHES!a} | dict(os.environ))"
    (site,) = VENV.glob("lib/python3*/site-packages")
    (site / "vibrissa-caches.pth").write_text(f"import os; {line}\n")


@contextmanager
def followed(count):
    """Say every few seconds how far pip is."""
    ended = threading.Event()

    def follow():
        while not ended.wait(EVERY):
            log = VENV / "pip.log"
            there = sum(1 for _ in VENV.glob("lib/python3*/site-packages/*.dist-info"))
            say(doing(log.read_text(errors="replace") if log.is_file() else "", count, there))

    watch = threading.Thread(target=follow, daemon=True)
    watch.start()
    try:
        yield
    finally:
        ended.set()
        watch.join()


def doing(log, count, there):
    """Name the package that pip fetches, or say how many are unpacked, from what it wrote into its log."""
    names = re.findall(r"(?:Collecting|Processing) (?:\S*/)?([\w.]+(?:-[a-z]+)*)", log)
    if "Installing collected packages" in log:
        return f"unpacking {len(names)} packages, {min(there, len(names))} are there"
    return f"fetching package {len(names)} of at most {count}: {names[-1]}" if names else "starting pip"


def pip(*words):
    """Call the environment's pip, deaf to PYTHONPATH, without resolving: the locks are complete."""
    log = VENV / "pip.log"
    log.unlink(missing_ok=True)
    options = ["--quiet", "--no-deps", "--no-input", "--no-user", "--disable-pip-version-check"]
    options += ["--log", log, "--progress-bar=off"]  # with a log pip would draw bars in spite of --quiet
    succeed([BIN / "python", "-I", "-m", "pip", "install", *options, *words], log)


def succeed(command, log=None):
    """Run one step of the set-up with all its talk on stderr, or stop."""
    if subprocess.run(command, stdout=sys.stderr).returncode != 0:
        said = log.read_text(errors="replace") if log and log.is_file() else ""
        sys.exit(f"run.py: the set-up failed: {cause(said)}")


def cause(said):
    """Name the likely cause of a failure from what pip wrote into its log."""
    if UNREACHED.search(said):
        return "pip cannot reach a package registry; is there a network, or a proxy in between? Then run this again"
    if "No matching distribution" in said:
        here = f"Python {platform.python_version()} on {platform.system()} {platform.machine()}"
        return f"where pip may look (PIP_INDEX_URL, PIP_NO_INDEX) is no wheel for {here}; the lock is for {LOCKED_FOR}"
    return "see above"


def here():
    """Name the Python and the place an environment was made for."""
    return hashlib.sha256(f"{sys.version} {VENV}".encode()).hexdigest()


def fingerprint(requirements):
    """Name the content of a lock together with the project's own table of contents."""
    return hashlib.sha256(requirements.read_bytes() + PYPROJECT.read_bytes()).hexdigest()


def test(words):
    """Run every check, the fast ones first, and stop at the first that fails."""
    fast = "--fast" in words
    install(DEV, compiled=not fast)  # the fast tests compile those loops that they need
    os.chdir(ROOT)
    for command in QUICK_CHECKS if fast else CHECKS:
        say(" ".join(command))
        code = subprocess.run([BIN / command[0], *command[1:]]).returncode
        if code != 0:
            sys.exit(code)
    stale = [path.name for path in (CORE, DEV, SORTING) if path.read_text() != sealed(body(path))]
    if stale:
        sys.exit(f"run.py: {' and '.join(stale)} not made from this pyproject.toml; python3 run.py lock")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # else each of the many processes that tests start compiles src
    # each worker has one core, where a second thread of linear algebra would only wait for it
    os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    if fast:
        words = [*FAST, *(word for word in words if word != "--fast")]
    # a worker for each core; in the order of the files, in which the longest is not the last;
    # a worker that crashes is not replaced: pytest-xdist may then wait for ever
    os.execv(
        BIN / "pytest",
        ["pytest", "-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder", "--max-worker-restart=0", *words],
    )


def lock(words):
    """Resolve the locks with uv, for every Python at once; what is locked already stays unless asked."""
    uv = shutil.which("uv", path=f"{BIN}{os.pathsep}{os.environ['PATH']}")
    if uv is None:
        install(DEV)
        uv = BIN / "uv"
    resolve = [uv, "pip", "compile", "pyproject.toml", "--no-config", "--quiet", "--universal"]
    resolve += ["--python-version=3.11", "--only-binary=:all:", "--generate-hashes", "--no-header"]
    resolve += ["--no-annotate", "--no-emit-index-url", "--no-emit-find-links", *words]
    os.chdir(ROOT)
    os.environ.setdefault("UV_CACHE_DIR", str(KEPT / "uv"))
    os.environ.setdefault("UV_SYSTEM_CERTS", "1")  # an institute's proxy signs with its own certificate
    succeed([*resolve, "--extra=all", "--group=dev", "--output-file", DEV])
    succeed([*resolve, "--group=build", "--constraints", DEV, "--output-file", CORE])
    succeed([*resolve, "--extra=sorting", "--group=test", "--output-file", SORTING])
    for path in (CORE, DEV, SORTING):
        path.write_text(sealed(body(path)))


def body(requirements):
    """Give the text of a lock without its comments."""
    lines = requirements.read_text().splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("#"))


def sealed(text):
    """Head the text of a lock with the digest of itself and of what it was resolved from."""
    import tomllib

    tables = tomllib.loads(PYPROJECT.read_text())
    project, groups = tables["project"], tables["dependency-groups"]
    keys = ("requires-python", "dependencies", "optional-dependencies")
    inputs = [[project[key] for key in keys], [groups[key] for key in ("build", "dev", "docs", "test")]]
    digest = hashlib.sha256((json.dumps(inputs, sort_keys=True) + text).encode()).hexdigest()
    return f"# Written by `python3 run.py lock` from pyproject.toml, for {LOCKED_FOR}.\n# {digest}\n{text}"


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.exit(130)
