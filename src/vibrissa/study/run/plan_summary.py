"""The parts of a study and the plan of its run, in lines for a reader and as a dataset for a program."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibrissa.quantities import dataset
from vibrissa.study.run.plan import Plan, Planned
from vibrissa.study.spec.parts import GIVES, absent, given

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.spec.settings import Study


def parts_lines(study: Study) -> list[str]:
    """What the parts of a study give, and what absent ones would.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    list of str
        One for each line.
    """
    there = [f"  {_key(name):<15}  {GIVES[name]}" for name in given(study)]
    other = [f"  {_key(name):<15}  {GIVES[name]}" for name in absent(study)]
    return [study.name, "it has", *there, *(["it could also have", *other] if other else [])]


def parts_dataset(study: Study) -> xr.Dataset:
    """The same: ``part_given`` and ``part_gives`` (part).

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    Dataset
        By ``part``.
    """
    there, names = given(study), [*given(study), *absent(study)]
    return dataset(part=names, part_given=[name in there for name in names], part_gives=[GIVES[n] for n in names])


def plan_lines(plan: Plan) -> list[str]:
    """A plan for a reader.

    Parameters
    ----------
    plan : Plan
        From :func:`vibrissa.study.run.plan.plan_study`.

    Returns
    -------
    list of str
        One for each line.
    """
    lines = [f"{plan.name}: nothing is done yet", f"parts      {', '.join(map(_key, plan.given))}"]
    lines += [f"reads      {one.name}  {one.problem or size(one.size)}" for one in plan.inputs]
    heads = ("stage", "tasks", "frames", "processor time", "memory", "disk")
    rows = [heads, *(_cells(one) for one in plan.stages)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(heads))]
    lines += ["  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows]
    if plan.kept:
        lines.append(f"kept       {plan.kept} sweeps are there already and are not done again")
    lines.append(
        f"in all     about {duration(plan.seconds)} on {plan.workers} {'cores' if plan.workers > 1 else 'core'}, up to "
        f"{size(plan.memory)} of memory, {size(plan.written)} on disk; a first run after installing compiles, too"
    )
    if plan.unstored:
        lines.append(f"movies     stay in memory: stored, they would be {size(plan.unstored)}")
    lines += [f"makes      {heading}" for _, heading in plan.figures]
    return [*lines, *(f"left out   Figure {number}: {reason}" for number, reason in plan.left_out)]


def _cells(stage: Planned) -> tuple[str, ...]:
    name, cost = stage
    numbers = duration(cost.seconds), size(cost.memory), size(cost.written)
    return name, str(cost.tasks), str(cost.frames or ""), *numbers


def plan_dataset(plan: Plan) -> xr.Dataset:
    """A plan for a program: bytes and seconds.

    Parameters
    ----------
    plan : Plan
        From :func:`vibrissa.study.run.plan.plan_study`.

    Returns
    -------
    Dataset
        By input, stage and figure.
    """
    figures = [*plan.figures, *plan.left_out]
    return dataset(
        input_file=[one.name for one in plan.inputs],
        input_size=[one.size for one in plan.inputs],
        input_problem=[one.problem for one in plan.inputs],
        work=[one.name for one in plan.stages],
        work_tasks=[one.cost.tasks for one in plan.stages],
        work_frames=[one.cost.frames for one in plan.stages],
        processor_time=[one.cost.seconds for one in plan.stages],
        memory_needed=[one.cost.memory for one in plan.stages],
        bytes_written=[one.cost.written for one in plan.stages],
        planned_figure=[number or heading for number, heading in figures],
        left_out=["" if one in plan.figures else one[1] for one in figures],
        wall_time=plan.seconds,
        peak_memory=plan.memory,
        disk_space=plan.written,
        n_workers=plan.workers,
        sweeps_kept=plan.kept,
    )


def size(count: float) -> str:
    """Bytes, in the unit that a reader wants.

    Parameters
    ----------
    count : float
        Bytes.

    Returns
    -------
    str
        ``1.2 GB``; "" for 0.
    """
    unit, scale = next((one for one in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)) if count >= one[1]), ("", 1.0))
    return f"{count / scale:.3g} {unit}" if unit else f"{count:.0f} B" if count else ""


def duration(seconds: float) -> str:
    """Seconds, in the units that a reader wants.

    Parameters
    ----------
    seconds : float
        [s].

    Returns
    -------
    str
        ``5 min``.
    """
    if seconds < 100:
        return f"{seconds:.2g} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"


def _key(name: str) -> str:
    """A part as a study file writes it."""
    return name if name == "sweeps" else f"[[{name}]]" if name in ("base_signal", "neural") else f"[{name}]"
