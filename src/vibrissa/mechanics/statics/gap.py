"""A gap in the substrate: where the contact jumps, and the quasi-static response that is linear in d (Eq. 11)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.exact import cone_kappa, cone_modes, shaft_quadrature
from vibrissa.mechanics.statics import jump_kernels
from vibrissa.mechanics.statics.chebyshev import Chebyshev
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import ALONG, Curve, Posture
from vibrissa.mechanics.statics.shooting import LONGEST

_TABLE = 14  # Chebyshev nodes for d₂(λ)/λ², smooth in λ: 1e-9 up to λ = 0.05 L
_ALIKE = 3  # and where all gaps are equally wide: 1e-10


@dataclass(frozen=True)
class UnitResponse:
    """What changes when an edge carries the contact by a small excursion d, per unit of d.

    Attributes
    ----------
    posture : Posture
        The flat posture it is linearised about.
    curve : Curve
        The stationary profile of that posture.
    contact, contact_angle, load : float
        Derivatives of ε, θ(ε) and Λ̂ by d.
    determinant : float
        det ∂(θ_b, D, H)/∂(ε, θ_ε, Λ), negative; 0 on the fold, beyond which no quasi-static response exists.
    """

    posture: Posture
    curve: Curve
    contact: float
    contact_angle: float
    load: float
    determinant: float

    def displacement(self, s: Array) -> Array:
        """Transverse displacement Ū(s) = n·∂r/∂d, n = (−sin θ, cos θ), r relative to the fixed base.

        Parameters
        ----------
        s : (S,) array
            Positions in [ε, 1].

        Returns
        -------
        (S,) array
            Ū [1], 0 at the base.
        """
        psi = self.curve.at(self.curve.psi, np.log(s / self.posture.contact))
        x, y = self.shift(s)
        return -np.sin(psi) * x + np.cos(psi) * y

    def shift(self, s: Array) -> tuple[Array, Array]:
        """∂r/∂d [1], along the substrate and up, (S,) each, of points s in [ε, 1].

        Parameters
        ----------
        s : (S,) array
            Points in [ε, 1].

        Returns
        -------
        x, y : (S,) arrays
            Along the substrate and up [1].
        """
        log_x = np.log(s / self.posture.contact)
        x, y = (self.curve.at(values, log_x) for values in self.shift_at_nodes)
        return x, y

    @cached_property
    def shift_at_nodes(self) -> tuple[Array, Array]:
        """:meth:`shift` at the Chebyshev nodes in ln s of the curve, (N,) each."""
        c, epsilon = self.curve, self.posture.contact
        x = np.exp(ALONG.nodes * c.span)
        shift_x = c.x - c.x[-1] - (x * np.cos(c.psi) - x[-1] * np.cos(c.psi[-1]))
        shift_y = c.y - c.y[-1] - (x * np.sin(c.psi) - x[-1] * np.sin(c.psi[-1]))
        turn, load = epsilon * self.contact_angle, epsilon * self.load
        delta_x = self.contact * shift_x + load * (c.x_load - c.x_load[-1]) - turn * (c.y - c.y[-1])
        delta_y = self.contact * shift_y + load * (c.y_load - c.y_load[-1]) + turn * (c.x - c.x[-1])
        return delta_x, delta_y


def unit_response(posture: Posture) -> UnitResponse:
    """Linear response of the stationary profile to the excursion of an edge.

    Ū of Eq. (11) of [Boubenec2014]_, U_qs = U₁ + d(t) Ū(s): the derivative at d = 0 with θ_b and H held, from
    the linearised problem.

    Parameters
    ----------
    posture : Posture
        On the flat.

    Returns
    -------
    UnitResponse
        Derivatives by the excursion.

    Raises
    ------
    InputError
        On or beyond the fold, where the sign of the response flips.
    """
    flat = on_the_flat(posture)
    if not flat.determinant < 0:
        raise RangeError(
            f"posture ({posture.contact:.4g}, {posture.base_angle:.4g} rad)",
            "must be before the fold (determinant below 0)",
            f"{flat.determinant:.4g}",
            "lower the base angle or raise the contact",
        )
    contact, contact_angle, load = np.linalg.solve(flat.sensitivity, [0.0, 1.0, 0.0])
    return UnitResponse(posture, flat.curve, contact, contact_angle, load, flat.determinant)


def coupling(response: UnitResponse, n_modes: int) -> Array:
    """Coupling c_i = ∫_ε^1 s² Ū V_i ds of the pinned modes to the excursion.

    Parameters
    ----------
    response : UnitResponse
        Of the posture.
    n_modes : int
        How many modes, from the lowest.

    Returns
    -------
    (n_modes,) array
        c_i [1].

    Examples
    --------
    >>> from vibrissa.mechanics.statics.profile import Posture
    >>> coupling(unit_response(Posture(contact=0.29, base_angle=1.2)), 3).round(5).tolist()
    [-0.1003, 0.01904, -0.00548]
    """
    contact = response.posture.contact
    s, weights = shaft_quadrature(contact, 80 + 8 * n_modes)
    shapes = cone_modes(cone_kappa(contact, n_modes), contact, s)
    return shapes @ (weights * s**2 * response.displacement(s))


def excursion_at_jump(posture: Posture, gap_width: float) -> float:
    """Excursion d₂ at which the profile, held by the far edge of a gap, meets the near one.

    On the curve from the far edge the near edge is at ln x = q, at distance λ along the substrate: so
    θ_ε = −atan(Y/X) and ε = λ/√(X² + Y²) follow from (Λ̂, q), which θ_b and H determine.

    Parameters
    ----------
    posture : Posture
        Posture on the flat, before the gap.
    gap_width : float
        Width λ of the gap, over L.

    Returns
    -------
    float
        d₂ over L; below λ.

    Raises
    ------
    InputError
        If the gap is not narrower than the base is far, or so wide that no profile held by its far edge meets the near
        one, or none before the fold.

    Examples
    --------
    >>> from vibrissa.mechanics.statics.profile import Posture
    >>> round(excursion_at_jump(Posture(contact=0.29, base_angle=1.2), 0.015), 9)
    0.000470776
    """
    flat = on_the_flat(posture)
    distance = flat.base[0]
    if not 0 < gap_width < distance:
        raise RangeError("gap_width", f"must lie between 0 and the base's distance {distance:.4g} (over L)", gap_width)
    found = float(jump_kernels.excursion_at_jump(flat.contact, flat.curve.load, flat.clamp, float(gap_width), LONGEST))
    if np.isfinite(found):
        return found
    narrow = "must be narrow enough for a profile from its far edge to meet the near one"
    rule = narrow if np.isnan(found) else "must be crossed before the fold"
    remedy = "narrow the gap, lower the base angle or raise the contact"
    raise RangeError("gap_width", rule, f"{gap_width:.4g} L", remedy)


@dataclass(frozen=True)
class JumpTable:
    """d₂ of every gap width in an interval, as a Chebyshev series of d₂/λ², which is smooth.

    Attributes
    ----------
    low, high : float
        Widths λ over L.
    coefficients : (n,) array
        Chebyshev coefficients.
    """

    low: float
    high: float
    coefficients: Array

    @property
    def along(self) -> Chebyshev:
        """Polynomials in λ."""
        return Chebyshev(len(self.coefficients), self.low, self.high)

    def __call__(self, gap_widths: Array) -> Array:
        """d₂ over L, (J,), of widths (J,) in [low, high]; see :func:`excursion_at_jump`."""
        if not np.all((gap_widths >= self.low) & (gap_widths <= self.high)):
            rule = f"must lie in the table's interval, {self.low:.4g} to {self.high:.4g} (over L)"
            raise RangeError("gap_width", rule, f"{gap_widths.min():.4g} to {gap_widths.max():.4g}")
        return gap_widths**2 * np.asarray(self.along.polynomials(gap_widths) @ self.coefficients)


def jump_table(posture: Posture, gap_widths: Array) -> JumpTable:
    """Table that serves all these widths, over L.

    Parameters
    ----------
    posture : Posture
        On the flat.
    gap_widths : (J,) array
        Widths λ over L.

    Returns
    -------
    JumpTable
        Between the narrowest and the widest.

    Raises
    ------
    InputError
        If one of them is too wide for the posture.
    """
    narrowest, widest = float(np.min(gap_widths)), float(np.max(gap_widths))
    low, high, nodes = 0.999 * narrowest, 1.001 * widest, _ALIKE if narrowest == widest else _TABLE
    along, ratio = Chebyshev(nodes, low, high), np.empty(nodes)
    flat = on_the_flat(posture)
    jump_kernels.jump_ratios(flat.contact, flat.curve.load, flat.clamp, along.nodes, LONGEST, ratio)
    if not np.isfinite(ratio).all():
        excursion_at_jump(posture, float(along.nodes[~np.isfinite(ratio)][0]))  # refuses, and says why
    return JumpTable(low, high, along.to_series @ ratio)
