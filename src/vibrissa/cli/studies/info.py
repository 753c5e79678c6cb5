"""The verb `info`: versions, extras, threads and places, for a report of a fault."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

from vibrissa import __version__
from vibrissa.cli.shared.display.output import Json, print_json, say
from vibrissa.cli.shared.display.tables import hanging

_EXTRA = re.compile(r"""^([\w.-]+).*;.*extra == ["'](\w+)["']""")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def info(*, json: Json = False) -> None:
    """Print versions, platform, extras, threads and caches, for the report of a fault."""
    found: dict[str, Any] = {
        "vibrissa": f"{__version__}, {Path(__file__).parents[2]}",
        "python": f"{platform.python_version()}, {sys.executable}",
        "platform": platform.platform(),
        "packages": {name: _version(name) for name in _packages(None)},
        "extras": {extra: {name: _version(name) for name in _packages(extra)} for extra in _extras()},
        "threads": {"cores": os.cpu_count(), **{name: os.environ[name] for name in _THREADS if name in os.environ}},
        "caches": _caches(),
        "report": "the issue tracker, with this text, the command and the file (CONTRIBUTING.md)",
    }
    if json:
        return print_json(found)
    return say(hanging([line for name, value in found.items() for line in _lines(name, value)]))


def _lines(name: str, value: Any) -> list[str]:
    if not isinstance(value, dict):
        return [f"{name}  {value}"]
    return [f"{name} {key}  {_words(one)}" for key, one in value.items()]


def _words(value: Any) -> str:
    if not isinstance(value, dict):
        return "absent" if value is None else str(value)
    return ", ".join(f"{name} {version or 'absent'}" for name, version in value.items())


def _requirements() -> list[str]:
    try:
        return metadata.requires("vibrissa") or []
    except metadata.PackageNotFoundError:  # run from its source
        return []


def _extras() -> list[str]:
    found = (_EXTRA.match(line) for line in _requirements())
    return sorted({one[2] for one in found if one} - {"all"})


def _packages(extra: str | None) -> list[str]:
    """Packages of an extra, or, of none, those that are always needed."""
    if extra is None:
        return sorted({re.split(r"[^\w.-]", line)[0] for line in _requirements() if "extra ==" not in line})
    found = (_EXTRA.match(line) for line in _requirements())
    return sorted({one[1] for one in found if one and one[2] == extra and one[1] != "vibrissa"})


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _caches() -> dict[str, str]:
    """Places outside the results that are written."""
    compiled = os.environ.get("NUMBA_CACHE_DIR", "__pycache__ beside each module")
    home = Path.home()
    return {
        "compiled loops": compiled,
        "matplotlib": os.environ.get("MPLCONFIGDIR", str(home / ".cache" / "matplotlib")),
        "movement": str(home / ".movement"),
    }
