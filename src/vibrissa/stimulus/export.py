"""Commands on disk: NetCDF, WAV, NPY and CSV, each with a sidecar that says what it holds."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.binary import read_npy, read_wav
from vibrissa.errors import FormatError, MissingError, RangeError, TooFewError, UnknownError, require_positive
from vibrissa.files import digest, written_whole
from vibrissa.netcdf import load, save
from vibrissa.quantities import dataset, require
from vibrissa.signals.even_times import even_rate
from vibrissa.tables.reader import read_table
from vibrissa.tables.units import PURE
from vibrissa.tables.writer import write_table

Encoding = Literal["float32", "int24", "int16"]

DIGITS = 9  # significant, of a CSV file: 1e-13 m of 100 µm
_BYTES = {"float32": 4, "int24": 3, "int16": 2}
_LARGEST_WAV = 2**32 - 2**10  # [bytes] RIFF counts them in 32 bits
# media subtype of WAVE_FORMAT_EXTENSIBLE: code 1 (integer) or 3 (float), then this fixed tail
_SUBTYPE = bytes.fromhex("000000001000800000aa00389b71")


@dataclass(frozen=True, kw_only=True)
class Sound:
    """Encoding of metres in a WAV file.

    Attributes
    ----------
    encoding : {"float32", "int24", "int16"}
        Of a sample.
    full_scale : float or None
        Displacement that is written as 1 (or as the largest integer) [m]; the command's peak by default.
    """

    encoding: Encoding = "float32"
    full_scale: float | None = None

    def __post_init__(self) -> None:
        if self.encoding not in get_args(Encoding):
            raise UnknownError("encoding", f"must be one of {', '.join(get_args(Encoding))}", repr(self.encoding))
        require_positive("full_scale", self.full_scale, "m")


def write_command(data: xr.Dataset, path: str | Path, *, sound: Sound | None = None) -> None:
    """Write a command in the format of the name's ending, and ``PATH.json`` beside it; each whole or not at all.

    ``.nc``: the whole dataset. ``.npy``: float64 (whisker, time) [m]. ``.csv``: ``time`` [s] and a column for each
    whisker [m], 9 digits. ``.wav``: a channel for each whisker, samples over ``full_scale``: float32 (24 bits of
    mantissa), or integers to half a step of full_scale / (2^(bits − 1) − 1). Nothing is clipped.

    Parameters
    ----------
    data : Dataset
        With ``command`` (whisker, time), from :func:`vibrissa.stimulus.array.replay_command`.
    path : path
        Name of the file.
    sound : Sound, optional
        Encoding and full scale of a WAV file.

    Raises
    ------
    InputError
        An unknown ending, a sampling rate or size that WAV does not know, a command beyond the full scale.
    """
    require(data, "command", "time", "whisker")
    if not np.all(np.isfinite(data["command"])):
        raise RangeError("command", "must be finite")
    path = Path(path)
    refuse_ending(path)
    write = _WRITERS[path.suffix.lower()]
    rate = even_rate(data["time"].to_numpy(), "command")
    more = _sound_facts(data, rate, sound or Sound()) if path.suffix.lower() == ".wav" else {}
    write(data, path, more)  # first: a stop between the two leaves a command that its sidecar does not describe
    facts = _facts(data, path, rate) | more | {"sha256": digest(path)}
    with written_whole(f"{path}.json") as temporary:
        temporary.write_text(json.dumps(facts, indent=2, ensure_ascii=False) + "\n", "utf-8")


def read_command(path: str | Path) -> xr.Dataset:
    """Command from a file that :func:`write_command` wrote: ``command`` (whisker, time) [m].

    Parameters
    ----------
    path : path
        The command; its sidecar, unless it is a dataset, is beside it.

    Returns
    -------
    Dataset
        With ``time`` [s] and, of a dataset, all that it holds.

    Raises
    ------
    InputError
        If a file is missing, of an unknown ending, or not as its sidecar says.
    """
    path = Path(path)
    refuse_ending(path)
    if path.suffix.lower() == ".nc":
        data = load(path)
        require(data, "command", "time", "whisker")
        return data
    facts = _sidecar(path)
    try:
        values = _READERS[path.suffix.lower()](path, facts)
    except (ValueError, OSError, KeyError) as error:
        raise FormatError(str(path), "must be a command written by vibrissa", remedy=str(error)) from error
    names = np.array(facts["whiskers"])
    if values.shape != (len(names), facts["samples"]):
        raise TooFewError(str(path), f"must hold {len(names)} whiskers, {facts['samples']} samples", values.shape)
    time = facts["start"] + np.arange(facts["samples"]) / facts["sampling_rate"]
    return dataset(facts["attributes"], whisker=names, time=time, command=values)


def refuse_ending(path: Path) -> None:
    """Refuse a file of another ending than those of commands.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    InputError
        Names the endings.
    """
    if path.suffix.lower() not in _WRITERS:
        raise FormatError(str(path), f"must end in {', '.join(_WRITERS)}", repr(path.suffix))


def _facts(data: xr.Dataset, path: Path, rate: float) -> dict[str, Any]:
    """Content of the sidecar; no clock, so equal commands have equal sidecars."""
    others = {
        str(name): {"unit": one.attrs.get("units", "1"), "dims": list(one.dims), "values": one.values.tolist()}
        for name, one in data.variables.items()
        if name not in ("command", "time", "whisker")
    }
    return {
        "file": path.name,
        "holds": "displacement commanded, (whisker, time)",
        "unit": "m",
        "sampling_rate": round(rate, 6),
        "start": float(data["time"][0]),
        "samples": data.sizes["time"],
        "whiskers": data["whisker"].values.tolist(),
        "versions": {name: version(name) for name in ("vibrissa", "numpy", "scipy")},
        "attributes": {str(name): _plain(value) for name, value in data.attrs.items()},
        "variables": others,
    }


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def _sidecar(path: Path) -> dict[str, Any]:
    beside = Path(f"{path}.json")
    for one in (path, beside):
        if not one.is_file():
            raise MissingError(str(one), "must be an existing file", remedy="a command is read with its sidecar")
    try:
        facts = json.loads(beside.read_text("utf-8"))
        facts = {name: facts[name] for name in ("sampling_rate", "start", "samples", "whiskers", "attributes")} | facts
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise FormatError(str(beside), "must be a sidecar written by vibrissa") from error
    if facts.get("sha256", digest(path)) != digest(path):
        remedy = f"take a copy of it; if you have changed it, take sha256 out of {beside.name}"
        raise FormatError(str(path), "must be as it was written: its checksum does not hold", remedy=remedy)
    return facts


def _sound_facts(data: xr.Dataset, rate: float, sound: Sound) -> dict[str, Any]:
    peak = float(np.abs(data["command"]).max())
    full = sound.full_scale or peak
    if not full > 0:
        raise RangeError("command", "must move, to have a full scale in WAV", peak, "give `full_scale`")
    if peak > full:
        remedy = f"`full_scale={peak * 1.001:.4g}` or above, or a smaller `scale`"
        raise RangeError("command", f"must stay within the full scale of {full:.6g} m", f"{peak:.6g} m", remedy)
    if abs(rate - round(rate)) > 1e-6 * rate:
        raise RangeError("sampling_rate", "must be a whole number of Hz in WAV", rate, "write .nc or .npy")
    size = _BYTES[sound.encoding] * data["command"].size
    if size > _LARGEST_WAV:
        raise RangeError("command", "must be below 4 GiB in WAV", f"{size} bytes", "write .nc or .npy")
    step = 0.0 if sound.encoding == "float32" else full / _top(sound.encoding)
    return {"encoding": sound.encoding, "full_scale": full, "step": step}


def _top(encoding: str) -> int:
    return 2 ** (8 * _BYTES[encoding] - 1) - 1


def _write_npy(data: xr.Dataset, path: Path, more: dict[str, Any]) -> None:
    with written_whole(path) as temporary:
        np.save(temporary, _metres(data))


def _write_csv(data: xr.Dataset, path: Path, more: dict[str, Any]) -> None:
    motions = zip(map(str, data["whisker"].values), _metres(data), strict=True)
    write_table(path, {"time": data["time"].to_numpy(), **dict(motions)}, digits=DIGITS)


def _write_wav(data: xr.Dataset, path: Path, more: dict[str, Any]) -> None:
    """RIFF with WAVE_FORMAT_EXTENSIBLE, which more than two channels and 24 bits ask for; no speaker positions."""
    rate = round(even_rate(data["time"].to_numpy(), "command"))
    samples = encoded(_metres(data).T / more["full_scale"], more["encoding"])
    channels, width = data.sizes["whisker"], _BYTES[more["encoding"]]
    code = 3 if more["encoding"] == "float32" else 1
    form = struct.pack("<HHIIHH", 0xFFFE, channels, rate, rate * channels * width, channels * width, 8 * width)
    form += struct.pack("<HHIH", 22, 8 * width, 0, code) + _SUBTYPE
    fact = struct.pack("<I", data.sizes["time"])
    chunks = [(b"fmt ", form), (b"fact", fact), (b"data", samples)]
    body = b"".join(name + struct.pack("<I", len(one)) + one + b"\0" * (len(one) % 2) for name, one in chunks)
    with written_whole(path) as temporary:
        temporary.write_bytes(b"RIFF" + struct.pack("<I", 4 + len(body)) + b"WAVE" + body)


def _metres(data: xr.Dataset) -> Array:
    return data["command"].transpose("whisker", "time").to_numpy().astype(float)


def encoded(values: Array, encoding: str) -> bytes:
    """Samples in [−1, 1], (T, channels), as the bytes of a WAV file, little-endian.

    Parameters
    ----------
    values : (T, channels) array
        Samples over the full scale.
    encoding : str
        As in :class:`Sound`.

    Returns
    -------
    bytes
        Channel by channel of each sample.
    """
    if encoding == "float32":
        return values.astype("<f4").tobytes()
    whole = np.round(values * _top(encoding)).astype("<i4")
    return whole[..., None].view(np.uint8)[..., : _BYTES[encoding]].tobytes()


def _read_wav(path: Path, facts: dict[str, Any]) -> Array:
    values = read_wav(path)[1].T.astype(float)
    # 24 bits are in the upper ones of 32
    top = {"float32": 1.0, "int16": float(_top("int16")), "int24": _top("int24") * 256.0}
    return values / top[facts["encoding"]] * facts["full_scale"]


def _read_csv(path: Path, facts: dict[str, Any]) -> Array:
    table = read_table(path, {"time": "s", **dict.fromkeys(facts["whiskers"], PURE)}, others=False)
    return np.array([table.numbers(name) for name in facts["whiskers"]])


_WRITERS = {".nc": lambda data, path, _: save(data, path), ".wav": _write_wav, ".npy": _write_npy, ".csv": _write_csv}
_READERS = {".wav": _read_wav, ".npy": lambda path, _: np.asarray(read_npy(path), float), ".csv": _read_csv}
