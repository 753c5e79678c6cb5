"""The measured rat whiskers: the atlas by position, and the single whiskers whose resonances were measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files
from typing import Any

from vibrissa.errors import FormatError, RangeError, UnknownError, nearest
from vibrissa.tables.reader import read_table
from vibrissa.whisker.cone import Whisker

GREEK = {"α": "alpha", "β": "beta", "γ": "gamma", "δ": "delta"}


@dataclass(frozen=True, kw_only=True)
class AtlasEntry:
    """The whiskers of one position on the rat's snout: mean and standard deviation (``_sd``, n − 1) across whiskers.

    Pooled over the animals, strains and studies of [Belli2017]_; NaN where too few were measured.
    ``docs/make_atlas.py`` makes the table and states what it leaves out.

    Attributes
    ----------
    name : str
        ``A1`` … ``E8``, or ``alpha`` … ``delta`` for the Greek arc.
    row, column : int
        Row 1–5 for A–E (in the Greek arc 1–4 for alpha–delta), column 0 for the Greek arc.
    n : int
        Whiskers with an arc length and a base diameter.
    arc_length, arc_length_sd, base_diameter, base_diameter_sd : float
        Over the n whiskers [m].
    n_cone : int
        Whiskers whose tip was measured too; only they give a cone.
    length, length_sd, cone_angle, cone_angle_sd, tip_diameter, tip_diameter_sd, tip, tip_sd : float
        Over the n_cone whiskers: L [m], α [rad], tip diameter [m], position of the tip over L.
    source : str
        Studies and doi.
    """

    name: str
    row: int
    column: int
    n: int
    arc_length: float
    arc_length_sd: float
    base_diameter: float
    base_diameter_sd: float
    n_cone: int
    length: float
    length_sd: float
    cone_angle: float
    cone_angle_sd: float
    tip_diameter: float
    tip_diameter_sd: float
    tip: float
    tip_sd: float
    source: str


@dataclass(frozen=True, kw_only=True)
class IsolatedWhisker:
    """One whisker of [Hartmann2003]_, with the resonances measured in air, clamped at its base; NaN = not measured.

    Attributes
    ----------
    name, row, column
        As in :class:`AtlasEntry`.
    arc_length, base_diameter, tip_diameter, length, cone_angle, tip : float
        Its geometry [m, rad]; ``length`` is that of the nontruncated cone.
    frequency_1, frequency_2, frequency_3 : float
        Resonant frequencies under vibration of the base [Hz].
    frequency_impulse : float
        First resonant frequency after an impulse [Hz].
    damping, damping_impulse : float
        Damping ratio ζ of the first mode, by vibration and by impulse.
    """

    name: str
    row: int
    column: int
    arc_length: float
    base_diameter: float
    length: float
    cone_angle: float
    tip_diameter: float
    tip: float
    frequency_1: float
    frequency_2: float
    frequency_3: float
    frequency_impulse: float
    damping: float
    damping_impulse: float

    @property
    def whisker(self) -> Whisker:
        """The cone of this whisker, of default keratin."""
        return Whisker(length=self.length, cone_angle=self.cone_angle, tip=self.tip)


@cache
def atlas() -> tuple[AtlasEntry, ...]:
    """Measured rat whiskers by position, row by row; one record per position."""
    return tuple(AtlasEntry(**line) for line in _packaged("atlas.csv", AtlasEntry))


@cache
def isolated_whiskers() -> tuple[IsolatedWhisker, ...]:
    """The single whiskers of [Hartmann2003]_, whose resonances can be compared with what their geometry predicts."""
    return tuple(IsolatedWhisker(**line) for line in _packaged("hartmann2003.csv", IsolatedWhisker))


def _packaged(name: str, record: type) -> list[dict[str, Any]]:
    kinds = {"str": str, "int": int, "float": float}
    with as_file(files("vibrissa") / "data" / name) as path:
        lines = read_table(path, {}).rows()
        return [{key: kinds[record.__annotations__[key]](cell) for key, cell in line.items()} for _, line in lines]


def atlas_entry(name: str) -> AtlasEntry:
    """The record of one position.

    Parameters
    ----------
    name : str
        ``C2``, ``c2``, ``beta`` or ``β``.

    Returns
    -------
    AtlasEntry
        Of :func:`atlas`.

    Raises
    ------
    InputError
        If no position has that name (the nearest are named).
    """
    if not isinstance(name, str):
        raise FormatError("name", "must be a text", repr(name), 'such as "C2"')
    entries = {entry.name.lower(): entry for entry in atlas()}
    key = GREEK.get(name.strip().lower(), name.strip().lower())
    if key not in entries:
        near = [entries[match].name for match in nearest(key, entries, cutoff=0.4, most=3)]
        remedy = f"did you mean {', '.join(near)}?" if near else "whiskers are named by row and column, C2, or beta"
        raise UnknownError("whisker", "must be in the atlas", repr(name), remedy)
    return entries[key]


def atlas_whisker(name: str) -> Whisker:
    """The mean whisker of one position: mean L, mean α and mean tip of :func:`atlas`, of default keratin.

    Parameters
    ----------
    name : str
        ``C2``, ``c2``, ``beta`` or ``β``.

    Returns
    -------
    Whisker
        The cone.

    Raises
    ------
    InputError
        If no position has that name (the nearest are named), or no cone was measured there.
    """
    entry = atlas_entry(name)
    if not entry.n_cone:
        raise RangeError(
            f"whisker {entry.name}", "has no measured cone: no tip diameter is known", remedy="give L and α"
        )
    return Whisker(length=entry.length, cone_angle=entry.cone_angle, tip=entry.tip)
