"""What marks mend: a person marks the longest wrong stretch of a whisking movie, again and again.

.venv/bin/python benchmarks/known_lines.py FOLDER [--seeds 50] [--frames 200] [--kinds one_pad,moving_head]

Movies are those of ``whisking_truth.py``, linked without marks. The person knows the truth, and looks for the longest
stretch of frames in which a whisker's own line has not its name, which is elsewhere or absent (gaps of up to three
frames do not end it), and marks the line in its middle; stretches of lines that two whiskers share cannot be mended
by a mark, nor can a whisker without a name. FOLDER/<kind>.csv holds a row for each seed and number of marks; rows that
are there are not made again. ``to mend`` are whisker-frames of 1,000 that are left in such stretches; ``harmed`` are
marks after which these have become more. At the end a table is printed; ``right`` are the shares that are
right of the names that marks have changed about them: of the whisker marked, where they are called 0.97, 0.75 and 0.55
sure, and of the one exchanged with it.
"""

import argparse
import csv
from pathlib import Path

import numpy as np
import xarray as xr
from identity_scores import SEEN, SHARE, Lines, Match, hairs, lines_of, matched, named_table, of_owners, shares
from identity_scores import whisker_of as owners_of
from tracking_truth import write
from whisking_movies import KINDS, scene_of
from whisking_truth import mean

from vibrissa.video.camera.pad.filming import film
from vibrissa.video.camera.pad.truth import scene_truth
from vibrissa.video.find.movie_segments import LineSearch, find_segments
from vibrissa.video.link.known.known_lines import LIKELY, PLAIN, UNLIKELY, LineNames
from vibrissa.video.link.known.known_names import chains_of, names_with
from vibrissa.video.link.known.renamed_linking import line_names
from vibrissa.video.link.thorough_linking import link_thoroughly
from vibrissa.video.link.whisker_linking import Linking

MARKS = (0, 1, 2, 4, 8, 16)
LEAST = 20  # points of a line that a person would mark
MIXED = 0.3  # share of a name's line that is at its whisker, from which on a mark cannot mend it
PROBABLE = "plain", "likely", "unlikely", "exchanged"
BRIDGED = 3  # frames between two parts of a stretch


def linked_movie(kind: str, seed: int, frames: int) -> tuple[xr.Dataset, Linking, xr.Dataset]:
    """Lines of a rendered movie, their linking, and the truth."""
    scene = scene_of(kind, seed)
    movie = np.concatenate(list(film(scene, frames)))
    lines, linking = link_thoroughly(find_segments(movie, LineSearch(polarity=scene.polarity)))
    return lines, linking, scene_truth(scene, frames, least_contrast=0.0).segments


class Person:
    """Who marks lines of a movie whose truth is known; names keep the whiskers that they have at first."""

    def __init__(self, lines: xr.Dataset, linking: Linking, truth: xr.Dataset, match: Match | None = None) -> None:
        self.lines, self.chains, self.names = lines_of(lines), chains_of(linking), line_names(linking)
        true, self.frames = lines_of(truth), int(truth.attrs["frames"])
        whiskers = int(true.whisker.max()) + 1
        self.match = matched(self.lines, true, whiskers) if match is None else match
        size = np.zeros((whiskers, self.frames))
        np.add.at(size, (true.whisker, true.frame), np.diff(true.ends))
        self.can, self.known = size >= SEEN, {}
        self.changed = {f"{kind}_{what}": 0 for kind in PROBABLE for what in ("names", "right")}
        right, _ = self._table()
        right[hairs(self.found, self.match, len(right))] = False
        self.owner = owners_of(right)

    @property
    def found(self) -> Lines:
        """Lines with their names."""
        names: LineNames = self.names
        return self.lines._replace(whisker=names.whisker, other=names.other, probability=names.sure)

    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        return named_table(self.found, self.match, self.frames, len(self.chains.roster))

    def scores(self) -> dict[str, float]:
        """How many frames are followed, how many names are wrong, and how much is left to mend."""
        right, given = self._table()
        own, hair = of_owners(right, self.owner), hairs(self.found, self.match, len(right))
        left = sum(int((line >= 0).sum()) for line in self.wrong_lines(own).values())
        return {
            "followed": float(shares(own, self.can).mean()),
            "wrong": 1000 * float(1 - own.sum() / given[~hair].sum()),
            "to_mend": 1000 * left / self.can.sum(),
        }

    def wrong_lines(self, own: np.ndarray) -> dict[int, np.ndarray]:
        """Line of its whisker that each name should have but has not, in each frame, −1 for none."""
        at, size, out = self.match.at, np.diff(self.lines.ends), {}
        for name, whisker in enumerate(self.owner):
            if whisker < 0:
                continue
            others = np.delete(at, whisker, axis=1).max(axis=1, initial=0)
            alone = np.flatnonzero((at[:, whisker] >= SHARE * size) & (size >= LEAST) & (others < SHARE * size))
            line = np.full(self.frames, -1)
            order = alone[np.argsort(size[alone], kind="stable")]
            line[self.lines.frame[order]] = order
            mine = np.flatnonzero((self.names.whisker == name) | (self.names.other == name))
            mixed = mine[at[mine, whisker] >= MIXED * size[mine]]
            wrong = ~own[whisker] & ~np.isin(np.arange(self.frames), self.lines.frame[mixed])
            out[name] = np.where(wrong, line, -1)
        return out

    def mark(self) -> bool:
        """Mark the line in the middle of the longest wrong stretch; False if there is none."""
        best = 0, -1, -1
        for name, line in self.wrong_lines(of_owners(self._table()[0], self.owner)).items():
            frames = np.flatnonzero(line >= 0)
            for run in np.split(frames, np.flatnonzero(np.diff(frames) > BRIDGED) + 1):
                if run.size and line[run[run.size // 2]] not in self.known:
                    best = max(best, (run.size, name, int(line[run[run.size // 2]])))
        size, name, line = best
        if size:
            before = self.names.whisker
            self.chains, self.names = names_with(self.chains, self.names, np.array([line]), name, self.known)
            self.known[line] = name
            self._count(before, name)
        return size > 0

    def _count(self, before: np.ndarray, marked: int) -> None:
        """Count names that a mark has changed about it, of its whisker and of the one exchanged, and the right ones."""
        now, size = self.names.whisker, np.diff(self.lines.ends)
        changed = np.setdiff1d(np.flatnonzero((now != before) & (now >= 0)), list(self.known))
        sure = self.names.sure[changed]
        at = np.where(self.owner[now[changed]] >= 0, self.match.at[changed, self.owner[now[changed]]], 0)
        right = at >= SHARE * size[changed]
        own = now[changed] == marked
        for kind, some in zip(
            PROBABLE, (own & (sure == PLAIN), own & (sure == LIKELY), own & (sure == UNLIKELY), ~own), strict=True
        ):
            self.changed[f"{kind}_names"] += int(some.sum())
            self.changed[f"{kind}_right"] += int(right[some].sum())


def rows(kind: str, seed: int, person: Person) -> list[dict[str, object]]:
    """Scores after each number of marks."""
    out, harmed, last = [], 0, np.inf
    for count in range(max(MARKS) + 1):
        if count and not person.mark():
            now = out[-1]
        else:
            now = person.scores()
            harmed += now["to_mend"] > last + 1e-9
            last = now["to_mend"]
            now |= {"marks": len(person.known), "harmed": harmed, **person.changed}
        if count in MARKS:
            out.append({**now, "kind": kind, "seed": seed, "allowed": count})
    return out


def share_of(value: dict[str, np.ndarray], what: str) -> str:
    """Share of the names changed that is right."""
    names = value[f"{what}_names"].sum()
    return f"{value[f'{what}_right'].sum() / names:.2f}" if names else "–"


def main() -> None:
    """Mark movies, and print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--kinds", default="one_pad,moving_head", help=", ".join(KINDS))
    words = parser.parse_args()
    words.folder.mkdir(parents=True, exist_ok=True)
    head = "movie", "seeds", "marks at most", "set", "followed", "wrong per 1,000", "to mend per 1,000", "harmed"
    print("|", " | ".join([*head, "right"]), "|")
    print("|---" * (len(head) + 1) + "|")
    for kind in words.kinds.split(","):
        path = words.folder / f"{kind}.csv"
        done = list(csv.DictReader(path.read_text().splitlines())) if path.is_file() else []
        for seed in sorted(set(range(words.seeds)) - {int(row["seed"]) for row in done}):
            done += rows(kind, seed, Person(*linked_movie(kind, seed, words.frames)))
            write(done, path)
        for allowed in MARKS:
            some = [row for row in done if int(row["allowed"]) == allowed]
            value = {name: np.array([float(row[name]) for row in some]) for name in some[0] if name != "kind"}
            cells = [mean(value["followed"], 3), mean(value["wrong"], 1), mean(value["to_mend"], 1)]
            share = f"{int(value['harmed'].sum())} of {int(value['marks'].sum())}"
            right = ", ".join(share_of(value, what) for what in PROBABLE)
            cells = [kind, str(len(some)), str(allowed), f"{value['marks'].mean():.1f}", *cells, share, right]
            print("|", " | ".join(cells), "|")


if __name__ == "__main__":
    main()
