"""Where the fast model with the free end agrees with the rod, in one place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.verdict import CAUTION, HEAVY, NO_TIP, OUTSIDE, USABLE
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr

Model = Literal["modes", "free-end", "auto"]

PAGE = "docs/when-it-holds"
CONTACTS = (0.15, 0.4)  # ε
FRICTIONS = (0.2, 0.6)
SPEEDS = (0.05, 0.2)  # [m/s]
SHALLOWEST, DEEPEST = 10e-6, 50e-6  # [m] of gaps into which a tip drops from more than the least steep angle
WIDEST_MEAN = 0.009  # [L] mean width of the gaps
BRIDGING = 5.0  # free end over the mean gap from which nearly all gaps are bridged, whatever their depth
# free end over the mean gap, and up to which base angle [rad] it serves from there on
STEEPEST = ((0.0, 0.8), (0.65, 1.0), (1.3, 1.2), (BRIDGING, 1.5))


def steepest(free_end: float, texture: Gaps) -> float:
    """Largest base angle at which the fast model agrees with the rod.

    Parameters
    ----------
    free_end : float
        Length of shaft beyond the contact [m].
    texture : Gaps
        The longer the free end over its mean gap, the steeper.

    Returns
    -------
    float
        θ_b [rad].
    """
    ratio = free_end / float(texture.width.mean())
    return max(angle for least, angle in STEEPEST if ratio >= least)


def limits(whisker: Whisker, posture: Posture, texture: Gaps | HeightProfile, scan: Scan) -> list[str]:
    """What lies outside the region in which the fast model was found to agree with the rod.

    There envelopes of modes 1 and 2 correlate by 0.95 or more without a lag, and their rms are within 11 % of the
    rod's; see docs/when-it-holds.md. It holds for straight whiskers alone: 1 /m of curvature takes
    mode 2 to 0.7 to 0.9.

    Parameters
    ----------
    whisker, posture, texture, scan
        What is drawn past what.

    Returns
    -------
    list of str
        A reason each; none where it agrees.
    """
    if isinstance(texture, HeightProfile):
        return ["the surface is not gaps"]
    if posture.adhesion > 0:
        return ["friction is adhesive"]
    ranges = (
        ("contact", posture.contact, CONTACTS, ""),
        ("friction", posture.friction, FRICTIONS, ""),
        ("speed", scan.speed, SPEEDS, " m/s"),
    )
    found = [
        f"{name} {value:g}{unit} is not in {low:g} to {high:g}"
        for name, value, (low, high), unit in ranges
        if not low <= value <= high
    ]
    most = steepest((posture.contact - whisker.tip) * whisker.length, texture)
    if posture.base_angle > most:
        found.append(f"base angle {posture.base_angle:.3g} is above {most:g} rad for this free end")
    found += _of_gaps(whisker, posture, texture)
    return found


def _of_gaps(whisker: Whisker, posture: Posture, texture: Gaps) -> list[str]:
    """What lies outside the region of the gaps' widths and depth."""
    found, mean = [], float(texture.width.mean())
    if mean > WIDEST_MEAN * whisker.length:
        found.append(f"mean gap {mean / whisker.length:.2g} L is above {WIDEST_MEAN:g} L")
    bridging = (posture.contact - whisker.tip) * whisker.length >= BRIDGING * mean
    if texture.depth < SHALLOWEST:
        found.append(f"gaps are shallower than {1e6 * SHALLOWEST:g} µm")
    elif texture.depth > DEEPEST and posture.base_angle > STEEPEST[0][1] and not bridging:
        found.append(f"gaps are deeper than {1e6 * DEEPEST:g} µm")
    return found


def chosen(posture: Posture, texture: Gaps | HeightProfile) -> Literal["modes", "free-end"]:
    """Model that ``auto`` means: the fast one with the free end wherever it can be had.

    Of mode 1 it was nearer to the rod than the single contact in every posture and with every free end that was
    compared, those that allow all jumps included. Heights that are not gaps and adhesive friction have the single
    contact alone.

    Parameters
    ----------
    posture, texture
        What is drawn past what.

    Returns
    -------
    {"modes", "free-end"}
        By name.
    """
    return "modes" if isinstance(texture, HeightProfile) or posture.adhesion > 0 else "free-end"


def free_end_verdict(facts: xr.Dataset, whisker: Whisker, posture: Posture, texture: Gaps, scan: Scan) -> str:
    """Verdict on a scan by the fast model: how many jumps the free end allows, and where the rod is needed.

    *Caution*: no physical tip was given; own weight above 0.2 of the contact force, which it leaves out. *Outside the
    model*: outside the region in which it agrees with the rod.

    Parameters
    ----------
    facts : Dataset
        What :meth:`vibrissa.mechanics.free_end.free_end_prediction.FreeEndPrediction.sampled` gives.
    whisker, posture, texture, scan
        What is drawn past what.

    Returns
    -------
    str
        One line.
    """
    allowed, count = int(facts.jumps_allowed), int(facts.jump_count)
    jumps = f"{allowed} of {count} jumps and bridges the other gaps" if allowed else f"no jump and bridges {count} gaps"
    free_end = f"its free end, which allows {jumps}"
    said = f"fast model of a straight whisker with {free_end}"
    beyond = limits(whisker, posture, texture, scan)
    reasons: list[str] = []
    if whisker.tip == 0:
        reasons.append(NO_TIP)
    weight = float(facts.weight_ratio)
    if weight > HEAVY:
        reasons.append(f"own weight is {weight:.2g} of the contact force")
    level = OUTSIDE if beyond else CAUTION if reasons else USABLE
    needs = [f"{', '.join(beyond)}: the model needed is the rod"] if beyond else []
    return f"{level}: {'; '.join([*needs, said, *reasons])} ({PAGE})"
