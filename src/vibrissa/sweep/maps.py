"""A map of what a texture does to a whisker, over contact, base angle, speed and friction, on Dask."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.mechanics.dynamics import RECOIL
from vibrissa.mechanics.family import equilibria
from vibrissa.mechanics.superposition import check_scale
from vibrissa.quantities import dataset
from vibrissa.sweep.cells import OK, TIP, row, shaft, side_nodes, width_nodes
from vibrissa.sweep.grid import Grid, Measure

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.texture.surface import Troughs
    from vibrissa.whisker import Whisker

Array = NDArray[np.float64]
Scheduler = Literal["threads", "processes", "synchronous"]
Progress = Callable[[str, int, int], None]

REASONS = (  # by the code in ``cell_reason``
    "ok",
    "beyond the fold",
    "contact beyond the tip",
    "no profile follows the edges of the widest gap",
    "less linear than asked for",
    "no equilibrium",
)
_CHUNK = 0.5  # [s] of work in a task
_LEAST_TASKS = 4  # for each core: blocks of contacts differ in how much of them is beyond the fold


class Job(NamedTuple):
    """What a task of Dask is given: plain data.

    Attributes
    ----------
    gaps : (2, J) array
        Starts and widths over L.
    pace : (V,) array
        Speeds over L [1/s].
    timescale, tip : float
        Of the whisker: k [s], s of its tip.
    base_angle : (B,) array
        Angles [rad].
    measure : Measure
        What is asked.
    """

    gaps: Array
    pace: Array
    timescale: float
    tip: float
    base_angle: Array
    measure: Measure


Block = list[tuple[float, float]]  # friction and contact of each row


def sweep(
    whisker: Whisker,
    texture: Troughs,
    grid: Grid,
    measure: Measure,
    *,
    scheduler: Scheduler = "threads",
    progress: Progress | None = None,
) -> xr.Dataset:
    """Map of the transduction gain over contact, base angle, speed and friction.

    Every cell is what :func:`vibrissa.mechanics.superposition.predict` gives, to some 1e-5: the same model by the
    scaled family of Eq. (1), marched in compiled loops.

    Parameters
    ----------
    whisker, texture
        What is drawn past what.
    grid : Grid
        The parameters.
    measure : Measure
        What a cell holds.
    scheduler : {"threads", "processes", "synchronous"}
        Dask's; the result is the same.
    progress : callable, optional
        Told stage, tasks done and all tasks.

    Returns
    -------
    Dataset
        ``peak_displacement`` or ``mode_rms`` (friction, speed, contact, base_angle), NaN where ``cell_reason``
        (friction, contact, base_angle) is not 0: its attribute ``flag_meanings`` lists the reasons, separated by
        semicolons. ``jump_linearity`` (friction, contact, base_angle): of the exact response, or where asked for.
        ``cells_with_value``, ``least_gain``, ``largest_gain`` of all.

    Raises
    ------
    InputError
        If the point looked at does not lie between the contacts and the base, or the scheduler is unknown.
    """
    contact, base_angle, speed, friction = grid.axes
    if not contact[-1] < measure.node < 1:
        raise InputError("node", "must lie between the largest contact and the base, 1", measure.node)
    if scheduler not in get_args(Scheduler):
        raise InputError("scheduler", f"must be one of {', '.join(get_args(Scheduler))}", repr(scheduler))
    check_scale(whisker, texture.end, texture.width)
    gaps = np.stack([texture.position - texture.position[0], texture.width]) / whisker.length
    job = Job(gaps, speed / whisker.length, whisker.timescale, whisker.tip, base_angle, measure)
    rows = _computed(job, [(mu, epsilon) for epsilon in contact for mu in friction], scheduler, progress)
    shape = len(contact), len(friction)
    values, ratio, reason = (np.array(column).reshape(*shape, *column[0].shape) for column in zip(*rows, strict=True))
    values = values.transpose(1, 2, 0, 3)
    return _labelled(whisker, texture, grid, measure, values, ratio.swapaxes(0, 1), reason.swapaxes(0, 1))


def _labelled(
    whisker: Whisker, texture: Troughs, grid: Grid, measure: Measure, values: Array, ratio: Array, reason: Array
) -> xr.Dataset:
    contact, base_angle, speed, friction = grid.axes
    name = "peak_displacement" if measure.quantity == "peak" else "mode_rms"
    attrs: dict[str, Any] = {
        "response": measure.response,
        "damping": measure.damping,
        "jump": measure.jump,
        "n_modes": measure.n_modes,
        "node": measure.node,
        "whisker_length": whisker.length,
        "timescale": whisker.timescale,
        "n_gaps": len(texture.width),
        "widest_gap": float(texture.width.max()),
    }
    if measure.least_linearity is not None:
        attrs["least_linearity"] = measure.least_linearity
    columns: dict[str, Any] = {name: values, "jump_linearity": ratio, "cell_reason": reason}
    if not np.isnan(values).all():
        columns |= {"least_gain": np.nanmin(values), "largest_gain": np.nanmax(values)}
    data = dataset(attrs, speed=speed, friction=friction, cells_with_value=(~np.isnan(values)).sum(), **columns)
    data = data.merge(dataset(lead=("contact",), contact=contact), combine_attrs="override")
    data = data.merge(dataset(lead=("base_angle",), base_angle=base_angle), combine_attrs="override")
    data.cell_reason.attrs.update(flag_values=np.arange(len(REASONS), dtype=np.int8), flag_meanings="; ".join(REASONS))
    return data


def _computed(job: Job, rows: Block, scheduler: Scheduler, progress: Progress | None) -> list[tuple[Array, ...]]:
    """All rows, in blocks of some half a second, as the last row shows; it also compiles what the others need."""
    from dask.base import compute
    from dask.callbacks import Callback
    from dask.delayed import delayed

    begin = time.process_time()
    last = map_rows(job, rows[-1:])
    each = time.process_time() - begin
    most = -(-(len(rows) - 1) // (_LEAST_TASKS * (os.cpu_count() or 1)))
    size = max(1, min(int(_CHUNK / each), most))
    tasks = [delayed(map_rows)(job, rows[i : min(i + size, len(rows) - 1)]) for i in range(0, len(rows) - 1, size)]
    done = 0

    def count(*_: object) -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress("sweep", done, len(tasks))

    with Callback(posttask=count):  # type: ignore[no-untyped-call]
        blocks = compute(*tasks, scheduler=scheduler)  # type: ignore[no-untyped-call]
    return [one for block in (*blocks, last) for one in block]


def map_rows(job: Job, rows: Block) -> list[tuple[Array, Array, NDArray[np.int8]]]:
    """Rows of a map, each values (V, B), linearity (B,) and reason (B,): the work of one task."""
    return [_one_row(job, friction, contact) for friction, contact in rows]


def _one_row(job: Job, friction: float, contact: float) -> tuple[Array, Array, NDArray[np.int8]]:
    measure, n = job.measure, len(job.base_angle)
    values, ratio = np.full((len(job.pace), n), np.nan), np.full(n, np.nan)
    reason = np.full(n, OK, np.int8)
    if contact < job.tip:
        reason[:] = TIP
        return values, ratio, reason
    of = shaft(contact, measure.n_modes if measure.quantity == "peak" else 1, measure.node)
    postures, determined = _postures(contact, job.base_angle, friction)
    exact = measure.response == "exact"
    least = -np.inf if measure.least_linearity is None else measure.least_linearity
    rule = measure.quantity == "peak", exact, least, measure.damping, RECOIL[measure.jump]
    tables = *(side_nodes() if exact else side_nodes(1)), *width_nodes()
    omega = of.kappa / job.timescale
    row(postures, determined, *of[:3], omega, job.gaps, job.pace, rule, tables, values, ratio, reason)
    return values, ratio, reason


def _postures(contact: float, base_angle: Array, friction: float) -> tuple[Array, NDArray[np.bool_]]:
    """Rows (ε, Λ̂, θ_b, D, H, φ), and whether each is an equilibrium."""
    out, determined = np.zeros((len(base_angle), 6)), np.ones(len(base_angle), bool)
    try:
        found = [np.array(equilibria(np.full(len(base_angle), contact), base_angle, friction))]
    except InputError:
        found = []
        for b, angle in enumerate(base_angle):
            try:
                found.append(np.array(equilibria([contact], [angle], friction)))
            except InputError:
                determined[b] = False
                found.append(np.ones((6, 1)))
    _, force, height, distance, _, _ = np.concatenate(found, axis=1)
    columns = (contact, force / contact**2, base_angle, distance, height, np.arctan(friction))
    for i, column in enumerate(columns):
        out[:, i] = column
    return out, determined
