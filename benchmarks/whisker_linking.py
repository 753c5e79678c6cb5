"""Whiskers linked over simulated pads without marks, against truth and against a linking by the nearest direction.

Run with: python benchmarks/whisker_linking.py [--seeds 7] [--kinds "4 whiskers" ...]

Eleven kinds of pads of 300, 400 or 1,200 frames: 4, 12 and 24 whiskers, a hard one (a fifth of the lines missing, a
third broken, eight false lines per frame), two sides of a face, one that points up, one whose head moves, one that a
paw hides, a dense one whose fan opens threefold, one whose whiskers drift as far as they are apart, a long one of this
kind. For each: pads whose whiskers were counted right, share of the visible frames followed, share of the claimed
frames under a wrong name, changes of name per 1,000 frames, and time; then how often lines of each probability are
right.
"""

from __future__ import annotations

import argparse
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))

from simulated_segments import Pad, Truth, main_segment, nearest_angle, score, simulate

from vibrissa.quantities.identity import SURE
from vibrissa.video.link.whisker_linking import link_segments

KINDS = {
    "4 whiskers": [Pad(whiskers=4)],
    "12 whiskers": [Pad()],
    "12, hard": [Pad(missing=0.2, broken=0.3, junk=8, own=2.0)],
    "24 whiskers": [Pad(whiskers=24, spread=110)],
    "two sides, 8 each": [
        Pad(whiskers=8, centre=(350.0, 240.0)),
        Pad(whiskers=8, centre=(290.0, 240.0), direction=180.0, mirror=True),
    ],
    "10, upward": [Pad(whiskers=10, direction=-90.0, centre=(320.0, 330.0), spread=120)],
    "10, moving head": [Pad(whiskers=10, head=6.0)],
    "10, paw": [Pad(whiskers=10, paw=True)],
    "14, dense fan": [
        Pad(whiskers=14, spread=50, opening=0.6, amplitude=15, own=1.0, missing=0.15, drift=1.5, carried=0.3)
    ],
    "13, drifting long": [
        Pad(
            whiskers=13,
            frames=1200,
            spread=75,
            opening=0.5,
            amplitude=14,
            own=2.2,
            missing=0.4,
            broken=0.2,
            drift=6.0,
            carried=0.4,
        )
    ],
    "12, drifting": [Pad(frames=300, spread=75, opening=0.35, amplitude=15, missing=0.2, drift=4.0, carried=0.4)],
}
EDGES = (0.0, 0.8, 0.9, 0.94, 0.96, 0.98, 0.99, 0.995, 0.999, 1.01)


def hits(truth: Truth, whisker: np.ndarray, sure: np.ndarray, main: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Probability of the main line of each whisker in each frame, and whether it is right."""
    chance, right = [], []
    for mine in (row[row >= 0] for row in main):
        real = truth.segment[mine]
        if (real >= 0).any():
            chance.append(sure[mine])
            right.append(real == np.bincount(real[real >= 0]).argmax())
    return np.concatenate(chance), np.concatenate(right)


def one(pads: list[Pad], seed: int) -> tuple[tuple[float, ...], np.ndarray, np.ndarray]:
    """Score of one simulated movie, and its probabilities."""
    segments, truth = simulate(pads, seed)
    begin = time.perf_counter()
    linking = link_segments(segments)
    identity = linking.identity()
    spent = time.perf_counter() - begin
    whisker, sure = identity.segment_whisker.values, identity.segment_probability.values
    found = score(segments, truth, np.where(sure >= SURE, whisker, -1))
    plain = score(segments, truth, nearest_angle(segments, len(truth.visible))) if len(pads) == 1 else None
    row = (found.found == len(truth.visible), *found[:3], plain.wrong if plain else np.nan, spent)
    return row, *hits(truth, whisker, sure, main_segment(segments, whisker, linking.whiskers))


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=7)
    parser.add_argument("--kinds", nargs="*", choices=KINDS, default=list(KINDS))
    asked = parser.parse_args()
    seeds = asked.seeds
    chance, right = [], []
    print("pad                  counted  followed  wrong [%]  changes  nearest, wrong [%]  time [s]")
    for name, pads in ((kind, KINDS[kind]) for kind in asked.kinds):
        results = [one(pads, seed) for seed in range(seeds)]
        counted, followed, wrong, changes, plain, spent = np.mean([row for row, _, _ in results], axis=0)
        worst = 100 * max(row[2] for row, _, _ in results)
        print(
            f"{name:20s} {counted * seeds:3.0f}/{seeds}  {100 * followed:8.1f}  {100 * wrong:5.2f} (most {worst:.1f})"
            f"  {changes:7.1f}  {100 * plain:6.0f}  {spent:8.1f}"
        )
        chance += [c for _, c, _ in results]
        right += [r for _, _, r in results]
    sure, hit = np.concatenate(chance), np.concatenate(right)
    print("\nprobability      lines  said   right")
    for low, high in pairwise(EDGES):
        here = (sure >= low) & (sure < high)
        if here.any():
            print(f"{low:5.3f}–{min(high, 1):5.3f}  {here.sum():8d}  {sure[here].mean():.4f}  {hit[here].mean():.4f}")


if __name__ == "__main__":
    main()
