"""Silently corrupted movies, datasets and results: what the verb that reads them finds, by kind of file.

    .venv/bin/python benchmarks/corrupted.py [--each 2] [--seed 0] [WORD ...]

One byte of the content of a whole file (pixels, samples, rows, chunks; no header) takes another value; then the verb
reads it. ``found``: it ends in one line; ``harmless``: its results are as without the damage; ``unseen``: they differ,
and nothing was said. Prints CSV; WORD: only
kinds whose name has it.
"""

# ruff: noqa: E501 (a kind is one line)
from __future__ import annotations

import argparse
import csv
import math
import os
import random
import re
import shlex
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parent))
import damage
import malformed
from malformed import CONE, TRIALS

Place = tuple[Path, int, int]  # a file, the start of a part of its content, its bytes
TRACK = "track {} --frame-rate 500 --pixel-size 1e-4 --tracking follow --seed-point 80,60 --out out.nc"
STUDY = "study"  # folder of a finished one, of malformed.py


class Kind(NamedTuple):
    """A kind of input: its name, the whole file or folder, the verb, where its content is, and what guards it."""

    name: str
    whole: str
    command: str
    places: Callable[[Path], Iterator[Place]]
    guard: str


def arrays(path: Path) -> Iterator[Place]:
    """Chunks of all arrays of numbers of HDF5."""
    import h5py

    found: list[h5py.Dataset] = []
    with h5py.File(path) as file:
        file.visititems(lambda _, one: found.append(one) if isinstance(one, h5py.Dataset) else None)
        for one in (one for one in found if one.size and one.size > 1 and one.dtype.kind in "biuf"):
            if one.chunks is None:
                yield from [(path, one.id.get_offset(), one.id.get_storage_size())] if one.id.get_offset() else []
                continue
            chunks = (one.id.get_chunk_info(k) for k in range(one.id.get_num_chunks()))
            yield from ((path, chunk.byte_offset, chunk.size) for chunk in chunks)


def results(folder: Path) -> Iterator[Place]:
    """The same of every dataset of a study."""
    for path in sorted(folder.rglob("*.nc")):
        yield from arrays(path)


def chunks(folder: Path) -> Iterator[Place]:
    """Files of the chunks of Zarr."""
    for path in sorted(folder.rglob("[0-9]*")):
        yield path, 0, path.stat().st_size


def below(head: Callable[[bytes], int]) -> Callable[[Path], Iterator[Place]]:
    """All that follows a head of so many bytes."""

    def places(path: Path) -> Iterator[Place]:
        content = path.read_bytes()
        start = head(content)
        yield path, start, len(content) - start

    return places


def lines(count: int) -> Callable[[Path], Iterator[Place]]:
    """All below so many lines."""
    return below(lambda content: [one.end() for one in re.finditer(b"\n", content)][count - 1])


SAMPLES = below(lambda content: content.index(b"data") + 8)
VALUES = below(lambda content: content.index(b"\n") + 1)  # of NumPy
MOVIES = {  # of damage.py, and what guards their frames
    "FFV1, MKV": "CRC of each slice",
    "PNG, MOV": "CRC of each chunk",
    "TIFF, deflate": "Adler-32 of each strip",
    "H.264 CRF 18, MP4": "none: the syntax alone",
    "MPEG-4, AVI": "none: the syntax alone",
    "MJPEG, AVI": "none: the syntax alone",
    "uncompressed, AVI": "none",
    "NumPy array": "none",
}
SPIKES = f"neural --spikes {{}} --stimulus stimulus.csv {TRIALS}"
KINDS = (
    Kind("profile", "profile.nc", f"decompose {{}} {CONE} --contact 0.29 --out out.nc", arrays, "SHA-256"),
    Kind("map of Zarr", "map.zarr", "show {}", chunks, "CRC-32 of each chunk, none of which it reads"),
    Kind("command, WAV", "command.wav", f"surround --spikes spikes.csv --command {{}} {TRIALS} --out out.nc", SAMPLES, "SHA-256 in its sidecar"),
    Kind("results, continued", STUDY, "run filmed.toml --out {} --scheduler synchronous", results, "computed again: nothing of one sweep is kept"),
    Kind("results, drawn", STUDY, "figure 4 --results {} --out out.png", results, "SHA-256"),
    Kind("profile of another program, NetCDF", "foreign.nc", f"decompose {{}} {CONE} --contact 0.29 --out out.nc", arrays, "none: finite places, ascending time"),
    Kind("spikes, NWB", "spikes.nwb", f"{SPIKES} --out out.nc", arrays, "none: finite times, within the trials"),
    Kind("spikes, CSV", "spikes.csv", f"{SPIKES} --out out.nc", lines(1), "none: numbers alone"),
    Kind("counts, NumPy", "counts.npy", f"{SPIKES} --counted-bin 10ms --out out.nc", VALUES, "none: counts are whole, from 0"),
    Kind("envelope, CSV", "stimulus.csv", f"neural --spikes spikes.csv --stimulus {{}} {TRIALS} --out out.nc", lines(1), "none: numbers, ascending time"),
    Kind("tracks of DeepLabCut, CSV", "dlc.csv", "import-tracks {} --frame-rate 500 --pixel-size 1e-4 --out out.nc", lines(3), "none: numbers alone"),
    Kind("signal, WAV", "signal.wav", "sensor {} --kind moment --signal-unit 'full scale' --calibration 1 --guess 100Hz --out out.nc", SAMPLES, "none"),
)  # fmt: skip


def main() -> None:
    """Print the table."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("words", nargs="*")
    asked.add_argument("--each", type=int, default=2, help="corrupted files of each kind")
    asked.add_argument("--seed", type=int, default=0)
    given = asked.parse_args()
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["input", "verb", "guard", "corrupted", "found", "harmless", "unseen"])
    total: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        malformed.whole_files(Path(folder))
        made_too()
        for kind in (*movies(), *KINDS):
            if not given.words or any(word in kind.name for word in given.words):
                counts = tally(kind, given.each, random.Random(f"{given.seed} {kind.name}"))
                total += counts
                counted = [counts[end] for end in ("found", "harmless", "unseen")]
                table.writerow([kind.name, kind.command.split()[0], kind.guard, given.each, *counted])
                sys.stdout.flush()
    print(f"{sum(total.values())} corrupted: {dict(total)}", file=sys.stderr)


def made_too() -> None:
    """A file that ``malformed.py`` does not make."""
    from vibrissa.warm import MAP

    malformed._made(f"{MAP} --scheduler synchronous --out map.zarr")


def movies() -> Iterator[Kind]:
    """A movie of each kind, each in a folder of its own."""
    frames = damage.scene()
    for name, guard in MOVIES.items():
        folder = Path(re.sub(r"\W+", "-", name))
        folder.mkdir()
        make = damage.OTHERS.get(name)
        path, coded = make(folder, frames) if make else damage.contained(folder, name, frames)
        yield Kind(name, str(path), TRACK, lambda path, coded=coded: ((path, *span) for span in coded), guard)


def tally(kind: Kind, count: int, chance: random.Random) -> Counter[str]:
    """Outcomes of so many damages of one kind."""
    places, true = list(kind.places(Path(kind.whole))), outcome(kind)
    if true.code:
        sys.exit(f"{kind.name}: {true.said}")
    sizes = [size for _, _, size in places]
    found: Counter[str] = Counter()
    for _ in range(count):
        path, start, size = chance.choices(places, sizes)[0]
        whole = path.read_bytes()
        damaged = bytearray(whole)
        damaged[chance.randrange(start, start + size)] ^= chance.randrange(1, 256)
        path.write_bytes(damaged)
        found[judged(true, outcome(kind))] += 1
        path.write_bytes(whole)
    return found


class Outcome(NamedTuple):
    """What a verb said, and what it made."""

    code: int
    said: str
    made: dict[str, bytes]


def outcome(kind: Kind) -> Outcome:
    """Run the verb; of a study on a copy of its folder."""
    given = Path(kind.whole)
    if kind.whole == STUDY:
        given = Path("copy")
        shutil.copytree(STUDY, given)
    end = malformed.ended(shlex.split(kind.command.replace("{}", str(given))), patience=math.inf)
    out = [*Path().glob("out.*"), *(given.rglob("*") if kind.whole == STUDY else ())]
    made = {str(path): path.read_bytes() for path in out if path.is_file()}
    for path in Path().glob("out.*"):
        path.unlink()
    shutil.rmtree("copy", ignore_errors=True)
    return Outcome(end.code, end.said, made)


def judged(true: Outcome, now: Outcome) -> str:
    """What a damage came to."""
    if now.code not in (0, 2) or "Traceback" in now.said:
        sys.exit(f"neither read nor refused: {now.said}")
    if now.code == 2:
        return "found"
    same = now.made == true.made and (bool(true.made) or now.said == true.said)
    return "harmless" if same else "unseen"


if __name__ == "__main__":
    main()
