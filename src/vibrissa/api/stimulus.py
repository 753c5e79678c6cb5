"""Envelopes of signals, and the command of a stimulator that replays a whisker's motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from vibrissa.api.motion import Motion
from vibrissa.api.shared.arguments import names_arguments
from vibrissa.signals.envelope import analytic_envelope

if TYPE_CHECKING:
    import xarray as xr

Held = TypeVar("Held")  # whatever holds a signal


def envelope(signal: Held) -> Held:
    """Envelope of a ringing signal by the analytic signal, Eq. 17.

    Parameters
    ----------
    signal : DataArray with a dimension ``time``, Tsd, TsdFrame, AnalogSignal, or (..., T) array, also of quantities
        On an even grid, any unit, without NaN; its mean is taken away first.

    Returns
    -------
    DataArray, Tsd, TsdFrame, AnalogSignal or array
        As the signal, in its unit.

    Raises
    ------
    InputError
        If the signal has less than 4 samples, NaN, masked samples or uneven times, or is of another kind.

    Examples
    --------
    >>> import numpy as np
    >>> import vibrissa as vb
    >>> t = np.arange(0, 1, 1e-3)
    >>> bool(abs(vb.envelope(3 * np.sin(2 * np.pi * 100 * t))[500] - 3) < 0.01)
    True
    """
    from vibrissa.api.objects.signals import changed_signal

    found: Held = changed_signal(signal, lambda values: analytic_envelope(values)[0], "envelope")
    return found


@names_arguments
def replay(
    *motions: Any,
    rate: float = 20e3,
    distance: float = 5e-3,
    duration: float = 10.0,
    low: float = 0.1,
    high: float = 83.0,
    fade: float = 0.05,
    ramp: float = 0.0,
    factor: float = 1.0,
    delays: Literal["even", "random", "least"] | Sequence[float] = "least",
    separation: float = 0.1,
    seed: int = 0,
) -> xr.Dataset:
    """Command of a 24-whisker stimulator that replays a whisker's motion on each, shifted in time.

    Parameters
    ----------
    *motions : Motion, Dataset, DataArray, Tsd or path
        One for each texture: a prediction, a sampled one with nodes, or the displacement of a point [m].
    rate : float
        Samples per second of the command [Hz].
    distance : float
        Of the point from the base whose motion is replayed [m].
    duration : float
        Of the command [s].
    low, high : float
        Corners of the band [Hz].
    fade, ramp : float
        Overlap of neighbouring textures, and rise from rest and back [s].
    factor : float
        Factor on the command.
    delays, separation, seed
        How the copies are shifted: see :func:`vibrissa.stimulus.array.replay_command`.

    Returns
    -------
    Dataset
        ``command`` (whisker, time) [m], ``delay`` (whisker), and how correlated the copies are.

    Raises
    ------
    InputError
        If the motions are too short, or a setting is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> import vibrissa as vb
    >>> surface = vb.random_grating(0.55, rng=1)
    >>> motion = vb.scan(vb.atlas("C2"), vb.Posture(contact=0.29, base_angle=1.2), surface, speed=0.1)
    >>> vb.replay(motion, duration=5.0).command.sizes["whisker"]
    24
    """
    from vibrissa.stimulus.array import replay_command
    from vibrissa.stimulus.band import Band

    return replay_command(
        [_point_motion(one, distance) for one in motions],
        duration=duration,
        sampling_rate=rate,
        band=Band(low=low, high=high),
        fade=fade,
        ramp=ramp,
        scale=factor,
        delays=delays,
        separation=separation,
        seed=seed,
    )


def _point_motion(thing: Any, distance: float) -> Any:
    """Motion of one point on an even grid, as the stimulator takes it."""
    import xarray as xr

    from vibrissa.api.objects.signals import as_signal
    from vibrissa.stimulus.waveform import PointMotion, motion_at

    if isinstance(thing, Motion):
        thing = thing.sample(nodes=[distance])
    if isinstance(thing, xr.Dataset) and ("displacement" in thing or "x" in thing):
        return motion_at(thing, distance)
    shown = as_signal(thing)
    return PointMotion(displacement=shown.to_numpy(), sampling_rate=shown.attrs["sampling_rate"])
