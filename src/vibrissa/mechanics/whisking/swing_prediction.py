"""A swing of a whole whisker as a dataset: what the follicle feels, where the shaft touches, and what changes when."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError
from vibrissa.limits import require_samples
from vibrissa.mechanics.rod.film import RodFilm, film_of
from vibrissa.mechanics.rod.free_rod import free_damping
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD, Rod
from vibrissa.mechanics.rod.rod_states import STATES, contact_states
from vibrissa.mechanics.scan.follicle import force_unit
from vibrissa.mechanics.scan.verdict import rod_verdict
from vibrissa.mechanics.whisking.base_path import BasePath
from vibrissa.mechanics.whisking.swing import SwingRun, swing
from vibrissa.mechanics.whisking.swing_start import About
from vibrissa.quantities import dataset
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr

_BESIDE = 0.1  # share of the time in contact that is remarked


@dataclass(frozen=True)
class SwingPrediction:
    """A whole whisker that will be moved over a surface.

    Attributes
    ----------
    whisker : Whisker
        The cone, to its physical tip.
    path : BasePath
        Of its base.
    texture : Gaps or HeightProfile
        In metres.
    speed : float
        Of the base along the surface, beside the path's own travel [m/s].
    damping : float
        ζ of the first three modes.
    settings : Rod
        Of the rod.
    about : {"contact", "air"}
        Whose modes have that ratio: see :func:`vibrissa.mechanics.whisking.swing.swing`.
    surface_distance : float, optional
        From the base to x = 0 of the surface where the path begins [m].
    """

    whisker: Whisker
    path: BasePath
    texture: Gaps | HeightProfile
    speed: float
    damping: float
    settings: Rod = USUAL_ROD
    about: About = "contact"
    surface_distance: float | None = None

    def run(self, rate: float, *, shapes: bool = False, progress: Callable[[int, int], None] | None = None) -> SwingRun:
        """The swing, recorded at a rate.

        Parameters
        ----------
        rate : float
            Records per second [Hz].
        shapes : bool
            Record the whole shaft too.
        progress : callable, optional
            Takes the records that are done, and all of them.

        Returns
        -------
        SwingRun
            From the path's first time to its last.

        Raises
        ------
        InputError
            If the rate is not positive, the record too long, or the start neither in the air nor at rest.
        """
        samples = (self.path.time[-1] - self.path.time[0]) * rate
        if not samples > 0:
            raise RangeError("rate", "must give samples", f"{samples:.3g}", "choose another `sampling_rate`")
        require_samples("scan", self.path.time[-1] - self.path.time[0], rate)
        return swing(
            self.whisker,
            self.path,
            self.texture,
            speed=self.speed,
            damping=self.damping,
            sampling_rate=rate,
            settings=self.settings,
            about=self.about,
            surface_distance=self.surface_distance,
            shapes=shapes,
            progress=progress,
        )

    def sampled(self, rate: float, *, progress: Callable[[int, int], None] | None = None) -> xr.Dataset:
        """The swing at even times of its path.

        Parameters
        ----------
        rate : float
            Samples per second [Hz].
        progress : callable, optional
            Takes the records that are done, and all of them.

        Returns
        -------
        Dataset
            As :func:`swing_signals` gives it.

        Raises
        ------
        InputError
            As of :meth:`run`.
        """
        return swing_signals(self, self.run(rate, progress=progress))


def swing_film(
    prediction: SwingPrediction, rate: float, *, progress: Callable[[int, int], None] | None = None
) -> RodFilm:
    """What a movie of a swing shows.

    Parameters
    ----------
    prediction : SwingPrediction
        What is asked for.
    rate : float
        Records per second [Hz].
    progress : callable, optional
        Takes the records that are done, and all of them.

    Returns
    -------
    RodFilm
        In a frame that goes along at the travel's first rate; heights over the ground of the beginning.

    Raises
    ------
    InputError
        As of :meth:`SwingPrediction.run`.
    """
    run = prediction.run(rate, shapes=True, progress=progress)
    state = contact_states(run.record.contact, prediction.texture, prediction.whisker.length)
    held = (run.record, run.ground, run.rod.shaft.s, run.drive[:, :2], state)
    return film_of(prediction.whisker, run.time, *held)


def swing_signals(prediction: SwingPrediction, run: SwingRun) -> xr.Dataset:
    """Signals of a swing.

    Parameters
    ----------
    prediction : SwingPrediction
        What was asked for.
    run : SwingRun
        Its run.

    Returns
    -------
    Dataset
        On (time): ``base_moment``, ``base_curvature``, ``transverse_force``, ``axial_force``, with the shaft's own
        inertia; ``contact_state``, ``contact_count``, ``contact_load``, ``first_contact`` and ``last_contact`` [m from
        the base], ``contact_ground``; ``moment_base_height``, ``moment_base_angle``, ``moment_base_travel``;
        ``tip_ground`` and ``tip_height``. Every change of the contacts on (contact_event). ``free_frequency`` and
        ``free_damping`` (mode) of the rod in the air. Shares of the time; the attribute ``verdict``.
    """
    whisker, length = prediction.whisker, prediction.whisker.length
    state = contact_states(run.record.contact, prediction.texture, length)
    signals = _signals(run, whisker)
    free = free_damping(run.rod)
    more: dict[str, Any] = {
        **signals,
        **contact_events(run.time, state, signals["base_moment"]),
        **_places(run, length),
    }
    shares = {f"{name}_share": float(np.mean(state == k)) for k, name in enumerate(STATES)}
    more |= shares
    data = dataset(
        _attributes(prediction, run),
        time=run.time,
        contact_state=state,
        **more,
        mode=np.arange(1, 1 + free.kappa.size),
        free_frequency=free.kappa / (2 * np.pi * whisker.timescale),
        free_damping=free.ratio,
        surface_distance=run.surface_distance,
        unconverged_share=run.record.unconverged / run.record.steps,
        redone_share=run.record.redone / run.record.steps,
    )
    data.axial_force.attrs["long_name"] = "force along the shaft into the follicle"  # the modes have none
    in_air = f"in the air {100 * shares['detached_share']:.0f} % of the time"
    judged = rod_verdict(data.drop_vars("detached_share")).replace("whole whisker", f"whole whisker, {in_air}", 1)
    return data.assign_attrs(verdict=judged, beside_surface=_beside(signals["contact_ground"], prediction.texture))


def _beside(place: Array, surface: Gaps | HeightProfile) -> float:
    """Share of the time in contact in which the contact is before the surface begins or after it ends."""
    touching = place[np.isfinite(place)]
    if not touching.size:
        return 0.0
    first, last = surface.position[0], (surface.end if isinstance(surface, Gaps) else surface.position)[-1]
    return float(np.mean((touching < first) | (touching > last)))


def _signals(run: SwingRun, whisker: Whisker) -> dict[str, Array]:
    record, unit, length = run.record, force_unit(whisker), whisker.length
    angle, mass = run.place[1], run.rod.shaft.mass[-1]
    speeding = whisker.timescale**2 * np.stack([run.acceleration[2] / length, run.acceleration[0]])
    force = record.force - mass * speeding  # the last half cell moves as the base does
    first, last, count = record.contact[2:5]
    none = np.where(count > 0, 1.0, np.nan)
    return {
        "base_moment": unit * length * record.moment,
        "base_curvature": record.moment / length,
        "transverse_force": unit * (np.cos(angle) * force[1] - np.sin(angle) * force[0]),
        "axial_force": unit * (np.cos(angle) * force[0] + np.sin(angle) * force[1]),
        "contact_load": unit * record.contact[0],
        "contact_count": count,
        "first_contact": none * (1 - last) * length,
        "last_contact": none * (1 - first) * length,
        "contact_ground": none * record.contact[10] * length,
    }


def _places(run: SwingRun, length: float) -> dict[str, Array]:
    return {
        "moment_base_height": run.place[0] * length,
        "moment_base_angle": run.place[1],
        "moment_base_travel": run.place[2],
        "tip_ground": run.tip[0] * length,
        "tip_height": run.tip[1] * length,
    }


def contact_events(time: Array, state: Integers, moment: Array) -> dict[str, Any]:
    """Changes of the contacts: what they changed to.

    Parameters
    ----------
    time : (T,) array
        [s].
    state : (T,) array
        Numbers of ``vibrissa.mechanics.rod.rod_states.STATES``.
    moment : (T,) array
        At the base [N m].

    Returns
    -------
    dict
        Variables on ``contact_event``: its time, its kind (attach: from the air, whatever follows; detach; else the
        state that begins) and the moment.
    """
    after = 1 + np.flatnonzero(np.diff(state))
    from_air = state[after - 1] == 0
    names = np.array(["detach", *STATES[1:]])[state[after]]
    return {
        "contact_event": np.arange(after.size),
        "contact_event_time": time[after],
        "contact_event_kind": np.where(from_air, "attach", names),
        "contact_event_moment": moment[after],
    }


def event_lines(data: xr.Dataset) -> list[str]:
    """What happened to the contacts, in a line.

    Parameters
    ----------
    data : Dataset
        From :func:`swing_signals`.

    Returns
    -------
    list of str
        How it begins, its first and last touch, and how many changes of each kind; how much of it misses the surface,
        and whose modes have the damping ratio where that is not what was asked for.
    """
    kinds, times = data.contact_event_kind.values, data.contact_event_time.values
    begins = f"the whisker begins {data.attrs['begins']}"
    lines = []
    if (beside := data.attrs["beside_surface"]) > _BESIDE:
        lines = [f"{100 * beside:.0f} % of the time in contact is on the level ground before or behind the surface"]
    if data.attrs["damping_about"] != data.attrs["damping_asked"]:
        lines += ["no posture of the path touches level ground: modes in the air have the damping ratio"]
    if not kinds.size:
        return [f"{begins}; its contacts do not change", *lines]
    parts = [begins]
    for kind, end, word in (("attach", 0, "first touches"), ("detach", -1, "last leaves")):
        if (kinds == kind).any():
            parts.append(f"{word} at {times[kinds == kind][end]:.4g} s")
    names, counts = np.unique(kinds, return_counts=True)
    states = f"{', '.join(parts)}; changes: {', '.join(map(' '.join, zip(names, counts.astype(str), strict=True)))}"
    return [states, *lines]


def _attributes(prediction: SwingPrediction, run: SwingRun) -> dict[str, Any]:
    texture, settings = prediction.texture, prediction.settings
    gaps = {"gaps": len(texture.width), "gap_depth": texture.depth} if isinstance(texture, Gaps) else {}
    return {
        "model": "rod",
        "damping": prediction.damping,
        "damping_about": run.about,
        "damping_asked": prediction.about,
        "scan_speed": prediction.speed,
        "friction": prediction.path.friction,
        "begins": "in the air" if run.in_air else "at rest",
        **settings.curvature_attributes,
        "edge_radius": settings.edge_radius,
        "thick": int(settings.thick),
        "follicle_translation": settings.follicle_translation,
        "follicle_rotation": settings.follicle_rotation,
        "states": ", ".join(f"{k} {name}" for k, name in enumerate(STATES)),
        **prediction.whisker.attributes,
        **gaps,
    }
