"""A map of what textures do to a whisker, over contact, base angle, speed, friction and the textures' seeds."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import InputError, RangeError
from vibrissa.limits import require_memory
from vibrissa.mechanics.contact.gap_events import check_gaps
from vibrissa.mechanics.scan.texture_prediction import check_scale
from vibrissa.mechanics.scan.verdict import map_verdict, rod_map_verdict
from vibrissa.mechanics.statics.elastica_table import equilibria
from vibrissa.mechanics.vibration.dynamics import RECOIL
from vibrissa.quantities import dataset
from vibrissa.sweep.cells import OK, REACH, RESTLESS, TIP, row
from vibrissa.sweep.engine import Engine, each
from vibrissa.sweep.gratings import Gratings
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.posture_cells import shaft, side_nodes, width_nodes
from vibrissa.sweep.rod_cells import rod_row

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.texture.surface import Gaps
    from vibrissa.whisker import Whisker

Progress = Callable[[str, int, int], None]

REASONS = (  # by the code in ``cell_reason``
    "ok",
    "beyond the fold",
    "contact beyond the tip",
    "no profile follows the edges of the widest gap",
    "less linear than required",
    "no equilibrium",
    "the rod does not come to rest",
)
_NUMBERS = 6  # of each cell and mode, at once
_CHUNK = 0.5  # [s] of work in a task
_LEAST_TASKS = 4  # for each core: blocks of contacts differ in how much of them is beyond the fold


class MapJob(NamedTuple):
    """What all tasks are given: plain data.

    Attributes
    ----------
    texture : Gaps or Gratings
        The gaps, or what each task draws its own from.
    whisker : Whisker
        The cone.
    pace : (V,) array
        Speeds over L [1/s].
    base_angle : (B,) array
        Angles [rad].
    measure : Measure
        What is asked.
    """

    texture: Gaps | Gratings
    whisker: Whisker
    pace: Array
    base_angle: Array
    measure: Measure


class MapRow(NamedTuple):
    """What sets a row of base angles apart; the seed counts only where gratings are drawn."""

    contact: float
    friction: float
    seed: int


RowValues = tuple[Array, Array, NDArray[np.int8]]  # of a row: values (V, B), linearity (B,), reason (B,)


def sweep(
    whisker: Whisker,
    texture: Gaps | Gratings,
    grid: Grid,
    measure: Measure,
    *,
    engine: Engine | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Map of the transduction gain over contact, base angle, speed, friction and the seeds of random gratings.

    Every cell is what :func:`vibrissa.mechanics.scan.texture_prediction.predict` gives: the same model by the scaled
    family of Eq. (1), marched in compiled loops. They agree to some 1e-5; near the fold, where the response bends, to
    1.4 % of an rms, and a peak between samples may be missed by 0.3 %. With ``measure.rod`` it is a run of the whole
    whisker.

    Parameters
    ----------
    whisker : Whisker
        What is drawn past the texture.
    texture : Gaps or Gratings
        One texture, or a random grating for each of several seeds.
    grid : Grid
        The parameters.
    measure : Measure
        What a cell holds.
    engine : Engine, optional
        Who does the work, by default the threads of this machine; the result is the same to the last bit.
    progress : callable, optional
        Called with stage, tasks done and all tasks.

    Returns
    -------
    Dataset
        ``peak_displacement`` or ``mode_rms`` (friction, speed, contact, base_angle), NaN where ``cell_reason``
        (friction, contact, base_angle) is not 0: its attribute ``flag_meanings`` lists the reasons, separated by
        semicolons. ``jump_linearity`` (friction, contact, base_angle): of the exact response, or where asked for.
        All three are led by ``seed`` where gratings are drawn. ``cells_with_value``, ``least_gain``, ``largest_gain``
        of all. The attribute ``verdict``: :func:`vibrissa.mechanics.scan.verdict.map_verdict`.

    Raises
    ------
    InputError
        If the point looked at does not lie between the contacts and the base, a texture is in a wrong unit, or the
        engine cannot do the work (:func:`vibrissa.sweep.engine.each`).
    """
    contact, base_angle, speed, friction = grid.axes
    if not contact[-1] < measure.node < 1:
        raise RangeError("node", "must lie between the largest contact and the base, 1", measure.node)
    attrs = _attributes(whisker, measure) | _of_texture(whisker, texture)
    verdict = map_verdict(contact, whisker.tip, whisker.length, attrs["widest_gap"])
    attrs["verdict"] = verdict if measure.rod is None else rod_map_verdict(whisker.tip)
    seeds = texture.seeds if isinstance(texture, Gratings) else np.zeros(1, np.int64)
    cells = len(contact) * len(base_angle) * len(speed) * len(friction) * len(seeds)
    require_memory("map", f"{cells} cells", 8 * _NUMBERS * measure.n_modes * float(cells), "take fewer")
    job = MapJob(texture, whisker, speed / whisker.length, base_angle, measure)
    rows = [MapRow(*where) for where in product(contact.tolist(), friction.tolist(), seeds.tolist())]
    found = _computed(job, rows, engine or Engine(scheduler="threads"), progress)
    shape = len(contact), len(friction), len(seeds)
    values, ratio, reason = (np.array(column).reshape(*shape, *column[0].shape) for column in zip(*found, strict=True))
    maps = values.transpose(2, 1, 3, 0, 4), ratio.transpose(2, 1, 0, 3), reason.transpose(2, 1, 0, 3)
    if isinstance(texture, Gratings):
        return _labelled(attrs, grid, measure, *maps).assign_coords(dataset(seed=seeds).coords)
    return _labelled(attrs, grid, measure, *(column[0] for column in maps))


def _of_texture(whisker: Whisker, texture: Gaps | Gratings) -> dict[str, Any]:
    """Attributes of the texture; refused where it is in a wrong unit."""
    drawn = [texture.drawn(int(seed)) for seed in texture.seeds] if isinstance(texture, Gratings) else [texture]
    for one in drawn:
        check_gaps(one, "maps are of gaps; for any other surface use relief_prediction.predict_relief")
        check_scale(whisker, one.end, one.width)
    attrs: dict[str, Any] = {"widest_gap": max(float(one.width.max()) for one in drawn)}
    if isinstance(texture, Gratings):
        how = {"grating_length": texture.length, "reading": texture.reading, "mean_period": texture.mean_period}
        return attrs | how
    return attrs | {"n_gaps": len(texture.width)}


def _attributes(whisker: Whisker, measure: Measure) -> dict[str, Any]:
    attrs: dict[str, Any] = {
        "response": measure.response,
        "damping": measure.damping,
        "jump": measure.jump,
        "n_modes": measure.n_modes,
        "node": measure.node,
        "whisker_length": whisker.length,
        "timescale": whisker.timescale,
    }
    if measure.rod is not None:
        return {"model": "rod", **attrs, **measure.rod.curvature_attributes}
    return attrs if measure.least_linearity is None else attrs | {"least_linearity": measure.least_linearity}


def _labelled(
    attrs: dict[str, Any], grid: Grid, measure: Measure, values: Array, ratio: Array, reason: Array
) -> xr.Dataset:
    contact, base_angle, speed, friction = grid.axes
    name = "peak_displacement" if measure.quantity == "peak" else "mode_rms"
    columns: dict[str, Any] = {name: values, "jump_linearity": ratio, "cell_reason": reason}
    if not np.isnan(values).all():
        columns |= {"least_gain": np.nanmin(values), "largest_gain": np.nanmax(values)}
    columns |= {"speed": speed, "friction": friction, "cells_with_value": (~np.isnan(values)).sum()}
    data = dataset(attrs, lead=("seed",), **columns)
    data = data.merge(dataset(lead=("contact",), contact=contact), combine_attrs="override")
    data = data.merge(dataset(lead=("base_angle",), base_angle=base_angle), combine_attrs="override")
    data.cell_reason.attrs.update(flag_values=np.arange(len(REASONS), dtype=np.int8), flag_meanings="; ".join(REASONS))
    return data


def _computed(job: MapJob, rows: list[MapRow], engine: Engine, progress: Progress | None) -> list[RowValues]:
    """All rows, in blocks of some half a second, as the last row shows."""
    report = progress or (lambda *_: None)
    report("sweep", 0, 0)
    map_rows(job._replace(pace=job.pace[:1], base_angle=job.base_angle[:1]), rows[-1:])  # compiles
    begin = time.process_time()
    last = map_rows(job, rows[-1:])
    one = time.process_time() - begin
    most = -(-(len(rows) - 1) // (_LEAST_TASKS * engine.at_once))
    size = max(1, min(int(_CHUNK / one), most))
    blocks = [rows[i : min(i + size, len(rows) - 1)] for i in range(0, len(rows) - 1, size)]

    found = each(partial(map_rows, job), blocks, engine, partial(report, "sweep"))
    return [row for block in (*found, last) for row in block]


def map_rows(job: MapJob, rows: list[MapRow]) -> list[RowValues]:
    """Rows of a map: the work of one task.

    Parameters
    ----------
    job : MapJob
        What all tasks are given.
    rows : list of MapRow
        Contact, friction and seed of each.

    Returns
    -------
    list
        Values, ratio and reason of each row.
    """
    return [_one_row(job, row) for row in rows]


def _gaps(job: MapJob, seed: int) -> Array:
    """Starts and widths over L, (2, J)."""
    texture = _texture(job, seed)
    return np.stack([texture.position - texture.position[0], texture.width]) / job.whisker.length


def _texture(job: MapJob, seed: int) -> Gaps:
    return job.texture.drawn(seed) if isinstance(job.texture, Gratings) else job.texture


def _one_row(job: MapJob, where: MapRow) -> RowValues:
    contact, friction, seed = where
    measure, n = job.measure, len(job.base_angle)
    values, ratio = np.full((len(job.pace), n), np.nan), np.full(n, np.nan)
    reason = np.full(n, OK, np.int8)
    if contact < job.whisker.tip or (measure.rod is not None and contact == job.whisker.tip):
        reason[:] = TIP
        return values, ratio, reason
    if measure.rod is not None:
        speed, texture = job.pace * job.whisker.length, _texture(job, seed)
        values, reachable = rod_row(job.whisker, contact, friction, job.base_angle, speed, texture, measure)
        reason[np.isnan(values).any(axis=0)] = RESTLESS
        reason[~reachable] = REACH
        return values, ratio, reason
    of = shaft(contact, measure.n_modes if measure.quantity == "peak" else 1, measure.node)
    exact = measure.response == "exact"
    least = -np.inf if measure.least_linearity is None else measure.least_linearity
    rule = measure.quantity == "peak", exact, least, measure.damping, RECOIL[measure.jump]
    tables = *(side_nodes() if exact else side_nodes(1)), *width_nodes()
    omega = of.kappa / job.whisker.timescale
    postures = _postures(contact, job.base_angle, friction)
    row(postures, *of[:3], omega, _gaps(job, seed), job.pace, rule, tables, values, ratio, reason)
    return values, ratio, reason


def _postures(contact: float, base_angle: Array, friction: float) -> Array:
    """Rows (ε, Λ̂, θ_b, D, H, μ); Λ̂, D and H are NaN where there is no equilibrium."""
    try:
        found = np.array(equilibria(np.full(len(base_angle), contact), base_angle, friction))
    except InputError:
        found = np.concatenate([_one_posture(contact, angle, friction) for angle in base_angle.tolist()], axis=1)
    _, force, height, distance, _, _ = found
    columns = np.broadcast_arrays(contact, force / contact**2, base_angle, distance, height, friction)
    return np.stack(columns, axis=1)


def _one_posture(contact: float, angle: float, friction: float) -> Array:
    """Equilibrium as a column (6, 1); NaN where there is none."""
    try:
        return np.array(equilibria([contact], [angle], friction))
    except InputError:
        return np.full((6, 1), np.nan)
