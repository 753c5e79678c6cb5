"""Real movies and stills, which stand beside the repository and not in it; and a reader of WHISK's traces."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"


def real(name: str) -> Path:
    path = DATA / name
    if not path.is_file():
        pytest.skip(f"real data {name} is not here")
    return path


class Segment(NamedTuple):
    frame: int
    x: np.ndarray
    y: np.ndarray


def whisk_segments(path: Path) -> list[Segment]:
    """Traces in a .whiskers file (bwhiskbin1): x is the column, y the row [px], in the order of x."""
    data = path.read_bytes()
    assert data[:12] == b"bwhiskbin1\0\0"
    segments, at = [], 12
    for _ in range(int.from_bytes(data[-4:], "little")):
        _, frame, points = np.frombuffer(data, "<i4", 3, at)
        x, y = np.frombuffer(data, "<f4", 2 * points, at + 12).reshape(2, points).astype(float)
        order = np.argsort(x, kind="stable")
        segments.append(Segment(int(frame), x[order], y[order]))
        at += 12 + 16 * int(points)
    assert at == len(data) - 4
    return segments
