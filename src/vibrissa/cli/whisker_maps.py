"""The verbs of what whiskers do to units: surround and glm."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.cli.options import Json, Out
from vibrissa.cli.pictures import Picture, refuse_picture, write_picture
from vibrissa.cli.recorded import Recorded, Window, span, tell_map
from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def surround(
    *,
    recorded: Recorded,
    command: Path,
    bin_width: float = 0.01,
    skip: float = 1.0,
    window: Window | None = None,
    band: Window | None = None,
    level: float = 0.05,
    unit: str | None = None,
    picture: Picture = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """How much every whisker drives every unit, while all replay delayed copies of one texture.

    Parameters
    ----------
    command
        What `vibrissa replay` wrote: the motion of all whiskers.
    bin_width
        Width of the bins [s].
    skip
        Time left out at the start, while units adapt [s].
    window
        START STOP of the part of the stimulus that is analysed [s].
    band
        LOW HIGH of the carrier whose envelope is taken [Hz]; all of the displacement by default.
    level
        Largest p-value, adjusted over whiskers, at which a whisker is said to drive or to suppress.
    unit
        Print and draw the map of this unit alone.
    """
    from vibrissa.cli.output import refuse_out
    from vibrissa.neural.surround import SurroundAnalysis, surround_map
    from vibrissa.stimulus.export import read_command

    how = SurroundAnalysis(bin_width=bin_width, skip=skip, window=window, band=band, level=level)
    refuse_out(out)
    refuse_picture(picture)
    moved = read_command(command)
    table, count = recorded.read(span(moved))
    data = surround_map(_alone(table, unit), moved, count, how)
    if picture is not None:
        from vibrissa.figures import surround as figure

        write_picture(figure.draw(figure.compute({"surround": data})), picture)
    names = ["surround_weight", "surround_weight_low", "surround_weight_high", "surround_verdict"]
    tell_map(data, names, ["strongest_whisker", "threshold", "latency", "reason", "condition_number"], json, out)


def glm(
    *,
    recorded: Recorded,
    command: Path,
    bin_width: float = 0.005,
    skip: float = 1.0,
    window: Window | None = None,
    band: Window | None = None,
    reach: float = 0.04,
    past: float = 0.1,
    penalty: float = 10.0,
    choose_penalty: bool = False,
    level: float = 0.05,
    unit: str | None = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Poisson model of each unit: every whisker at every latency, and the unit's own past.

    Parameters
    ----------
    command
        What `vibrissa replay` wrote: the motion of all whiskers.
    bin_width
        Width of the bins [s].
    skip
        Time left out at the start, while units adapt [s].
    window
        START STOP of the part of the stimulus that is analysed [s].
    band
        LOW HIGH of the carrier whose envelope is taken [Hz].
    reach
        Longest latency of a whisker's kernel [s].
    past
        Longest lag of the unit's own past [s]; 0 leaves it out.
    penalty
        On the squared coefficients of the whiskers.
    choose_penalty
        Take the penalty that foresees unseen trials best instead; intervals of strong kernels are then too narrow.
    level
        Largest p-value, adjusted over whiskers, at which a whisker is said to matter.
    unit
        Print this unit alone.
    """
    from vibrissa.cli.output import refuse_out
    from vibrissa.neural.glm import whisker_kernels
    from vibrissa.neural.kernel_columns import KernelAnalysis
    from vibrissa.stimulus.export import read_command

    how = KernelAnalysis(
        bin_width=bin_width,
        skip=skip,
        window=window,
        band=band,
        reach=reach,
        past=past,
        penalty=None if choose_penalty else penalty,
        level=level,
    )
    refuse_out(out)
    moved = read_command(command)
    table, count = recorded.read(span(moved))
    data = whisker_kernels(_alone(table, unit), moved, count, how)
    names = ["whisker_effect", "whisker_effect_low", "whisker_effect_high", "whisker_p_value", "whisker_matters"]
    tell_map(data, names, ["kernel_rate", "deviance_explained", "penalty", "reason", "kernel_condition"], json, out)


def _alone(spikes: xr.Dataset, name: str | None) -> xr.Dataset:
    """Spikes of one unit alone, so that no other is fitted; of all where none is named."""
    if name is None:
        return spikes
    names = [str(one) for one in spikes.unit_name.values]
    if name not in names:
        raise InputError("--unit", f"must be one of {', '.join(names)}", repr(name))
    k = names.index(name)
    alone = spikes.isel(spike=spikes.spike_unit.values == k, unit=[k])
    return alone.assign(spike_unit=alone.spike_unit - k)
