"""A whisker as a rod that rests on the ground, and its run through time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError
from vibrissa.mechanics.rod.damping import RodModes
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness, Touch, untouched
from vibrissa.mechanics.rod.kernels.elastic_kernels import SegmentWork
from vibrissa.mechanics.rod.kernels.ground import Ground
from vibrissa.mechanics.rod.kernels.record_kernels import COLUMNS
from vibrissa.mechanics.rod.kernels.shaft import RodShaft
from vibrissa.mechanics.rod.kernels.state import CLAMPED, Damping, Follicle, RodState
from vibrissa.mechanics.rod.kernels.step_kernels import Method, advance
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker

_BLOCK = 400  # steps after which a run is looked at
_LOST = 40  # steps of a block whose iterations may fail before a run is given up
_AWAY = 2.0  # [L] from the base, where no node of a whisker at work is
_HALVINGS = 8  # of a step that does not converge: 25 µs become 0.1 µs at least


class RodRecord(NamedTuple):
    """What was recorded of a run, along time.

    Attributes
    ----------
    projected : (M, T) array
        Projections of the motion from the equilibrium.
    force : (2, T) array
        Of the shaft on the follicle, along x and y, over the force unit.
    moment : (T,) array
        At the base, over force unit and L.
    contact : (11, T) array
        ``Touch.summary``.
    energy : (6, T) array
        Kinetic, elastic, power of viscous damping; work of the ground, work at the base, lost to friction.
    steps, unconverged, redone : int
        Steps in all, parts of steps whose iterations did not end, and steps that were redone in parts.
    shapes : (T, 2N + 3) array
        Positions; empty where they were not asked for.
    """

    projected: Array
    force: Array
    moment: Array
    contact: Array
    energy: Array
    steps: int
    unconverged: int
    redone: int
    shapes: Array


@dataclass
class RestingRod:
    """A rod in equilibrium under a steady drag of the ground.

    Attributes
    ----------
    whisker : Whisker
        The cone.
    posture : Posture
        As Eq. (1) has it; gives the height of the base.
    shaft : RodShaft
        Its discretisation.
    state : RodState
        At rest.
    touch : Touch
        Its contacts.
    stiffness : Stiffness
        Of the ground, and friction.
    damping : Damping
        For the damping ratio that was asked for.
    drive : (3,) array
        x, y and angle of what holds the base, so that the base itself is where Eq. (1) has it.
    work : SegmentWork
        Forces in the shaft.
    follicle : Follicle
        How the base is held.
    modes : RodModes
        About the equilibrium.
    """

    whisker: Whisker
    posture: Posture
    settings: Rod
    shaft: RodShaft
    state: RodState
    touch: Touch
    stiffness: Stiffness
    damping: Damping
    drive: Array
    work: SegmentWork = field(repr=False)
    follicle: Follicle = CLAMPED
    modes: RodModes = field(init=False)

    def over(self, ground: Ground) -> None:
        """Make room for the edges of a ground; what the nodes remember stays.

        Parameters
        ----------
        ground : Ground
            That comes.
        """
        fresh = untouched(self.shaft.s.size, ground.edge.size)
        self.touch = fresh._replace(node_drag=self.touch.node_drag, node_drag_now=self.touch.node_drag_now)

    def run(
        self,
        ground: Ground,
        drive: Array,
        step: float,
        project: Array,
        *,
        every: int = 1,
        shapes: bool = False,
        halvings: int = _HALVINGS,
        progress: Callable[[int, int], None] | None = None,
    ) -> RodRecord:
        """Carry the rod through a drive; it continues from where it was.

        Parameters
        ----------
        ground : Ground
            Under it.
        drive : (T + 1, 5) array
            As of :func:`vibrissa.mechanics.rod.kernels.step_kernels.advance`.
        step : float
            Over k.
        project : (M, 2N + 3) array
            What is recorded of the positions.
        every : int
            Steps for each record.
        shapes : bool
            Record all positions too.
        halvings : int
            How often a step that does not converge is halved.
        progress : callable, optional
            Takes the records that are done, and all of them.

        Returns
        -------
        RodRecord
            At every record's end.

        Raises
        ------
        ConvergenceError
            If more than 40 of 400 steps do not converge, or a node is lost.
        """
        steps = drive.shape[0] - 1
        rows = steps // every
        record = np.zeros((rows, project.shape[0] + COLUMNS))
        kept = np.zeros((rows if shapes else 0, self.state.at.size))
        resting = project @ self.state.at
        chunk = every * max(1, _BLOCK // every)
        method = Method(step, self.settings.tolerance, halvings)
        for first in range(0, rows * every, chunk):
            last, lost = min(first + chunk, rows * every), self.state.counts[1]
            lines = slice(first // every, last // every)
            advance(
                self.shaft, ground, self.stiffness, self.damping, self.follicle, drive[first : last + 1], method,
                every, project, self.state, self.touch, self.work, record[lines],
                kept[lines] if shapes else kept,
            )  # fmt: skip
            away = np.abs(self.state.at[:-1].reshape(-1, 2) - drive[last, 2:4]).max()
            if self.state.counts[1] - lost > _LOST or not away < _AWAY:
                raise ConvergenceError(
                    "motion of the rod", float(np.abs(self.state.force).max()), int(self.state.counts[0])
                )
            if progress is not None:
                progress(lines.stop, rows)
        m = project.shape[0]
        columns = record.T
        return RodRecord(
            projected=columns[:m] - resting[:, None],
            force=columns[m : m + 2],
            moment=columns[m + 2],
            contact=columns[m + 3 : m + 14],
            energy=columns[m + 14 : m + 20],
            steps=rows * every,
            unconverged=int(columns[m + 20, -1]) if rows else 0,
            redone=int(self.state.counts[2]),
            shapes=kept,
        )
