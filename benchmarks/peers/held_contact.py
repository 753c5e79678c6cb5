"""Where an edge holds the contact after a jump, what the modes are there, and how long it holds it."""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
import xarray as xr
from numpy.polynomial import chebyshev

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.quasi_static.projection import profiles
from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.mechanics.statics.edge_contact import Held
from vibrissa.mechanics.vibration.dynamics import Drive
from vibrissa.quantities import dataset

Array = np.ndarray

_NODES = 8  # Chebyshev nodes between the lowest excursion and 0
_LOOKS = 200  # from a jump until the contact is back on the flat


def held_kappa(flat: Held, contact: float, contact_angle: float, n_modes: int, *, straight: bool) -> Array:
    """Frequencies κ_i (M,) of a whisker that an edge holds at ε, at the angle θ_ε.

    Of the straight shaft, pinned at ε; or about the profile. Eq. 1 and the force of an edge, at the angle φ to the
    normal of the whisker, know no horizontal: turned by θ_ε the profile is that on the flat of (ε, θ_b − θ_ε), and so
    are its modes on the edge.
    """
    if straight:
        return cone_kappa(contact, n_modes)
    turned = replace(flat.posture, contact=contact, base_angle=flat.posture.base_angle - contact_angle)
    return curved_modes(turned, n_modes, condition="edge").kappa


def held_contacts(prediction: Prediction) -> xr.Dataset:
    """What the jumps of a prediction lead to: the contact drawn up the shaft, until it is back at ε.

    A prediction rings in the modes of ε all the time. After a jump the edge is up the shaft, where they are others,
    and comes down to ε at t₃. It holds the contact for as long as the shaft is off the land beside it; where the
    vibration turns the shaft onto the land before, the model goes on as if it had not.

    Parameters
    ----------
    prediction : Prediction
        Over gaps.

    Returns
    -------
    Dataset
        Over the gaps (trough), from t₂ to t₃: ``held_contact``, mean of ε; ``held_shift`` (trough, mode), mean of κ_i
        where the edge holds the contact over κ_i at ε, of straight modes, pinned, or else of curved ones on an edge;
        ``sag_height`` [m], λ sin θ_ε just after the jump; ``held_share``, the part of the time before the vibration
        first turns the shaft onto the land.

    Raises
    ------
    InputError
        If the posture cannot follow as far.
    """
    response, n_modes = prediction.response, len(prediction.kappa)
    flat, straight = response.flat, response.modes == "straight"
    width, after = prediction.texture.width, prediction.events.gaps[1]
    z = chebyshev.chebpts1(_NODES)
    excursions = float(after.min()) * (1 - z[::-1]) / 2
    unknowns = profiles(flat, excursions[np.argsort(-excursions)], np.array([flat.contact, 1.0])).unknowns
    held = np.array([[c, *held_kappa(flat, c, turn, n_modes, straight=straight)] for c, turn, _ in unknowns])
    rest = held_kappa(flat, flat.contact, 0.0, n_modes, straight=straight)
    series = chebyshev.chebfit(1 + 2 * np.sort(-excursions) / after.min(), held, _NODES - 1)
    means = _means(series, after / after.min())
    angle = response(after)[n_modes + FOLLICLE.index("contact_angle")]
    return dataset(
        {"modes": response.modes},
        trough=np.arange(len(width)),
        mode=np.arange(1, n_modes + 1),
        held_contact=means[0],
        held_shift=(means[1:] / rest[:, None]).T,
        sag_height=width * np.sin(angle),
        held_share=_held_shares(prediction),
    )


def held_frequency(prediction: Prediction) -> Drive:
    """ω_i(t) [rad/s] of the modes where the edges hold the contact, all along its way; at ε on the flat.

    A prediction takes them from ε. In this drift, :func:`vibrissa.mechanics.whisking.drifting_oscillator.drift` gives
    the ringing that two programs show after a jump; what is left out is that the shapes of the modes change too.

    Returns
    -------
    Drive
        Frequencies of M modes, polynomials of time at the events of ``prediction.drive``.

    Raises
    ------
    InputError
        If the posture cannot follow as far.
    """
    response, time, events = prediction.response, prediction.drive.time, prediction.events
    before, after = events.gaps
    low, high = float(after.min()), float(before.max())
    excursions = (low + high) / 2 + (high - low) / 2 * chebyshev.chebpts1(_NODES)
    outwards = np.argsort(np.abs(excursions))
    unknowns = profiles(response.flat, excursions[outwards], np.array([response.flat.contact, 1.0])).unknowns
    straight, n_modes = response.modes == "straight", len(prediction.kappa)
    kappa = [held_kappa(response.flat, c, turn, n_modes, straight=straight) for c, turn, _ in unknowns]
    z = (2 * excursions[outwards] - low - high) / (high - low)
    series = chebyshev.chebfit(z, np.array(kappa) / prediction.whisker.timescale, _NODES - 1)
    moving = np.cumsum(np.append(0.0, events.rate))[np.searchsorted(events.time, time, side="right")]
    at, rate = (2 * events.excursion(time) - low - high) / (high - low), 2 * moving / (high - low)
    powers = [chebyshev.chebval(at, chebyshev.chebder(series, k)) * rate**k / factorial(k) for k in range(_NODES)]
    rest = chebyshev.chebval(-(low + high) / (high - low), series)
    return Drive(time, np.stack(powers, axis=2), np.asarray(rest))


def _means(series: Array, depth: Array) -> Array:
    """Means (R, J) between 0 and each share of the lowest excursion (J,), of series (n, R) that ascend from it to 0."""
    primitive = chebyshev.chebint(series, lbnd=1)
    return np.asarray(-chebyshev.chebval(1 - 2 * depth, primitive) / (2 * depth))


def _held_shares(prediction: Prediction) -> Array:
    """Part of the time from each jump to t₃ before θ_ε and the vibration's rotation there come to 0, (J,)."""
    jump, back = prediction.events.time[1::3], prediction.events.time[2::3]
    share = (np.arange(_LOOKS) + 0.5) / _LOOKS
    t = (jump[:, None] + (back - jump)[:, None] * share).ravel()
    n_modes, contact = len(prediction.kappa), prediction.posture.contact
    beyond = np.array([contact / 2, contact, 1.0])
    up = prediction.response.basis.displacement(beyond)[1]
    turn = (up[:, 1] - up[:, 0]) / (contact / 2)  # the free end is straight
    angle = prediction.drive(t)[n_modes + FOLLICLE.index("contact_angle")] + turn @ prediction.amplitudes(t)
    lies = angle.reshape(len(jump), -1) <= 0
    return np.asarray(np.where(lies.any(axis=1), lies.argmax(axis=1) / _LOOKS, 1.0))
