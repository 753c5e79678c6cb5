"""The stationary profile of a whisker held at its base and pinned at a frictional contact (Eq. 1)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, RangeError, give_share
from vibrissa.mechanics.statics.chebyshev import Chebyshev, chebyshev_sum
from vibrissa.mechanics.statics.contact_law import ContactLaw, inclination
from vibrissa.mechanics.statics.elastica_table import equilibria, equilibria_at_height
from vibrissa.quantities import dataset
from vibrissa.tables.stated import number

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.whisker import Whisker


_UNITS = {"contact": "1", "base_angle": "rad", "friction": "1", "adhesion": "1"}
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
    adhesion : float
        Strength b of adhesive friction, T/N = μ + b N̂^{−1/3} [1]; Coulomb's law without it. See
        :func:`vibrissa.mechanics.statics.contact_law.hertzian`.
    """

    contact: float
    base_angle: float
    friction: float = 0.4
    adhesion: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in _UNITS.items():
            value = number(f"Posture.{name}", getattr(self, name), unit, "contact is over L, base_angle in rad")
            object.__setattr__(self, name, value)
        if not 0 < self.contact < 1:
            remedy = give_share(self.contact) if self.contact > 1 else ""
            raise RangeError("Posture.contact", "must lie between 0 and 1 (over L)", self.contact, remedy)
        if not 0 < self.base_angle < np.pi / 2:
            meant = float(np.deg2rad(self.base_angle))
            remedy = f"give it in rad: np.deg2rad({self.base_angle:g}) = {meant:.5g}" if 0 < meant < np.pi / 2 else ""
            raise RangeError("Posture.base_angle", "must lie between 0 and π/2 rad", self.base_angle, remedy)
        if not np.isfinite(self.friction):
            raise RangeError("Posture.friction", "must be a finite number", self.friction)
        if not 0 <= self.adhesion < np.inf:
            raise RangeError("Posture.adhesion", "must be 0 or a positive number", self.adhesion)
        if self.adhesion > 0 > self.friction:
            raise RangeError("Posture.friction", "must not be negative with adhesion", self.friction)

    @classmethod
    def at_height(cls, base_distance: float, base_angle: float, friction: float = 0.4, adhesion: float = 0.0) -> Self:
        """Posture of a base held at a height: the contact ε that is then under it.

        Parameters
        ----------
        base_distance : float
            Height H of the base above the substrate, over L.
        base_angle, friction, adhesion : float
            As of the posture.

        Returns
        -------
        Posture
            With the contact found.

        Raises
        ------
        InputError
            If no contact is; the message gives the heights within reach.
        """
        form = "base_distance is over L, base_angle in rad"
        base_distance = number("Posture.base_distance", base_distance, "1", form)
        base_angle = number("Posture.base_angle", base_angle, "rad", form)
        friction = number("Posture.friction", friction, "1", form)
        if not 0 < base_distance < 1:
            remedy = give_share(base_distance) if base_distance > 1 else ""
            raise RangeError("Posture.base_distance", "must lie between 0 and 1 (over L)", base_distance, remedy)
        contact = float(equilibria_at_height([base_distance], [base_angle], friction).contact[0])
        posture = cls(contact=contact, base_angle=base_angle, friction=friction, adhesion=adhesion)
        return posture._moved_to(base_distance) if adhesion else posture

    def _moved_to(self, base_distance: float) -> Self:
        """The same with the contact at which the base is at a height, by the secant method from this one."""
        from scipy.optimize import newton

        def too_high(contact: float) -> float:
            return contact * float(flat_curve(replace(self, contact=contact)).y[-1]) - base_distance

        try:
            contact = float(newton(too_high, self.contact, x1=self.contact * 0.99, tol=1e-14, maxiter=_ITERATIONS))
        except RuntimeError as error:
            raise ConvergenceError("contact at a height", too_high(self.contact), _ITERATIONS) from error
        return replace(self, contact=contact)

    @property
    def law(self) -> ContactLaw:
        """The contact law."""
        return ContactLaw(float(self.friction), float(self.adhesion))

    @property
    def friction_attributes(self) -> dict[str, float]:
        """The constants of the law, as attributes of a Dataset."""
        return {"friction": self.friction} | ({"adhesion": self.adhesion} if self.adhesion else {})

    @property
    def friction_angle(self) -> float:
        """Angle arctan μ of the coefficient of friction [rad]: that of the contact force by Coulomb's law."""
        return float(np.arctan(self.friction))


_NODES = 64  # in ln s: round-off accuracy down to ε = 0.005
ALONG = Chebyshev(_NODES, 0.0, 1.0, ends=True)  # ln x over its span: the nodes of a curve


@dataclass(frozen=True)
class Curve:
    """One member of the one-parameter family that solves Eq. (1) for every ε and θ(ε).

    With x = s/ε and ψ = θ − θ(ε), (x⁴ψ')' = Λ̂ cos(φ − ψ), ψ(1) = ψ'(1) = 0, Λ̂ = Λ/ε². Arrays are on
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

    @property
    def base_state(self) -> Array:
        """State (8,) at the base as the kernels of ``shooting`` have it; they read all but the sixth, n by Λ̂."""
        n = self.slope[-1] * np.exp(2 * self.span)
        columns = (self.x, self.y, self.psi_load, np.zeros(1), self.x_load, self.y_load)
        return np.array([self.psi[-1], n, *(column[-1] for column in columns)])

    def at(self, values: Array, log_x: ArrayLike) -> Array:
        """Interpolate one of the arrays at ln x.

        Parameters
        ----------
        values : (N,) array
            One of the arrays of the curve.
        log_x : array_like
            ln x, in [0, span].

        Returns
        -------
        array
            Of the shape of ``log_x``.
        """
        z = 2 * np.asarray(log_x, float) / self.span - 1
        return chebyshev_sum(z, ALONG.to_series @ values)


def curve(load: float, span: float, law: ContactLaw, start: Array | None = None) -> Curve:
    """Solve the scaled equation for one load by collocation in ln x and Newton's method.

    Parameters
    ----------
    load : float
        Λ̂ = Λ/ε² [1].
    span : float
        ln(1/ε): ln x at the base.
    law : ContactLaw
        Gives the direction φ of the contact force at this load.
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
    integral = ALONG.integration * span
    x = np.exp(ALONG.nodes * span)
    twice = integral @ (x[:, None] ** -3.0 * integral * x)  # ψ = ∫ x⁻³ ∫ x f dln x dln x
    psi = np.zeros(_NODES) if start is None else start
    phi, rate = inclination(law, load)
    for _ in range(_ITERATIONS):
        residual = psi - load * twice @ np.cos(phi - psi)
        jacobian = np.eye(_NODES) - load * twice * np.sin(phi - psi)
        step = np.linalg.solve(jacobian, residual)
        psi = psi - step * min(1.0, 0.5 / np.abs(step).max(initial=1e-300))
        if np.abs(step).max() < _TOLERANCE:
            break
    else:
        raise ConvergenceError("stationary profile", float(np.abs(step).max()), _ITERATIONS)
    gain = np.cos(phi - psi) - rate * np.sin(phi - psi)  # of Λ̂ cos(φ − ψ) by Λ̂, with the direction
    psi_load = np.linalg.solve(jacobian, twice @ gain)
    along, up = x * np.cos(psi), x * np.sin(psi)
    return Curve(
        load,
        span,
        psi,
        slope=load * x**-3 * (integral @ (x * np.cos(phi - psi))),
        psi_load=psi_load,
        x=integral @ along,
        x_load=-integral @ (up * psi_load),
        y=integral @ up,
        y_load=integral @ (along * psi_load),
    )


@lru_cache(maxsize=8)
def flat_curve(posture: Posture) -> Curve:
    """Member of the family that touches flat ground at ε, with the angle θ_b at the base.

    Parameters
    ----------
    posture : Posture
        On the flat.

    Returns
    -------
    Curve
        Of the load that gives θ_b.

    Raises
    ------
    ConvergenceError
        If no load is found that gives θ_b.
    """
    span, law = -np.log(posture.contact), posture.law
    start = equilibria([posture.contact], [posture.base_angle], posture.friction)
    load = float(start.contact_force[0]) / posture.contact**2
    psi = None
    for _ in range(_ITERATIONS):
        solution = curve(load, span, law, psi)
        psi = solution.psi
        step = (psi[-1] - posture.base_angle) / solution.psi_load[-1]
        load -= np.clip(step, -load / 2, load)
        if abs(step) <= _TOLERANCE * load:
            return curve(load, span, law, psi)
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
        raise RangeError("s", f"must lie between the contact {contact} and the base 1")
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
        attrs=posture.friction_attributes,
    )


def check_tip(posture: Posture, whisker: Whisker) -> None:
    """Refuse a contact that lies beyond the whisker's physical tip.

    Parameters
    ----------
    posture : Posture
        Gives ε.
    whisker : Whisker
        Gives its tip.

    Raises
    ------
    InputError
        If ε is below the tip.
    """
    if posture.contact < whisker.tip:
        share = posture.contact / whisker.length
        beyond = f"give a contact above {whisker.tip:.4g}, nearer to the base, or a tip below {posture.contact:.4g}"
        remedy = f"give it over L: {share:.5g} for {posture.contact:g} m" if whisker.tip < share < 1 else beyond
        rule = f"must not lie beyond the whisker's tip at {whisker.tip:.4g}"
        raise RangeError("Posture.contact", rule, float(f"{posture.contact:.6g}"), remedy)
