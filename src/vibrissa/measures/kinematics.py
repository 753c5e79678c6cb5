"""Kinematics of the whiskers of a profile: what is measured of each in every frame, and its touches."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import ConflictError, MissingError, RangeError, TooFewError, require_not_negative, require_positive
from vibrissa.head_pose import HeadPose, head_of
from vibrissa.measures.base_arc import LEAST_NODES, fit_base_arc
from vibrissa.measures.bending import bending, bent_frames
from vibrissa.measures.face import Face, Side, face_through, whisker_names
from vibrissa.measures.hidden_parts import distance_with_hidden_parts
from vibrissa.measures.kinematics_remarks import (
    remark_on_base,
    remark_on_face,
    remark_on_frames,
    remark_on_object,
    remark_on_touches,
)
from vibrissa.measures.touched_object import Pole, Touchable, held_place
from vibrissa.measures.touches import long_touches, touch_events, touch_table
from vibrissa.measures.whisk_cycle import BAND, frame_rate_of, whisk_cycle
from vibrissa.measures.whisker_nodes import mean_base, mean_way, nodes_of, seen_frames, surely_named, usual_length
from vibrissa.quantities import dataset, require, stacked
from vibrissa.quantities.tracks import stored_names

if TYPE_CHECKING:
    import xarray as xr

SHARE = 0.25  # of the usual arc length of the longest whisker, from the base, by default taken for the base
PIXELS = 2.0  # distance to an object by default taken for touch
HIDDEN = 5.0  # times that distance: up to which a pole hides a line
IN_TIME = (
    "whisker_angle",
    "whisker_angle_sd",
    "image_angle",
    "whisking_phase",
    "whisking_amplitude",
    "set_point",
    "whisking_frequency",
    "whisker_curvature",
    "whisker_curvature_sd",
    "base_misfit",
    "rest_curvature",
    "rest_held",
    "curvature_change",
    "object_distance",
    "touching",
)
NEEDS_TOUCH = ("object_distance", "touching", "object_x", "object_y")


@dataclass(frozen=True, kw_only=True)
class KinematicsSettings:
    """How whiskers are measured.

    Attributes
    ----------
    face : Face, optional
        Line of the face; without it, it is the head's axis where the head is known, else fitted to the bases. It moves
        with the head, its points are of the first frame in which the head is known.
    nose : {"left", "right", "top", "bottom"}, optional
        Side of the image to which the nose points; must be given without ``face``, but where the head is known.
    dorsal : {"left", "right", "top", "bottom"}, optional
        Side of the image to which the back points, in a view from the side: names by row and column.
    base_part : (float, float), optional
        Arc lengths between which direction and curvature are measured [m]; by default a quarter of the
        length up to which the longest whisker is usually seen, and at least three nodes of each whisker.
    whisking_band : (float, float)
        Corners of the band of the whisking cycle [Hz].
    bridged : int
        Longest gap of unseen frames that is bridged for the filter, and does not end a touch.
    touched : Pole or Wall, optional
        What is touched.
    touch_distance : float, optional
        Distance of the centreline to its surface up to which it touches [m]; two pixels by default.
    find_touches : bool
        Whether touches are found from the bending of the whisker, where no object is given.
    least_frames : int
        Frames below which a touch is left out, and its frames count as free.
    least_probability : float, optional
        Probability of a name below which the whisker counts as not seen; else that of the tracking. The face, the
        base part and the labels are those of all names.
    """

    face: Face | None = None
    nose: Side | None = None
    dorsal: Side | None = None
    base_part: tuple[float, float] | None = None
    whisking_band: tuple[float, float] = BAND
    bridged: int = 0
    touched: Touchable | None = None
    touch_distance: float | None = None
    find_touches: bool = False
    least_frames: int = 1
    least_probability: float | None = None

    def __post_init__(self) -> None:
        if self.face is not None and self.nose is not None:
            raise ConflictError("nose", "must be left out where the face is given", self.nose)
        require_positive("touch_distance", self.touch_distance, "m")
        require_not_negative("bridged", self.bridged)
        require_positive("least_frames", self.least_frames)


def kinematics_of(profile: xr.Dataset, settings: KinematicsSettings) -> xr.Dataset:
    """Angle, whisking cycle, curvature and touches of every whisker of a profile.

    Parameters
    ----------
    profile : Dataset
        ``x``, ``y`` ([whisker,] time, node) and ``arc_length`` [m]; ``y_sd``, ``x_sd`` where it has them.
    settings : KinematicsSettings
        How.

    Returns
    -------
    Dataset
        On (whisker, time), and (touch) where touches were sought; see ``quantities/kinematics.py``. NaN where the
        whisker was not seen. The attribute ``remarks`` is a list (JSON).

    Raises
    ------
    InputError
        If the profile has too few nodes in the part measured, is uneven in time, or settings do not fit it.
    """
    require(profile, "time", "x", "y", "arc_length")
    whole = profile if "whisker" in profile.x.dims else profile.expand_dims("whisker")
    head = head_of(profile)
    every = [nodes_of(whole.isel(whisker=w), head) for w in range(whole.sizes["whisker"])]
    down = profile.attrs.get("frame", "image") == "image"
    bases, ways = (np.array([mean(one) for one in every]) for mean in (mean_base, mean_way))
    frames = np.array([seen_frames(one).sum() for one in every])
    face = _face(settings, head, bases, ways, frames, down)
    turned = np.zeros(whole.sizes["time"]) if head is None else head.turned()
    numbers = whole.whisker.values if "whisker" in whole.coords else np.arange(len(every))
    given = _given_names(whole)
    names = whisker_names(bases, face, settings.dorsal, ways=ways, downwards=down, given=given)
    time, near = np.asarray(whole.time.values, float), _touch_distance(profile, settings)
    part = settings.base_part or _base_part(every)
    _refuse_beyond(part, every)
    whiskers = surely_named(every, profile, settings.least_probability)
    rows = [_of_whisker(time, one, face, turned, part, settings, near) for one in whiskers]
    each = zip(names, numbers, [row.pop("events") for row in rows], strict=True)
    events = [
        {"touch_whisker": name, "touch_whisker_number": number, **event}
        for name, number, touches in each
        for event in touches
    ]
    excess, columns = [row.pop("excess") for row in rows], stacked(rows)
    spoilt = remark_on_base(names, excess, columns, part)
    followed = int(sum(seen_frames(one).sum() for one in whiskers))
    return dataset(
        _attributes(profile, settings, face, part, near, columns, followed, spoilt),
        lead=("whisker",),
        whisker=numbers,
        time=time,
        whisker_label=np.array(names),
        mean_base_x=bases[:, 0],
        mean_base_y=bases[:, 1],
        **{name: values for name, values in columns.items() if near is not None or name not in NEEDS_TOUCH},
        **(touch_table(events) if near is not None else {}),
    )


def _given_names(profile: xr.Dataset) -> list[str]:
    """Names given to whiskers, by their numbers in the tracks; "" where none was, or two whiskers have the same."""
    stored = stored_names(profile) or [""] * profile.sizes["whisker"]
    given = ["" if re.fullmatch(r"whisker \d+", one) else one for one in stored]
    return [one if given.count(one) == 1 else "" for one in given]


def _face(
    settings: KinematicsSettings, head: HeadPose | None, bases: Array, ways: Array, frames: Array, down: bool
) -> Face:
    """Line of the face: as given, the head's axis, or by the bases."""
    if settings.face is not None:
        return settings.face
    if head is not None and settings.nose is None:
        way = np.deg2rad(head.angle[head.first])
        return Face(caudal=(0.0, 0.0), rostral=(float(np.cos(way)), float(np.sin(way))), origin="the head's axis")
    if settings.nose is None:
        raise MissingError("nose", "must be given where the face is not", remedy="give the side it points to")
    return face_through(bases, settings.nose, frames, ways=ways, downwards=down)


def _touch_distance(profile: xr.Dataset, settings: KinematicsSettings) -> float | None:
    """Distance below which a whisker touches; None where no touches are sought."""
    if settings.touched is None and not settings.find_touches:
        return None
    if settings.touch_distance is not None:
        return settings.touch_distance
    if "pixel_size" not in profile.attrs:
        raise MissingError("touch_distance", "must be given: the profile does not state its pixel size")
    return PIXELS * float(profile.attrs["pixel_size"])


def _of_whisker(
    time: Array,
    nodes: Mapping[str, Array],
    face: Face,
    turned: Array,
    part: tuple[float, float],
    settings: KinematicsSettings,
    near: float | None,
) -> dict[str, Any]:
    """All that is measured of one whisker, by the names of the table, its ``events``, and the ``excess`` of its arc."""
    arc = nodes["arc_length"]
    inside = (arc >= part[0]) & (arc <= part[1])
    _refuse_few(arc, inside, part)
    x, y = nodes["x"], nodes["y"]
    sds = [nodes[name][:, inside] if name in nodes else None for name in ("x_sd", "y_sd")]
    base = fit_base_arc(arc[inside], x[:, inside], y[:, inside], sds[0], sds[1])
    turn = face.turn(base.direction)
    angle, curvature = face.angle(base.direction, turn), turn * base.curvature
    cycle = whisk_cycle(time, angle, band=settings.whisking_band, bridged=settings.bridged)
    touching, distance, place = _contact(nodes["image_x"], nodes["image_y"], angle, curvature, settings, near)
    touching = long_touches(touching, settings.least_frames, settings.bridged)
    bent = bending(angle, curvature, touching != 1)
    events = touch_events(
        time,
        touching,
        angle=angle,
        phase=cycle.phase,
        change=bent.change,
        bridged=settings.bridged,
    )
    series = (
        angle,
        base.direction_sd,
        (base.direction + turned + np.pi) % (2 * np.pi) - np.pi,
        *cycle,
        curvature,
        base.curvature_sd,
        base.misfit,
        *bent,
        distance,
        touching,
    )
    return {
        **dict(zip(IN_TIME, series, strict=True)),
        "object_x": place[0],
        "object_y": place[1],
        "events": events,
        "excess": base.excess,
    }


def _base_part(whiskers: list[dict[str, Array]]) -> tuple[float, float]:
    """A quarter of the usual length of the longest whisker; longer where nodes are few, as keypoints are."""
    few = [np.sort(one["arc_length"][np.isfinite(one["arc_length"])])[:LEAST_NODES] for one in whiskers]
    return 0.0, max(SHARE * max(map(usual_length, whiskers)), *(float(arc[-1]) for arc in few if arc.size))


def _refuse_beyond(part: tuple[float, float], whiskers: list[dict[str, Array]]) -> None:
    """Refuse a base part that does not ascend, or ends beyond all nodes."""
    furthest = max(float(np.nanmax(one["arc_length"], initial=0)) for one in whiskers)
    if not 0 <= part[0] < part[1] <= furthest * (1 + 1e-9):
        found = f"{1e3 * part[0]:.4g} to {1e3 * part[1]:.4g} mm"
        raise RangeError(
            "base_part", "must ascend, within the nodes", found, f"the nodes reach to {1e3 * furthest:.4g} mm"
        )


def _refuse_few(arc: Array, inside: Mask, part: tuple[float, float]) -> None:
    """Refuse a base part with too few nodes."""
    if inside.sum() < LEAST_NODES:
        rule = f"must hold {LEAST_NODES} nodes of each whisker or more"
        found = f"{int(inside.sum())} in {1e3 * part[0]:.4g} to {1e3 * part[1]:.4g} mm"
        raise TooFewError("base_part", rule, found, f"the nodes reach to {1e3 * np.nanmax(arc, initial=0):.4g} mm")


def _contact(
    x: Array, y: Array, angle: Array, curvature: Array, settings: KinematicsSettings, near: float | None
) -> tuple[Array, Array, tuple[float, float]]:
    """Whether it touches and the distance to what is touched, both (T,), and where it is held, if that was found."""
    nowhere, unknown = (np.nan, np.nan), np.full(len(x), np.nan)
    if near is None:
        return unknown, unknown, nowhere
    if settings.touched is not None:
        return *_by_distance(settings.touched, x, y, near), nowhere
    bent = bent_frames(angle, curvature)
    place = held_place(x, y, bent, near)
    if place is not None:
        return *_by_distance(Pole(centre=place), x, y, near), place
    return np.where(np.isfinite(curvature), bent * 1.0, np.nan), unknown, nowhere


def _by_distance(touched: Touchable, x: Array, y: Array, near: float) -> tuple[Array, Array]:
    if isinstance(touched, Pole):
        distance = distance_with_hidden_parts(touched, x, y, HIDDEN * near)
    else:
        distance = touched.distance(x, y)
    touches: Mask = distance <= near
    return np.where(np.isfinite(distance), touches * 1.0, np.nan), distance


def _attributes(
    profile: xr.Dataset,
    settings: KinematicsSettings,
    face: Face,
    part: tuple[float, float],
    near: float | None,
    columns: Mapping[str, Array],
    followed: int,
    spoilt: list[str],
) -> dict[str, Any]:
    """What counts as the face, the base and a touch, and remarks on what the user should know."""
    kept = {
        name: profile.attrs[name]
        for name in ("frame", "pixel_size", "frame_rate", "source", "least_probability")
        if name in profile.attrs
    }
    if settings.least_probability is not None:
        kept["least_probability"] = settings.least_probability
    down = profile.attrs.get("frame", "image") == "image"
    remarks = [
        *([] if settings.face is not None else remark_on_face(face, settings.nose, head_of(profile) is not None, down)),
        *remark_on_frames(columns, followed, settings.whisking_band, settings.bridged),
        *spoilt,
        *remark_on_touches(columns, near, settings.find_touches and settings.touched is None),
        *([] if settings.touched is None else remark_on_object(columns, near or 0.0)),
    ]
    return {
        **kept,
        "frame_rate": frame_rate_of(np.asarray(profile.time.values, float)),
        "face_caudal": list(face.caudal),
        "face_rostral": list(face.rostral),
        "face_from": face.origin,
        "base_part": list(part),
        "whisking_band": list(settings.whisking_band),
        "bridged_frames": settings.bridged,
        "touch_distance": np.nan if near is None else near,
        "remarks": json.dumps(remarks, ensure_ascii=False),
    }
