"""Which source of this package made a result."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import resources
from pathlib import Path

from vibrissa.files import digest


@cache
def source_digest() -> str:
    """SHA-256 of this package's modules and data, names included."""
    root = Path(str(resources.files("vibrissa")))
    parts = sorted(path for path in root.rglob("*") if path.suffix in (".py", ".toml", ".csv"))
    text = "\n".join(f"{path.relative_to(root).as_posix()} {digest(path)}" for path in parts)
    return hashlib.sha256(text.encode()).hexdigest()
