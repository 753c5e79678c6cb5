"""Run readers on changed files, each in a forked process with limits of memory and time.

    python tests/helpers/fuzzing.py [--seed N] [--times N] [--keep] [READER ...]

What is neither read nor refused in one line is printed; ``--keep`` adds it to the corpus (``tests/corpus``), which the
tests read again from then on.
"""

import argparse
import hashlib
import os
import random
import resource
import select
import signal
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from fuzzed_readers import READERS, Reader, import_readers
from mutations import mutated

sys.path.append(str(Path(__file__).parents[1] / "video" / "foreign"))  # makers of whole files

CORPUS = Path(__file__).parents[1] / "corpus"
READ, REFUSED = "read", "refused: "
PROCESSOR, PATIENCE = 20.0, 300.0  # [s] that one file may take, of the processor and by the clock
MEMORY, LIMIT = "2", 3 << 30  # [GB] that readers may plan with, bytes that they get


def kept(name: str) -> list[bytes]:
    """Files that this reader once failed on."""
    return [path.read_bytes() for path in sorted((CORPUS / name).glob("*"))]


def changed(name: str, whole: bytes, seed: int, times: int) -> Iterator[bytes]:
    """Copies of a whole file with changes that are the same every time."""
    chance = random.Random(f"{seed} {name}")
    for _ in range(READERS[name].cases * times):
        yield mutated(whole, chance, READERS[name].text)


def tried(name: str, contents: list[bytes]) -> list[str]:
    """How each content ends: read, refused with its line, or what went wrong."""
    ends: list[str] = []
    while len(ends) < len(contents):
        ends += _some(READERS[name], contents[len(ends) :])
    return ends


def _some(one: Reader, contents: list[bytes]) -> list[str]:
    """The same of the first of them, up to one that ends the process."""
    ear, mouth = os.pipe()
    child = os.fork()
    if not child:
        os.close(ear)
        _read_all(one, contents, mouth)
    os.close(mouth)
    ends, said = [], b""
    while len(ends) < len(contents):
        ready, _, _ = select.select([ear], [], [], PATIENCE)
        part = os.read(ear, 1 << 16) if ready else b""
        said += part
        *lines, said = said.split(b"\n")
        ends += [line.decode(errors="replace") for line in lines]
        if not part:
            os.kill(child, signal.SIGKILL)
            ends.append("its process died, or took too long" if ready else f"it did not end in {PATIENCE:g} s")
            break
    os.close(ear)
    os.waitpid(child, 0)
    return ends


def _read_all(one: Reader, contents: list[bytes], mouth: int) -> None:
    """In the child: read every content, and say in one line how it ended."""
    from vibrissa import reader_process

    reader_process.PATIENCE = 60.0
    os.environ["VIBRISSA_MEMORY"] = MEMORY
    resource.setrlimit(resource.RLIMIT_DATA, (LIMIT, LIMIT))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    with tempfile.TemporaryDirectory() as folder:
        path = one.make(Path(folder))
        for content in contents:
            path.write_bytes(content)
            signal.setitimer(signal.ITIMER_PROF, PROCESSOR)  # whose signal ends the process, whatever it is doing
            os.write(mouth, ending(one, path).encode() + b"\n")
    os._exit(0)


def ending(one: Reader, path: Path) -> str:
    """How a file ends in its reader."""
    from vibrissa.errors import InputError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            one.read(path)
    except InputError as error:
        line = str(error)
        return f"{REFUSED}{line}" if line and "\n" not in line else f"more than one line: {line!r}"
    except BaseException as error:
        step = error.__traceback__
        while step and step.tb_next:
            step = step.tb_next
        place = f"{Path(step.tb_frame.f_code.co_filename).name}:{step.tb_lineno}" if step else "?"
        return f"{type(error).__name__} at {place}: {error}".replace("\n", " ")[:300]
    return READ


def wrong(end: str) -> bool:
    """Whether a file was neither read nor refused in one line."""
    return end != READ and not end.startswith(REFUSED)


def whole_file(name: str) -> bytes:
    """A whole file of this reader; it is read."""
    with tempfile.TemporaryDirectory() as folder:
        return READERS[name].make(Path(folder)).read_bytes()


def main() -> None:
    """Print what goes wrong."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("readers", nargs="*")
    asked.add_argument("--seed", type=int, default=0)
    asked.add_argument("--times", type=int, default=1, help="cases, over those of the tests")
    asked.add_argument("--keep", action="store_true", help="add what goes wrong to the corpus")
    given = asked.parse_args()
    import_readers()
    failed = 0
    for name in given.readers or READERS:
        whole = whole_file(name)
        contents = [whole, *kept(name), *changed(name, whole, given.seed, given.times)]
        ends = tried(name, contents)
        count = Counter("wrong" if wrong(end) else end.partition(":")[0] for end in ends)
        if ends[0] != READ:
            count["wrong"] += 1
            print(f"{name}: the whole file: {ends[0]}")
        failed += count["wrong"]
        print(f"{name}: {dict(count)}", flush=True)
        for content, end in zip(contents, ends, strict=True):
            if wrong(end):
                print(f"    {end}", flush=True)
                if given.keep:
                    place = CORPUS / name
                    place.mkdir(parents=True, exist_ok=True)
                    (place / hashlib.sha256(content).hexdigest()[:12]).write_bytes(content)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
