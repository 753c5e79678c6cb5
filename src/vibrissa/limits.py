"""Limits: what is to be computed or read must fit into the memory of this machine."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from vibrissa.errors import FormatError, RangeError

MOST_SAMPLES = 2_000_000  # of one record: 12 modes, or 24 whiskers, of them are half a gigabyte
MOST_BINS = 1_000_000  # of one trial: a window in milliseconds, taken for seconds, would fill the memory
SHARE = 0.5  # of the machine's memory that one computation may take: intermediate arrays need as much again
VARIABLE = "VIBRISSA_MEMORY"  # environment: another limit [GB]
_UNKNOWN = 4e9  # bytes, of a system that does not say how much it has
_CGROUPS = "/sys/fs/cgroup"  # where the limits of containers and batch jobs are
_MINE = "/proc/self/cgroup"  # which of them this process is in: lines number:controllers:path


def machine_memory() -> float:
    """Memory that this process can have [bytes]: of the machine, of its container, or as ``VIBRISSA_MEMORY`` says.

    Returns
    -------
    float
        Bytes.

    Raises
    ------
    InputError
        If the variable is no positive number.
    """
    if given := os.environ.get(VARIABLE):
        try:
            if 0 < (size := float(given)) < float("inf"):
                return size * 1e9
        except ValueError:
            pass
        raise FormatError(VARIABLE, "must be a positive number of gigabytes", given)
    sizes = [_limit(file) for file in _cgroup_files()]
    try:
        sizes.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
    except (AttributeError, ValueError, OSError):  # a system without it
        sizes.append(_UNKNOWN)
    return min(size for size in sizes if size > 0)


def _cgroup_files() -> list[Path]:
    """Files with the limits of the groups of processes that this one is in, and of those that these are in."""
    try:
        lines = [line.split(":", 2) for line in Path(_MINE).read_text(encoding="utf-8").splitlines()]
    except OSError:
        lines = []
    files = []
    for root, name, kind in (("", "memory.max", ""), ("memory", "memory.limit_in_bytes", "memory")):
        own = next((line[2] for line in lines if len(line) == 3 and kind in line[1].split(",")), "/")
        group = Path("/", own.lstrip("/"))
        for one in (group, *group.parents):
            files.append(Path(_CGROUPS, root, one.relative_to("/"), name))
    return files


def _limit(file: Path) -> float:
    """Limit of a group of processes [bytes]; infinite where there is none."""
    try:
        return float(file.read_text(encoding="ascii"))
    except (OSError, ValueError):  # "max", or no such file
        return float("inf")


def require_memory(quantity: str, value: object, size: float, remedy: str = "") -> None:
    """Refuse what would take more than half of the machine's memory, before any of it is taken.

    Parameters
    ----------
    quantity : str
        What is to be had, by the name the user knows.
    value : object
        As given or found.
    size : float
        Bytes that it needs.
    remedy : str
        What to do about it; by default, how the limit is raised.

    Raises
    ------
    InputError
        With both numbers.
    """
    most = SHARE * machine_memory()
    if not size <= most:
        rule = f"must fit into {most / 1e9:.3g} GB of memory, half of what this machine has"
        remedy = remedy or f"take less; {VARIABLE}=32 (GB) states another size of the machine"
        raise RangeError(quantity, rule, f"{value}, which need {size / 1e9:.3g} GB", remedy)


def require_samples(thing: str, duration: float, rate: float, most: int = MOST_SAMPLES) -> None:
    """Refuse a record of too many samples.

    Parameters
    ----------
    thing : str
        What would have them.
    duration : float
        [s].
    rate : float
        Samples per second [Hz].
    most : int
        Samples at most.

    Raises
    ------
    InputError
        With their number.
    """
    if not duration * rate <= most:
        count = f"{duration * rate:.3g}"
        raise RangeError(thing, f"must have at most {most:,} samples", count, "lower `sampling_rate`")


def require_bins(duration: float, bin_width: float, most: int = MOST_BINS, quantity: str = "window") -> None:
    """Refuse a window of too many bins.

    Parameters
    ----------
    duration : float
        Of the window [s].
    bin_width : float
        [s].
    most : int
        Bins at most.
    quantity : str
        What has this duration.

    Raises
    ------
    InputError
        With their number.
    """
    if duration > most * bin_width > 0:
        rule, found = f"must hold at most {most:,} bins of {bin_width:g} s", f"{duration:g} s"
        raise RangeError(quantity, rule, found, "times are in seconds; or take a wider `bin_width`")


def cap_memory() -> None:
    """Let this process have no more than the machine has: beyond it an allocation fails, not the machine."""
    if sys.platform == "linux":
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
        most = int(machine_memory())
        if soft == resource.RLIM_INFINITY or soft > most:
            resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
