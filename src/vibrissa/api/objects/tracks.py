"""Tracks of whiskers from any object that holds them, and back to movement: a profile's nodes are keypoints."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from os import PathLike
from typing import Any, Literal

import numpy as np
import xarray as xr

from vibrissa.errors import ConflictError, MissingError, ShapeError, UnknownError
from vibrissa.quantities import dataset, require
from vibrissa.quantities.schema import conforming
from vibrissa.signals.even_times import even_rate
from vibrissa.tables.kinds import described
from vibrissa.tables.units import in_si
from vibrissa.video.foreign.keypoints import LIKELIHOOD, keypoints_of, profile_from_keypoints
from vibrissa.video.foreign.tracks import read_tracks
from vibrissa.video.foreign.whisk_profile import Identity, Side
from vibrissa.video.tracking import Calibration

HERE = "movement dataset"
SD = ("x_sd", "y_sd")
ENDS = {-1: "base", -2: "tip"}  # keypoints that are no nodes, by the number that stands for one
SINGULAR = (0, 17)  # first version of movement whose dimensions are keypoint and individual
MOVEMENT = ("fps", "time_unit", "source_software", "ds_type", "source_file", "log")  # attributes that movement writes


def as_tracks(
    thing: Any,
    *,
    frame_rate: float | None = None,
    pixel_size: float | None = None,
    keypoints: Sequence[Sequence[str]] | None = None,
    least_likelihood: float | None = None,
    node_spacing: float | None = None,
    measurements: str | PathLike[str] | None = None,
    identity: Identity | Literal["link"] | None = None,
    whiskers: Sequence[int] | None = None,
    skin: Sequence[tuple[float, float]] | None = None,
    base: Side | None = None,
) -> xr.Dataset:
    """Profile of the whiskers of any object: x and y of nodes along the shaft, in time.

    Parameters
    ----------
    thing : object
        A profile. A ``movement`` poses dataset: its individuals are whiskers, its keypoints nodes from base to tip. The
        name of a file of WHISK, WhiskiWrap, DeepLabCut, SLEAP or WhiskerTracker.
    frame_rate : float, optional
        Of the camera [Hz]; a movement dataset in seconds has its own.
    pixel_size : float, optional
        Side of a pixel [m]; a movement dataset that :func:`to_movement` made has its own.
    keypoints, least_likelihood, node_spacing
        As in :func:`vibrissa.video.foreign.keypoints.profile_from_keypoints`; without a likelihood, 0.6 of DeepLabCut.
    measurements, identity, whiskers, skin, base
        Of files of WHISK and WhiskiWrap, as in :func:`vibrissa.video.foreign.tracks.read_tracks`.

    Returns
    -------
    Dataset
        ``profile``: ``x``, ``y`` (whisker, time, node) and ``arc_length`` (whisker, node) [m], frame ``image``. A
        dataset of :func:`to_movement` keeps its arc length, standard deviations and attributes; of another arc length
        runs through the keypoints. The attribute ``individuals`` lists the names of movement's individuals.

    Raises
    ------
    InputError
        If the object is of no such kind, its frames are uneven, or frame rate or pixel size are not known or contradict
        it.

    Examples
    --------
    >>> import numpy as np
    >>> from vibrissa.quantities import dataset
    >>> arc = np.arange(3) * 1e-3
    >>> bent = dataset({"frame": "image", "pixel_size": 1e-4, "frame_rate": 500.0}, lead=("whisker",), whisker=[0],
    ...     time=np.arange(4) / 500, node=np.arange(3), x=np.tile(arc, (1, 4, 1)), y=np.full((1, 4, 3), 2e-3),
    ...     arc_length=arc[None])
    >>> bool(np.allclose(as_tracks(to_movement(bent)).x, bent.x))
    True
    """
    options: dict[str, Any] = {
        "keypoints": keypoints,
        "least_likelihood": least_likelihood,
        "node_spacing": node_spacing,
    }
    lines: dict[str, Any] = {
        "measurements": measurements,
        "identity": identity,
        "whiskers": whiskers,
        "skin": skin,
        "base": base,
    }
    if isinstance(thing, str | PathLike):
        given = frame_rate is not None or pixel_size is not None
        calibration = _calibration(str(thing), frame_rate, pixel_size) if given else None
        return read_tracks(str(thing), calibration, **options, **lines)
    if not isinstance(thing, xr.Dataset):
        right = "give a profile, a movement poses dataset, or the name of a file"
        raise UnknownError("tracks", "must be an object that holds x and y in time", described(thing), right)
    for name, value in lines.items():
        if value is not None:
            raise ConflictError(name, "must be left out: a dataset has whiskers, not lines", value)
    if "position" in thing:
        return _of_movement(thing, frame_rate, pixel_size, **options)
    require(thing, "time", "node", "x", "y", "arc_length")
    for name, value in {"frame_rate": frame_rate, "pixel_size": pixel_size, **options}.items():
        if value is not None:
            raise ConflictError(name, "must be left out: a profile is in metres and seconds", value)
    return conforming(thing)


def to_movement(profile: xr.Dataset, *, unit: Literal["px", "m"] = "px", ends: bool = False) -> xr.Dataset:
    """Poses dataset of movement from a profile: individuals are whiskers, keypoints nodes along the shaft.

    Parameters
    ----------
    profile : Dataset
        With ``x``, ``y`` (whisker, time, node) and ``arc_length`` [m].
    unit : {"px", "m"}
        Of the positions: pixels of the image, rows downwards, as movement's own readers have them, or metres; stated in
        the attribute ``space_unit`` of ``position``.
    ends : bool
        Whether the keypoints ``base`` and ``tip`` go before and after the nodes: in every frame the first and the last
        node that were seen, which need not be the ends of the hair.

    Returns
    -------
    Dataset
        ``position`` (time, space, keypoints, individuals), the last two in the singular from movement 0.17 on;
        ``confidence``, NaN as a profile has none; ``x_sd`` and ``y_sd`` in the unit of the positions, where the profile
        has them; coordinate ``arc_length`` [m]. Time is in seconds, ``fps`` the frame rate. All attributes are kept:
        ``vibrissa.api.objects.tracks.as_tracks`` gives the profile back.

    Raises
    ------
    InputError
        If pixels are asked of a profile that is not of an image, frames are uneven, or a variable is missing.

    Examples
    --------
    >>> import numpy as np
    >>> from vibrissa.quantities import dataset
    >>> x = np.zeros((1, 4, 2)) + [0.0, 1e-3]
    >>> straight = dataset({"frame": "image", "pixel_size": 1e-4, "frame_rate": 500.0}, lead=("whisker",),
    ...     whisker=[0], time=np.arange(4) / 500, node=np.arange(2), x=x, y=0 * x, arc_length=x[:, 0])
    >>> to_movement(straight).position.sel(space="x")[:, 1, 0].values.tolist()
    [10.0, 10.0, 10.0, 10.0]
    """
    require(profile, "time", "node", "x", "y", "arc_length")
    if unit not in ("px", "m"):
        raise UnknownError("unit", "must be px or m", repr(unit))
    whole = profile if "whisker" in profile.x.dims else profile.expand_dims("whisker")
    scale = _pixel(profile) if unit == "px" else 1.0
    if ends:
        whole = _with_ends(whole)
    order = ("time", "node", "whisker")
    x, y = (whole[name].transpose(*order).values / scale for name in ("x", "y"))
    keypoints, time = ("time", "keypoints", "individuals"), profile.time.values
    more = {name: (keypoints, whole[name].transpose(*order).values / scale) for name in SD if name in whole}
    own = {"fps": even_rate(time, "profile"), "time_unit": "seconds", "source_software": "vibrissa", "ds_type": "poses"}
    arc = whole.arc_length.broadcast_like(whole.x.isel(time=0)).transpose("node", "whisker").values
    names = [f"whisker_{w}" for w in whole.whisker.values]
    poses = xr.Dataset(
        {
            "position": (("time", "space", *keypoints[1:]), np.stack([x, y], 1), {"space_unit": unit}),
            "confidence": (keypoints, np.full(x.shape, np.nan)),
            **more,
        },
        {
            "time": time,
            "space": ["x", "y"],
            "keypoints": [ENDS.get(int(k), f"node_{k}") for k in whole.node.values],
            "individuals": names,
            "node": ("keypoints", whole.node.values),
            "whisker": ("individuals", whole.whisker.values),
            "arc_length": (keypoints[1:], arc, {"units": "m"}),
        },
        {**profile.attrs, **own},
    )
    return poses.rename(_present_names())


def _with_ends(profile: xr.Dataset) -> xr.Dataset:
    """The profile with the first and the last node seen in each frame as nodes of their own, of no arc length."""
    seen = (profile.x.notnull() & profile.y.notnull()).transpose("whisker", "time", "node").values
    count, whole = seen.shape[-1], profile.assign(arc_length=profile.arc_length.broadcast_like(profile.x.isel(time=0)))
    chosen = {"base": seen.argmax(axis=-1), "tip": count - 1 - seen[..., ::-1].argmax(axis=-1)}
    parts = {}
    for number, name in ENDS.items():
        at = xr.DataArray(chosen[name], dims=("whisker", "time"))
        part = whole[[one for one in whole.data_vars if {"time", "node"} <= set(whole[one].dims)]].isel(node=at)
        parts[name] = part.drop_vars("node").expand_dims(node=[number])
    return xr.concat([parts["base"], whole, parts["tip"]], "node", data_vars="minimal", join="outer")


def _present_names() -> dict[str, str]:
    """Names of the dimensions in the movement that is installed, which are singular from 0.17 on."""
    try:
        number = tuple(map(int, version("movement").split(".")[:2]))
    except PackageNotFoundError:
        return {}
    return {"keypoints": "keypoint", "individuals": "individual"} if number >= SINGULAR else {}


def _pixel(profile: xr.Dataset) -> float:
    if profile.attrs.get("frame") != "image" or "pixel_size" not in profile.attrs:
        found = f"frame {profile.attrs.get('frame')!r}"
        raise MissingError("profile", "must be of an image, with its pixel size", found, "unit='m'")
    return float(profile.attrs["pixel_size"])


def _given(name: str, value: float | None, here: str) -> float:
    if value is None:
        example = {"frame_rate": "500.0", "pixel_size": "95e-6"}[name]
        raise MissingError(name, f"must be given: {here} does not state it", None, f"{name}={example}")
    return float(value)


def _calibration(here: str, frame_rate: float | None, pixel_size: float | None) -> Calibration:
    rate, size = _given("frame_rate", frame_rate, here), _given("pixel_size", pixel_size, here)
    return Calibration(frame_rate=rate, pixel_size=size)


def _of_movement(data: xr.Dataset, frame_rate: float | None, pixel_size: float | None, **options: Any) -> xr.Dataset:
    data = _plural(data)
    start, rate = _clock(data, frame_rate)
    size = _agreed("pixel_size", pixel_size, data.attrs.get("pixel_size"))
    if "arc_length" in data.coords and rate is not None and not any(one is not None for one in options.values()):
        return _own(data, size)
    calibration = _calibration(HERE, rate, size)
    attrs = {str(name): value for name, value in data.attrs.items() if name not in MOVEMENT}
    attrs |= {"source": HERE, "format": str(data.attrs.get("source_software") or HERE)}
    attrs["individuals"] = json.dumps([str(name) for name in data.individuals.values])
    if options["least_likelihood"] is None:
        options["least_likelihood"] = LIKELIHOOD.get(attrs["format"], 0.0)
    pixels = data.assign(position=data.position * (_metres(data, calibration.pixel_size) / calibration.pixel_size))
    points = keypoints_of(HERE, pixels)
    profile = profile_from_keypoints(points, calibration=calibration, source=HERE, attrs=attrs, **options)
    return profile.assign_coords(time=profile.time + start) if start else profile


def _plural(data: xr.Dataset) -> xr.Dataset:
    """The dataset with movement's usual names of dimensions, of poses."""
    for name in ("individuals", "keypoints"):
        if name not in data.dims:
            other = next((str(dim) for dim in data.dims if name.startswith(str(dim))), None)
            if other is None:
                remedy = "give poses with all their dimensions: data.expand_dims(…); boxes have no keypoints"
                raise ShapeError(HERE, f"must have the dimension {name}", tuple(data.dims), remedy)
            data = data.rename({other: name})
    return data


def _own(data: xr.Dataset, pixel_size: float | None) -> xr.Dataset:
    """The profile of which :func:`to_movement` made the dataset."""
    data = data.isel(keypoints=data.node.values >= 0)
    scale, order = _metres(data, pixel_size), ("individuals", "time", "keypoints")
    places = {axis: data.position.sel(space=axis) for axis in ("x", "y")} | {n: data[n] for n in SD if n in data}
    attrs = {str(name): value for name, value in data.attrs.items() if name not in (*MOVEMENT, "vibrissa_version")}
    return dataset(
        attrs,
        lead=("whisker",),
        whisker=data.whisker.values,
        time=data.time.values,
        node=data.node.values,
        **{name: one.transpose(*order).values * scale for name, one in places.items()},
        arc_length=data.arc_length.transpose("individuals", "keypoints").values,
    )


def _clock(data: xr.Dataset, frame_rate: float | None) -> tuple[float, float | None]:
    """Time of the first frame [s], and frames per second."""
    time = np.asarray(data.time.values, float)
    if data.attrs.get("time_unit") == "seconds":
        return float(time[0]), _agreed("frame_rate", frame_rate, even_rate(time, HERE))
    if (np.diff(time) != 1).any():
        remedy = "keep every frame; those without a whisker are NaN"
        raise ShapeError(HERE, "must have a row for every frame", f"frames {time[:3].astype(int)}…", remedy)
    return float(time[0] / frame_rate) if frame_rate else 0.0, frame_rate


def _agreed(name: str, given: float | None, own: float | None) -> float | None:
    """The value given or the object's own, which must not contradict each other."""
    if given is not None and own is not None and not np.isclose(given, own, rtol=1e-6):
        raise ConflictError(name, f"must be that of the {HERE}, {own:.6g}, or be left out", given)
    return own if own is not None else given


def _metres(data: xr.Dataset, pixel_size: float | None) -> float:
    """Metres of the unit that the positions state, pixels where they state none."""
    unit = str(data.position.attrs.get("space_unit", "px"))
    if unit in ("px", "pixel", "pixels"):
        return _given("pixel_size", pixel_size, HERE)
    scale, si = in_si(1.0, unit)
    if si != "m":
        raise UnknownError(f"{HERE}: space_unit", "must be px, m, mm or um", repr(unit))
    return scale
