"""From tracked centrelines back to modal amplitudes (Eqs. 2, 14 and 15)."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial

from vibrissa.arrays import Array, Mask
from vibrissa.errors import MissingError, RangeError, TooFewError, UnknownError
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.inverse.modal_fit import TAIL, blocks, projection, some_nodes, variance_explained, with_tail
from vibrissa.mechanics.inverse.steady_nodes import steady_nodes
from vibrissa.mechanics.modes.basis import Modes, basis
from vibrissa.mechanics.modes.straight import check_contact
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset, measured, require
from vibrissa.whisker import Whisker

Method = Literal["least-squares", "paper2014"]

_PROFILE_DEGREE = 8  # of the polynomial through the mean profile: its tangent to 1e-3 rad
_SMALLEST_TURN = 0.02  # [rad] below it the concave side of a mean profile is not determined


def normal_displacement(profile: xr.Dataset) -> tuple[Array, Mask]:
    """Displacement of each node along the normal of the mean profile.

    The normal points to the concave side of the mean profile. That side is away from the substrate, so it is
    n = (−sin θ, cos θ), whichever way the camera turns or mirrors the scene. Since the shaft does not stretch, a node
    at fixed arc length is one point of it.

    Parameters
    ----------
    profile : Dataset
        One whisker: ``x``, ``y`` (time, node) [m], ``arc_length`` (node) [m]. NaN where lost. If there is
        ``y_sd`` or ``x_sd``, nodes without one (extrapolated, not measured) are left out.

    Returns
    -------
    displacement : (T, N) array
        n·(r − mean r) [m]; NaN where lost.
    visible : (N,) array of bool
        Nodes measured in at least half of the frames and not at the border of a shadow, see
        :func:`vibrissa.mechanics.inverse.steady_nodes.steady_nodes`; the others are all NaN.

    Raises
    ------
    InputError
        If too few nodes are visible, or the mean profile is too straight to determine its concave side.
    """
    require(profile, "x", "y", "arc_length")
    x, y, arc = profile.x.values, profile.y.values, profile.arc_length.values
    if x.ndim != 2:
        raise TooFewError("profile", "must be of one whisker", f"dimensions {profile.x.dims}", "select one")
    if len(x) < 2:
        raise TooFewError("profile", "must have two frames at least: a displacement is about their mean", len(x))
    seen = measured(profile) & np.isfinite(x)
    visible = steady_nodes(seen, arc)
    if visible.sum() < 3 * _PROFILE_DEGREE:
        rule, remedy = (
            f"must have {3 * _PROFILE_DEGREE} nodes seen in half the frames",
            "track with a finer node spacing, or cut the record to where the whisker was followed",
        )
        raise TooFewError("profile", rule, int(visible.sum()), remedy)
    mean = _mean(x, visible, seen), _mean(y, visible)
    fit_x, fit_y = (Polynomial.fit(arc[visible], values, _PROFILE_DEGREE) for values in mean)
    angle = np.unwrap(np.arctan2(fit_y.deriv()(arc[visible]), fit_x.deriv()(arc[visible])))
    turn = angle[np.argmax(arc[visible])] - angle[np.argmin(arc[visible])]
    if abs(turn) < _SMALLEST_TURN:
        raise RangeError(
            "mean profile", f"must turn by {_SMALLEST_TURN} rad to determine its concave side", f"{turn:.3g}"
        )
    displacement = np.full(x.shape, np.nan)
    for part in blocks(len(x)):
        dx, dy = x[part, visible] - mean[0], y[part, visible] - mean[1]
        dx[~seen[part, visible]] = np.nan
        displacement[part, visible] = np.sign(turn) * (np.cos(angle) * dy - np.sin(angle) * dx)
    return displacement, visible


def _mean(values: Array, visible: Mask, seen: Mask | None = None) -> Array:
    """Mean over time of the visible nodes, (V,)."""
    nodes, means = np.flatnonzero(visible), []
    for part in some_nodes(values):
        some = np.zeros_like(visible)
        some[nodes[part]] = True
        one = values[:, some]
        if seen is not None:
            one[~seen[:, some]] = np.nan
        means.append(np.nanmean(one, axis=0) if some.any() else np.empty(0))
    return np.concatenate(means)


def decompose(
    profile: xr.Dataset,
    whisker: Whisker,
    contact: float,
    *,
    n_modes: int = 3,
    extra_modes: int = 2,
    method: Method = "least-squares",
    modes: Modes = "straight",
    posture: Posture | None = None,
) -> xr.Dataset:
    """Modal amplitudes of a tracked whisker.

    Eq. (15) of [Boubenec2014]_, u(s, t) = Σ_i q_i(t) V_i(s), is solved for q by least squares on the visible nodes,
    weighted by their residual variance (``least-squares``, default), or by the projection of
    Eq. (14) of [Boubenec2014]_, q_i = ∫ u s² V_i ds, of a profile extrapolated to skin and contact (``paper2014``).
    Since the mean is taken away, these are q + Q(d) − mean, not q alone.

    Parameters
    ----------
    profile : Dataset
        One whisker: ``x``, ``y`` (time, node), ``arc_length`` (node) from the skin, ``time``.
    whisker : Whisker
        Gives L: s = 1 − arc_length/L.
    contact : float
        Position ε of the contact, over L.
    n_modes : int
        Modes asked for.
    extra_modes : int
        Modes above them that take part in the least squares, so that they do not leak into those asked for. Seven more
        take part within a limit.
    method : {"least-squares", "paper2014"}
        See above.
    modes : {"straight", "curved", "curved-coulomb", "curved-edge"}
        The paper's V_i, or the transverse part of those about the curved profile; see
        :func:`vibrissa.mechanics.modes.basis.basis`.
    posture : Posture, optional
        On the flat, with the same contact: the profile that curved modes are about.

    Returns
    -------
    Dataset
        ``mode_displacement`` (mode, time), ``mode_displacement_sd`` (NaN for ``paper2014``), both over L; ``kappa``;
        ``displacement`` (time, node) [m]; ``variance_explained`` (mode): what each mode adds to those before.
        Attributes ``base_angle`` [rad] and ``friction`` of the posture, where one is given.

    Raises
    ------
    InputError
        If the profile states its time in another unit, leaves [ε, 1] or too few nodes are visible; or curved modes
        lack their posture, or are to be projected on by the paper's method, whose ∫ u s² V_i ds is of straight ones.

    Examples
    --------
    Mode 1 recovered from the model's own profile:

    >>> from vibrissa.mechanics.statics.profile import Posture
    >>> from vibrissa.mechanics.scan.scan_settings import Scan
    >>> from vibrissa.mechanics.scan.texture_prediction import predict
    >>> from vibrissa.quantities import dataset
    >>> from vibrissa.texture.surface import periodic_grating
    >>> from vibrissa.whisker import Whisker
    >>> whisker, posture = Whisker(length=0.04, cone_angle=1.5e-3), Posture(contact=0.29, base_angle=1.2)
    >>> scan = Scan(speed=0.1, damping=0.11)
    >>> moved = predict(whisker, posture, periodic_grating(0.02, period=2e-3), scan, n_modes=3)
    >>> time, s = np.arange(200) / 2000, np.linspace(0.99, 0.32, 60)
    >>> x, y = (0.04 * values for values in moved.position(time, s))
    >>> profile = dataset({"frame": "substrate"}, time=time, arc_length=0.04 * (1 - s), x=x, y=y)
    >>> found, true = decompose(profile, whisker, 0.29).mode_displacement.values[0], moved.mode_displacement(time)[0]
    >>> bool(np.abs(found - (true - true.mean())).max() < 0.01 * np.ptp(true))
    True
    """
    require(profile, "time")
    check_contact(contact)
    _check_modes(modes, posture, contact, method)
    displacement, visible = normal_displacement(profile)
    s = 1 - profile.arc_length.values / whisker.length
    visible = visible & (s >= contact) & (s <= 1)
    kappa, every = transverse_shapes(modes, posture, contact, n_modes + extra_modes + TAIL, s[visible])
    shapes = every[: n_modes + extra_modes]
    u = displacement[:, visible]
    u /= whisker.length
    if method == "least-squares":
        q, sd = with_tail(u, every, len(shapes))
    elif method == "paper2014":
        q = projection(u, s[visible], kappa[: len(shapes)], contact)
        sd = np.full(q.shape, np.nan)
    else:
        raise UnknownError("method", "must be 'least-squares' or 'paper2014'", repr(method))
    about = {} if posture is None else {"base_angle": posture.base_angle} | posture.friction_attributes
    return dataset(
        {"method": method, "modes": modes, "whisker_length": whisker.length} | about,
        time=profile.time.values,
        mode=np.arange(1, n_modes + 1),
        node=np.arange(len(s)),
        arc_length=profile.arc_length.values,
        contact=contact,
        kappa=kappa[:n_modes],
        mode_displacement=q[:n_modes],
        mode_displacement_sd=sd[:n_modes],
        displacement=displacement,
        variance_explained=variance_explained(u, shapes, n_modes),
    )


def _check_modes(modes: Modes, posture: Posture | None, contact: float, method: Method) -> None:
    if modes == "straight":
        return
    if posture is None or posture.contact != contact:
        found = None if posture is None else f"one with the contact {posture.contact:g}, not {contact:g}"
        raise MissingError("posture", f"must be given for {modes} modes", found, "they are about the profile it has")
    if method == "paper2014":
        raise UnknownError("method", f"must be least-squares for {modes} modes", method)


def transverse_shapes(
    modes: Modes, posture: Posture | None, contact: float, count: int, s: Array
) -> tuple[Array, Array]:
    """Frequencies κ (M,) and transverse displacement V (M, S) of the lowest modes at points s.

    Parameters
    ----------
    modes, posture, contact
        As in :func:`decompose`.
    count : int
        Modes, from the lowest.
    s : (S,) array
        Positions in [ε, 1].

    Returns
    -------
    array
        Shapes at the nodes.
    """
    if modes == "straight" or posture is None:
        kappa = cone_kappa(contact, count)
        return kappa, cone_modes(kappa, contact, s)
    flat = on_the_flat(posture)
    found, angle = basis(modes, flat, count), flat.angle(s)
    along, up = found.displacement(s)
    return found.kappa, up * np.cos(angle) - along * np.sin(angle)
