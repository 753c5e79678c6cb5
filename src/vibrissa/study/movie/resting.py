"""The posture at rest of a whisker that was filmed over a texture: the model's mean is removed from the profile."""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.inverse.stationary_posture import Line, fit_profile
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.study.spec.textures import predict_surface
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.scan.motion import PredictedMotion
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.whisker import Whisker

_LEVELLINGS = 2  # after one ε is still off by 0.0001, half its standard error, as the first posture was by 0.002
_BLOCK = 1000  # frames at a time


def posture_at_rest(
    profile: xr.Dataset,
    whisker: Whisker,
    *,
    substrate: Line | None = None,
    friction: float = 0.4,
    texture: Gaps | HeightProfile | None = None,
    scan: Scan | None = None,
) -> xr.Dataset:
    """Fit Eq. 1 to the mean profile of a whisker, over a texture that may be known.

    Over a texture the mean profile is not the profile on the flat: gaps let the contact hang back, by some 0.1 mm on
    the paper's gratings, which makes ε too large by 0.002 to 0.004 and θ_b too small by 0.01 to 0.02 rad, many times
    their standard errors. Where texture and scan are known, the mean displacement that the model predicts for the
    posture found is removed from the profile, and Eq. 1 is fitted again, twice. The mean has a quasi-static part and,
    where damping acts on the whole motion (``continuous``), a fifth of it of opposite sign from the vibration. The
    intervals are cautious: they take the texture's motion about that mean for noise, though it is predicted too.

    Parameters
    ----------
    profile : Dataset
        One whisker, as :func:`vibrissa.mechanics.inverse.stationary_posture.fit_profile` takes it; ``time`` 0 is the
        moment x = 0 of the texture meets the contact.
    whisker : Whisker
        Its geometry.
    substrate, friction
        As :func:`vibrissa.mechanics.inverse.stationary_posture.fit_profile` takes them.
    texture : Gaps or HeightProfile, optional
        What it was drawn over; unknown by default.
    scan : Scan, optional
        How; needed with a texture.

    Returns
    -------
    Dataset
        What :func:`vibrissa.mechanics.inverse.stationary_posture.fit_profile` gives. With a texture also ``rest_x``,
        ``rest_y`` (node) [m], the displacement that was removed, and ``mean_excursion`` [m].
    """
    found = fit_profile(profile, whisker, substrate=substrate, friction=friction)
    if texture is None or scan is None:
        return found
    for _ in range(_LEVELLINGS):
        posture = Posture(contact=float(found.contact), base_angle=float(found.base_angle), friction=friction)
        motion = predict_surface(whisker, posture, texture, scan)
        x, y = _imposed(profile, motion, found)
        level = profile.assign(x=profile.x - x, y=profile.y - y)
        found = fit_profile(level, whisker, substrate=substrate, friction=friction)
    excursion = float(motion.excursion(profile.time.values).mean()) * whisker.length
    off = dataset(node=profile.node.values, rest_x=x, rest_y=y, mean_excursion=excursion)
    return found.merge(off, combine_attrs="override")


def at_rest(profile: xr.Dataset, found: xr.Dataset) -> xr.Dataset:
    """The profile to which a posture was fitted: without the texture's mean, where that was removed.

    Parameters
    ----------
    profile : Dataset
        One whisker.
    found : Dataset
        From :func:`posture_at_rest`.

    Returns
    -------
    Dataset
        The profile.
    """
    if "rest_x" not in found:
        return profile
    return profile.assign(x=profile.x - found.rest_x.values, y=profile.y - found.rest_y.values)


def _imposed(profile: xr.Dataset, motion: PredictedMotion, found: xr.Dataset) -> tuple[Array, Array]:
    """Mean displacement of the nodes by the texture, in the profile's frame [m]; NaN where there is no node."""
    s = 1 - profile.arc_length.values / motion.whisker.length
    node = np.isfinite(s)
    flat, off = motion.response.flat, np.full(s.size, np.nan, complex)
    along, up = _mean_position(motion, profile.time.values, s[node]) - np.array(flat.position(s[node]))
    turn, mirrored = _laid(flat.position(found.s.values), found.fitted_x.values, found.fitted_y.values)
    off[node] = turn * (along - 1j * up if mirrored else along + 1j * up)
    return off.real, off.imag


def _mean_position(motion: PredictedMotion, t: Array, s: Array) -> Array:
    """Mean position at these times [s], over L, (2, N); that of the vibration is not 0, because of the jumps."""
    blocks = (motion.position(t[first : first + _BLOCK], s) for first in range(0, len(t), _BLOCK))
    return np.asarray(sum(np.array([one.sum(axis=0) for one in block]) for block in blocks) / len(t))


def _laid(shape: tuple[Array, Array], x: Array, y: Array) -> tuple[complex, bool]:
    """How a curve of the substrate's frame lies in the image: its turn, with L, and whether it is mirrored."""
    drawn = (x - x.mean()) + 1j * (y - y.mean())
    fits = []
    for mirrored in (False, True):
        curve = shape[0] - 1j * shape[1] if mirrored else shape[0] + 1j * shape[1]
        curve = curve - curve.mean()
        turn = complex(np.vdot(curve, drawn) / np.vdot(curve, curve))
        fits.append((float(np.abs(drawn - turn * curve).sum()), turn, mirrored))
    return min(fits, key=itemgetter(0))[1:]


def shown_posture(
    profile: xr.Dataset,
    whisker: Whisker,
    *,
    true: float = np.nan,
    about: dict[str, int] | None = None,
    **how: Any,
) -> dict[str, xr.Dataset]:
    """Posture at rest as a result of a study, with the attributes that Figure 1 needs.

    Parameters
    ----------
    profile, whisker
        As :func:`posture_at_rest` takes them.
    true : float
        True contact ε, over L; NaN where it is not known.
    about : dict, optional
        More attributes: the number of the sweep.
    **how
        ``substrate``, ``friction``, ``texture``, ``scan`` of :func:`posture_at_rest`.

    Returns
    -------
    dict of Datasets
        ``posture``; empty if no curve of Eq. 1 fits.
    """
    try:
        found = posture_at_rest(profile, whisker, **how)
    except (InputError, ConvergenceError):  # too few nodes, or a curve that is none of Eq. 1
        return {}
    attrs = {"tip": whisker.tip, "cone_angle": whisker.cone_angle, "contact_true": true, **(about or {})}
    return {"posture": found.assign_attrs(attrs)}
