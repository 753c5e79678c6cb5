"""The verb neural: spikes against the envelope of their stimulus."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, print_json, show, tell
from vibrissa.cli.shared.display.pictures import NO_PAGES, PagesOptions
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.options import Seed
from vibrissa.cli.shared.recorded import WHOLE, PartOptions, RecordingOptions, StimulusOptions
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.cli.shared.words.units import Duration

if TYPE_CHECKING:
    import xarray as xr

TABLE = ("unit_name", "significant", "p_value", "adjusted_p_value", "threshold", "threshold_low", "threshold_high",
         "slope", "latency", "tuning_r_squared", "tuning_r_squared_ceiling")  # fmt: skip


def neural(
    *,
    recorded: RecordingOptions,
    shown: StimulusOptions,
    null: Literal["circular", "paper2014"] = "circular",
    fit: Literal["forward", "paper2014"] = "forward",
    first_segment: Literal["flat-first", "free-first"] = "flat-first",
    level: float = 0.01,
    bin_width: Duration = 0.01,
    part: PartOptions = WHOLE,
    delay: list[Duration] | None = None,
    spontaneous: tuple[Duration, Duration] | None = None,
    settled_by: Path | None = None,
    seed: Seed = 0,
    drawing: PagesOptions = NO_PAGES,
    output: OutputOptions = PRINTED,
) -> None:
    """Test whether the envelope of a stimulus drives each unit; estimate threshold, slope and latency.

    Parameters
    ----------
    null
        Chance: all circular shifts, adjusted over units, or the paper's 300 shuffles, not adjusted.
    fit
        Threshold-linear, averaged over the bins, of continuous latency; or the paper's two segments at the best
        whole shift.
    first_segment
        First segment of the paper's fit: flat, or with its own slope.
    level
        Largest p-value (adjusted, for the circular null) that counts as significant.
    bin_width
        Width of the bins [s].
    delay
        Delay at which another whisker had the same stimulus [s]; once for each.
    spontaneous
        START STOP of a window without stimulus [s], for the spontaneous rate.
    settled_by
        Table that `neural --out` wrote of the same units under another stimulus: it decides where this one cannot tell
        envelope from phase.
    seed
        Seed of the resampled trials and shuffles.
    """
    from vibrissa.netcdf import load
    from vibrissa.neural.coupling.carrier import settled_by as settled
    from vibrissa.study.neurons.neurons import analyse_neurons
    from vibrissa.study.spec.neurons import Neurons

    asked = Neurons(
        **recorded.words(),
        **shown.words(),
        null=null,
        fit=fit,
        first_segment=first_segment,
        level=level,
        bin_width=bin_width,
        **vars(part),
        delay=tuple(delay or ()),
        spontaneous=spontaneous,
        seed=seed,
    )
    with progress_bars() as progress:
        found = analyse_neurons(asked, progress=progress)
    remarks = [in_options(line) for line in found.remarks]
    tell(*remarks)
    units = found.units if settled_by is None else settled(found.units, load(settled_by))
    drawing.draw_units(found._replace(units=units), remarks)  # refuses a unit that is not there: before any file
    output.save(units)
    if output.json:
        _print_units(units)
    else:
        _print_table(units, settled=settled_by is not None)


def _print_table(units: xr.Dataset, *, settled: bool) -> None:
    """The table, with the verdict on envelope and phase where one is in doubt, and lags where they were not tested."""
    import numpy as np

    from vibrissa.neural.coupling.carrier import peak_elsewhere

    doubtful = settled or bool(set(units.envelope_verdict.values.tolist()) - {"", "envelope"})
    elsewhere = peak_elsewhere(units)
    beyond = bool(np.isfinite(elsewhere).any())
    named = [*(["peak_lag"] if beyond else []), *(["envelope_verdict"] if doubtful else [])]
    shown = units.assign(peak_lag=units.peak_lag.copy(data=elsewhere))
    show(shown, [*TABLE, *named, "identified", "reason"])


def _print_units(data: xr.Dataset) -> None:
    """One JSON object with a list of units, each named by `unit` and `unit_name`; NaN becomes null, "not measured"."""
    columns = {"unit": data.unit_name.values.tolist()}
    columns |= {str(name): data[name].values.tolist() for name in data.data_vars}
    rows = zip(*columns.values(), strict=True)
    print_json({"units": [dict(zip(columns, row, strict=True)) for row in rows]})
