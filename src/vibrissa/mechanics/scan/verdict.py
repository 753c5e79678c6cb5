"""Whether a prediction is usable: one line from its diagnostics, with the reason."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa.arrays import Array

if TYPE_CHECKING:
    import xarray as xr

USABLE, CAUTION, OUTSIDE = "usable", "caution", "outside the model"
PAGE = "docs/when-it-holds"
MOST_JUMPS = 0.5  # share of jumps that are not made
MOST_TIME = 0.1  # share of the time
NO_TIP = "no tip was given, so the cone is sharp"
HEAVY, HEAVIER = 0.2, 1.0  # own weight over contact force
NONLINEAR = 0.2  # exact over linear jump, less one
UNCONVERGED = 1e-3  # share of the rod's steps
SHIFTED = 0.05  # resonance about the profile over the straight shaft's, less one
_SLIDING = ("edge", "constant", "coulomb")  # laws by which the contact moves as the vibration asks


class Finding(NamedTuple):
    """One thing that limits a prediction, and how far."""

    level: str
    reason: str


def verdict(facts: Mapping[str, Any] | xr.Dataset) -> str:
    """Verdict on a prediction: usable, caution or outside the model, with the reasons and the page that explains them.

    *Outside the model* are predictions whose larger part is an artefact; *caution* asks for a look at what is named.

    - Jumps that the free end does not allow, or that are steps through smooth valleys: caution for any, outside beyond
      half of them. At each the vibration is many times too large (docs/disagreements.md); beyond half, such jumps
      carry most of the power, and the rms is wrong by √2 or more.
    - Time in which the contact would lift off, or stick because its slip reverses: caution for any, outside beyond a
      tenth of the time. The contact that the modes assume is lost there; a tenth of the time is a tenth of the power.
    - Own weight over contact force: caution above 0.2, outside above 1, where the weight and not the surface holds the
      whisker.
    - Of a scan it is said beside the reasons which model has the free end, if that does not allow a jump, and that no
      physical tip was given: the free end is then that of a sharp cone.
    - A posture beyond the fold: outside, no quasi-static response exists.
    - The linear response where mode 1 jumps by more than 20 % less or more in the exact one: caution.
    - Modes of the straight shaft where those about the profile ring more than 5 % lower or higher while the contact
      slides (edge, friction constant or following the load), or grow: caution. To 0.6 rad it is less.

    Parameters
    ----------
    facts : mapping or Dataset
        What :func:`vibrissa.mechanics.scan.diagnostics.diagnostics` and the like give; what is absent is not judged.

    Returns
    -------
    str
        One line.

    Examples
    --------
    >>> verdict({"jump_count": 20, "jumps_allowed": 0, "free_end_length": 11.6e-3})
    'outside the model: free end prevents 20 of 20 jumps (docs/when-it-holds)'
    >>> verdict({"jump_count": 20, "jumps_allowed": 20, "free_end_length": 0.1e-3})
    'usable: free end prevents 0 of 20 jumps (docs/when-it-holds)'
    """
    found = list(findings(facts))
    level = next((one for one in (OUTSIDE, CAUTION) if any(one == each.level for each in found)), USABLE)
    worst_first = sorted(found, key=lambda each: each.level != level)
    reasons = [each.reason for each in worst_first] or [_well(facts)]
    reasons += _of_scan(facts)
    return f"{level}: {'; '.join(reasons)} ({PAGE})"


def unknown_verdict(contact: float, gap_width: float) -> str:
    """Verdict on a gap crossed by a whisker that is not known.

    Parameters
    ----------
    contact, gap_width : float
        ε and λ, over L.

    Returns
    -------
    str
        One line.
    """
    return f"{CAUTION}: the jump needs a tip beyond s = {contact - gap_width:.3g} ({PAGE})"


def map_verdict(contact: Array, tip: float, length: float, widest: float) -> str:
    """Verdict on a map over contacts: whether the free end can be shorter than the widest gap at all.

    It must be for a jump, but need not suffice: how deep the free end hangs, and narrower gaps, are not looked at.

    Parameters
    ----------
    contact : (E,) array
        Positions of the contact, over L.
    tip, length : float
        Of the whisker: its physical tip, over L, and L [m].
    widest : float
        Width of the widest gap [m].

    Returns
    -------
    str
        One line.

    Examples
    --------
    >>> map_verdict(np.array([0.2, 0.3]), 0.0, 0.04, 0.6e-3)
    'outside the model: free end is longer than every gap at all contacts (docs/when-it-holds)'
    """
    long = (np.asarray(contact) - tip) * length >= widest
    if not long.any():
        return f"{CAUTION}: free end is shorter than the widest gap; whether it allows each jump is not known ({PAGE})"
    where = "all contacts" if long.all() else f"{long.sum()} of {long.size} contacts"
    return f"{OUTSIDE if long.mean() > MOST_JUMPS else CAUTION}: free end is longer than every gap at {where} ({PAGE})"


_MOST_TIP = 0.5  # over L: a tip that would be beyond if it were in metres was not meant in metres
THIN_TIP = 0.03  # over L: where the rod ends if its tip is thinner


def rod_map_verdict(tip: float) -> str:
    """Verdict on a map by the rod, which includes the free end.

    Parameters
    ----------
    tip : float
        Physical tip of the whisker, over L.

    Returns
    -------
    str
        One line.
    """
    whole = "whole whisker, its free end on the ground where it reaches it"
    reason = "" if tip else "no physical tip was given, the shaft ends in a point; "
    return f"{USABLE if tip else CAUTION}: {reason}{whole} ({PAGE})"


def rod_verdict(facts: Mapping[str, Any] | xr.Dataset) -> str:
    """Verdict on a scan by the rod, which includes the free end: which input is missing, and what the rod leaves out.

    *Caution*: no physical tip was given, so that the shaft ends in a point that no whisker has, or one thinner than the
    rod can end in, which would do as a length in metres; own weight above 0.2 of
    the contact force, which the rod leaves out; more than one step in a thousand did not converge; off the ground for
    more than a tenth of the time. *Outside the model*: off the ground for more than half of it.

    Parameters
    ----------
    facts : mapping or Dataset
        What :meth:`vibrissa.mechanics.rod.rod_prediction.RodPrediction.sampled` gives.

    Returns
    -------
    str
        One line.
    """
    reasons = []
    if getattr(facts, "attrs", {}).get("whisker_tip") == 0:
        reasons.append("no physical tip was given, the shaft ends in a point")
    if 0 < (tip := float(getattr(facts, "attrs", {}).get("whisker_tip", 0))) < THIN_TIP:
        length = float(facts.attrs["whisker_length"])  # type: ignore[union-attr]
        if tip < _MOST_TIP * length:
            metres = f"if {1e3 * tip:.3g} mm were meant: {tip / length:.3g}"
            reasons.append(f"the rod ends at {THIN_TIP:g} L, short of the tip at {tip:.3g} L ({metres})")
    if (weight := _of(facts, "weight_ratio", 0)) > HEAVY:
        reasons.append(f"own weight is {weight:.2g} of the contact force")
    if (share := _of(facts, "unconverged_share", 0)) > UNCONVERGED:
        reasons.append(f"{100 * share:.2g} % of the steps did not converge")
    if (share := _of(facts, "detached_share", 0)) > MOST_TIME:
        reasons.append(f"the whisker is off the ground in {100 * share:.0f} % of the time")
    level = OUTSIDE if share > MOST_JUMPS else CAUTION if reasons else USABLE
    way = ", ".join(
        f"{what} {100 * share:.0f} %"
        for what, name in (("bridges", "bridge"), ("sticks", "stick"))
        if (share := _of(facts, f"{name}_share", 0)) >= 0.005
    )
    whole = f"whole whisker{f', which {way} of the time' if way else ''}"
    return f"{level}: {'; '.join([*reasons, whole])} ({PAGE})"


def findings(facts: Mapping[str, Any] | xr.Dataset) -> Iterator[Finding]:
    """What limits a prediction, one by one; nothing where it is usable.

    Parameters
    ----------
    facts
        As of :func:`verdict`.

    Returns
    -------
    iterator of Finding
        Each with its level.
    """
    count = _of(facts, "jump_count", 0)
    if "fold_determinant" in facts and not _of(facts, "fold_determinant") < 0:
        yield Finding(OUTSIDE, "beyond the fold")
    if count and (missed := count - _of(facts, "jumps_allowed", count)):
        yield Finding(_level(missed / count, MOST_JUMPS), _jumps(facts))
    if count and (steps := _of(facts, "valley_steps", 0)):
        yield Finding(_level(steps / count, MOST_JUMPS), f"{steps:.0f} of {count:.0f} jumps are steps through valleys")
    for name, what in (("lift_off", "contact lifts off"), ("slip_reversed", "contact sticks")):
        if (share := _of(facts, name, 0)) > 0:
            yield Finding(_level(share, MOST_TIME), f"{what} in {100 * share:.2g} % of the time")
    if (weight := _of(facts, "weight_ratio", 0)) > HEAVY:
        yield Finding(_level(weight, HEAVIER), f"own weight is {weight:.2g} of the contact force")
    yield from _of_modes(facts)


def _of_modes(facts: Mapping[str, Any] | xr.Dataset) -> Iterator[Finding]:
    attrs = getattr(facts, "attrs", {})
    if attrs.get("response") == "linear" and abs(_of(facts, "linearity", 1) - 1) > NONLINEAR:
        yield Finding(CAUTION, f"mode 1 jumps {_of(facts, 'linearity'):.2f} times the linear response")
    if attrs.get("modes") != "straight" or "resonance_ratio" not in facts:
        return
    laws = [facts.sel(contact_law=law) for law in _SLIDING]  # type: ignore[union-attr]
    if any(float(one.growth_rate[0]) > 0 for one in laws):
        yield Finding(CAUTION, "mode 1 about the profile is unstable")
    off = max((float(one.resonance_ratio[0]) - 1 for one in laws), key=abs)
    if abs(off) > SHIFTED:
        yield Finding(CAUTION, f"first resonance {100 * off:+.0f} % about the profile".replace("-", "−"))


def _of_scan(facts: Mapping[str, Any] | xr.Dataset) -> Iterator[str]:
    """What a scan says beside its findings: which model has the free end, and that no tip was given."""
    attrs = getattr(facts, "attrs", {})
    count = _of(facts, "jump_count", 0) if "scan_speed" in attrs else 0
    if count > _of(facts, "jumps_allowed", count):
        yield f"single contact, take model {'auto' if 'gaps' in attrs else 'rod'}"
    if count and attrs.get("whisker_tip") == 0:
        yield NO_TIP
    if attrs.get("response") == "linear" and "linearity" not in facts:
        yield "how far the linear response holds is not judged"


def _level(value: float, most: float) -> str:
    return OUTSIDE if value > most else CAUTION


def _of(facts: Mapping[str, Any] | xr.Dataset, name: str, absent: float = np.nan) -> float:
    """A fact, of mode 1 where it has modes; what is absent otherwise, and where it is not known."""
    value = float(np.ravel(np.asarray(facts[name]))[0]) if name in facts else absent
    return absent if value != value else value


def _jumps(facts: Mapping[str, Any] | xr.Dataset) -> str:
    count = _of(facts, "jump_count", 0)
    return f"free end prevents {count - _of(facts, 'jumps_allowed', 0):.0f} of {count:.0f} jumps"


def _well(facts: Mapping[str, Any] | xr.Dataset) -> str:
    return _jumps(facts) if _of(facts, "jump_count", 0) else "contact never jumps"
