"""Resonant modes of the whisker: κ_i(ε) and V_i(s)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, UnknownError
from vibrissa.exact import Boundary, cone_kappa, cone_modes
from vibrissa.quantities import dataset
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr


CONTACT_RANGE = (0.005, 0.9)  # where κ is accurate to 1e-12 and V orthonormal to 1e-10
MOST_MODES = 40  # the 40th of a whisker of 40 mm rings at 25 kHz or more, above what cameras and afferents follow


def eigenmodes(
    contact: float, n_modes: int = 3, *, boundary: Boundary = "pinned", s: ArrayLike | None = None
) -> xr.Dataset:
    """Resonant frequencies and mode shapes of a whisker clamped in its follicle.

    Homogeneous solutions of Eq. (2) of [Boubenec2014]_: (s⁴V'')'' = κ² s² V on [ε, 1], V(1) = V'(1) = 0, and at the
    contact V(ε) = V''(ε) = 0 (``pinned``) or V''(ε) = (s⁴V'')'(ε) = 0 (``free``: in air, cut at s = ε).

    Parameters
    ----------
    contact : float
        Position ε of the contact, or of the free tip, over L: in [0.005, 0.9]; 0 too for a whole free cone.
    n_modes : int
        How many modes, from the lowest; at most 40.
    boundary : {"pinned", "free"}
        What holds at s = ε.
    s : (S,) array, optional
        Where to give the shapes, in [ε, 1]; 201 even steps by default.

    Returns
    -------
    Dataset
        ``kappa`` (mode), ``mode_shape`` and ``mode_curvature`` V'' (mode, s); V orthonormal under s²,
        V''(1) > 0. At s = 0 the shapes of the whole cone are NaN (0/0 in the closed form).

    Raises
    ------
    InputError
        If ε, the number of modes or a position is out of range.

    Examples
    --------
    >>> eigenmodes(0.29).kappa.values.round(4).tolist()
    [22.7838, 64.3713, 128.6569]
    """
    nodes = checked_nodes(contact, n_modes, s, boundary)
    kappa = cone_kappa(contact, n_modes, boundary)
    inside = np.where(nodes > 0, nodes, np.nan)
    return dataset(
        {"boundary": boundary},
        mode=np.arange(1, n_modes + 1),
        s=nodes,
        contact=contact,
        kappa=kappa,
        mode_shape=cone_modes(kappa, contact, inside, boundary),
        mode_curvature=cone_modes(kappa, contact, inside, boundary, derivative=2),
    )


def checked_nodes(contact: float, n_modes: int, s: ArrayLike | None, boundary: Boundary = "pinned") -> Array:
    """Points at which the shapes of modes are asked for, once contact and number of modes are known to be in range.

    Parameters
    ----------
    contact : float
        ε over L.
    n_modes : int
        Number of modes.
    s : (S,) array, optional
        The points, in [ε, 1]; 201 even steps by default.
    boundary : {"pinned", "free"}
        What holds at s = ε.

    Returns
    -------
    (S,) array
        The points.

    Raises
    ------
    InputError
        If one of them is out of range.
    """
    check_contact(contact, boundary)
    if not 1 <= n_modes <= MOST_MODES:
        raise RangeError("number of modes", f"must be between 1 and {MOST_MODES}", n_modes)
    nodes = np.linspace(contact, 1, 201) if s is None else np.asarray(s, float)
    if not np.all((nodes >= contact) & (nodes <= 1)):
        raise RangeError("s", f"must lie between the contact {contact} and the base 1", f"{nodes.min()}…{nodes.max()}")
    return nodes


def check_contact(contact: float, boundary: Boundary = "pinned") -> None:
    """Refuse an unknown boundary, or a contact where the modes are not known to full accuracy.

    Parameters
    ----------
    contact : float
        ε over L.
    boundary : {"pinned", "free"}
        What holds there.

    Raises
    ------
    InputError
        Names the rule that is broken.
    """
    if boundary not in ("pinned", "free"):
        raise UnknownError("boundary", "must be 'pinned' or 'free'", repr(boundary))
    low, high = CONTACT_RANGE
    if not (low <= contact <= high or (boundary == "free" and contact == 0)):
        whole = ", or 0 for the whole cone" if boundary == "free" else ""
        raise RangeError("contact", f"must lie between {low} and {high} (over L){whole}", contact)


def resonances(whisker: Whisker, contact: float, n_modes: int = 3, *, boundary: Boundary = "pinned") -> xr.Dataset:
    """Resonant frequencies of one whisker, in hertz.

    Parameters
    ----------
    whisker : Whisker
        Its timescale k turns κ into f = κ/(2πk).
    contact : float
        Position ε over L; a ``pinned`` contact must lie on the whisker, at or above its physical tip.
    n_modes, boundary
        As in :func:`eigenmodes`.

    Returns
    -------
    Dataset
        :func:`eigenmodes` with ``resonant_frequency`` (mode) [Hz].

    Raises
    ------
    InputError
        If the contact lies beyond the physical tip.
    """
    if contact < whisker.tip:
        raise RangeError("contact", f"must not lie beyond the whisker's tip at {whisker.tip:.4g} (over L)", contact)
    modes = eigenmodes(contact, n_modes, boundary=boundary)
    frequency = modes.kappa.values / (2 * np.pi * whisker.timescale)
    return modes.merge(dataset(mode=modes.mode.values, resonant_frequency=frequency), combine_attrs="override")


def shear(kappa: Array, contact: float, amplitude: Array) -> Array:
    """Transverse force of the vibration on the follicle, of which the taper makes a part.

    Parameters
    ----------
    kappa : (M,) array
        Adimensional frequencies of the modes of the straight shaft, pinned at the contact.
    contact : float
        ε over L.
    amplitude : (M, T) array
        Vibration amplitudes q, over L.

    Returns
    -------
    (T,) array
        (u''' + 4u'')(1) over πEα⁴L²/4.
    """
    one = np.ones(1)
    bending, third = (cone_modes(kappa, contact, one, derivative=order)[:, 0] for order in (2, 3))
    return (third + 4 * bending) @ amplitude


def contact_shear(kappa: Array, contact: float, amplitude: Array) -> Array:
    """Load of the vibration on the contact.

    Parameters
    ----------
    kappa, contact, amplitude
        As of :func:`shear`.

    Returns
    -------
    (T,) array
        Σ q_i ε⁴ V_i'''(ε) over πEα⁴L²/4.
    """
    third = cone_modes(kappa, contact, np.array([contact]), derivative=3)[:, 0]
    return contact**4 * third @ amplitude
