"""Surfaces made to measure: self-affine roughness, waves, and a texture that rides on a curved shape."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.tables.stated import number
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import generator

MOST_POINTS = 5_000_000


def self_affine(
    length: float,
    *,
    rng: np.random.Generator | int,
    rms: float,
    hurst: float = 0.8,
    spacing: float = 1e-6,
    longest: float = 1e-3,
    shortest: float = 10e-6,
) -> HeightProfile:
    """Self-affine random roughness, as sandpaper's: Gaussian heights with the power spectrum C(k) ∝ k^−(1 + 2H).

    The spectrum is that of a profile (a line, not an area); it is flat, not cut, above the longest wave, and nothing is
    shorter than the shortest. Drawn by Fourier's method on a circle twice as long as the profile, with Gaussian
    amplitudes, so that profiles have the rms only on average over draws.

    Parameters
    ----------
    length : float
        Length of the profile [m]; it starts at x = 0.
    rng : Generator or int
        Source of randomness, or a seed.
    rms : float
        Root mean square height about the mean, of the ensemble [m].
    hurst : float
        Hurst exponent H, in (0, 1).
    spacing : float
        Between points [m].
    longest, shortest : float
        Wavelengths at which the spectrum rolls off and ends [m].

    Returns
    -------
    HeightProfile
        Heights about 0.

    Raises
    ------
    InputError
        If H or a length is out of range, or the points are too many.
    """
    length, rms, spacing = number("length", length, "m"), number("rms", rms, "m"), number("spacing", spacing, "m")
    longest, shortest = number("longest", longest, "m"), number("shortest", shortest, "m")
    if not 0 < hurst < 1:
        raise RangeError("hurst", "must lie between 0 and 1", hurst)
    if not (rms > 0 and np.isfinite(rms)):
        raise RangeError("rms", "must be positive (m)", rms)
    if not 2 * spacing <= shortest < longest <= length:
        found = f"{spacing:g}, {shortest:g}, {longest:g}, {length:g} m"
        raise RangeError("roughness", "must have 2 · spacing ≤ shortest < longest ≤ length", found)
    rng, count = generator(rng), _points(length, spacing)
    k = np.fft.rfftfreq(2 * count, spacing)
    power = np.where(k <= 1 / shortest, np.maximum(k, 1 / longest) ** -(1 + 2 * hurst), 0.0)
    power[0] = 0.0
    amplitude = rms * np.sqrt(power / power.sum())
    waves = amplitude * (rng.normal(size=k.size) + 1j * rng.normal(size=k.size))
    return HeightProfile(
        position=spacing * np.arange(count, dtype=np.float64), height=np.fft.irfft(waves * count, 2 * count)[:count]
    )


def wave(
    length: float, *, amplitude: float, period: float, phase: float = 0.0, spacing: float = 10e-6
) -> HeightProfile:
    """Sinusoid h = A sin(2πx/period + phase), from x = 0, less its height there.

    Parameters
    ----------
    length : float
        [m].
    amplitude, period : float
        A and the period [m].
    phase : float
        [rad].
    spacing : float
        Between points [m].

    Returns
    -------
    HeightProfile
        The sinusoid.

    Raises
    ------
    InputError
        If a length is out of range, or the points are too many.
    """
    length, spacing = number("length", length, "m"), number("spacing", spacing, "m")
    amplitude, period = number("amplitude", amplitude, "m"), number("period", period, "m")
    phase = number("phase", phase, "rad")
    if not (period > 2 * spacing > 0 and np.isfinite([amplitude, period, phase]).all()):
        raise RangeError("wave", "must have a period of more than two spacings", f"{period:g} m, {spacing:g} m")
    x = spacing * np.arange(_points(length, spacing), dtype=np.float64)
    return HeightProfile(position=x, height=amplitude * (np.sin(2 * np.pi * x / period + phase) - np.sin(phase)))


def riding(texture: HeightProfile, shape: HeightProfile) -> HeightProfile:
    """A texture that rides on a shape: heights added, at the points of either.

    Heights are added vertically, not along the shape's normal: for gentle shapes the same, to the square of the slope.

    Parameters
    ----------
    texture, shape : HeightProfile
        Only one of them may have walls at one place. Each is level beyond its ends.

    Returns
    -------
    HeightProfile
        Sum of the two.

    Raises
    ------
    InputError
        If both have a wall at the same place.
    """
    walls = [one.position[1:][np.diff(one.position) == 0] for one in (texture, shape)]
    if np.intersect1d(*walls).size:
        raise RangeError("shape", "must have no wall where the texture has one", f"{np.intersect1d(*walls)[0]:.6g} m")
    x = np.union1d(texture.position, shape.position)
    right = texture.at(x) + shape.at(x)
    wall = np.isin(x, np.concatenate(walls))
    left = _before(texture, x[wall]) + _before(shape, x[wall])
    position, height = np.insert(x, np.flatnonzero(wall), x[wall]), np.insert(right, np.flatnonzero(wall), left)
    return HeightProfile(position=position, height=height)


def _before(surface: HeightProfile, x: Array) -> Array:
    """Height just before each place, on the side away from the base."""
    first = np.searchsorted(surface.position, x, side="left")
    known = (first < surface.position.size) & (surface.position[np.minimum(first, surface.position.size - 1)] == x)
    return np.where(known, surface.height[np.minimum(first, surface.position.size - 1)], surface.at(x))


def _points(length: float, spacing: float) -> int:
    if not (0 < spacing < length <= MOST_POINTS * spacing):
        rule = f"must be 1 to {MOST_POINTS} spacings of {spacing:g} m"
        raise RangeError("length", rule, f"{length:g} m", "lengths are in metres")
    return int(np.floor(length / spacing * (1 + 1e-12))) + 1
