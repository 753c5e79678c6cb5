"""From tracked centrelines back to modal amplitudes (Eqs. 2, 14 and 15)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.basis import Modes, basis
from vibrissa.mechanics.edge import on_the_flat
from vibrissa.mechanics.modes import check_contact
from vibrissa.quantities import dataset, measured, require

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.profile import Posture
    from vibrissa.whisker import Whisker

Array = NDArray[np.float64]
Method = Literal["least-squares", "paper2014"]

_PROFILE_DEGREE = 8  # of the polynomial through the mean profile: its tangent to 1e-3 rad
_SMALLEST_TURN = 0.02  # [rad] below it a mean profile does not tell its concave side
_BLOCK = 12_000  # frames at a time; of longer movies sums are formed in parts, and differ in the last bits
_TAIL = 7  # modes above those that are solved for freely
_LIMIT = 5.0  # times their likely size: 20 leaks less where all is seen, and doubles the noise where 4 mm are hidden
_END_NODES = 25  # nodes (about 3 mm) that extrapolate the profile in the paper's form


def normal_displacement(profile: xr.Dataset) -> tuple[Array, NDArray[np.bool_]]:
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
        Nodes measured in at least half of the frames; the others are all NaN.

    Raises
    ------
    InputError
        If too few nodes are visible, or the mean profile is too straight to tell its concave side.
    """
    require(profile, "x", "y", "arc_length")
    x, y, arc = profile.x.values, profile.y.values, profile.arc_length.values
    if x.ndim != 2:
        raise InputError("profile", "must be of one whisker", f"dimensions {profile.x.dims}", "select one")
    if len(x) < 2:
        raise InputError("profile", "must have two frames at least: a displacement is about their mean", len(x))
    seen = measured(profile) & np.isfinite(x)
    visible = seen.mean(axis=0) >= 0.5
    if visible.sum() < 3 * _PROFILE_DEGREE:
        rule, remedy = (
            f"must have {3 * _PROFILE_DEGREE} nodes seen in half the frames",
            "track with a finer node spacing",
        )
        raise InputError("profile", rule, int(visible.sum()), remedy)
    mean = _mean(x, visible, seen), _mean(y, visible)
    fit_x, fit_y = (Polynomial.fit(arc[visible], values, _PROFILE_DEGREE) for values in mean)
    angle = np.unwrap(np.arctan2(fit_y.deriv()(arc[visible]), fit_x.deriv()(arc[visible])))
    turn = angle[-1] - angle[0]
    if abs(turn) < _SMALLEST_TURN:
        raise InputError("mean profile", f"must turn by {_SMALLEST_TURN} rad to tell its concave side", f"{turn:.3g}")
    displacement = np.full(x.shape, np.nan)
    for part in _blocks(len(x)):
        dx, dy = x[part, visible] - mean[0], y[part, visible] - mean[1]
        dx[~seen[part, visible]] = np.nan
        displacement[part, visible] = np.sign(turn) * (np.cos(angle) * dy - np.sin(angle) * dx)
    return displacement, visible


def _blocks(count: int, size: int = 0) -> list[slice]:
    """Parts of a long movie that are worked on one after the other, so that little is held at a time."""
    size = size or _BLOCK
    return [slice(first, first + size) for first in range(0, count, size)]


def _some_nodes(values: Array) -> list[slice]:
    """Nodes that are worked on at a time, in all frames: all of them, if the movie is no longer than one block."""
    return _blocks(values.shape[1], max(1, _BLOCK * values.shape[1] // len(values)))


def _mean(values: Array, visible: NDArray[np.bool_], seen: NDArray[np.bool_] | None = None) -> Array:
    """Mean over time of the visible nodes, (V,)."""
    nodes, means = np.flatnonzero(visible), []
    for part in _some_nodes(values):
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
        :func:`vibrissa.mechanics.basis.basis`.
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
        If the profile leaves [ε, 1] or too few nodes are visible; or curved modes lack their posture, or are to be
        projected on by the paper's method, whose ∫ u s² V_i ds is of straight ones.

    Examples
    --------
    What the model's own profile tells of its mode 1:

    >>> from vibrissa.mechanics.profile import Posture
    >>> from vibrissa.mechanics.superposition import Scan, predict
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
    check_contact(contact)
    _check_modes(modes, posture, contact, method)
    displacement, visible = normal_displacement(profile)
    s = 1 - profile.arc_length.values / whisker.length
    visible = visible & (s >= contact) & (s <= 1)
    kappa, every = transverse_shapes(modes, posture, contact, n_modes + extra_modes + _TAIL, s[visible])
    shapes = every[: n_modes + extra_modes]
    u = displacement[:, visible]
    u /= whisker.length
    if method == "least-squares":
        q, sd = _with_tail(u, every, len(shapes))
    elif method == "paper2014":
        q = _projection(u, s[visible], kappa[: len(shapes)], contact)
        sd = np.full(q.shape, np.nan)
    else:
        raise InputError("method", "must be 'least-squares' or 'paper2014'", repr(method))
    about = {} if posture is None else {"base_angle": posture.base_angle, "friction": posture.friction}
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
        variance_explained=_variance_explained(u, shapes, n_modes),
    )


def _check_modes(modes: Modes, posture: Posture | None, contact: float, method: Method) -> None:
    if modes == "straight":
        return
    if posture is None or posture.contact != contact:
        found = None if posture is None else f"one with the contact {posture.contact:g}, not {contact:g}"
        raise InputError("posture", f"must be given for {modes} modes", found, "they are about the profile it has")
    if method == "paper2014":
        raise InputError("method", f"must be least-squares for {modes} modes", method)


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
    """
    if modes == "straight" or posture is None:
        kappa = cone_kappa(contact, count)
        return kappa, cone_modes(kappa, contact, s)
    flat = on_the_flat(posture)
    found, angle = basis(modes, flat, count), flat.angle(s)
    along, up = found.displacement(s)
    return found.kappa, up * np.cos(angle) - along * np.sin(angle)


def _with_tail(u: Array, every: Array, count: int) -> tuple[Array, Array]:
    """Amplitudes of the first modes; the others, small as they are, must not pass for them.

    The contact's excursion bends the shaft in all modes at once; beyond those that ring, by amounts that fall like i⁻³.
    Left out, they leak, in step with the excursion, and raise the resonance of mode 2 in the built-in experiment by
    0.05 %. So they take part, within five times what the last of the first modes makes likely: without a limit, nodes
    that end short of the contact would take noise for them.
    """
    shapes = every[:count]
    weight = _node_weights(u, shapes)
    last = np.nanstd(_least_squares(u, shapes, weight)[0][-1])
    number = np.arange(count + 1, len(every) + 1)
    unit = every.copy()  # the others in units of their limit
    unit[count:] *= _LIMIT * last * (count / number[:, None]) ** 3
    precision = (np.arange(len(every)) >= count).astype(float)
    q, _ = _least_squares(u, unit, weight, precision)
    return _least_squares(u, unit, 1 / _residual_variance(u, q, unit), precision)


def _least_squares(u: Array, shapes: Array, weight: Array, precision: Array | float = 0.0) -> tuple[Array, Array]:
    """Amplitudes (M, T), zero to within 1/√precision, and their standard deviations; NaN in frames with few nodes."""
    found = [_solved(u[part], shapes, weight, precision) for part in _blocks(len(u))]
    q, sd = (np.concatenate(one, axis=1) for one in zip(*found, strict=True))
    return q, sd


def _solved(u: Array, shapes: Array, weight: Array, precision: Array | float) -> tuple[Array, Array]:
    seen = np.isfinite(u)
    w = np.where(seen, weight, 0.0)
    moment = np.einsum("in,jn,tn->tij", shapes, shapes, w, optimize=True) + np.diag(precision + np.zeros(len(shapes)))
    right = np.einsum("in,tn->ti", shapes, w * np.where(seen, u, 0.0))
    free = len(shapes) - np.count_nonzero(precision)
    enough = seen.sum(axis=1) >= max(3 * free, u.shape[1] // 2)
    q = np.full((len(shapes), len(u)), np.nan)
    sd = np.full_like(q, np.nan)
    covariance = np.linalg.inv(moment[enough])
    q[:, enough] = np.einsum("tij,tj->it", covariance, right[enough])
    sd[:, enough] = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    return q, sd


def _node_weights(u: Array, shapes: Array) -> Array:
    """1/variance of each node's residual about an unweighted fit, (N,)."""
    q, _ = _least_squares(u, shapes, np.ones(u.shape[1]))
    return 1 / _residual_variance(u, q, shapes)


def _residual_variance(u: Array, q: Array, shapes: Array) -> Array:
    """Variance over time of what the modes leave at each node, (N,)."""
    return np.concatenate([np.nanvar(u[:, part] - q.T @ shapes[:, part], axis=0) for part in _some_nodes(u)])


def _mean_square(u: Array, q: Array | None = None, shapes: Array | None = None) -> float:
    """Mean square, or that of what the modes leave."""
    total, count = 0.0, 0
    for part in _blocks(len(u)):
        left = (u[part] if q is None or shapes is None else u[part] - q[:, part].T @ shapes) ** 2
        total, count = total + float(np.nansum(left)), count + int(np.count_nonzero(~np.isnan(left)))
    return total / count


def _variance_explained(u: Array, shapes: Array, n_modes: int) -> Array:
    """Share of the displacement's variance that each mode adds, by nested unweighted fits."""
    even = np.ones(u.shape[1])
    residual = [_mean_square(u)]
    for count in range(1, n_modes + 1):
        q, _ = _least_squares(u, shapes[:count], even)
        residual.append(_mean_square(u, q, shapes[:count]))
    return -np.diff(residual) / residual[0]


def _projection(u: Array, s: Array, kappa: Array, contact: float) -> Array:
    """∫ u s² V ds with u extrapolated: a straight line to the skin, a second-degree polynomial to the contact."""
    order = np.argsort(s)
    s, u = s[order], u[:, order]
    step = np.median(np.diff(s))
    outer, inner = np.arange(contact, s[0], step), np.arange(s[-1] + step, 1, step)
    to_contact = _extrapolation(s[:_END_NODES], outer, 2)
    to_skin = _extrapolation(s[-_END_NODES:], inner, 1)
    whole = np.concatenate([u[:, :_END_NODES] @ to_contact, u, u[:, -_END_NODES:] @ to_skin], axis=1)
    grid = np.concatenate([outer, s, inner])
    shapes = cone_modes(kappa, contact, grid)
    return np.trapezoid(whole[None] * (grid**2 * shapes)[:, None, :], grid, axis=2)


def _extrapolation(known: Array, wanted: Array, degree: int) -> Array:
    """(K, W) matrix that carries values at known points to wanted ones along a fitted polynomial."""
    centre, width = known.mean(), np.ptp(known)
    fit = np.linalg.pinv(np.vander((known - centre) / width, degree + 1))
    return (np.vander((wanted - centre) / width, degree + 1) @ fit).T
