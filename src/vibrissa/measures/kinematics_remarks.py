"""What the reader of kinematics should know: what angles are to, what was not measured, and what touches rest on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vibrissa.arrays import Array
from vibrissa.measures.face import SIDES, Face, Side
from vibrissa.measures.whisk_cycle import PERIODS, stretches

MOST = 0.8  # share of the angles that have a phase, below which a remark says so
DEEP = 0.1  # share of the touching frames in which a line runs deep inside the object, from which on it is said
SPOILT = 0.25  # share of a whisker's frames in which its base part is no arc, from which on it is said
SINGLE = 0.5  # share of the touches that last one frame, from which on it is said


def remark_on_face(face: Face, nose: Side | None, known: bool, downwards: bool) -> list[str]:
    """What angles are to, how surely that is known, and whether it is not the axis of a head that is known."""
    instead = "; without `nose`, to the axis of the head" if known and nose is not None else ""
    fitted = ""
    if nose is not None and np.isfinite(face.direction_sd):
        side = np.array(SIDES[nose]) * (1 if downwards else (1, -1))
        tilt, error = np.degrees([np.arccos(min(float(face.direction @ side), 1.0)), face.direction_sd])
        fitted = (
            f", {tilt:.1f} ± {error:.1f}° (standard error) from the image's axis to the {nose}: an error of this line "
            "shifts all angles alike; `face` gives it by two points"
        )
    return [f"angles are to {face.origin}{fitted}{instead}"]


def remark_on_frames(columns: Mapping[str, Array], followed: int, band: tuple[float, float], bridged: int) -> list[str]:
    """Lines without an angle, and whiskers and frames without a phase.

    Parameters
    ----------
    columns : mapping
        Series of all whiskers (W, T).
    followed : int
        In how many whiskers' frames a node is seen.
    band : (float, float)
        Of whisking [Hz].
    bridged : int
        Frames of a gap that is bridged.

    Returns
    -------
    list of str
        Remarks.
    """
    measured, phase, needed = np.isfinite(columns["whisker_angle"]), columns["whisking_phase"], PERIODS / band[0]
    remarks = []
    if short := followed - int(measured.sum()):
        remarks.append(
            f"{short} of {followed} lines have no angle: less than half of their base part is seen, or the standard "
            "deviation of its direction is above 30°, or unknown where other nodes have one"
        )
    if silent := int((~np.isfinite(phase)).all(axis=1).sum()):
        remarks.append(
            f"{silent} of {len(phase)} whiskers {'has' if silent == 1 else 'have'} no phase: none is seen for "
            f"{needed:.3g} s without a gap of more than {bridged} frames; `bridged` bridges longer gaps"
        )
    if (share := np.isfinite(phase)[measured].mean() if measured.any() else 1.0) < MOST:
        cycle = np.isfinite(columns["set_point"])[measured].mean()
        remarks.append(
            f"{100 * share:.0f} % of the angles have a phase, {100 * cycle:.0f} % an amplitude and a set point: there "
            f"are none in stretches below {needed:.3g} s between gaps of more than {bridged} frames, nor within "
            f"{needed / 4:.3g} s of the ends of others; a whisker is lost more often where it moves fast, so what is "
            "left may be of quiet periods alone"
        )
    return remarks


def remark_on_base(
    names: Sequence[str], excess: Sequence[Array], columns: Mapping[str, Array], part: tuple[float, float]
) -> list[str]:
    """Whiskers whose base part is often no arc, and a part farther out.

    Parameters
    ----------
    names : sequence of str
        Of the whiskers.
    excess : sequence of (T,) arrays
        Scatter of the nodes about the arc over what their standard deviations explain.
    columns : mapping
        Series of all whiskers (W, T).
    part : (float, float)
        Arc lengths between which they are measured [m].

    Returns
    -------
    list of str
        Remarks.
    """
    measured = np.isfinite(columns["whisker_angle"])
    spoilt = np.array([(one > 1)[of].mean() if of.any() else 0.0 for one, of in zip(excess, measured, strict=True)])
    named = np.flatnonzero(spoilt >= SPOILT)
    if not named.size:
        return []
    whose = f"of the whisker{'s' * (named.size > 1)} labelled {', '.join(np.array(names)[named])}"
    misfit = 1e3 * np.array([np.median(columns["base_misfit"][w, measured[w]]) for w in named])
    start, stop = (1e3 * (end + (part[1] - part[0]) / 3) for end in part)
    return [
        f"the base part {whose} is no arc within the error of its nodes in {100 * spoilt[named].min():.0f} % of the "
        f"frames or more (distance to it, median: up to {misfit.max():.2g} mm): hairs or fur at the base change angle, "
        f"amplitude and curvature; measure farther out, for example from {start:.2g} to {stop:.2g} mm (`base_part`)"
    ]


def remark_on_touches(columns: Mapping[str, Array], near: float | None, found: bool) -> list[str]:
    """What touches and Δκ rest on.

    Parameters
    ----------
    columns : mapping
        Series of all whiskers (W, T).
    near : float or None
        Distance of a touch [m]; None where none are sought.
    found : bool
        Whether touches were found from bending.

    Returns
    -------
    list of str
        Remarks.
    """
    held, known = np.nansum(columns["rest_held"]), np.isfinite(columns["rest_held"]).sum()
    if near is None:
        return ["no touches are sought: the curvature at rest is the median over all frames"]
    remarks = []
    if held:
        remarks.append(
            f"in {int(held)} of {int(known)} frames the angle lies beyond those of the free whisker: there Δκ is "
            "against its curvature at the end of them (rest_held)"
        )
    if found:
        places = int(np.isfinite(columns["object_x"]).sum())
        remarks.append(
            f"of {columns['object_x'].size} whiskers, {places} are held at one place while bent: their touches are by "
            "the distance to it, those of the others by Δκ alone"
        )
        length = np.array([stop - start for one in columns["touching"] for start, stop in stretches(one == 1)])
        if length.size and (length == 1).sum() >= SINGLE * length.size:
            remarks.append(
                f"{(length == 1).sum()} of {length.size} stretches of touch last one frame: a wrong line bends as "
                "suddenly; `least_frames` leaves short ones out"
            )
    return remarks


def remark_on_object(columns: Mapping[str, Array], near: float) -> list[str]:
    """Whether lines come near an object that was given, and whether they run through it.

    Parameters
    ----------
    columns : mapping
        Series of all whiskers (W, T).
    near : float
        Distance of a touch [m].

    Returns
    -------
    list of str
        Remarks.
    """
    distance, touching = columns["object_distance"], columns["touching"] == 1
    if not np.isfinite(distance).any():
        return []
    if not touching.any():
        least = np.min(distance, initial=np.inf, where=np.isfinite(distance))
        return [f"no whisker touches the object: the nearest line passes {1e3 * least:.3g} mm from it"]
    deep = int((distance[touching] < -near).sum())
    if deep < DEEP * touching.sum():
        return []
    where = f"in {deep} of {touching.sum()} touching frames a line runs more than {1e3 * near:.2g} mm inside the object"
    return [f"{where}, the farthest {-1e3 * np.min(distance[touching]):.2g} mm: are its place and its size right?"]
