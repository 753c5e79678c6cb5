"""A user's sweeps: the table that lists them, and what is done with each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from reprlib import repr as short
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import InputError
from vibrissa.files import as_number, csv_lines, load
from vibrissa.mechanics.superposition import FASTEST
from vibrissa.study.backward import track_file
from vibrissa.study.settings import MovieFile
from vibrissa.study.sweep_analysis import Known, Line, Row, analyse_sweep, followed_throughout
from vibrissa.study.sweep_table import refuse_long
from vibrissa.texture.io import read_troughs
from vibrissa.video.movie import open_movie
from vibrissa.video.tracking import Calibration
from vibrissa.video.tracks import read_tracks
from vibrissa.whisker import Whisker, atlas_whisker

if TYPE_CHECKING:
    import xarray as xr

UNKNOWN = "unknown"
UNITS = {  # numbers, each with its units by the end of the column's name, per SI unit
    "scan_speed": {"": 1.0, "_mm_s": 1e3},
    "base_height": {"": 1.0, "_mm": 1e3},
    "length": {"": 1.0, "_mm": 1e3},
    "cone_angle": {"": 1.0, "_mrad": 1e3},
    "pixel_size": {"": 1.0, "_um": 1e6},
    "frame_rate": {"": 1.0},
    "exposure": {"": 1.0, "_ms": 1e3},
    "start": {"": 1.0},
    "contact": {"": 1.0},
    "base_angle": {"": 1.0},
    "friction": {"": 1.0},
}
POINTS = {"seed": 1, "skin": 1, "substrate": 2}  # points in pixels: columns and rows, separated by spaces
WORDS = ("movie", "track", "animal", "whisker", "texture", "base", "polarity", "identity")
WHOLE = ("condition", "run", "which")
NUMBERS = {name + end: (name, scale) for name, ends in UNITS.items() for end, scale in ends.items()}
COLUMNS = (*WORDS, *WHOLE, *NUMBERS, *POINTS)
NEEDED = ("animal", "whisker", "texture", "scan_speed")
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
        As in :class:`vibrissa.study.settings.MovieFile`.
    identity, which
        Of a track file with several whiskers: how WHISK's segments are told apart, and the number of the one that is
        meant; see :func:`vibrissa.video.tracks.read_tracks`.
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

    Raises
    ------
    InputError
        Names the file, the line and the column: unknown or double columns, cells that are no numbers or in another
        unit, a line without what it needs.
    """
    lines = csv_lines(path)
    if len(lines) < 2:
        raise InputError(str(path), "must hold a header and a line for each sweep", f"{len(lines)} lines")
    number, names = lines[0]
    _refuse_header(f"{path}, line {number}", names)
    return [_entry(f"{path}, line {number}", names, cells, Path(path).parent) for number, cells in lines[1:]]


def _refuse_header(here: str, names: list[str]) -> None:
    for name in names:
        if name not in COLUMNS:
            near = get_close_matches(name, COLUMNS, n=1, cutoff=0.4)
            cure = f"did you mean {near[0]!r}?" if near else f"it knows {', '.join(COLUMNS)}"
            raise InputError(f"{here}: column {name!r}", "is unknown", remedy=cure)
    kinds = [NUMBERS[name][0] if name in NUMBERS else name for name in names]
    for kind in kinds:
        if kinds.count(kind) > 1:
            raise InputError(f"{here}: column {kind!r}", "must be there once", kinds.count(kind))
    absent = [name for name in NEEDED if name not in kinds]
    if absent or not {"movie", "track"} & set(kinds):
        raise InputError(here, f"must have columns {', '.join(NEEDED)}, and movie or track", ",".join(names))


def _entry(here: str, names: list[str], cells: list[str], folder: Path) -> RecordedSweep:
    if len(cells) != len(names):
        raise InputError(here, f"must have {len(names)} cells", len(cells))
    given = {name: cell for name, cell in zip(names, cells, strict=True) if cell}
    told = _values(here, given)
    for name in NEEDED:
        if name not in told:
            raise InputError(f"{here}, {name}", "must be given")
    if ("movie" in told) == ("track" in told):
        raise InputError(here, "must name either a movie or a track file")
    if "movie" in told and not {"seed", "pixel_size"} <= set(told):
        raise InputError(here, "must have a seed and a pixel_size for its movie")
    if ("contact" in told) != ("base_angle" in told):
        raise InputError(here, "must give both contact and base_angle, or neither")
    name = told.pop("whisker")
    whisker = _whisker(here, name, told)
    if told["texture"] == UNKNOWN:
        del told["texture"]
    return RecordedSweep(whisker_name=name, whisker=whisker, folder=folder, **told)


def _values(here: str, given: Mapping[str, str]) -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, cell in given.items():
        place = f"{here}, {name}"
        if name in WORDS:
            told[name] = cell
        elif name in WHOLE:
            told[name] = int(_number(place, cell, whole=True))
        elif name in POINTS:
            told[name] = tuple(_number(place, word) for word in cell.split())
            if len(told[name]) != 2 * POINTS[name]:
                raise InputError(place, f"must have {2 * POINTS[name]} numbers, columns and rows", short(cell))
        else:
            kind, scale = NUMBERS[name]
            told[kind] = _number(place, cell) / scale
            if not 0 <= told[kind] <= LARGEST.get(kind, np.inf):
                raise InputError(place, f"must lie between 0 and {LARGEST.get(kind, np.inf) * scale:g}", short(cell))
    return told


def _number(place: str, cell: str, *, whole: bool = False) -> float:
    value = as_number(cell)
    if not np.isfinite(value) or (whole and value != int(value)):
        raise InputError(place, f"must be a {'whole' if whole else 'finite'} number", short(cell))
    return value


def _whisker(here: str, name: str, told: dict[str, Any]) -> Whisker:
    """The whisker that was measured, or the atlas's of that name."""
    geometry = {key: told.pop(key) for key in ("length", "cone_angle") if key in told}
    if len(geometry) == 1:
        raise InputError(here, "must give both length and cone_angle, or neither")
    try:
        return Whisker(**geometry) if geometry else atlas_whisker(name)
    except InputError as error:
        raise InputError(here, f"has no whisker: {error}") from error


def recorded_sweep(sweep: RecordedSweep) -> tuple[Row, xr.Dataset]:
    """Track or read one recorded sweep, and analyse it.

    Returns
    -------
    row, series
        As :func:`vibrissa.study.sweep_analysis.analyse_sweep`.

    Raises
    ------
    InputError
        If a file is missing or bad, or the whisker was lost.
    """
    if sweep.movie is not None and (sweep.folder / sweep.movie).exists():
        refuse_long(open_movie(sweep.folder / sweep.movie).frame_count)
    profile, substrate = profile_of(sweep)
    refuse_long(profile.sizes["time"])
    followed_throughout(profile)
    texture = None if sweep.texture is None else read_troughs(sweep.folder / sweep.texture)
    known = Known(
        whisker=sweep.whisker,
        scan_speed=sweep.scan_speed,
        base_height=sweep.base_height,
        texture=texture,
        substrate=substrate,
        contact=sweep.contact,
        base_angle=sweep.base_angle,
        friction=sweep.friction,
        exposure=sweep.exposure,
    )
    return analyse_sweep(profile.assign_coords(time=profile.time - sweep.start), known)


def profile_of(sweep: RecordedSweep) -> tuple[xr.Dataset, Line | None]:
    """Track or read the profile of a sweep's whisker; with the substrate's line, if it is known [m]."""
    profile = _profile(sweep)
    return profile, _substrate(sweep, profile)


def _profile(sweep: RecordedSweep) -> xr.Dataset:
    """Profile of the sweep's whisker."""
    if sweep.movie is not None and sweep.pixel_size is not None and sweep.seed is not None:
        profile = track_file(_movie(sweep, sweep.movie, sweep.pixel_size, sweep.seed), sweep.folder, lambda *_: None)
    else:
        path = sweep.folder / str(sweep.track)
        profile = load(path) if path.suffix == ".nc" else _imported(path, sweep)
    if "whisker" not in profile.dims:
        return profile
    count = profile.sizes["whisker"]
    if count != 1 and (sweep.which is None or not 0 <= sweep.which < count):
        raise InputError(str(sweep.track), f"must hold one whisker, or which must be 0 to {count - 1}", sweep.which)
    return profile.isel(whisker=0 if count == 1 else sweep.which)


def _imported(path: Path, sweep: RecordedSweep) -> xr.Dataset:
    """Profile of a track file of another program; of WHISK's, of the whisker that is meant."""
    which = None if sweep.which is None else [sweep.which]
    return read_tracks(path, _calibration(sweep), identity=sweep.identity, base=sweep.base, whiskers=which)


def _movie(sweep: RecordedSweep, path: str, pixel_size: float, seed: tuple[float, ...]) -> MovieFile:
    return MovieFile(
        path=path,
        pixel_size=pixel_size,
        frame_rate=sweep.frame_rate,
        seeds=((seed[0], seed[1]),),
        skin=None if sweep.skin is None else ((sweep.skin[0], sweep.skin[1]),),
        base=sweep.base or "left",
        polarity=sweep.polarity,
    )


def _calibration(sweep: RecordedSweep) -> Calibration | None:
    if sweep.pixel_size is None or sweep.frame_rate is None:
        return None
    return Calibration(frame_rate=sweep.frame_rate, pixel_size=sweep.pixel_size)


def _substrate(sweep: RecordedSweep, profile: xr.Dataset) -> Line | None:
    if sweep.substrate is None:
        return None
    size = sweep.pixel_size or profile.attrs["pixel_size"]
    a, b, c, d = (float(value * size) for value in sweep.substrate)
    return (a, b), (c, d)
