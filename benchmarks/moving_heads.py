"""Whiskers of a head that moves, linked with and without head coordinates; the head of rendered scenes, found.

Run with: python benchmarks/moving_heads.py [--seeds 50] [--rendered 6]

Pads are those of ``whisker_linking.py``: 8 whiskers, 150 frames, moved as a whole by a smooth random motion of 15 px
and 5° (standard deviations). The head is known exactly, or within 1 px and 1° in every frame,
as it is or smoothed as tracked points are, or is not given and found from the lines. Rendered
scenes: 24 whiskers, 100 frames of 320 × 240 pixels, a head that moves by 2 mm and turns by 5°.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))

from moved_heads import head_error, moved, scene
from simulated_segments import Pad, score, simulate

from vibrissa.head_pose import HeadPose, with_head
from vibrissa.quantities import dataset
from vibrissa.quantities.identity import SURE
from vibrissa.video.camera.pad.filming import film
from vibrissa.video.find.head_finding import find_head
from vibrissa.video.foreign.head_points import smoothed
from vibrissa.video.link.whisker_linking import link_segments

FRAMES = 150


def linked(segments, truth, head: HeadPose | None) -> tuple[float, float]:
    """Share of visible frames followed, share of claimed frames under a wrong name."""
    if head is not None:
        segments = with_head(segments.merge(dataset(time=np.arange(FRAMES) / 200)), head)
    identity = link_segments(segments).identity()
    sure = identity.segment_probability.values >= SURE
    return score(segments, truth, np.where(sure, identity.segment_whisker.values, -1))[:2]


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--rendered", type=int, default=6)
    asked = parser.parse_args()
    names = ("exact", "1 px, 1°", "smoothed", "not given")
    rows: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for seed in range(asked.seeds):
        segments, truth = simulate([Pad(whiskers=8, frames=FRAMES)], seed)
        segments, head = moved(segments, seed)
        rng = np.random.default_rng([seed, 9])
        noisy = HeadPose(*(one + rng.standard_normal(FRAMES) for one in head))
        for name, pose in zip(rows, (head, noisy, smoothed(noisy), None), strict=True):
            rows[name].append(linked(segments, truth, pose))
    print(f"head       followed [%]   wrong name [%] (mean and worst of {asked.seeds})")
    for name, some in rows.items():
        followed, wrong = 100 * np.array(some).T
        print(f"{name:10s} {followed.mean():5.1f} {followed.min():5.1f}   {wrong.mean():5.2f} {wrong.max():5.1f}")
    errors = []
    for seed in range(asked.rendered):
        one = scene(seed)
        errors.append(head_error(find_head(film(one, 100)), one, 100))
    print("\nfound head: seed, frames known, rms of the place [px], of the turn [°]")
    for seed, (known, place, turn) in enumerate(errors):
        print(f"{seed}  {known}  {place:.2f}  {turn:.2f}")


if __name__ == "__main__":
    main()
