"""Sorted spikes and events from Plexon (.plx) and NeuroExplorer (.nex) files, through neo."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from struct import Struct
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, MissingError, UnknownError
from vibrissa.neural.io.formats.foreign import one_line, optional_module
from vibrissa.neural.io.tables.spikes import table_of_trains
from vibrissa.quantities import dataset
from vibrissa.tables.table import LONGEST

FORMATS = {  # module and class of neo, and the bytes a file starts with
    ".plx": ("neo.rawio.plexonrawio", "PlexonRawIO", b"PLEX"),
    ".nex": ("neo.rawio.neuroexplorerrawio", "NeuroExplorerRawIO", b"NEX1"),
}
WAY_OUT = {
    ".pl2": "open it in Offline Sorter and export .plx, or convert it to NWB",
    ".pl3": "open it in Offline Sorter and export .plx, or convert it to NWB",
    ".nex5": "export .nex from NeuroExplorer, or convert it to NWB",
}
# bytes of a .plx file: its first header, where the numbers of channels and the counts of spikes are in it, the
# headers of a channel of spikes, of events, of signals; the header of a block (kind, time, channel, unit, waveform)
PLX_HEADER, PLX_CHANNELS, PLX_COUNTS, PLX_CHANNEL_HEADERS = 7504, 140, 256, (1020, 296, 296)
PLX_BLOCK = Struct("<HHIHHHH")
NEX_HEADER, NEX_VARIABLE = 544, 208  # bytes of a .nex file's first header, and of that of a variable
EVER = 1e9  # [s] neo leaves out what comes after the last block of a file unless given a stop
BROKEN, DAMAGED = "is truncated or damaged", "copy it again from where it was recorded, or export it again"


def read_plexon(
    path: str | Path,
    *,
    event: str | None = None,
    unsorted: bool = False,
    progress: Callable[[str, int, int], None] | None = None,
) -> xr.Dataset:
    """Sorted spikes from a .plx or .nex file, on the session's clock, and the times of an event.

    Parameters
    ----------
    path : path
        The file. Other formats of these makers are refused with a way out.
    event : str, optional
        Name of an event channel, the one that marks the onsets of trials.
    unsorted : bool
        Take the unsorted spikes of each channel as a unit, instead of leaving them out.
    progress : callable, optional
        Called with (stage, done, total) after each unit.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`. Units are named ``channel,unit`` in a .plx file
        (``3,1``), by their variable in a .nex file. Unsorted spikes (unit 0; variables like ``sig001U``) are left out
        and counted in ``spikes_unsorted``; variables that repeat spikes with their waveforms (``sig001a_wf``) are
        passed over. ``event_channels`` names the channels of events. With an event, ``marker_time`` [s] and
        ``marker_label`` (marker), the label being the code of a strobed event: see
        :func:`vibrissa.neural.io.tables.trials.trials_at`.

    Raises
    ------
    InputError
        If neo is not installed; if the file is not there, not of these formats, truncated or damaged; if there is no
        such event.
    """
    reader = _open(path)
    with one_line(str(path), BROKEN, DAMAGED):
        named, total = [], reader.spike_channels_count()
        for k in range(total):
            named.append((_name(reader, k), _spike_times(reader, k)))
            if progress is not None:
                progress("reading units", k + 1, total)
        channels = [str(name) for name in reader.header["event_channels"]["name"]]
    for name, time in named:
        _refuse_times(path, f"unit {name}", time)
    names = {name for name, _ in named}
    named = [(name, time) for name, time in named if not (name.endswith("_wf") and name[:-3] in names)]
    left_out = [] if unsorted else [(name, time) for name, time in named if _unsorted(name)]
    units = [(name, time) for name, time in named if unsorted or not _unsorted(name)]
    attrs = {
        "source": Path(path).name,
        "spikes_unsorted": sum(time.size for _, time in left_out),
        "event_channels": ",".join(channels),
    }
    table = table_of_trains([time for _, time in units], [name for name, _ in units], attrs)
    return table if event is None else table.assign(_events(reader, path, channels, event).data_vars)


def plexon_waveforms(path: str | Path, names: Sequence[str]) -> dict[str, Any]:
    """Mean waveforms of units of a .plx file, which holds the waveform of each spike, and their deviations.

    Parameters
    ----------
    path : path
        The file.
    names : sequence of str
        Units, as :func:`read_plexon` names them.

    Returns
    -------
    dict
        ``unit_waveform`` and ``unit_waveform_sd`` (unit, sample) [V], of the first electrode of several, and
        ``snr_smallest`` (unit); NaN for units with fewer than two spikes.

    Raises
    ------
    InputError
        As :func:`read_plexon`.
    """
    reader = _open(path)
    with one_line(str(path), BROKEN, DAMAGED):
        known = {_name(reader, k): k for k in range(reader.spike_channels_count())}
        waves = [_waveforms(reader, known[name]) for name in names]
    samples = max((one.shape[1] for one in waves), default=0)
    wide, smallest = np.full((2, len(waves), samples), np.nan), np.full(len(waves), np.nan)
    for k, one in enumerate(waves):
        if len(one):
            wide[:, k, : one.shape[1]] = one.mean(axis=0), one.std(axis=0)
            noise = float(np.sqrt(one.var(axis=0).mean()))
            smallest[k] = np.ptp(one, axis=1).min() / noise if noise else np.nan
    return {"unit_waveform": wide[0], "unit_waveform_sd": wide[1], "snr_smallest": smallest}


def _waveforms(reader: Any, k: int) -> Array:
    """Waveforms of one unit [V]; none with fewer than two spikes, or where the file does not state the gain."""
    step = 1e-3 * float(reader.header["spike_channels"]["wf_gain"][k])  # neo gives mV
    if len(reader.get_spike_timestamps(0, 0, k, None, EVER)) < 2 or not 0 < step < np.inf:
        return np.zeros((0, 0))
    raw = reader.get_spike_raw_waveforms(0, 0, k, None, EVER)
    return step * np.asarray(raw[:, 0], float)


def _open(path: str | Path) -> Any:
    """Reader of neo for the file, its header parsed and its length checked."""
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise FormatError(str(path), "must be a .plx or .nex file", remedy=WAY_OUT.get(kind, "other files: CSV or NWB"))
    if not path.is_file():
        raise MissingError(str(path), "must be an existing file")
    module, name, magic = FORMATS[kind]
    with path.open("rb") as file:
        if file.read(4) != magic:
            raise FormatError(str(path), f"must be a {kind} file", remedy=f"it does not start with {magic.decode()}")
    make = getattr(optional_module(module, str(path), "neuro"), name)
    with one_line(str(path), BROKEN, DAMAGED):
        _refuse_truncated(path)
        reader = make(str(path), **({"progress_bar": False} if kind == ".plx" else {}))
        reader.parse_header()
    return reader


def _refuse_truncated(path: Path) -> None:
    """Refuse a file that ends within a block or variable, or holds fewer spikes than its header says."""
    data = np.memmap(path, "u1", "r")
    end, found, counted = (_plx_end if path.suffix.lower() == ".plx" else _nex_end)(data)
    if end > data.size:
        raise FormatError(str(path), f"is truncated: it should reach byte {end}", f"{data.size} bytes", DAMAGED)
    if found < counted:
        raise FormatError(str(path), f"is truncated: it should hold {counted} spikes", found, DAMAGED)


def _plx_end(data: NDArray[np.uint8]) -> tuple[int, int, int]:
    """Byte at which the last block of a .plx file ends, spikes in its blocks, and spikes by its header."""
    channels = np.frombuffer(data[PLX_CHANNELS : PLX_CHANNELS + 12], "<i4").clip(0)
    counted = np.frombuffer(data[PLX_COUNTS : PLX_COUNTS + 4 * 650], "<i4").clip(0)  # channels beyond 129 are not in it
    end, found = int(PLX_HEADER + channels @ np.array(PLX_CHANNEL_HEADERS)), 0
    while end < data.size:
        if end + PLX_BLOCK.size > data.size:
            return end + PLX_BLOCK.size, found, int(counted.sum())
        kind, *_, waves, words = PLX_BLOCK.unpack_from(data.data, end)
        found += kind == 1
        end += PLX_BLOCK.size + 2 * waves * words
    return end, found, int(counted.sum())


def _nex_end(data: NDArray[np.uint8]) -> tuple[int, int, int]:
    """Byte at which the last variable of a .nex file ends; spikes are not counted twice."""
    number = int(np.frombuffer(data[280:284], "<i4")[0])
    end = NEX_HEADER + NEX_VARIABLE * number
    if end > data.size:
        return end, 0, 0
    for start in range(NEX_HEADER, end, NEX_VARIABLE):
        (kind,), (begin, n), (points,) = (
            np.frombuffer(data[start + at : start + at + 4 * m], "<i4").tolist()
            for at, m in ((0, 1), (72, 2), (128, 1))
        )
        each = {0: 4 * n, 1: 4 * n, 2: 8 * n, 3: n * (4 + 2 * points), 5: 8 * n + 2 * points, 6: 4 * n}
        if n < 0:
            raise ValueError(f"a variable of {n} entries")
        end = max(end, begin % 2**32 + each.get(kind, 0))
    return end, 0, 0


def _name(reader: Any, k: int) -> str:
    """Name of a unit: ``channel,unit`` where neo's id has them, else the variable's name."""
    channel = reader.header["spike_channels"][k]
    plexon = re.fullmatch(r"ch(\d+)#(\d+)", channel["id"])
    return f"{plexon[1]},{plexon[2]}" if plexon else str(channel["name"]).strip()


def _unsorted(name: str) -> bool:
    return name.endswith(",0") or re.fullmatch(r"(sig|SPK)\w*\d+U", name) is not None


def _spike_times(reader: Any, k: int) -> Array:
    ticks = reader.get_spike_timestamps(0, 0, k, None, EVER)
    return np.asarray(reader.rescale_spike_timestamp(ticks, "float64"), float)


def _refuse_times(path: str | Path, what: str, time: Array) -> None:
    if not (np.abs(time) <= LONGEST).all():
        raise FormatError(f"{path}, {what}", "must have finite times in a session", remedy=DAMAGED)


def _events(reader: Any, path: str | Path, channels: list[str], event: str) -> xr.Dataset:
    """Times and labels of an event."""
    if event not in channels:
        remedy = f"it has {', '.join(channels) or 'none'}"
        raise UnknownError(f"event {event!r}", f"must be one of {path}", remedy=remedy)
    k = channels.index(event)
    with one_line(str(path), BROKEN, DAMAGED):
        ticks, _, labels = reader.get_event_timestamps(0, 0, k, None, EVER)
        time = np.asarray(reader.rescale_event_timestamp(ticks, "float64", k), float)
    _refuse_times(path, f"event {event}", time)
    if not time.size:
        raise UnknownError(f"event {event!r}", f"must occur in {path}", "never")
    order = np.argsort(time, kind="stable")
    return dataset(marker_time=time[order], marker_label=np.array(labels, str)[order])
