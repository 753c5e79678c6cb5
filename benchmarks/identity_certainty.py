"""Weights of the certainty of names, from movies whose whiskers are known.

    .venv/bin/python benchmarks/identity_certainty.py FOLDER [--seeds 50] [--frames 200] [--kinds paw,pole]

The movies are those of ``whisking_movies.py``. What speaks for each name of a whisker, and whether it is right by the
rule of ``identity_scores.py``, goes to FOLDER/<kind>-<seed>.npz, both for one linking alone and for the names on which
all linkings agree; what is there is not made again. Names of hairs are left out, and each movie counts alike. Printed
are the weights of ``video/link/certainty.py`` fitted anew, and what those of the agreed names come to, as the linker
has them and in movies of other seeds than those that they were fitted to (five parts): of all names the share that is
called at least so sure, and of these the share that is right. The weights of agreement depend on those of one linking:
after a change of these make all anew.
"""

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from identity_scores import SHARE, Lines, Match, hairs, lines_of, matched, named_table, whisker_of
from scipy.optimize import minimize
from scipy.special import expit, logit
from whisking_movies import KINDS, scene_of

from vibrissa.video.camera.pad.filming import film
from vibrissa.video.camera.pad.truth import scene_truth
from vibrissa.video.find.movie_segments import LineSearch, find_segments
from vibrissa.video.link.certainty import AGREED, agreement
from vibrissa.video.link.thorough_linking import link_thoroughly

PARTS, LEVELS = 5, (0.8, 0.9, 0.95, 0.99)
RIDGE = 1e-3  # of the squared weights of evidence in units of its scatter


class Claims(NamedTuple):
    """Names of one movie: kind and seed; of one linking alone the evidence (n, 6), and whether each is right (n,); of
    the agreed names the log odds of the mean (m, 1), and whether each is right (m,)."""

    kind: str
    seed: int
    evidence: np.ndarray
    right: np.ndarray
    odds: np.ndarray
    agreed: np.ndarray


def claims(segments: xr.Dataset, truth: xr.Dataset) -> dict[str, np.ndarray]:
    """What the linker says, and whether it is right."""
    segments, linking = link_thoroughly(segments)
    true = lines_of(truth)
    match = matched(lines_of(segments), true, int(true.whisker.max()) + 1)
    found = lines_of(segments, linking.identity())
    some, agreed = judged(found, match, int(truth.attrs["frames"]))
    odds = (logit(found.probability[some]) - AGREED[0]) / AGREED[1]
    linking.others = None  # one linking alone
    names, found = linking.names(), lines_of(segments, linking.identity())
    evidence = np.nansum([one.evidence for one in names], axis=0)
    known = np.isfinite([one.evidence[:, 0] for one in names]).any(axis=0)
    mine, right = judged(found, match, int(truth.attrs["frames"]))
    keep = known[mine]
    return {"evidence": evidence[mine[keep]], "right": right[keep], "odds": odds[:, None], "agreed": agreed}


def judged(found: Lines, match: Match, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Segments with a name that is no hair's, and whether it is right."""
    right, given = named_table(found, match, frames)
    hair = hairs(found, match, len(given))
    right[hair] = False
    some = np.flatnonzero(found.whisker >= 0)
    some = some[~hair[found.whisker[some]]]
    mine = whisker_of(right)[found.whisker[some]]
    return some, (mine >= 0) & (match.at[some, mine] >= SHARE * np.diff(found.ends)[some])


def stored(folder: Path, kind: str, seed: int, frames: int) -> Claims:
    """Claims of a movie, made if they are not there."""
    path = folder / f"{kind}-{seed}.npz"
    if not path.is_file():
        scene = scene_of(kind, seed)
        truth = scene_truth(scene, frames, least_contrast=0.0).segments
        movie = np.concatenate(list(film(scene, frames)))
        np.savez(path, **claims(find_segments(movie, LineSearch(polarity=scene.polarity)), truth))
        print(path, file=sys.stderr)
    with np.load(path) as file:
        return Claims(kind, seed, *(file[name] for name in Claims._fields[2:]))


def fitted(terms: list[np.ndarray], rights: list[np.ndarray]) -> np.ndarray:
    """Weights of largest likelihood: of 1, and of each term (n, k) of all movies."""
    right = np.concatenate(rights)
    weight = np.concatenate([np.full(one.size, 1 / one.size / len(rights)) for one in rights])
    every = np.concatenate(terms)
    scale = np.where(np.ptp(every, axis=0) > 0, every.std(axis=0), 1.0)
    every = np.column_stack([np.ones(right.size), every / scale])

    def cost(weights: np.ndarray) -> tuple[float, np.ndarray]:
        odds, ridge = every @ weights, RIDGE * np.append(0, weights[1:])
        of = np.logaddexp(0, np.where(right, -odds, odds))
        return weight @ of + ridge @ weights, every.T @ (weight * (1 / (1 + np.exp(-odds)) - right)) + 2 * ridge

    best = minimize(cost, np.zeros(every.shape[1]), jac=True, method="L-BFGS-B").x
    return best / np.append(1, scale)


def agreement_weights(some: list[Claims]) -> np.ndarray:
    """Weights (2,) of the mean over linkings."""
    return fitted([one.odds for one in some], [one.agreed for one in some])


def held_out(every: list[Claims]) -> list[np.ndarray]:
    """Certainty of each movie's agreed names by the weights of movies of other seeds."""
    weights = [agreement_weights([one for one in every if one.seed % PARTS != part]) for part in range(PARTS)]
    return [agreement(expit(one.odds[:, 0]), weights[one.seed % PARTS]) for one in every]


def row(name: str, sure: np.ndarray, right: np.ndarray) -> str:
    """A line of the table."""
    entries = [f"{right.size}", f"{sure.mean():.3f}", f"{right.mean():.3f}"]
    for level in LEVELS:
        of = right[sure >= level]
        entries.append(f"{of.size / right.size:.2f}: {of.mean():.3f}" if of.size else "–")
    return "| " + " | ".join([name, *entries]) + " |"


def main() -> None:
    """Make what is missing, fit, and print."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("folder", type=Path)
    words.add_argument("--seeds", type=int, default=50)
    words.add_argument("--frames", type=int, default=200)
    words.add_argument("--kinds", default=",".join(KINDS))
    asked = words.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    kinds = asked.kinds.split(",")
    every = [stored(asked.folder, kind, seed, asked.frames) for kind in kinds for seed in range(asked.seeds)]
    for name, weights in (
        ("WEIGHTS", fitted([one.evidence for one in every], [one.right for one in every])),
        ("AGREED", agreement_weights(every)),
    ):
        print(f"{name} = [{', '.join(f'{one:.3g}' for one in weights)}]")
    linker = [agreement(expit(one.odds[:, 0])) for one in every]
    for title, sure in (("weights of the linker", linker), ("weights of other seeds", held_out(every))):
        table(title, every, sure)


def table(title: str, every: list[Claims], sure: list[np.ndarray]) -> None:
    """Print a line for each kind of movie, and one for all."""
    levels = " | ".join(f"from {one}" for one in LEVELS)
    head = f"| movies | names | mean certainty | right | {levels} |"
    print("", title, head, (4 + len(LEVELS)) * "|---" + "|", sep="\n")
    for kind in dict.fromkeys(one.kind for one in every):
        mine = [n for n, one in enumerate(every) if one.kind == kind]
        print(row(kind, np.concatenate([sure[n] for n in mine]), np.concatenate([every[n].agreed for n in mine])))
    print(row("all", np.concatenate(sure), np.concatenate([one.agreed for one in every])))


if __name__ == "__main__":
    main()
