"""The table of a user's sweeps, as the key ``sweeps`` of a study names it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from reprlib import repr as short
from typing import Any

import numpy as np

from vibrissa.errors import ConflictError, FormatError, InputError, MissingError, RangeError, ShapeError, UnknownError
from vibrissa.limits import require_memory
from vibrissa.mechanics.scan.scan_settings import FASTEST
from vibrissa.tables.reader import read_table
from vibrissa.tables.text import as_number
from vibrissa.tables.units import PURE, TEXT, spellings, to_si
from vibrissa.whisker import Whisker, atlas_whisker

PER_NODE, NODES = 90.0, 400  # bytes that the analysis takes for each node of each frame; nodes of a usual whisker
UNKNOWN = "unknown"
NUMBERS = {  # each with its SI unit
    "scan_speed": "m/s",
    "base_height": "m",
    "length": "m",
    "cone_angle": "rad",
    "pixel_size": "m",
    "frame_rate": "Hz",
    "exposure": "s",
    "start": "s",
    "contact": PURE,
    "base_angle": "rad",
    "friction": PURE,
}
POINTS = {"seed": 1, "skin": 1, "substrate": 2}  # points in pixels: columns and rows, separated by spaces
WORDS = ("movie", "track", "animal", "whisker", "texture", "base", "polarity", "identity")
WHOLE = ("condition", "run", "which")
COLUMNS = {**dict.fromkeys((*WORDS, *WHOLE, *POINTS), TEXT), **NUMBERS}
NEEDED = ("animal", "whisker", "texture", "scan_speed")
Units = Mapping[str, tuple[str, str]]  # quantity and unit of each column
SIGNED = ("start", "friction")  # may be negative: a texture that came before the movie, a contact that is pulled along
LARGEST = {"scan_speed": FASTEST, "base_height": 0.5, "length": 1.0, "cone_angle": 0.1, "pixel_size": 1e-3}


@dataclass(frozen=True, kw_only=True)
class RecordedSweep:
    """One line of the table of a user's sweeps, in SI units.

    Attributes
    ----------
    movie, track : str, optional
        One of them: a movie to be tracked, or a profile (.nc) or a track file, relative to ``folder``.
    animal, whisker_name : str
        As named.
    texture : str, optional
        Its CSV of gaps, relative to ``folder``.
    scan_speed, base_height : float
        v [m/s], H [m].
    whisker : Whisker
        Of default keratin.
    start : float
        When x = 0 of the texture meets the contact, in the movie [s].
    exposure : float
        [s].
    contact, base_angle : float, optional
        ε over L and θ_b [rad], if they are not to be found from the mean profile.
    friction : float
        μ.
    pixel_size, frame_rate : float, optional
        [m], [Hz].
    seed, skin, substrate
        In pixels.
    base, polarity : str
        As in :class:`vibrissa.study.spec.settings.MovieFile`.
    identity, which
        Of a track file with several whiskers: how WHISK's segments are identified, and the number of the one that is
        meant; see :func:`vibrissa.video.foreign.tracks.read_tracks`.
    """

    animal: str
    whisker_name: str
    whisker: Whisker
    scan_speed: float
    folder: Path
    movie: str | None = None
    track: str | None = None
    texture: str | None = None
    base_height: float = np.nan
    condition: int = 0
    run: int = 0
    start: float = 0.0
    exposure: float = 0.0
    contact: float | None = None
    base_angle: float | None = None
    friction: float = 0.4
    pixel_size: float | None = None
    frame_rate: float | None = None
    seed: tuple[float, ...] | None = None
    skin: tuple[float, ...] | None = None
    substrate: tuple[float, ...] | None = None
    base: Any = None
    polarity: Any = "dark"
    identity: Any = None
    which: int | None = None


def read_sweeps(path: str | Path) -> list[RecordedSweep]:
    """Sweeps from a CSV table; the header names the columns and their units.

    Parameters
    ----------
    path : path
        UTF-8 text, comma-separated, a line for each sweep. Columns that must be there: ``movie`` or ``track``,
        ``animal``, ``whisker``, ``texture`` (a CSV of gaps, or ``unknown``), ``scan_speed`` [m/s] or
        ``scan_speed_mm_s``. The others: ``base_height`` H, ``length`` L (each [m], or ending in ``_mm``),
        ``cone_angle`` [rad] or ``cone_angle_mrad``: without L and α the whisker must be in the atlas; ``condition``,
        ``run``; ``pixel_size`` [m] or ``pixel_size_um``, ``frame_rate`` [Hz], ``exposure`` [s] or ``exposure_ms``;
        ``start`` [s], when x = 0 of the texture meets the contact; ``contact`` and ``base_angle``
        [rad], if not to be found from the profile; ``friction``; ``seed``, ``skin``,
        ``substrate``, points in pixels, such as ``120 44``; ``base``; ``polarity``; of track files with several
        whiskers ``identity`` and ``which``. Files are relative to the table. An empty cell is as if its column were
        absent.

    Returns
    -------
    list of RecordedSweep
        One for each line.

    Raises
    ------
    InputError
        Names the file, the line and the column: unknown or double columns, cells that are no numbers or in another
        unit, a line without what it needs.
    """
    table = read_table(path, {name: COLUMNS[name] for name in NEEDED}, COLUMNS, others=False)
    table.refuse_empty("must hold a line for each sweep below its header", "0 lines")
    if not {"movie", "track"} & set(table.named):
        raise MissingError(str(path), "must have a column movie or track", short(",".join(table.header)))
    units = {column: (kind, unit) for kind, (column, unit) in table.named.items()}
    return [_entry(here, units, cells, Path(path).parent) for here, cells in table.rows()]


def _entry(here: str, units: Units, cells: Mapping[str, str], folder: Path) -> RecordedSweep:
    values = _values(here, units, {name: cell for name, cell in cells.items() if cell})
    for name in NEEDED:
        if name not in values:
            raise MissingError(f"{here}, {name}", "must be given")
    if ("movie" in values) == ("track" in values):
        raise ConflictError(here, "must name either a movie or a track file")
    if "movie" in values and not {"seed", "pixel_size"} <= set(values):
        raise MissingError(here, "must have a seed and a pixel_size for its movie")
    if ("contact" in values) != ("base_angle" in values):
        raise ConflictError(here, "must give both contact and base_angle, or neither")
    name = values.pop("whisker")
    whisker = _whisker(here, name, values)
    if values["texture"] == UNKNOWN:
        del values["texture"]
    return RecordedSweep(whisker_name=name, whisker=whisker, folder=folder, **values)


def _values(here: str, units: Units, given: Mapping[str, str]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name, cell in given.items():
        place = f"{here}, {name}"
        if name in WORDS:
            values[name] = cell
        elif name in WHOLE:
            values[name] = int(_number(place, cell, whole=True))
        elif name in POINTS:
            values[name] = tuple(_number(place, word) for word in cell.split())
            if len(values[name]) != 2 * POINTS[name]:
                raise ShapeError(place, f"must have {2 * POINTS[name]} numbers, columns and rows", short(cell))
        else:
            kind, unit = units[name]
            values[kind] = to_si(_number(place, cell), unit)
            if kind not in SIGNED:
                _refuse_outside(place, kind, unit, values[kind], cell)
    return values


def _refuse_outside(place: str, kind: str, unit: str, value: float, cell: str) -> None:
    if value < 0:
        remedy = "give its size" if kind in NEEDED else "leave the cell empty if it is not known"
        raise RangeError(place, "must be zero or positive", short(cell), remedy)
    if value > LARGEST.get(kind, np.inf):
        remedy = (
            f"numbers in another unit have it in the column's name: {', '.join(spellings([(kind, NUMBERS[kind])]))}"
        )
        raise RangeError(place, f"must be at most {LARGEST[kind] / to_si(1.0, unit):g}", short(cell), remedy)


def _number(place: str, cell: str, *, whole: bool = False) -> float:
    value = as_number(cell)
    if not np.isfinite(value) or (whole and value != int(value)):
        raise FormatError(place, f"must be a {'whole' if whole else 'finite'} number", short(cell))
    return value


def _whisker(here: str, name: str, values: dict[str, Any]) -> Whisker:
    """The whisker that was measured, or the atlas's of that name."""
    geometry = {key: values.pop(key) for key in ("length", "cone_angle") if key in values}
    if len(geometry) == 1:
        raise ConflictError(here, "must give both length and cone_angle, or neither")
    try:
        return Whisker(**geometry) if geometry else atlas_whisker(name)
    except InputError as error:
        raise UnknownError(here, f"has no whisker: {error}") from error


def refuse_long(frames: int, nodes: int = NODES) -> None:
    """Refuse a sweep of more frames than can be analysed in the memory of this machine.

    Parameters
    ----------
    frames : int
        Number of frames.
    nodes : int
        Nodes of its whisker.

    Raises
    ------
    InputError
        If it has more.
    """
    require_memory("a sweep", f"{frames:,} frames of {nodes} nodes", PER_NODE * frames * nodes, "cut it into several")
