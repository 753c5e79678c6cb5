"""Small .plx and .nex files, written from the formats' published layouts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

Units = Mapping[tuple[int, int], Sequence[int]]  # ticks by channel and unit
Events = Mapping[str, Sequence[tuple[int, int]]]  # ticks and codes by channel name

PLX = np.dtype(
    [
        ("magic", "S4"),
        ("version", "<i4"),
        ("comment", "S128"),
        ("frequency", "<i4"),
        ("dsp", "<i4"),
        ("events", "<i4"),
        ("slow", "<i4"),
        ("points", "<i4"),
        ("before", "<i4"),
        ("date", "<i4", 6),
        ("fast", "<i4"),
        ("rate", "<i4"),
        ("last", "<f8"),
        ("trodes", "u1", 2),
        ("bits", "u1", 2),
        ("mv", "<u2", 2),
        ("gain", "<u2"),
        ("text", "S46"),
        ("spikes", "<i4", (130, 5)),
        ("waves", "<i4", (130, 5)),
        ("event_counts", "<i4", 512),
    ]
)
PLX_DSP = np.dtype(
    [("name", "S32"), ("sig", "S32"), ("channel", "<i4"), ("other", "<i4", 3), ("gain", "<i4"), ("more", "V936")]
)
PLX_EVENT = np.dtype([("name", "S32"), ("channel", "<i4"), ("more", "V260")])
PLX_BLOCK = np.dtype(
    [
        ("kind", "<u2"),
        ("upper", "<u2"),
        ("time", "<u4"),
        ("channel", "<u2"),
        ("unit", "<u2"),
        ("n", "<u2"),
        ("words", "<u2"),
    ]
)
NEX = np.dtype(
    [
        ("magic", "S4"),
        ("version", "<i4"),
        ("comment", "S256"),
        ("frequency", "<f8"),
        ("span", "<i4", 2),
        ("n", "<i4"),
        ("pad", "V260"),
    ]
)
NEX_VARIABLE = np.dtype(
    [
        ("kind", "<i4"),
        ("version", "<i4"),
        ("name", "S64"),
        ("offset", "<i4"),
        ("n", "<i4"),
        ("where", "<i4", 4),
        ("xy", "<f8", 2),
        ("rate", "<f8"),
        ("to_mv", "<f8"),
        ("points", "<i4"),
        ("markers", "<i4", 2),
        ("more", "V68"),
    ]
)


def write_plx(
    path: Path,
    units: Units,
    events: Events = {},  # noqa: B006
    *,
    frequency: int = 40_000,
    points: int = 8,
    waves: Mapping[tuple[int, int], np.ndarray] = {},
) -> Path:
    """Write blocks in the order of time, each spike with a waveform: of a unit in `waves` its own, (spikes, points)."""
    header = np.zeros((), PLX)
    channels = sorted({channel for channel, _ in units})
    header["magic"], header["version"], header["frequency"], header["rate"] = b"PLEX", 106, frequency, frequency
    header["dsp"], header["events"], header["points"], header["date"] = (
        len(channels),
        len(events),
        points,
        (2014, 5, 7, 1, 2, 3),
    )
    header["bits"], header["mv"], header["gain"] = (12, 12), (3000, 5000), 1000
    dsp, event = np.zeros(len(channels), PLX_DSP), np.zeros(len(events), PLX_EVENT)
    dsp["name"], dsp["channel"], dsp["gain"] = [f"sig{channel:03d}" for channel in channels], channels, 10
    event["name"], event["channel"] = list(events), 257 + np.arange(len(events))
    blocks = [(tick, 1, channel, unit) for (channel, unit), ticks in units.items() for tick in ticks]
    blocks += [(tick, 4, 257 + k, code) for k, one in enumerate(events.values()) for tick, code in one]
    for channel, unit in units:
        header["spikes"][channel, unit] = len(units[channel, unit])
    left = {unit: iter(rows) for unit, rows in waves.items()}
    body = b"".join(_plx_block(*block, points, left.get(block[2:])) for block in sorted(blocks))
    path.write_bytes(header.tobytes() + dsp.tobytes() + event.tobytes() + body)
    return path


def _plx_block(tick: int, kind: int, channel: int, unit: int, points: int, waves: Iterator | None = None) -> bytes:
    n, words = (1, points) if kind == 1 else (0, 0)
    header = np.array((kind, tick >> 32, tick & 0xFFFFFFFF, channel, unit, n, words), PLX_BLOCK)
    wave = np.arange(n * words) if waves is None else next(waves)
    return header.tobytes() + wave.astype("<i2").tobytes()


def write_nex(
    path: Path,
    units: Mapping[str, Sequence[int]],
    events: Mapping[str, Sequence[int]] = {},
    *,
    frequency: float = 40_000.0,
) -> Path:
    """Write units (with waveforms where the name ends in _wf) and events, one variable each."""
    entries = [(name, 3 if name.endswith("_wf") else 0, ticks) for name, ticks in units.items()]
    entries += [(name, 1, ticks) for name, ticks in events.items()]
    header, variables, data = np.zeros((), NEX), np.zeros(len(entries), NEX_VARIABLE), b""
    last = max((max(ticks, default=0) for _, _, ticks in entries), default=0)
    header["magic"], header["version"], header["frequency"] = b"NEX1", 104, frequency
    header["span"], header["n"] = (0, last), len(entries)
    begin = header.nbytes + variables.nbytes
    for variable, (name, kind, ticks) in zip(variables, entries, strict=True):
        variable["kind"], variable["name"], variable["offset"], variable["n"] = (
            kind,
            name,
            begin + len(data),
            len(ticks),
        )
        variable["rate"], variable["to_mv"], variable["points"] = frequency, 1.0, 4 if kind == 3 else 0
        data += np.array(ticks, "<i4").tobytes() + np.zeros(4 * len(ticks) * (kind == 3), "<i2").tobytes()
    path.write_bytes(header.tobytes() + variables.tobytes() + data)
    return path
