"""Damaged and odd inputs for every reader: python benchmarks/malformed.py [--each N] [--seed N] [VERB ...].

Whole files of each kind are cut, flipped, filled, doubled, recoded and given extreme numbers; each goes through a verb
in a forked process with limits of time and memory. A case fails if it ends in a traceback or a fault, lasts 60 s, takes
4 GB, refuses in more than one last line, or leaves a file behind where it refused. What is read all the same is
counted: a text with other numbers is another input.
"""

from __future__ import annotations

import argparse
import math
import os
import random
import resource
import shlex
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

PATIENCE, MOST, PATCH = 60.0, 4e9, 64  # [s], [bytes], bytes of a patch
EXAMPLES = Path(__file__).parents[1] / "examples"
AT, CONE = "--contact 0.29 --base-angle 70deg", "--atlas C2"
TRIALS = "--trials 20"
VERBS = (  # a command with {} for the input, and a whole file of its kind
    ("whisker --diameters {}", "diameters.csv"),
    (f"scan {{}} {AT} {CONE} --speed 100mm/s --out out.nc", "grating.csv"),
    (f"scan {{}} {AT} {CONE} --speed 100mm/s --out out.nc", "ridges.csv"),
    (f"scan {{}} {AT} {CONE} --speed 100mm/s --x-unit m --z-unit m --levelling line --out out.nc", "heights.npy"),
    (f"whisking gaps.csv {{}} --speed 100mm/s {CONE} --out out.nc", "path.csv"),
    (
        "sensor {} --kind moment --signal-unit V --calibration 1 --guess 100Hz --column bridge_V --out out.nc",
        "robot.csv",
    ),
    ("sensor {} --kind moment --signal-unit 'full scale' --calibration 1 --guess 100Hz --out out.nc", "signal.wav"),
    ("track {} --frame-rate 500 --pixel-size 1e-4 --out out.nc", "movie.mkv"),
    ("track {} --frame-rate 500 --pixel-size 1e-4 --out out.nc", "movie.npy"),
    ("track {} --frame-rate 500 --pixel-size 1e-4 --out out.nc", "movie.tif"),
    (f"decompose {{}} {CONE} --contact 0.29 --out out.nc", "profile.nc"),
    ("kinematics {} --nose left --out out.nc", "foreign.nc"),
    ("import-tracks {} --frame-rate 500 --pixel-size 1e-4 --out out.nc", "dlc.csv"),
    (f"neural --spikes {{}} --stimulus stimulus.csv {TRIALS} --out out.nc", "spikes.csv"),
    (f"neural --spikes {{}} --stimulus stimulus.csv {TRIALS} --out out.nc", "spikes.nwb"),
    (f"neural --spikes {{}} --stimulus stimulus.csv {TRIALS} --counted-bin 10ms --out out.nc", "counts.npy"),
    (f"neural --spikes {{}} --stimulus stimulus.csv {TRIALS} --counted-bin 10ms --out out.nc", "counts.mat"),
    (f"neural --spikes spikes.csv --stimulus {{}} {TRIALS} --out out.nc", "stimulus.csv"),
    ("discriminate spikes.csv --textures {} --window 0 4 --out out.nc", "textures.csv"),
    ("quality --spikes {} --duration 100s --out out.nc", "spikes.nwb"),
    (f"surround --spikes spikes.csv --command {{}} {TRIALS} --out out.nc", "command.wav"),
    ("run {} --dry-run", "laboratory.toml"),
    ("study {}", "spikes.toml"),
    ("recordings {} --out out", "recorded.csv"),
    ("show {}", "profile.nc"),
)


class Ending(NamedTuple):
    """How a case ended."""

    code: int
    said: str
    seconds: float
    processor: float
    peak: int


def main() -> None:
    """Print the cases that fail, and the counts of each verb."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("verbs", nargs="*")
    asked.add_argument("--each", type=int, default=14, help="damaged files of each kind")
    asked.add_argument("--seed", type=int, default=0)
    given = asked.parse_args()
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        whole_files(Path(folder))
        for command, name in VERBS:
            if given.verbs and command.split()[0] not in given.verbs:
                continue
            rng = random.Random(f"{given.seed} {command} {name}")
            before = set(os.listdir())
            _made(command.replace("{}", name))  # the whole file is read; what is compiled is compiled
            _remove(set(os.listdir()) - before)
            whole, ends = Path(name).read_bytes(), Counter[str]()
            for k in range(given.each):
                how = rng.choice(DAMAGES if name.endswith((".csv", ".toml")) else DAMAGES[:BINARY])
                damaged = Path(f"damaged{k}{Path(name).suffix}")
                damaged.write_bytes(how(whole, rng))
                for beside in Path().glob(f"{name}.json"):
                    shutil.copy(beside, f"{damaged}.json")
                ends[judged(command, damaged, f"{how.__name__} {name}")] += 1
                damaged.unlink(missing_ok=True)
            print(f"{command.split()[0]} {name}: {dict(ends)}", flush=True)
            counts += ends
    print(f"{sum(counts.values())} cases: {dict(counts)}")


def judged(command: str, damaged: Path, what: str, *, every: bool = False) -> str:
    """Run one case; print it if it fails, or in any case; say how it ended."""
    before = set(os.listdir())
    end = ended(shlex.split(command.replace("{}", str(damaged))))
    left = set(os.listdir()) - before
    _remove(left)
    remarks = [line for line in end.said.splitlines() if line.startswith("vibrissa: ")]
    faults = {
        "hang": end.seconds > PATIENCE,
        "memory": end.peak > MOST,
        "crash": end.code < 0 and end.seconds <= PATIENCE and end.peak <= MOST,
        "traceback": "Traceback" in end.said or "a fault of vibrissa" in end.said,
        "left behind": end.code == 2 and bool(left),
        "no line": end.code == 2 and not remarks,
        "code": end.code not in (0, 2, 3) and end.code >= 0,
    }
    wrong = [name for name, found in faults.items() if found]
    if wrong or every:
        last = end.said.strip().splitlines()[-1:]
        seen = f"{end.seconds:.0f} s, {end.peak / 1e9:.1f} GB, left {sorted(left)}"
        print(
            f"{', '.join(wrong) or 'as it should be'}: {command.split()[0]} {what}: code {end.code}, {seen}: {last}",
            flush=True,
        )
    return wrong[0] if wrong else ("refused" if end.code == 2 else "read")


def _remove(names: set[str]) -> None:
    for one in names:
        shutil.rmtree(one) if Path(one).is_dir() else Path(one).unlink()


def ended(words: list[str], patience: float = PATIENCE) -> Ending:
    """Run a command line in a forked process."""
    output, start, peak = Path("said.txt"), time.monotonic(), 0
    child = os.fork()
    if not child:
        _be_the_command(words, output)
    while True:
        done, state, used = os.wait4(child, os.WNOHANG)
        seconds = time.monotonic() - start
        if done:
            break
        peak = max(peak, _resident(child))
        if seconds > patience or peak > MOST:
            os.killpg(child, signal.SIGKILL)
        time.sleep(0.02)
    said = output.read_text(errors="replace")
    output.unlink()
    return Ending(os.waitstatus_to_exitcode(state), said, seconds, used.ru_utime + used.ru_stime, peak)


def _be_the_command(words: list[str], output: Path) -> None:
    from vibrissa.cli import main as command_line

    os.setsid()
    file = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(file, 1)
    os.dup2(file, 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.argv, code = ["vibrissa", *words], 0
    try:
        command_line()
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 1
    except BaseException:
        import traceback

        traceback.print_exc()
        code = 99
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _resident(child: int) -> int:
    try:
        return int(Path(f"/proc/{child}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):
        return 0


def cut(whole: bytes, rng: random.Random) -> bytes:
    """End too early."""
    return whole[: rng.randrange(len(whole))]


def flipped(whole: bytes, rng: random.Random) -> bytes:
    """Flip one bit in each of some bytes."""
    damaged = bytearray(whole)
    for _ in range(rng.choice((1, 3, 30))):
        damaged[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def filled(whole: bytes, rng: random.Random) -> bytes:
    """A stretch of zeros, of ones or of noise, as of a bad sector."""
    place = rng.randrange(len(whole))
    patch = rng.choice((bytes(PATCH), b"\xff" * PATCH, rng.randbytes(PATCH)))
    return whole[:place] + patch + whole[place + PATCH :]


def doubled(whole: bytes, rng: random.Random) -> bytes:
    """A stretch twice."""
    place = rng.randrange(len(whole))
    return whole[:place] + whole[max(0, place - 10 * PATCH) :]


def shuffled(whole: bytes, rng: random.Random) -> bytes:
    """Two halves in the other order."""
    place = rng.randrange(len(whole))
    return whole[place:] + whole[:place]


def emptied(whole: bytes, rng: random.Random) -> bytes:
    """Nothing, or nothing but the start."""
    return whole[: rng.choice((0, 1, 8, 128))]


def extreme(whole: bytes, rng: random.Random) -> bytes:
    """One number that is none, or far beyond any."""
    words = whole.decode().split(",")
    for _ in range(3):
        value = rng.choice(("nan", "inf", "-inf", "1e999", "-1e308", "1e-320", "", "٣", "0x10", "1_000", "--1", '"'))
        words[rng.randrange(len(words))] = value
    return ",".join(words).encode()


def recoded(whole: bytes, rng: random.Random) -> bytes:
    """In another encoding, or with other ends of lines."""
    text = whole.decode()
    return rng.choice(
        (text.encode("utf-16"), text.encode("utf-32"), whole.replace(b"\n", b"\r"), b"\xef\xbb\xbf" + whole)
    )


def headless(whole: bytes, rng: random.Random) -> bytes:
    """A header that is lost, doubled or of other names."""
    first, _, rest = whole.partition(b"\n")
    return rng.choice(
        (rest, first + b"\n" + whole, first[::-1] + b"\n" + rest, first + b"\n", first * 500 + b"\n" + rest)
    )


def nested(whole: bytes, rng: random.Random) -> bytes:
    """A value nested too deeply, in a line that is too long."""
    return whole + b"\nx = " + b"[" * rng.choice((100, 5000, 200_000))


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    *(cut, flipped, filled, doubled, shuffled, emptied),
    *(extreme, recoded, headless, nested),
)
BINARY = 6  # of them are for files that are no text


def whole_files(folder: Path) -> None:
    """A file of each kind that the commands read."""
    import numpy as np
    from scipy.io import savemat, wavfile

    from vibrissa import warm
    from vibrissa.netcdf import load
    from vibrissa.video.io.movie import read_blocks, write_movie

    warm._write_inputs("movies")
    for path in EXAMPLES.glob("*.*"):
        if not (folder / path.name).exists():
            shutil.copy(path, folder)
    rng = np.random.default_rng(0)
    np.save("heights.npy", np.c_[np.arange(4000) * 1e-5, 1e-5 * rng.normal(size=4000).cumsum() / 30])
    wavfile.write("signal.wav", 2000, (1e4 * np.sin(np.arange(8000) / 3)).astype(np.int16))
    frames = np.concatenate(list(read_blocks("movie.mkv")))
    np.save("movie.npy", frames)
    write_movie("movie.tif", [frames])
    Path("filmed.toml").write_text(warm.STUDY)
    _made("run filmed.toml --out study --scheduler synchronous")
    shutil.copy("study/profile.nc", "profile.nc")
    row = "profile.nc,a,C1,unknown,0.1,0.04,1.5e-3"
    Path("recorded.csv").write_text(f"track,animal,whisker,texture,scan_speed,length,cone_angle\n{row}\n")
    load("profile.nc").to_netcdf("foreign.nc", engine="h5netcdf")  # without a checksum
    rows = "\n".join(f"{k},{k % 7 + 3},{k % 5 + 3},0.9,{k % 3 + 40},{k % 4 + 9},0.9" for k in range(60))
    Path("dlc.csv").write_text(
        f"scorer,a,a,a,a,a,a\nbodyparts,base,base,base,tip,tip,tip\ncoords,x,y,likelihood,x,y,likelihood\n{rows}\n"
    )
    counts = rng.poisson(1.0, (400, 20, 2))
    np.save("counts.npy", counts)
    savemat("counts.mat", {"counts": counts.astype(float)})
    Path("textures.csv").write_text("trial,texture\n" + "".join(f"{k},{'ab'[k % 2]}\n" for k in range(20)))
    _made(f"scan grating.csv {AT} {CONE} --speed 100mm/s --node 5mm --out motion.nc")
    _made("replay motion.nc --out command.wav --duration 4s --sampling-rate 2kHz --max-travel 5mm")
    _write_nwb()


def _made(words: str) -> None:
    end = ended(shlex.split(words), patience=math.inf)
    if end.code:
        sys.exit(f"{words}: {end.said}")


def _write_nwb() -> None:
    import datetime

    import numpy as np
    import pynwb

    start = datetime.datetime(2024, 1, 1, tzinfo=datetime.UTC)
    file = pynwb.NWBFile(session_description="odd", identifier="odd", session_start_time=start)
    rng = np.random.default_rng(0)
    for _ in range(2):
        file.add_unit(spike_times=np.sort(rng.uniform(0, 80, 900)))
    for k in range(20):
        file.add_trial(start_time=4.0 * k, stop_time=4.0 * k + 4)
    with pynwb.NWBHDF5IO("spikes.nwb", "w") as io:
        io.write(file)


if __name__ == "__main__":
    main()
