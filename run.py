"""Set vibrissa up in .venv beside this file, then run it. Needs nothing but Python and git.

python3 run.py             the main job: vibrissa run
python3 run.py modes ...   any other command of vibrissa
python3 run.py test ...    every check; further words go to pytest
python3 run.py lock ...    write the locks anew; further words go to uv (--upgrade)
"""

import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent
PYPROJECT = ROOT / "pyproject.toml"
CORE = ROOT / "requirements.lock"  # what vibrissa needs, and what builds it
DEV = ROOT / "requirements-dev.lock"  # the same versions, every extra and the tools
LOCKED_FOR = "Python 3.11 to 3.14 on Linux, and on macOS 14 or newer with Apple silicon"
VENV = ROOT / ".venv"
BIN = VENV / "bin"

CHECKS = [["ruff", "format", "--check"], ["ruff", "check"], ["mypy"], ["lint-imports", "--no-logo"]]


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


def install(requirements):
    """Install a lock, then the package itself, into .venv, unless that is done already."""
    record = VENV / "installed"  # for which Python and place, then which locks; absent while at work
    place, *done = record.read_text().split() if record.is_file() else ["nowhere"]
    if place == here() and fingerprint(requirements) in done:
        return
    say(f"installing {requirements.name} into {VENV}, once; this takes a minute or more")
    if place != here():
        succeed([sys.executable, "-m", "venv", "--clear", VENV])
    record.unlink(missing_ok=True)
    pip("--require-hashes", "--only-binary=:all:", "-r", requirements)
    pip("--no-index", "--no-build-isolation", "--editable", ROOT)
    done = [CORE, DEV] if requirements == DEV else [CORE]
    record.write_text(" ".join([here(), *map(fingerprint, done)]))


def pip(*words):
    """Call the environment's pip, deaf to PYTHONPATH, without resolving: the locks are complete."""
    options = ["--quiet", "--no-deps", "--no-input", "--no-user", "--disable-pip-version-check"]
    succeed([BIN / "python", "-I", "-m", "pip", "install", *options, *words])


def succeed(command):
    """Run one step of the set-up with all its talk on stderr, or stop."""
    if subprocess.run(command, stdout=sys.stderr).returncode != 0:
        version = sys.version.split()[0]
        sys.exit(f"run.py: the set-up failed, see above; here is Python {version}, the lock is for {LOCKED_FOR}")


def here():
    """Name the Python and the place an environment was made for."""
    return hashlib.sha256(f"{sys.version} {VENV}".encode()).hexdigest()


def fingerprint(requirements):
    """Name the content of a lock together with the project's own table of contents."""
    return hashlib.sha256(requirements.read_bytes() + PYPROJECT.read_bytes()).hexdigest()


def test(words):
    """Run every check, the fast ones first, and stop at the first that fails."""
    install(DEV)
    os.chdir(ROOT)
    for command in CHECKS:
        say(" ".join(command))
        code = subprocess.run([BIN / command[0], *command[1:]]).returncode
        if code != 0:
            sys.exit(code)
    stale = [path.name for path in (CORE, DEV) if path.read_text() != sealed(body(path))]
    if stale:
        sys.exit(f"run.py: {' and '.join(stale)} not made from this pyproject.toml; python3 run.py lock")
    os.execv(BIN / "pytest", ["pytest", "-n", "auto", "--dist", "loadfile", *words])  # a worker for each core


def lock(words):
    """Resolve both locks with uv, for every Python at once; what is locked already stays unless asked."""
    uv = shutil.which("uv", path=f"{BIN}{os.pathsep}{os.environ['PATH']}")
    if uv is None:
        install(DEV)
        uv = BIN / "uv"
    resolve = [uv, "pip", "compile", "pyproject.toml", "--no-config", "--quiet", "--universal"]
    resolve += ["--python-version=3.11", "--only-binary=:all:", "--generate-hashes", "--no-header"]
    resolve += ["--no-annotate", "--no-emit-index-url", "--no-emit-find-links", *words]
    os.chdir(ROOT)
    os.environ.setdefault("UV_SYSTEM_CERTS", "1")  # an institute's proxy signs with its own certificate
    succeed([*resolve, "--all-extras", "--group=dev", "--output-file", DEV])
    succeed([*resolve, "--group=build", "--constraints", DEV, "--output-file", CORE])
    for path in (CORE, DEV):
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
    inputs = [[project[key] for key in keys], [groups[key] for key in ("build", "dev", "docs")]]
    digest = hashlib.sha256((json.dumps(inputs, sort_keys=True) + text).encode()).hexdigest()
    return f"# Written by `python3 run.py lock` from pyproject.toml, for {LOCKED_FOR}.\n# {digest}\n{text}"


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.exit(130)
