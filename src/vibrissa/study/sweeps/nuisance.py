"""What a real sweep has and the model leaves out: each stated, off by default."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vibrissa.arrays import Array
from vibrissa.exact import shaft_quadrature
from vibrissa.mechanics.modes.basis import amplitudes
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.study.spec.nuisance import Nuisance
from vibrissa.study.sweeps.truth import TrueMotion
from vibrissa.texture.surface import Gaps

Course = Callable[[Array], Array]

HARMONICS = 3  # of the hum, the n-th 1/n as large
_GRID = 1 / 32_000  # [s] of the friction noise: straight lines between its points to 1 % at 800 Hz
_STEP = 1e-4  # of μ for the derivative of the profile, whose error is of its square


def slow_motion(sd: float, shortest: float, span: float, rng: np.random.Generator) -> Course:
    """Gaussian random motion, of even power down to its shortest period; it repeats after ``span`` [s].

    Parameters
    ----------
    sd : float
        Standard deviation over draws.
    shortest : float
        Shortest period [s].
    span : float
        After which it repeats [s].
    rng : Generator
        Source of randomness.

    Returns
    -------
    callable
        Times (T,) [s] → values (T,), of standard deviation ``sd`` over draws.
    """
    count = max(1, int(span / shortest))
    turn = 2 * np.pi * np.arange(1, count + 1) / span
    cosines, sines = sd / np.sqrt(count) * rng.standard_normal((2, count))

    def motion(t: Array) -> Array:
        angle = np.outer(t, turn)
        return np.asarray(np.cos(angle) @ cosines + np.sin(angle) @ sines)

    return motion


def wandered(texture: Gaps, speed: float, wander: Course) -> Gaps:
    """Texture as a tip meets it that wanders by w(t) along it: v t + w(t) = x, to first order in w.

    Parameters
    ----------
    texture : Gaps
        The texture.
    speed : float
        v [m/s].
    wander : callable
        Times [s] → w [m].

    Returns
    -------
    Gaps
        As met.

    Raises
    ------
    InputError
        If the tip would meet edges out of turn.
    """
    return with_edges(texture, lambda edge: edge - wander(edge / speed))


def with_edges(texture: Gaps, moved: Course) -> Gaps:
    """Texture with its edges moved.

    Parameters
    ----------
    texture : Gaps
        The texture.
    moved : callable
        Places of edges [m] → places to which they move [m].

    Returns
    -------
    Gaps
        As met.
    """
    first = moved(texture.position)
    return replace(texture, position=first, width=moved(texture.end) - first)


def travel(texture: Gaps, met: Gaps) -> float:
    """Root mean square of how far the edges that were met lie from those of the texture [m], about the mean.

    Parameters
    ----------
    texture : Gaps
        The texture.
    met : Gaps
        As the tip met it.

    Returns
    -------
    float
        [m].
    """
    return float(np.std(np.concatenate([met.position - texture.position, met.end - texture.end])))


@dataclass(frozen=True)
class FrictionNoise:
    """Motion that a fluctuating friction gives to a whisker whose base is held.

    The profile follows, δU_qs = δμ ∂U/∂μ at H and θ_b, and each mode answers q̈ + 2ζω_i q̇ + ω_i² q = −c_i δμ̈, with
    c_i = ∫ s² ∂U/∂μ V_i ds, as in Eq. (6).

    Attributes
    ----------
    prediction : Prediction
        The whisker and its modes.
    time, friction : (K,) arrays
        Grid [s], and δμ on it; they repeat.
    """

    prediction: Prediction
    time: Array
    friction: Array

    @cached_property
    def unit(self) -> tuple[Course, Course]:
        """∂(x, y)/∂μ of points s, from the base and over L, base and angle held."""
        posture, height = self.prediction.posture, self.prediction.response.flat.base[1]
        low, high = (
            on_the_flat(Posture.at_height(height, posture.base_angle, posture.friction + step))
            for step in (-_STEP, _STEP)
        )

        def slope(axis: int) -> Course:
            return lambda s: (high.position(s)[axis] - low.position(s)[axis]) / (2 * _STEP)

        return slope(0), slope(1)

    @cached_property
    def coupling(self) -> Array:
        """c_i, (M,)."""
        basis = self.prediction.response.basis
        s, weights = shaft_quadrature(self.prediction.posture.contact, 80 + 8 * len(basis.kappa))
        along, up = self.unit
        return amplitudes(basis, s, weights, along(s), up(s))

    @cached_property
    def modes(self) -> Array:
        """q_i on the grid, over L, (M, K)."""
        omega = self.prediction.omega[:, None]
        w = 2 * np.pi * np.fft.rfftfreq(len(self.time), _GRID)
        answer = self.coupling[:, None] * w**2 / (omega**2 - w**2 + 2j * self.prediction.scan.damping * omega * w)
        return np.asarray(np.fft.irfft(answer * np.fft.rfft(self.friction), len(self.time)))

    def position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """Displacement of the points s along the substrate and up, over L, (T, S) each.

        Parameters
        ----------
        t : (T,) array
            Times [s].
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        x, y : (T, S) arrays
            Over L.
        """
        change = np.interp(t, self.time, self.friction)[:, None]
        q = np.stack([np.interp(t, self.time, mode) for mode in self.modes], axis=1)
        shapes = self.prediction.response.basis.displacement(s)
        x, y = (change * unit(s) + q @ shape for unit, shape in zip(self.unit, shapes, strict=True))
        return x, y


def friction_noise(
    prediction: Prediction, sd: float, corner: float, span: float, rng: np.random.Generator
) -> FrictionNoise:
    """Draw δμ of standard deviation ``sd``, with the power density of a Lorentzian of this corner [Hz].

    Parameters
    ----------
    prediction : Prediction
        The whisker and its modes.
    sd : float
        Standard deviation of μ.
    corner : float
        [Hz].
    span : float
        After which it repeats, at least [s].
    rng : Generator
        Source of randomness.

    Returns
    -------
    FrictionNoise
        Drawn.
    """
    count = 2 * int(np.ceil(span / _GRID / 2))
    frequency = np.fft.rfftfreq(count, _GRID)
    power = 1 / (1 + (frequency / corner) ** 2)
    power[[0, -1]] = 0.0
    waves = np.sqrt(power / power.sum()) * (rng.standard_normal(power.size) + 1j * rng.standard_normal(power.size))
    time = _GRID * np.arange(count, dtype=np.float64)
    return FrictionNoise(prediction, time, sd * np.fft.irfft(waves * count / 2, count))


@dataclass(frozen=True)
class Disturbed:
    """A motion with what disturbs it.

    Attributes
    ----------
    motion : TrueMotion
        Over the surface.
    along, up : callable
        Motion of the whole whisker along the substrate and across it [m].
    friction : FrictionNoise, optional
        What a fluctuating friction adds.
    """

    motion: TrueMotion
    along: tuple[Course, ...] = ()
    up: tuple[Course, ...] = ()
    friction: FrictionNoise | None = None

    def position(self, t: Array, s: Array) -> tuple[Array, Array]:
        """Position of the points s from where the base is without drift, over L, (T, S) each.

        Parameters
        ----------
        t : (T,) array
            Times [s].
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        x, y : (T, S) arrays
            Over L.
        """
        x, y = self.motion.position(t, s)
        if self.friction is not None:
            dx, dy = self.friction.position(t, s)
            x, y = x + dx, y + dy
        length = self.motion.prediction.whisker.length
        x = sum((motion(t)[:, None] / length for motion in self.along), x)
        y = sum((motion(t)[:, None] / length for motion in self.up), y)
        return x, y


def hum(amplitude: float, frequency: float, rng: np.random.Generator) -> Course:
    """Sum of the hum and its harmonics, of random phases [m].

    Parameters
    ----------
    amplitude : float
        Of the first [m].
    frequency : float
        Of the first [Hz].
    rng : Generator
        Source of randomness.

    Returns
    -------
    callable
        Times (T,) [s] → motion (T,) [m].
    """
    order = np.arange(1, HARMONICS + 1)
    phase = rng.uniform(0, 2 * np.pi, HARMONICS)

    def motion(t: Array) -> Array:
        return np.asarray(np.sin(2 * np.pi * frequency * np.outer(t, order) + phase) @ (amplitude / order))

    return motion


def disturbed(motion: TrueMotion, nuisance: Nuisance, span: float, rng: np.random.Generator) -> Disturbed:
    """Disturb a motion that lasts ``span`` [s] by hum, drift of the head and friction noise, as far as they are on.

    Parameters
    ----------
    motion : TrueMotion
        What is disturbed.
    nuisance : Nuisance
        By what.
    span : float
        [s].
    rng : Generator
        Source of randomness.

    Returns
    -------
    Disturbed
        The motion.
    """
    along: list[Course] = []
    up: list[Course] = []
    friction = None
    if nuisance.hum:
        up.append(hum(nuisance.hum, nuisance.hum_frequency, rng))
    if nuisance.head_drift:
        for motions in (along, up):
            motions.append(slow_motion(nuisance.head_drift, nuisance.drift_time, 2 * span, rng))
    if nuisance.friction_noise:
        friction = friction_noise(motion.prediction, nuisance.friction_noise, nuisance.friction_corner, 2 * span, rng)
    return Disturbed(motion, tuple(along), tuple(up), friction)
