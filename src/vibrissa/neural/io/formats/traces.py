"""Raw recordings, opened through SpikeInterface: bare samples, SpikeGLX, Open Ephys, and its own folders."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

import numpy as np

from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError, ShapeError, TooFewError
from vibrissa.neural.io.formats.foreign import one_line, optional_module

Samples = Literal["int16", "int32", "float32", "float64"]
RAW = (".raw", ".dat", ".bin")
LEAST = 1.0  # [s] below which no sorter finds units
RATES = (5e3, 1e6)  # [Hz] of recordings in which spikes can be seen
PITCHES = (1e-6, 2e-3)  # [m] between neighbouring electrodes
LOOK = 1.0  # [s] of the start and of the middle that are looked at before any work


def part(name: str) -> Any:
    """Module of SpikeInterface, which is imported only here.

    Parameters
    ----------
    name : str
        Of the module: ``core``, ``sorters``, …

    Returns
    -------
    module
        The module.

    Raises
    ------
    InputError
        If SpikeInterface is not installed.
    """
    return optional_module(f"spikeinterface.{name}", "spike sorting", "sorting")


@dataclass(frozen=True, kw_only=True)
class RawFormat:
    """Format of a file of bare samples, which has no header: all channels of a sample, then the next sample.

    Attributes
    ----------
    sampling_rate : float, optional
        Samples per second of each channel [Hz].
    channels : int, optional
        Number of channels.
    dtype : {"int16", "int32", "float32", "float64"}
        Kind of the samples, little-endian.
    gain : float, optional
        Volts per step [V]; without it, waveforms are not measured.
    pitch : float, optional
        Distance between neighbouring electrodes [m]: the channels are in their order along one shank. Also for
        recordings without their probe. Not needed for one channel.
    stream : str, optional
        Which of several streams of a SpikeGLX or Open Ephys folder.
    """

    sampling_rate: float | None = None
    channels: int | None = None
    dtype: Samples = "int16"
    gain: float | None = None
    pitch: float | None = None
    stream: str | None = None

    def __post_init__(self) -> None:
        for name, value, low, high, unit in (
            ("sampling_rate", self.sampling_rate, *RATES, "Hz"),
            ("channels", self.channels, 1, 10_000, "channels"),
            ("gain", self.gain, 1e-12, 1.0, "V per step"),
            ("pitch", self.pitch, *PITCHES, "m"),
        ):
            if value is not None and not low <= value <= high:
                raise RangeError(f"RawFormat.{name}", f"must be from {low:g} to {high:g} {unit}", value)


def open_traces(path: str | Path, how: RawFormat = RawFormat()) -> Any:
    """Open a recording; its samples are read when they are needed.

    Parameters
    ----------
    path : path
        ``.raw``, ``.dat`` or ``.bin``: bare samples. A folder: of SpikeGLX (with ``.ap.bin`` and ``.meta``), of Open
        Ephys (binary format, ``structure.oebin``), or one that SpikeInterface saved a recording in.
    how : RawFormat, optional
        What the file lacks.

    Returns
    -------
    spikeinterface.BaseRecording
        One stretch of recording with a probe.

    Raises
    ------
    InputError
        If SpikeInterface is not installed; if the file is not there or of no such kind; if it says too little, or
        something else than was said; if it is shorter than 1 s, has several stretches, is constant or not finite.
    """
    path = Path(path)
    if not path.exists():
        raise MissingError(str(path), "must be an existing file or folder")
    with one_line(str(path), "could not be opened"):
        traces = _folder(path, how) if path.is_dir() else _bare(path, how)
        count = traces.get_num_segments()
        if count != 1:
            raise ShapeError(str(path), "must be one stretch of recording", f"{count}", "export one of them")
        traces = _with_probe(path, traces, how)
        _refuse_samples(path, traces)
    return traces


def _bare(path: Path, how: RawFormat) -> Any:
    """Samples without a header."""
    if path.suffix not in RAW:
        raise FormatError(str(path), f"must end in {', '.join(RAW)}, or be a folder", path.suffix or None)
    for name in ("sampling_rate", "channels"):
        if getattr(how, name) is None:
            remedy = f"the file does not state it: --{name.replace('_', '-')}"
            raise MissingError(str(path), f"must be given its {name.replace('_', ' ')}", None, remedy)
    rate, channels = float(how.sampling_rate or 0), int(how.channels or 0)
    size, row = path.stat().st_size, channels * np.dtype(how.dtype).itemsize
    if size == 0 or size % row:
        row_text = f"{channels} channels of {how.dtype} are {row} bytes for each sample"
        raise RangeError(str(path), f"must be a whole number of samples: {row_text}", f"{size} bytes")
    scale = {"gain_to_uV": 1e6 * how.gain, "offset_to_uV": 0.0} if how.gain is not None else {}
    return part("core").read_binary(path, sampling_frequency=rate, dtype=how.dtype, num_channels=channels, **scale)


def _folder(path: Path, how: RawFormat) -> Any:
    """A folder of a system that describes itself."""
    for name in ("sampling_rate", "channels", "gain"):
        if getattr(how, name) is not None:
            raise ConflictError(f"RawFormat.{name}", f"must be left out: {path} is a folder, which states it")
    if any(path.rglob("*.ap.meta")):
        return _stream(path, "spikeglx", "read_spikeglx", how.stream, lambda name: name.endswith(".ap"))
    if any(path.rglob("structure.oebin")):
        return _stream(path, "openephysbinary", "read_openephys", how.stream, lambda _: True)
    try:
        found = part("core").load(path)
    except Exception:  # of many kinds, for a folder that SpikeInterface does not know
        found = None
    if found is None or not hasattr(found, "get_traces"):
        kinds = "of SpikeGLX (.ap.meta), Open Ephys (structure.oebin) or a recording saved by SpikeInterface"
        raise MissingError(str(path), f"must be a folder {kinds}")
    return found


def _stream(path: Path, kind: str, reader: str, wanted: str | None, fits: Any) -> Any:
    """One stream of a folder; chosen by its name where there are several."""
    extractors = part("extractors")
    names = [str(name) for name in extractors.get_neo_streams(kind, path)[0]]
    likely = [name for name in names if fits(name)] if wanted is None else [name for name in names if name == wanted]
    if len(likely) != 1:
        there = f"`stream`; they are {', '.join(names)}"
        raise MissingError(str(path), "must be given one of its streams", wanted, there)
    return getattr(extractors, reader)(path, stream_name=likely[0])


def _with_probe(path: Path, traces: Any, how: RawFormat) -> Any:
    """The recording with its own probe, or with one straight shank."""
    if traces.has_probe():
        if how.pitch is not None:
            raise ConflictError("RawFormat.pitch", f"must be left out: {path} states where its electrodes are")
        return traces
    channels = traces.get_num_channels()
    if how.pitch is None and channels > 1:
        remedy = "the file does not state it: give `pitch`, in metres"
        raise MissingError(str(path), "must be given where its electrodes are", None, remedy)
    pitch = how.pitch or PITCHES[0]  # of one electrode it has no meaning
    shank = import_module("probeinterface").generate_linear_probe(num_elec=channels, ypitch=1e6 * pitch)
    shank.set_device_channel_indices(np.arange(channels))
    traces.set_probe(shank)
    return traces


def _refuse_samples(path: Path, traces: Any) -> None:
    """Refuse what no sorter could use."""
    rate, count = traces.get_sampling_frequency(), traces.get_num_samples()
    if count < LEAST * rate:
        raise TooFewError(str(path), f"must last at least {LEAST:g} s", f"{count / rate:.3g} s")
    look, middle = int(LOOK * rate), count // 2
    seen = np.concatenate([traces.get_traces(start_frame=k, end_frame=min(k + look, count)) for k in (0, middle)])
    if not np.isfinite(seen).all():
        raise FormatError(str(path), "must hold finite numbers", None, "is its dtype right?")
    flat = int((np.ptp(seen, axis=0) == 0).sum())
    if flat:
        silent = f"{flat} of {seen.shape[1]} channels constant over 2 s"
        raise TooFewError(str(path), "must have a signal on every channel", silent, "leave such channels out")
