"""What share of the predicted jumps a free end allows, in the first lines of a report."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.scan.diagnostics import percent
from vibrissa.mechanics.scan.free_end import TOO_LARGE
from vibrissa.quantities.kinds import Results
from vibrissa.study.paper.paper_columns import OWNED, truth_of

if TYPE_CHECKING:
    import xarray as xr

COVERED = 0.95  # of the intervals hold the truth, if they are right
_NAMES = ("jump_count", "jumps_allowed")
_CONSEQUENCE = (
    "Where the free end prevents a jump, the shaft bridges the gap. Amplitudes, gains and envelopes of the model are "
    f"those of a whisker whose shaft ends at its contact; {TOO_LARGE} is the largest ratio found in MuJoCo with the "
    "whole length on the ground (vibrissa's page on validation, full length)."
)
BIASED = (
    "Contact ε and base angle θ_b are biased by more than their intervals: over a texture the mean profile is not that "
    "at rest, since the contact dips into the gaps."
)


def validity(results: Results) -> list[str]:
    """Say what share of the jumps the free end allows: of the motion that is shown, and of all sweeps.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study; ``scan`` or ``apparatus``, and ``sweeps``, are looked at.

    Returns
    -------
    list of str
        Sentences; none where nothing is predicted.
    """
    lines = list(_shares(results))
    wrong = any(allowed < count for count, allowed in _counts(results))
    biased = is_biased(results)
    return [*lines, *([_CONSEQUENCE] if lines and wrong else []), *_of_rods(results), *([BIASED] if biased else [])]


def is_biased(results: Results) -> bool:
    """Whether intervals of contact or base angle hold the truth in fewer than 95 % of sweeps, chance aside.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study; ``sweep_verdict`` is looked at.

    Returns
    -------
    bool
        False where no truth is known.
    """
    if "sweep_verdict" not in results:
        return False
    table = results["sweep_verdict"]
    posture = np.isin(table.row_key.values, ["contact", "base_angle"])
    return bool((table.covered_high.values[posture] < COVERED).any())


def _of_rods(results: Results) -> Iterator[str]:
    """What the single contact leaves out, where the truth of virtual sweeps is the rod: two sentences."""
    if "sweeps" not in results or truth_of(results["sweeps"]) != "rod":
        return
    sweeps = results["sweeps"].isel(sweep=np.flatnonzero(results["sweeps"].accepted.values))
    ratio = _known(sweeps.mode_rms_true.values[:, 0] / sweeps.mode_rms_model.values[:, 0])
    if not ratio.size:
        return
    yield (
        f"Of {ratio.size} virtual sweeps a rod with its free end on the ground is the truth: where the single contact "
        f"predicts a motion of mode 1, the rod makes {percent(float(np.median(ratio)))} of it ({percent(ratio.min())} "
        f"to {percent(ratio.max())} in a sweep, rms)."
    )
    held = results.get(f"comparison{OWNED}")
    rho = _known(held.correlation.values[:, 0]) if held is not None else np.empty(0)
    if rho.size:
        yield (
            "The free end that the single contact leaves out bears on the land behind a gap, so that the whisker "
            "bridges the gap; the envelope of what motion is left correlates with the predicted one at "
            f"{np.median(rho):.2f} (median; {rho.min():.2f} to {rho.max():.2f}), the lag being free within 50 ms."
        )


def _known(values: Array) -> Array:
    return values[np.isfinite(values)]


def shown_motion(results: Results) -> xr.Dataset | None:
    """The dataset that holds the jumps of the one motion that a study shows; None where no motion is predicted.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    Dataset or None
        ``scan`` or ``apparatus``.
    """
    some = (results[name] for name in ("scan", "apparatus") if name in results)
    return next((one for one in some if "jump_count" in one), None)


def _shares(results: Results) -> Iterator[str]:
    if (one := shown_motion(results)) is not None:
        where = "sweep that is shown" if "sweep" in results.get("posture", one).attrs else "scan"
        yield _of_motion(1e3 * float(one.free_end_length), int(one.jump_count), int(one.jumps_allowed), where)
    if "sweeps" in results and (line := _of_sweeps(results["sweeps"])):
        yield line


def _of_motion(free: float, count: int, allowed: int, where: str) -> str:
    """Jumps of one motion that the free end allows, with the consequence: the main reservation of a report."""
    if allowed == count:
        return f"Validity: in the {where} the free end ({free:.3g} mm) allows all {count} predicted jumps."
    which = "every gap" if not allowed else f"{count - allowed} of {count} gaps"
    return (
        f"Validity: a real free end, {free:.3g} mm long in the {where}, would bridge {which} that the model lets the "
        f"contact cross with a jump ({allowed} of {count} jumps are possible): the model's amplitudes are up to "
        f"{TOO_LARGE} times too large."
    )


def _of_sweeps(sweeps: xr.Dataset) -> str:
    """Share over all sweeps with a prediction; nothing without one."""
    if "jump_count" not in sweeps or not np.isfinite(sweeps.jump_count.values).any():
        return ""
    count, allowed = (sweeps[name].values[np.isfinite(sweeps.jump_count.values)] for name in _NAMES)
    each = allowed / count
    spread = f"; {percent(each.min())} to {percent(each.max())} in a sweep" if np.ptp(each) else ""
    return (
        f"Validity: over {len(count)} sweeps the free end allows {allowed.sum():.0f} of {count.sum():.0f} predicted "
        f"jumps ({percent(allowed.sum() / count.sum())}{spread})."
    )


def allowed_jumps(sweeps: xr.Dataset) -> str:
    """How many of the predicted jumps of some sweeps the free end allows; nothing without a prediction.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    str
        ``3 of 5``, or "".
    """
    count, allowed = (float(np.nansum(sweeps[name].values)) for name in _NAMES)
    return f"{allowed:.0f} of {count:.0f}" if count else ""


def _counts(results: Results) -> Iterator[tuple[float, float]]:
    """Jumps, and those allowed, of the motion shown and of all sweeps."""
    some = [shown_motion(results), results.get("sweeps")]
    for one in some:
        if one is not None and "jump_count" in one:
            yield float(one.jump_count.sum()), float(one.jumps_allowed.sum())
