"""Scatter of lines in a recorded movie against the standard deviation that is given with them.

    .venv/bin/python benchmarks/real_scatter.py MOVIE [--frames 600]

A line that goes on plainly through three frames: how far each point of the middle one lies, across the line, from the
mean of its neighbours, less a parabola along the line (the whisker's own motion and bending), times √(2/3), has the
standard deviation of one reading if errors of frames are independent. Printed is its root mean square over the one that
is told, median over such lines, by how far the line moves in a frame: background that stands still is the same error
in all three frames of a line at rest, and blur that follows motion is none of the three readings' own.
"""

import argparse
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

from vibrissa.video.find.movie_segments import find_segments
from vibrissa.video.link.whisker_linking import Linking, link_segments

MOTION = (0.0, 0.1, 0.3, 1.0, 2.0, 4.0)  # edges of the classes [px per frame]
REACH, END, LEAST = 4.0, 5, 30  # [px] to a neighbour's line at most, left out at either end, and left then


def triples(linking: Linking) -> Iterator[tuple[int, int, int]]:
    """Segments of three frames in a row that are one plain stretch."""
    for one in linking.solutions:
        order = np.lexsort((one.frame, one.tracklet))
        order = order[one.tracklet[order] >= 0]
        a, b, c = order[:-2], order[1:-1], order[2:]
        plain = (one.tracklet[a] == one.tracklet[c]) & (one.frame[b] - one.frame[a] == 1)
        yield from zip(*(each[plain & (one.frame[c] - one.frame[b] == 1)] for each in (a, b, c)), strict=True)


def tangents(line: np.ndarray) -> np.ndarray:
    """Direction of a line (n, 2) at its points."""
    way = np.gradient(line, axis=0)
    return way / np.hypot(*way.T)[:, None]


def across(line: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Distance (n,) of another line across a line (n, 2) [px]; NaN beyond its ends."""
    way = tangents(line)
    normal = np.stack([-way[:, 1], way[:, 0]], axis=1)
    far, nearest = cKDTree(other).query(line, distance_upper_bound=REACH)
    nearest = np.where(np.isfinite(far), nearest, 0)
    off, there = other[nearest] - line, tangents(other)[nearest]
    along, turn = (off * way).sum(axis=1), (there * way).sum(axis=1)
    found = (off * normal).sum(axis=1) - along * (there * normal).sum(axis=1) / turn
    return np.where(np.isfinite(far) & (np.abs(along) < 1.5) & (np.abs(turn) > 0.3), found, np.nan)


def scatter(segments: xr.Dataset, linking: Linking) -> np.ndarray:
    """Motion [px per frame] and scatter over the standard deviation told, of each triple (n, 2)."""
    pieces, told = linking.pieces, segments["position_sd"].values
    points = np.stack([pieces.column, pieces.row], axis=1)
    rows = []
    for three in triples(linking):
        before, line, after = (points[pieces.start[s] : pieces.stop[s]] for s in three)
        if len(line) < LEAST:
            continue
        steps = across(line, before), across(line, after)
        sd = told[pieces.start[three[1]] : pieces.stop[three[1]]]
        use = np.flatnonzero(np.isfinite(steps[0] + steps[1] + sd))
        use = use[(use >= END) & (use < len(line) - END)]
        if use.size < LEAST:
            continue
        mean, motion = (steps[0][use] + steps[1][use]) / 2, np.abs(np.median(steps[1][use] - steps[0][use])) / 2
        terms = np.vander(np.linspace(-1, 1, use.size), 3)
        left = mean - terms @ np.linalg.lstsq(terms, mean, rcond=None)[0]
        variance = (left @ left) / (use.size - 3) * 2 / 3
        rows.append((motion, np.sqrt(variance / np.mean(sd[use] ** 2))))
    return np.array(rows)


def main() -> None:
    """Find, link, and print the table."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("movie", type=Path)
    words.add_argument("--frames", type=int, default=600)
    asked = words.parse_args()
    segments = find_segments(asked.movie, stop=asked.frames)
    found = scatter(segments, link_segments(segments))
    print("| motion [px per frame] | lines | scatter over SD told: median | a tenth below | a tenth above |")
    print(5 * "|---" + "|")
    for low, high in pairwise(MOTION):
        ratio = found[(found[:, 0] >= low) & (found[:, 0] < high), 1]
        if ratio.size:
            entries = " | ".join(f"{np.quantile(ratio, share):.2f}" for share in (0.5, 0.1, 0.9))
            print(f"| {low:g}–{high:g} | {ratio.size} | {entries} |")


if __name__ == "__main__":
    main()
