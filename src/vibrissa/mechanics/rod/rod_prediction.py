"""A scan by the rod, as a dataset with the names that the single-contact model's has."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, TooFewError
from vibrissa.exact import cone_kappa
from vibrissa.limits import require_samples
from vibrissa.mechanics.rod.film import RodFilm, film_of
from vibrissa.mechanics.rod.rod_scan import RodRun, drag
from vibrissa.mechanics.rod.rod_settings import USUAL_ROD, Rod
from vibrissa.mechanics.rod.rod_states import STATES, contact_states
from vibrissa.mechanics.scan.diagnostics import own_weight
from vibrissa.mechanics.scan.follicle import force_unit
from vibrissa.mechanics.scan.sampled import node_distances
from vibrissa.mechanics.scan.scan_span import SpannedScan
from vibrissa.mechanics.scan.verdict import rod_verdict
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class RodPrediction(SpannedScan):
    """A surface that will be drawn under the rod.

    Attributes
    ----------
    settings : Rod
        Of the rod.
    """

    settings: Rod = USUAL_ROD

    def times(self, rate: float) -> Array:
        """Times at which it is sampled at a rate [s].

        Parameters
        ----------
        rate : float
            Samples per second [Hz].

        Returns
        -------
        (T,) array
            From 0 until the ringing after the end has died away.
        """
        return np.arange(round(self.duration * rate) + 1) / rate

    def run(
        self,
        rate: float,
        nodes: Array | None = None,
        *,
        duration: float | None = None,
        shapes: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> RodRun:
        """The run, recorded at a rate.

        Parameters
        ----------
        rate : float
            Records per second [Hz].
        nodes : (P,) array, optional
            Points whose motion is wanted, over L from the tip of the cone.
        duration : float, optional
            From time 0 [s]; until all is quiet by default.
        shapes : bool
            Record the whole shaft too.
        progress : callable, optional
            Takes the records that are done, and all of them.

        Returns
        -------
        RodRun
            From time 0 on; at −1/rate the rod was at rest.

        Raises
        ------
        InputError
            If the rate is not positive or the record too long.
        """
        if not 0 < rate < np.inf:
            raise RangeError("rate", "must be positive (Hz)", rate)
        lasting = self.duration if duration is None else duration
        require_samples("scan", lasting, rate)
        return drag(
            self.whisker,
            self.posture,
            self.texture,
            speed=self.scan.speed,
            damping=self.scan.damping,
            start=-1 / rate,
            duration=lasting + 1 / rate,
            sampling_rate=rate,
            n_modes=self.n_modes,
            nodes=() if nodes is None else tuple(nodes),
            settings=self.settings,
            shapes=shapes,
            progress=progress,
        )

    def film(self, rate: float, *, progress: Callable[[int, int], None] | None = None) -> RodFilm:
        """What a movie of it shows.

        Parameters
        ----------
        rate : float
            Records per second [Hz].
        progress : callable, optional
            Takes the records that are done, and all of them.

        Returns
        -------
        RodFilm
            In the frame of the base.

        Raises
        ------
        InputError
            As of :meth:`run`.
        """
        run = self.run(rate, shapes=True, progress=progress)
        travelled = -self.scan.speed * run.time / self.whisker.length
        shift = np.column_stack([travelled, np.zeros(run.time.size)])
        held = (run.record, run.ground, run.rod.shaft.s, shift, self._states(run))
        return film_of(self.whisker, run.time, *held)

    def displacement(self, t: Array, s: Array) -> Array:
        """Motion along the normal at points of the shaft, on an even grid of times that begins at 0.

        Parameters
        ----------
        t : (T,) array
            Times [s].
        s : (P,) array
            Points, over L from the tip of the cone.

        Returns
        -------
        (T, P) array
            Over L.

        Raises
        ------
        InputError
            If there are fewer than two times, or they are not even from 0 on.
        """
        if len(t) < 2:
            raise TooFewError("times", "must be two or more for the rod", len(t))
        rate = (len(t) - 1) / float(t[-1] - t[0])
        if not np.allclose(np.asarray(t) * rate, np.arange(len(t)), rtol=0, atol=1e-3):
            found = f"{t[0]:g} to {t[-1]:g} s, the first step {t[1] - t[0]:g} s of {1 / rate:g} s on average"
            raise RangeError("times", "must be even and begin at 0 for the rod", found, "take those of `times`")
        return self.run(rate, s, duration=float(t[-1])).displacement.T

    def sampled(
        self,
        rate: float,
        nodes: Sequence[float] | None = None,
        *,
        progress: Callable[[int, int], None] | None = None,
    ) -> xr.Dataset:
        """The scan at even times, from 0 until the ringing after its end has died away.

        Parameters
        ----------
        rate : float
            Samples per second [Hz].
        nodes : sequence of float, optional
            Distances from the base of points whose motion is wanted [m].
        progress : callable, optional
            Takes the records that are done, and all of them.

        Returns
        -------
        Dataset
            ``mode_displacement`` (mode, time), what a movie shows of the pinned modes: the motion from the equilibrium
            along its normal, fitted; its ``envelope`` [m] and ``mode_sd``; what the follicle feels; ``contact_state``,
            ``contact_count``, ``first_contact``, ``last_contact`` [m from the base], ``contact_load`` (time);
            ``displacement`` (time, node) [m]; ``free_end_length``, from the contact that is nearest to the base, at
            the first moment, to the tip [m]; shares of time of the states; the attribute ``verdict``.

        Raises
        ------
        InputError
            If the rate is not positive, the record too long, or a node not on the whisker.
        """
        distances = node_distances(self.whisker, nodes)
        points = None if distances is None else 1 - distances / self.whisker.length
        return self.labelled(self.run(rate, points, progress=progress), distances)

    def labelled(self, run: RodRun, distances: Array | None = None) -> xr.Dataset:
        """A run as a dataset.

        Parameters
        ----------
        run : RodRun
            Of :meth:`run`.
        distances : (P,) array, optional
            From the base, of the points whose motion was asked for [m].

        Returns
        -------
        Dataset
            As of :meth:`sampled`.
        """
        state = self._states(run)
        more: dict[str, Any] = dict(self._signals(run))
        if distances is not None:
            moved = run.displacement.T * self.whisker.length
            more |= {"node": np.arange(distances.size), "arc_length": distances, "displacement": moved}
        shown = run.mode_displacement
        if shown.shape[1] > 3:
            more["envelope"] = self.whisker.length * analytic_envelope(shown)[0]
        more |= {f"{name}_share": float(np.mean(state == k)) for k, name in enumerate(STATES)}
        data = dataset(
            self._attributes(),
            time=run.time,
            mode=np.arange(1, self.n_modes + 1),
            mode_displacement=shown,
            mode_sd=shown.std(axis=1),
            kappa=cone_kappa(self.posture.contact, self.n_modes),
            resonant_frequency=self.resonances,
            rod_frequency=run.rod.modes.kappa[: self.n_modes] / (2 * np.pi * self.whisker.timescale),
            free_end_length=self._free_end(run),
            weight_ratio=own_weight(self.whisker) / on_the_flat(self.posture).contact_force,
            unconverged_share=run.record.unconverged / run.record.steps,
            contact_state=state,
            **more,
        )
        data.axial_force.attrs["long_name"] = "force along the shaft into the follicle"  # the modes have none
        return data.assign_attrs(verdict=rod_verdict(data))

    def _signals(self, run: RodRun) -> dict[str, Array]:
        record, angle = run.record, self.posture.base_angle
        unit, length = force_unit(self.whisker), self.whisker.length
        first, last, count = record.contact[2:5]
        none = np.where(count > 0, 1.0, np.nan)
        return {
            "base_moment": unit * length * record.moment,
            "base_curvature": record.moment / length,
            "transverse_force": unit * (np.array([-np.sin(angle), np.cos(angle)]) @ record.force),
            "axial_force": unit * (np.array([np.cos(angle), np.sin(angle)]) @ record.force),
            "contact_load": unit * record.contact[0],
            "contact_count": count,
            "first_contact": none * (1 - last) * length,
            "last_contact": none * (1 - first) * length,
        }

    def _free_end(self, run: RodRun) -> float:
        """From the first record's contact that is nearest to the base, to the tip [m]; NaN if nothing touches then."""
        nearest, count = run.record.contact[3:5, 0]
        return float(nearest - run.rod.shaft.s[0]) * self.whisker.length if count else np.nan

    def _states(self, run: RodRun) -> Integers:
        return contact_states(run.record.contact, self.texture, self.whisker.length)

    def _attributes(self) -> dict[str, Any]:
        surface = (
            {"gaps": len(self.texture.width), "gap_depth": self.texture.depth} if isinstance(self.texture, Gaps) else {}
        )
        return {
            "model": "rod",
            "damping": self.scan.damping,
            "scan_speed": self.scan.speed,
            "contact": self.posture.contact,
            "base_angle": self.posture.base_angle,
            **self.settings.curvature_attributes,
            "edge_radius": self.settings.edge_radius,
            "thick": int(self.settings.thick),
            "follicle_translation": self.settings.follicle_translation,
            "follicle_rotation": self.settings.follicle_rotation,
            "states": ", ".join(f"{k} {name}" for k, name in enumerate(STATES)),
            **self.posture.friction_attributes,
            **self.whisker.attributes,
            **surface,
        }
