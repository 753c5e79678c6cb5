"""Both ends of a tracked whisker that the camera does not show: where it leaves the skin, and its contact."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from scipy.stats import t as student

from vibrissa.arrays import Array
from vibrissa.errors import MissingError, RangeError, ShapeError, TooFewError, UnknownError, give_in
from vibrissa.quantities import dataset, measured_sd, require
from vibrissa.video.profile.tangent import parabola, tapered

if TYPE_CHECKING:
    import xarray as xr

Line = tuple[tuple[float, float], tuple[float, float]]
Method = Literal["cone", "paper2014"]

WINDOW = {"cone": 6e-3, "paper2014": 3e-3}  # arc length of the visible end that is carried on [m]
BASE_WINDOW = 3e-3  # the same at the skin [m]
# Error of the curve itself, root mean square over ε = 0.1 … 0.4, θ_b = 0.8 … 1.4 and 1.5 to 5 mm hidden of 40 mm: of
# the contact over the span from the far end of the window to it, of its height over drop × span / hidden length
MODEL_ERROR = {"cone": (0.006, 0.01), "paper2014": (0.2, 0.15)}
FURTHEST = 2.0  # extrapolation over the length it is made from, above which it is of no use
LONGEST = 0.5  # [m] of a whisker
FEWEST_NODES = 6
BATCHES = 20  # of consecutive frames, whose means give the noise of the mean, vibration and all
STEP = 1e-8  # of a node for the derivative of the extrapolation [m]
COVERAGE = float(student.ppf(0.975, BATCHES - 1))  # standard deviations in half a 95 % interval


@dataclass(frozen=True)
class _Nodes:
    """Nodes of one end.

    Attributes
    ----------
    mean, places : (2, N) and (T, 2, N) arrays
        Their x and y, mean and in time [m].
    arc, weight : (N,) arrays
        Arc length [m], and one over the standard deviation of a frame.
    reported : (2, N) array
        Standard deviation of x and y of the mean, as the tracker reports it; 0 of the one it does not measure.
    """

    mean: Array
    places: Array
    arc: Array
    weight: Array
    reported: Array


@dataclass(frozen=True)
class _Carried:
    """An extrapolation from some nodes: values (K,), its derivative by the nodes (K, 2, N), covariance (K, K)."""

    values: Array
    response: Array
    covariance: Array


def ends(
    profile: xr.Dataset,
    substrate: Line,
    *,
    whisker_length: float | None = None,
    method: Method = "cone",
    skin: Line | None = None,
    substrate_sd: float | None = None,
    whisker_length_sd: float = 0.0,
) -> xr.Dataset:
    """Skin and contact of a tracked whisker, extrapolated from its mean profile; whether the contact is consistent.

    The visible end must be whisker that bears load: where the free end beyond the contact is seen too, end the region
    that is tracked before the contact. To the skin the whisker is straight, from its first 3 mm that are seen. To the
    contact it is a cone bent by the contact force (``cone``, from the last 6 mm) or a second-degree polynomial
    (``paper2014``, from the last 3 mm), and the contact is where it lies tangent to the substrate line, as in
    [Boubenec2014]_. The polynomial knows no taper: with 3 mm hidden it misses by 1 mm, which its standard deviation
    includes. The paper's rule: a trial whose contact is inconsistent with the line is not to be used; here one whose
    height has a 95 % interval without 0, or that lies further beyond the visible end than twice the part that was used.

    Parameters
    ----------
    profile : Dataset
        One whisker, as :func:`vibrissa.video.tracking.track` gives it.
    substrate : ((x, y), (x, y))
        Two points of the substrate line, in the profile's frame [m].
    whisker_length : float
        Length L of the nontruncated cone from where arc length is 0 [m]; for ``cone``.
    method : {"cone", "paper2014"}
        See above.
    skin : ((x, y), (x, y)), optional
        Two points of the skin's outline [m]; by default the whisker leaves the skin where arc length is 0.
    substrate_sd : float, optional
        Standard deviation of either point across the line [m]; half a pixel by default.
    whisker_length_sd : float
        Standard deviation of L [m].

    Returns
    -------
    Dataset
        ``contact_x``, ``contact_y``, ``contact_arc_length``, ``contact_height`` above the substrate line, ``skin_x``,
        ``skin_y``, ``skin_arc_length``, each with ``_sd``, all [m]: noise of the mean over ``BATCHES`` batches of
        frames, or as the tracker reports it, of fewer than two frames a batch; the two lines; and the model.
        ``contact_accepted``; the attribute ``rejected`` gives the reason. ``contact`` (ε) if L is given. NaN where the
        curve has no tangent point ahead.

    Raises
    ------
    InputError
        If the profile is not of one whisker, has too few nodes, or lacks what a method needs.
    """
    length_sd = whisker_length_sd if method == "cone" else 0.0
    line_sd = _line_sd(profile, substrate_sd)
    nodes = _nodes(profile, WINDOW[_checked(method, whisker_length)], at_base=False)
    carried = _carried(nodes, lambda places: _estimate(places, nodes, substrate, method, whisker_length))
    # the substrate line and the length are known with an error of their own: its covariance is that of one shift each
    for moved, length in _perturbed(substrate, nodes, line_sd, whisker_length, length_sd):
        off = _estimate(nodes.mean, nodes, moved, method, length) - carried.values
        carried = _Carried(carried.values, carried.response, carried.covariance + np.outer(off, off))
    values, sd = carried.values, np.sqrt(np.diag(carried.covariance + _model(carried.values, nodes, substrate, method)))
    reason = _verdict(values, sd, nodes)
    left = _skin(_nodes(profile, BASE_WINDOW, at_base=True), skin)
    found = _named("contact", ("arc_length", "x", "y", "height"), values, sd)
    if whisker_length is not None:
        found["contact"] = 1 - values[0] / whisker_length
    attrs = {"method": method, "rejected": reason, "substrate": json.dumps(substrate), "substrate_sd": line_sd}
    return dataset(attrs, contact_accepted=not reason, **found, **left)


def _checked(method: Method, whisker_length: float | None) -> Method:
    if method not in get_args(Method):
        raise UnknownError("method", "must be 'cone' or 'paper2014'", repr(method))
    if method == "cone" and whisker_length is None:
        raise MissingError("whisker_length", "must be given", remedy="or take method 'paper2014', which knows no taper")
    if whisker_length is not None and not 0 < whisker_length < LONGEST:
        raise RangeError(
            "whisker_length",
            f"must be positive, below {LONGEST} m",
            whisker_length,
            give_in("m", whisker_length, "mm", 1e-3),
        )
    return method


def _line_sd(profile: xr.Dataset, substrate_sd: float | None) -> float:
    if substrate_sd is None and "pixel_size" not in profile.attrs:
        raise MissingError("substrate_sd", "must be given where the profile has no pixel size")
    sd = profile.attrs["pixel_size"] / 2 if substrate_sd is None else substrate_sd
    if not sd >= 0:
        raise RangeError("substrate_sd", "must not be negative", substrate_sd)
    return float(sd)


def _nodes(profile: xr.Dataset, window: float, at_base: bool) -> _Nodes:
    """Nodes seen in half of the frames or more, within ``window`` of either visible end."""
    require(profile, "x", "y", "arc_length", "time")
    if profile.x.ndim != 2:
        raise TooFewError("profile", "must be of one whisker", f"dimensions {profile.x.dims}", "select one")
    measured, arc = measured_sd(profile), profile.arc_length.values
    sd = measured.values
    seen = np.flatnonzero(np.isfinite(sd).mean(axis=0) >= 0.5)
    if seen.size:
        reach = arc[seen] - arc[seen[0]] if at_base else arc[seen[-1]] - arc[seen]
        seen = seen[reach <= window]
    if seen.size < FEWEST_NODES:
        rule = f"must have {FEWEST_NODES} nodes in {window * 1e3:g} mm at its end, seen in half the frames"
        raise TooFewError("profile", rule, seen.size, "choose a smaller node spacing")
    places = np.stack([profile.x.values[:, seen], profile.y.values[:, seen]], axis=1)
    places = np.where(np.isfinite(sd[:, None, seen]), places, np.nan)
    scatter = np.nansum(np.nanvar(places, axis=0), axis=0)
    variance, reported = np.nanmean(sd[:, seen] ** 2, axis=0), np.zeros((2, seen.size))
    reported[int(measured.name == "y_sd")] = np.sqrt(variance / np.isfinite(sd[:, seen]).sum(axis=0))
    return _Nodes(np.nanmean(places, axis=0), places, arc[seen], 1 / np.sqrt(scatter + variance), reported)


def _frame(places: Array, substrate: Line) -> tuple[Array, Array, Array]:
    """A point of the substrate, unit vector along it towards the base, and across it to the whisker's side."""
    start, stop = np.array(substrate, float)
    if not np.hypot(*(stop - start)) > 0:
        raise ShapeError("substrate", "must be two different points", substrate)
    along = (stop - start) / np.hypot(*(stop - start))
    along = along * (1.0 if along @ (places[:, 0] - places[:, -1]) > 0 else -1.0)
    above = np.array([-along[1], along[0]])
    return start, along, above * (1.0 if above @ (places.mean(axis=1) - start) > 0 else -1.0)


def _estimate(places: Array, nodes: _Nodes, substrate: Line, method: Method, length: float | None) -> Array:
    """Arc length, x, y and height above the substrate line of the contact."""
    start, along, above = _frame(nodes.mean, substrate)
    u, v = along @ (places - start[:, None]), above @ (places - start[:, None])
    curve = parabola if length is None or method == "paper2014" else partial(tapered, length=length)
    arc, at, height = curve(u, v, nodes.arc, nodes.weight)
    return np.array([arc, *(start + at * along + height * above), height])


def _carried(nodes: _Nodes, estimate: Callable[[Array], Array]) -> _Carried:
    """An estimate from the mean places, with its derivative and the covariance that their noise gives it."""
    values = estimate(nodes.mean)
    response = np.empty((values.size, *nodes.mean.shape))
    for index in np.ndindex(nodes.mean.shape):
        moved = nodes.mean.copy()
        moved[index] += STEP
        response[:, *index] = (estimate(moved) - values) / STEP
    if len(nodes.places) < 2 * BATCHES:
        return _Carried(values, response, np.einsum("kcn,jcn,cn->kj", response, response, nodes.reported**2))
    means = np.array([_mean(batch) for batch in np.array_split(nodes.places, BATCHES)])
    known = means[~np.isnan(means).any(axis=(1, 2))]
    if len(known) < BATCHES // 2:
        raise TooFewError("profile", f"must show its end in {BATCHES // 2} of {BATCHES} parts of its time", len(known))
    course = np.einsum("kcn,bcn->kb", response, known - nodes.mean)
    return _Carried(values, response, np.atleast_2d(np.cov(course)) / len(known))


def _mean(places: Array) -> Array:
    seen = np.isfinite(places)
    return np.where(seen.any(axis=0), np.where(seen, places, 0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1), np.nan)


def _perturbed(
    substrate: Line, nodes: _Nodes, line_sd: float, length: float | None, length_sd: float
) -> list[tuple[Line, float | None]]:
    """What is given, with either point of the line or the length off by one standard deviation."""
    above = _frame(nodes.mean, substrate)[2]
    first, last = np.array(substrate, float)
    lines: list[Any] = [(first + line_sd * above, last), (first, last + line_sd * above)]
    longer = [(substrate, length + length_sd)] if length is not None and length_sd > 0 else []
    return [(line, length) for line in lines] + longer


def _model(values: Array, nodes: _Nodes, substrate: Line, method: Method) -> Array:
    """Covariance that the error of the curve gives to arc length, x, y and height."""
    start, along, above = _frame(nodes.mean, substrate)
    hidden, span = values[0] - nodes.arc[-1], values[0] - nodes.arc[0]
    drop = above @ (nodes.mean[:, -1] - start) - values[3]
    far, high = MODEL_ERROR[method][0] * span, MODEL_ERROR[method][1] * drop * span / hidden
    directions = np.array([[far, *(far * along), 0.0], [0.0, *(high * above), high]])
    return np.asarray(directions.T @ directions)


def _verdict(values: Array, sd: Array, nodes: _Nodes) -> str:
    """Why a trial is not to be used; empty if it is."""
    far, seen = values[0] - nodes.arc[-1], nodes.arc[-1] - nodes.arc[0]
    height, sd = values[3], sd[3]
    if not np.isfinite(height):
        return "the visible end does not bend towards a tangent point on the substrate"
    if not 0 <= far <= FURTHEST * seen:
        used = f"of which {seen * 1e3:.2g} mm were used"
        return f"the contact would lie {far * 1e3:.3g} mm beyond the visible end, {used}"
    if abs(height) <= COVERAGE * sd:
        return ""
    side = "above" if height > 0 else "below"
    off = f"{abs(height) * 1e6:.0f} µm {side} the substrate line"
    return f"the extrapolated contact is {off}, uncertain by {sd * 1e6:.0f} µm"


def _skin(nodes: _Nodes, skin: Line | None) -> dict[str, Any]:
    """Arc length, x and y of the skin, each with its standard deviation."""
    straight = _carried(nodes, lambda places: _meets(places, nodes, skin, 1))
    # what a bend of the whisker would make of it
    bent = _meets(nodes.mean, nodes, skin, 2) - straight.values
    sd = np.sqrt(np.diag(straight.covariance) + bent**2)
    return _named("skin", ("arc_length", "x", "y"), straight.values, sd)


def _named(place: str, names: tuple[str, ...], values: Array, sd: Array) -> dict[str, Any]:
    """Values and standard deviations of a place by their names in the dataset."""
    keys = [f"{place}_{name}" for name in names]
    return dict(zip(keys, values, strict=True)) | dict(zip((f"{key}_sd" for key in keys), sd, strict=True))


def _meets(places: Array, nodes: _Nodes, skin: Line | None, degree: int) -> Array:
    """Where a polynomial along the shaft meets the skin's outline, or where arc length is 0."""
    first = nodes.arc[0]
    course = [np.polyfit(nodes.arc - first, values, degree, w=nodes.weight) for values in places]
    arc = 0.0
    if skin is not None:
        start, stop = np.array(skin, float)
        normal = np.array([start[1] - stop[1], stop[0] - start[0]])
        off = normal[0] * course[0] + normal[1] * course[1]
        off[-1] -= normal @ start
        roots = np.roots(off)
        real = roots[np.isreal(roots)].real
        if not real.size:
            return np.full(3, np.nan)
        arc = first + real[np.argmin(np.abs(real))]
    return np.array([arc, *(np.polyval(one, arc - first) for one in course)])
