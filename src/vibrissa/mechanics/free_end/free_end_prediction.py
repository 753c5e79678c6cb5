"""A scan by the fast model with the free end: gap by gap, the support that the shaft has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import ConflictError, RangeError
from vibrissa.exact import cone_kappa
from vibrissa.limits import require_samples
from vibrissa.mechanics.contact.gap_events import check_gaps
from vibrissa.mechanics.free_end.bridge_statics import POWERS, bridged, on_the_floor, too_wide
from vibrissa.mechanics.free_end.march_kernels import march
from vibrissa.mechanics.free_end.phases import BRIDGE, FAR, LAND, TIP, Passage, Phases, Work
from vibrissa.mechanics.free_end.sample_kernels import sample
from vibrissa.mechanics.free_end.tables import MODES_HELD, NO_POINTS, Tables, tables
from vibrissa.mechanics.free_end.validity import free_end_verdict
from vibrissa.mechanics.scan.diagnostics import own_weight
from vibrissa.mechanics.scan.follicle import force_unit
from vibrissa.mechanics.scan.free_end import free_end_facts
from vibrissa.mechanics.scan.sampled import node_distances
from vibrissa.mechanics.scan.scan_settings import QUICK
from vibrissa.mechanics.scan.scan_span import SpannedScan
from vibrissa.mechanics.scan.texture_prediction import check_scale
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import check_tip
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    import xarray as xr

_STEP, _WAIT, _LOOK = 4e-4, 1e-4, 1e-3  # [s] of the march; half of each changes correlations by 0.001
_MOST_SAMPLES = 20_000_000
_ROOM = 20  # phases for each gap, at first
_MOST_ROOM = 2000
_NO_SURFACE = "for any other surface use model 'rod'"


@dataclass(frozen=True)
class FreeEndPrediction(SpannedScan):
    """Gaps drawn past a whisker whose free end bears on the land behind each gap until it ends.

    Attributes
    ----------
    texture : Gaps
        In metres.

    Raises
    ------
    InputError
        If the texture is not gaps, out of scale, or the contact beyond the tip.
    """

    texture: Gaps

    def __post_init__(self) -> None:
        check_gaps(self.texture, _NO_SURFACE)
        check_tip(self.posture, self.whisker)
        check_scale(self.whisker, self.texture.end, self.texture.width)
        if self.n_modes < 1:
            raise RangeError("number of modes", "must be at least 1", self.n_modes)
        if self.posture.friction < 0 or self.posture.adhesion > 0:
            law = f"friction {self.posture.friction:g}, adhesion {self.posture.adhesion:g}"
            raise ConflictError("Posture", "must have Coulomb's friction for the free end", law, "use model 'rod'")

    @property
    def free_end(self) -> float:
        """Length of shaft beyond the contact, over L."""
        return self.posture.contact - self.whisker.tip

    @property
    def jumps(self) -> Mask:
        """Which gaps the tip drops into, (J,): those wider than the free end. The others it bridges."""
        return np.asarray(self.texture.width > self.free_end * self.whisker.length)

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

        Raises
        ------
        InputError
            If the rate is not positive or the record too long.
        """
        if not 0 < rate < np.inf:
            raise RangeError("rate", "must be positive (Hz)", rate)
        require_samples("scan", self.duration, rate, _MOST_SAMPLES)
        return np.arange(int(self.duration * rate) + 1) / rate

    @cached_property
    def tables(self) -> Tables:
        """Of the posture and the free end."""
        return self._tables(NO_POINTS)

    def _tables(self, points: Array) -> Tables:
        widest = float(self.texture.width.max()) / self.whisker.length
        farthest = 1.001 * max(widest - self.free_end, 0.0)
        return tables(
            self.whisker.tip,
            self.posture,
            damping=self.scan.damping,
            farthest=farthest,
            n_seen=self.n_modes,
            points=points,
        )

    @cached_property
    def phases(self) -> Phases:
        """The motion, from support to support."""
        course, room = self._course(), _ROOM * len(self.texture.width) + 100
        m, n = MODES_HELD, POWERS
        sizes = ((m, n), (m, n), (2, n), (n,), (2, m), (m,), (m,), (m,), (n,), (2, m), (3, 2, m))
        while True:
            phases = Phases(
                np.empty(room), np.empty(room, np.int64), np.empty(room, np.int64), np.empty((room, 2, m)),
                np.empty((room, m, n)), np.empty((room, 2, n)),
            )  # fmt: skip
            stop = self.duration / self.whisker.timescale  # what rings then goes on ringing
            count = march(self.tables, course, stop, Work(*(np.zeros(size) for size in sizes)), phases)
            if count >= 0:
                return self._bounded(Phases._make(each[:count] for each in phases))
            room *= 4
            if room > _MOST_ROOM * len(self.texture.width) + 100:
                raise RangeError("scan", "must settle on its supports", "they change without end", "use model 'rod'")

    def _bounded(self, phases: Phases) -> Phases:
        """The same; refused where the motion grows beyond the whisker, as over a gap hardly narrow enough."""
        if not np.abs(phases.free).max() < 1:  # NaN, too
            found = f"one beyond the whisker's length; the widest gap is {self.texture.width.max():.3g} m"
            raise RangeError("scan", "must have a motion that bends the shaft little", found, "use model 'rod'")
        return phases

    def _course(self) -> Passage:
        length, k, speed = self.whisker.length, self.whisker.timescale, self.scan.speed
        width, depth = self.texture.width / length, self.texture.depth / length
        at = self.tables.resistance
        if (wide := too_wide(at, width, self.free_end)).any():
            rule = "must be narrow enough for a shaft that bends little to lie on both its edges"
            found = f"{width[wide.argmax()] * length:.3g} m, {width[wide.argmax()]:.2g} of the whisker's length"
            raise RangeError(f"gap at {self.texture.position[wide.argmax()]:.4g} m", rule, found, "use model 'rod'")
        turn, lift, least = on_the_floor(at, width, self.free_end, depth, abs(float(self.tables.slope[-1])))
        return Passage(
            begin=self.texture.position / (speed * k),
            end=self.texture.end / (speed * k),
            width=width,
            bridge=np.stack(bridged(at, width, self.free_end)),
            floor=np.stack([turn, lift]),
            least=least,
            depth=depth,
            free_end=self.free_end,
            speed=speed * k / length,
            step=_STEP / max(k, QUICK),
            wait=_WAIT / max(k, QUICK),
            look=_LOOK / max(k, QUICK),
        )

    def _rows(self, t: Array, of: Tables) -> Array:
        out = np.empty((of.seen.shape[1], len(t)))
        sample(np.asarray(t, float) / self.whisker.timescale, self.phases, of, of.seen, of.held_seen, out)
        return out

    def mode_displacement(self, t: Array) -> Array:
        """What a movie shows of the pinned modes, q_i + Q_i, fitted as of the rod.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            Over L; 0 at rest on the flat.
        """
        return self._rows(t, self.tables)[: self.n_modes]

    def displacement(self, t: Array, s: Array) -> Array:
        """Motion along the normal at points of the shaft.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.
        s : (P,) array
            Points, over L from the tip of the cone; the free end is taken for straight.

        Returns
        -------
        (T, P) array
            Over L.
        """
        return self._rows(t, self._tables(np.asarray(s, float)))[self.n_modes : -1].T

    def sampled(self, rate: float, nodes: Sequence[float] | None = None) -> xr.Dataset:
        """The scan at even times, from 0 until the ringing after its end has died away.

        Parameters
        ----------
        rate : float
            Samples per second [Hz].
        nodes : sequence of float, optional
            Distances from the base of points whose motion is wanted [m].

        Returns
        -------
        Dataset
            ``mode_displacement`` (mode, time), its ``envelope`` [m] and ``mode_sd``; ``base_curvature`` [1/m],
            ``base_moment`` [N m] and ``excursion`` over L (time); ``displacement`` (time, node) [m];
            ``free_end_length`` [m], ``jump_count``, ``jumps_allowed``; ``bridge_share``, that of the time; the
            attribute ``verdict``.

        Raises
        ------
        InputError
            If the rate is not positive, the record too long, or a node not on the whisker.
        """
        distances, length = node_distances(self.whisker, nodes), self.whisker.length
        time = self.times(rate)
        of = self.tables if distances is None else self._tables(1 - distances / length)
        rows = self._rows(time, of)
        shown, curvature = rows[: self.n_modes], rows[-1] + on_the_flat(self.posture).base_curvature
        more: dict[str, Any] = {}
        if distances is not None:
            moved = rows[self.n_modes : -1].T * length
            more |= {"node": np.arange(distances.size), "arc_length": distances, "displacement": moved}
        if time.size > 3:
            more["envelope"] = length * analytic_envelope(shown)[0]
        data = dataset(
            self._attributes(),
            time=time,
            mode=np.arange(1, self.n_modes + 1),
            mode_displacement=shown,
            mode_sd=shown.std(axis=1),
            excursion=self.excursion(time),
            kappa=cone_kappa(self.posture.contact, self.n_modes),
            resonant_frequency=self.resonances,
            base_curvature=curvature / length,
            base_moment=force_unit(self.whisker) * length * curvature,
            weight_ratio=own_weight(self.whisker) / on_the_flat(self.posture).contact_force,
            bridge_share=self._bridge_share(time[-1]),
            **free_end_facts(self.free_end * length, self.jumps),
            **more,
        )
        return data.assign_attrs(verdict=free_end_verdict(data, self.whisker, self.posture, self.texture, self.scan))

    def excursion(self, t: Array) -> Array:
        """How far the surface has carried the contact: from ε on land, on a far edge, on a near edge, on the tip.

        Parameters
        ----------
        t : (T,) array
            Times [s].

        Returns
        -------
        (T,) array
            Over L, positive away from the base.
        """
        phase = np.searchsorted(self.phases.start * self.whisker.timescale, t, "right") - 1
        support, gap = self.phases.support[phase], self.phases.gap[phase]
        place = np.asarray(t, float) * self.scan.speed
        far, near = place - self.texture.position[gap], place - self.texture.end[gap]
        out = np.select([support == LAND, support == FAR, support == TIP], [0 * place, far, 0 * place], near)
        return np.where(support == TIP, self.free_end, out / self.whisker.length)

    def _bridge_share(self, until: float) -> float:
        k = self.whisker.timescale
        borders = np.clip(np.append(self.phases.start * k, np.inf), 0.0, until)
        return float(np.sum(np.diff(borders)[self.phases.support == BRIDGE]) / until)

    def _attributes(self) -> dict[str, Any]:
        return {
            "model": "free-end",
            "damping": self.scan.damping,
            "scan_speed": self.scan.speed,
            "contact": self.posture.contact,
            "base_angle": self.posture.base_angle,
            "gaps": len(self.texture.width),
            "gap_depth": self.texture.depth,
            **self.posture.friction_attributes,
            **self.whisker.attributes,
        }
