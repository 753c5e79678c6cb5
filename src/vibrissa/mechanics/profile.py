"""The stationary profile of a whisker held at its base and pinned at a frictional contact (Eq. 1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.family import equilibria, equilibria_at_height
from vibrissa.mechanics.series import chebyshev_sum
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

_NODES = 64  # Chebyshev nodes in ln s: round-off accuracy down to ε = 0.005
_TOLERANCE = 1e-13
_ITERATIONS = 60


@dataclass(frozen=True, kw_only=True)
class Posture:
    """How the whisker is held against the substrate.

    Attributes
    ----------
    contact : float
        Position ε of the contact along the shaft, over L, in (0, 1).
    base_angle : float
        Angle θ_b of the shaft at the base to the substrate [rad], in (0, π/2).
    friction : float
        Coefficient μ = tan φ of the substrate that drags the contact away from the base [1].
    """

    contact: float
    base_angle: float
    friction: float = 0.4

    def __post_init__(self) -> None:
        if not 0 < self.contact < 1:
            raise InputError("Posture.contact", "must lie between 0 and 1 (over L)", self.contact)
        if not 0 < self.base_angle < np.pi / 2:
            raise InputError("Posture.base_angle", "must lie between 0 and π/2 rad", self.base_angle)
        if not np.isfinite(self.friction):
            raise InputError("Posture.friction", "must be a finite number", self.friction)

    @classmethod
    def at_height(cls, base_distance: float, base_angle: float, friction: float = 0.4) -> Self:
        """Posture of a base held at height H (over L): the contact ε that stands under it.

        Raises
        ------
        InputError
            If no contact does; the message tells the heights within reach.
        """
        found = equilibria_at_height([base_distance], [base_angle], friction)
        return cls(contact=float(found.contact[0]), base_angle=base_angle, friction=friction)

    @property
    def friction_angle(self) -> float:
        """Friction angle φ = arctan μ [rad]."""
        return float(np.arctan(self.friction))


@dataclass(frozen=True)
class Curve:
    """One member of the one-parameter family that solves Eq. (1) for every ε and θ(ε).

    With x = s/ε and ψ = θ − θ(ε), (x⁴ψ')' = Λ̂ cos(φ − ψ), ψ(1) = ψ'(1) = 0, Λ̂ = Λ/ε². Arrays stand on
    Chebyshev nodes of ln x in [0, span]; ``slope`` = dψ/d ln x; the suffix ``_load`` marks derivatives by Λ̂.
    """

    load: float
    span: float
    psi: Array
    slope: Array
    psi_load: Array
    x: Array
    x_load: Array
    y: Array
    y_load: Array

    def at(self, values: Array, log_x: ArrayLike) -> Array:
        """Interpolate one of the arrays at ln x."""
        z = 2 * np.asarray(log_x, float) / self.span - 1
        return chebyshev_sum(z, nodes_to_series() @ values)


@cache
def unit_nodes() -> Array:
    """Chebyshev–Lobatto nodes on [0, 1]."""
    return np.asarray((1 - np.cos(np.pi * np.arange(_NODES) / (_NODES - 1))) / 2, float)


@cache
def nodes_to_series() -> Array:
    """Matrix from values at the nodes to Chebyshev coefficients."""
    return np.asarray(np.linalg.inv(chebyshev.chebvander(2 * unit_nodes() - 1, _NODES - 1)), float)


@cache
def _integration() -> Array:
    """Matrix that integrates from 0 to each node on [0, 1], exact for polynomials through the nodes."""
    z = 2 * unit_nodes() - 1
    columns = [chebyshev.chebval(z, chebyshev.chebint(c, lbnd=-1)) / 2 for c in np.eye(_NODES)]
    return np.asarray(np.stack(columns, axis=1) @ nodes_to_series(), float)


def curve(load: float, span: float, friction_angle: float, start: Array | None = None) -> Curve:
    """Solve the scaled equation for one load by collocation in ln x and Newton's method.

    Parameters
    ----------
    load : float
        Λ̂ = Λ/ε² [1].
    span : float
        ln(1/ε): where the base stands in ln x.
    friction_angle : float
        φ [rad].
    start : (N,) array, optional
        ψ at the nodes to start from; straight by default.

    Returns
    -------
    Curve
        ψ, the positions X = ∫cos ψ dx and Y = ∫sin ψ dx from the contact, and their derivatives by Λ̂.

    Raises
    ------
    ConvergenceError
        If Newton's method stops short of 1e-13.
    """
    integral = _integration() * span
    x = np.exp(unit_nodes() * span)
    twice = integral @ (x[:, None] ** -3.0 * integral * x)  # ψ = ∫ x⁻³ ∫ x f dln x dln x
    psi = np.zeros(_NODES) if start is None else start
    for _ in range(_ITERATIONS):
        residual = psi - load * twice @ np.cos(friction_angle - psi)
        jacobian = np.eye(_NODES) - load * twice * np.sin(friction_angle - psi)
        step = np.linalg.solve(jacobian, residual)
        psi = psi - step * min(1.0, 0.5 / np.abs(step).max(initial=1e-300))
        if np.abs(step).max() < _TOLERANCE:
            break
    else:
        raise ConvergenceError("stationary profile", float(np.abs(step).max()), _ITERATIONS)
    psi_load = np.linalg.solve(jacobian, twice @ np.cos(friction_angle - psi))
    along, up = x * np.cos(psi), x * np.sin(psi)
    return Curve(
        load,
        span,
        psi,
        slope=load * x**-3 * (integral @ (x * np.cos(friction_angle - psi))),
        psi_load=psi_load,
        x=integral @ along,
        x_load=-integral @ (up * psi_load),
        y=integral @ up,
        y_load=integral @ (along * psi_load),
    )


@lru_cache(maxsize=8)
def flat_curve(posture: Posture) -> Curve:
    """Member of the family that touches flat ground at ε and stands at θ_b at the base.

    Raises
    ------
    ConvergenceError
        If no load is found that gives θ_b.
    """
    span, phi = -np.log(posture.contact), posture.friction_angle
    start = equilibria([posture.contact], [posture.base_angle], posture.friction)
    load = float(start.contact_force[0]) / posture.contact**2
    psi = None
    for _ in range(_ITERATIONS):
        solution = curve(load, span, phi, psi)
        psi = solution.psi
        step = (psi[-1] - posture.base_angle) / solution.psi_load[-1]
        load -= np.clip(step, -load / 2, load)
        if abs(step) <= _TOLERANCE * load:
            return curve(load, span, phi, psi)
    raise ConvergenceError("load on the stationary profile", float(abs(step)), _ITERATIONS)


def stationary_profile(posture: Posture, s: ArrayLike | None = None) -> xr.Dataset:
    """Stationary profile on a flat substrate.

    Eq. (1) of [Boubenec2014]_: ∂/∂s[(s⁴θ')'/cos(φ − θ + θ(ε))] = 0, θ(ε) = θ'(ε) = 0, θ(1) = θ_b.

    Parameters
    ----------
    posture : Posture
        Contact ε, base angle θ_b and friction μ.
    s : (S,) array, optional
        Where to give the profile, in [ε, 1]; 201 even steps by default.

    Returns
    -------
    Dataset
        ``angle`` θ (s) [rad], ``profile_x``, ``profile_y`` (s): position from the contact, x along the substrate
        towards the base, y up, over L; ``contact_force`` Λ in units of πEα⁴L²/4; ``base_distance`` H and
        ``contact_distance`` D over L.

    Raises
    ------
    InputError
        If s leaves [ε, 1].
    ConvergenceError
        If the solver fails.

    Examples
    --------
    >>> profile = stationary_profile(Posture(contact=0.29, base_angle=1.2))
    >>> round(float(profile.base_distance), 6), round(float(profile.contact_force), 6)  # H and Λ
    (0.461769, 0.799412)
    """
    contact = posture.contact
    nodes = np.linspace(contact, 1, 201) if s is None else np.asarray(s, float)
    if not np.all((nodes >= contact) & (nodes <= 1)):
        raise InputError("s", f"must lie between the contact {contact} and the base 1")
    solution = flat_curve(posture)
    log_x = np.log(nodes / contact)
    return dataset(
        s=nodes,
        contact=contact,
        base_angle=posture.base_angle,
        angle=solution.at(solution.psi, log_x),
        profile_x=contact * solution.at(solution.x, log_x),
        profile_y=contact * solution.at(solution.y, log_x),
        contact_force=solution.load * contact**2,
        contact_distance=contact * solution.x[-1],
        base_distance=contact * solution.y[-1],
        attrs={"friction": posture.friction},
    )
