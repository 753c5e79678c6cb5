"""The whole whisker, its free end on the ground, in MuJoCo beside our rod: case, both runs, and what a movie shows.

Both have the same nodes, the same damping (in proportion to mass and to stiffness: ζ of modes 1 and 3), and the same
ground. MuJoCo's shaft and edges are round: its nodes see edges of radius ``RADIUS + CORNER`` and gaps narrower by
2 ``RADIUS``, and that is the ground which the rod is given.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from time import process_time

import mujoco
import numpy as np
from chain import HELD, MM, MS, REACH, SLIDE, Array, block, edge, heavy, shaft

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.rod.equilibrium import resting_rod
from vibrissa.mechanics.rod.kernels.ground import ground_of
from vibrissa.mechanics.rod.kernels.state import Damping
from vibrissa.mechanics.rod.mesh import Fineness, graded_nodes
from vibrissa.mechanics.rod.observation import fitted_modes
from vibrissa.mechanics.rod.rod_scan import fine_reach
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.statics.edge_contact import Held, on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

SETTLE = 20e-3  # [s] before the surface begins; the first half near critical damping
KEPT = 1e-4  # [s] between samples
RADIUS, CORNER = 5e-3, 5e-3  # [mm] of what touches, and of the edges
ROUND = (RADIUS + CORNER) * MM  # [m]


@dataclass(frozen=True, kw_only=True)
class Whole:
    """A whole whisker over a surface.

    Attributes
    ----------
    tip : float
        Where the shaft ends, over L.
    surface : Gaps
        Sharp, in metres.
    duration : float
        From when x = 0 of the surface meets the contact [s].
    contact, base_angle, speed, zeta : float
        Posture, speed of the substrate [m/s], damping ratio of modes 1 and 3.
    """

    tip: float
    surface: Gaps
    duration: float
    contact: float = 0.29
    base_angle: float = 1.2
    speed: float = 0.1
    zeta: float = 0.11

    @cached_property
    def whisker(self) -> Whisker:
        return Whisker(length=40e-3, cone_angle=1.5e-3, tip=self.tip)

    @cached_property
    def posture(self) -> Posture:
        return Posture(contact=self.contact, base_angle=self.base_angle)

    @cached_property
    def flat(self) -> Held:
        return on_the_flat(self.posture)

    @property
    def gap(self) -> float:
        """The widest [m]: as far beyond the contact MuJoCo looks for touches."""
        return float(self.surface.width.max())

    @cached_property
    def rounded(self) -> Gaps:
        """Gaps as MuJoCo's nodes see them."""
        thick = RADIUS * MM
        return Gaps(self.surface.position + thick, self.surface.width - 2 * thick, self.surface.depth)

    @cached_property
    def damping(self) -> tuple[float, float]:
        """Damping over mass and over stiffness, in 1/k and k."""
        modes = resting_rod(self.whisker, self.posture, damping=self.zeta).modes
        terms = np.stack([np.ones(2), modes.stiffness[[0, 2]]], axis=1)
        mass, stiffness = np.linalg.solve(terms, 2 * self.zeta * modes.kappa[[0, 2]])
        return float(mass), float(stiffness)

    def nodes(self, fineness: Fineness) -> Array:
        """Nodes of both, over L, ascending."""
        return graded_nodes(self.tip, self.contact, fineness, fine_reach(self.surface, self.whisker.length))

    def seen(self, s: Array, rest: Array) -> Array:
        """Rows that give the pinned modes that fit best, (3, 2N + 3)."""
        return fitted_modes(s, rest, self.contact, cone_kappa(self.contact, 3))


@dataclass(frozen=True)
class Seen:
    """Pinned modes over L, (3, T), every ``KEPT``; CPU seconds per simulated second; nodes, steps [s]."""

    modes: Array
    cost: float
    nodes: int
    step: float
    iterations: float = field(default=np.nan)


def ours(case: Whole, settings: Rod, *, sharp: bool = False) -> Seen:
    """Our rod over MuJoCo's ground, or over the sharp one."""
    whisker, surface = case.whisker, case.surface if sharp else case.rounded
    ground = ground_of(surface, whisker.length, 0.0 if sharp else ROUND)
    reach = fine_reach(case.surface, whisker.length)
    rod = resting_rod(whisker, case.posture, damping=case.zeta, settings=settings, reach=reach)
    rod.damping = Damping(*case.damping, np.zeros((0, rod.state.at.size)), np.zeros(0))
    every = max(1, round(KEPT / settings.step))
    count = round((SETTLE + case.duration) / KEPT) * every
    step = KEPT / every
    travel = case.speed / whisker.length * (SETTLE - step * np.arange(count + 1))
    drive = np.hstack([np.stack([travel, 0 * travel], axis=1), np.tile(rod.drive, (count + 1, 1))])
    rod.over(ground)
    project = case.seen(rod.shaft.s, rod.state.at)
    start = process_time()
    record = rod.run(ground, drive, step / whisker.timescale, project, every=every)
    cost = (process_time() - start) / (count * step)
    first = round(SETTLE / KEPT)
    return Seen(record.projected[:, first:], cost, rod.shaft.s.size, step, rod.state.counts[0] / count)


def grating(case: Whole) -> str:
    """Boxes for lands and floors, thin cylinders for edges, on one heavy body that slides away from the base."""
    edges = (np.stack([case.surface.position, case.surface.end], axis=1) + case.speed * SETTLE) / MM
    edges += CORNER * np.array([-1, 1])  # centres of the cylinders, where boxes end: nodes and links see the same edge
    lands = np.concatenate([[-REACH], edges.ravel(), [edges[-1, 1] + REACH]]).reshape(-1, 2)
    text = "".join(block(*land, 0.0) for land in lands)
    text += "".join(block(*gap, -case.surface.depth / MM) for gap in edges)
    text += "".join(edge(x, CORNER, at=CORNER) for x in edges.ravel())
    return heavy(text, SLIDE)


def model_of(case: Whole, s: Array, step: float, softness: float) -> mujoco.MjModel:
    """Chain and ground; the joint of the ground follows those of the chain."""
    return mujoco.MjModel.from_xml_string(f"""<mujoco><compiler angle="radian"/>
    <option timestep="{step / MS}" gravity="0 0 0" cone="elliptic" integrator="Euler" impratio="10"
    tolerance="1e-11"/>
    <default><geom friction="{case.posture.friction} 0 0" solref="{softness / MS} 1"
    solimp="0.99 0.99 0.001" condim="3"/></default>
    <worldbody>{shaft(case, s, "gaps", RADIUS)}{grating(case)}</worldbody></mujoco>""")


def theirs(case: Whole, fineness: Fineness, step: float, softness: float) -> Seen:
    """MuJoCo's chain over the same ground."""
    s = case.nodes(fineness)[::-1]
    model = model_of(case, s, step, softness)
    data, links = mujoco.MjData(model), len(s) - 1
    angle = case.flat.angle(np.maximum((s[1:] + s[:-1]) / 2, case.contact))
    data.qpos[:links] = np.diff(angle, prepend=case.base_angle)
    data.qvel[links] = case.speed
    mass, stiffness = case.damping
    k = case.whisker.timescale / MS
    model.dof_damping[:links] = stiffness * k * model.jnt_stiffness[:links]
    base = -np.array(case.flat.position(np.array([case.contact]))).ravel()
    samples = round((SETTLE + case.duration) / KEPT) + 1
    at, seconds = np.zeros((samples, 2 * len(s) + 1)), 0.0
    at[:, -3:] = *base, case.base_angle
    scale = case.whisker.length / MM
    for i in range(samples):
        near_critical = 0.7 / case.zeta if i * KEPT < SETTLE / 2 else 1.0
        if i > 0:
            seconds += advance(model, data, links, near_critical * mass / k, step)
        mujoco.mj_kinematics(model, data)
        at[i, 0:-3:2] = data.site_xpos[::-1, 0] / scale
        at[i, 1:-3:2] = (data.site_xpos[::-1, 1] - RADIUS) / scale
    first = round(SETTLE / KEPT)
    rest = at[first - 5]
    modes = case.seen(s[::-1], rest) @ (at[first + 1 :] - rest).T
    return Seen(modes, seconds / (SETTLE + case.duration), len(s), step)


def advance(model: mujoco.MjModel, data: mujoco.MjData, links: int, drag: float, step: float) -> float:
    """One kept sample further, under drag proportional to mass, brought up to date every ``HELD``; MuJoCo's seconds."""
    momentum, start = np.zeros(model.nv), process_time()
    for _ in range(round(KEPT / HELD)):
        mujoco.mj_mulM(model, data, momentum, data.qvel)
        data.qfrc_applied[:links] = -drag * momentum[:links]
        mujoco.mj_step(model, data, nstep=round(HELD / step))
    return process_time() - start


def alike(one: Array, other: Array) -> list[tuple[float, float]]:
    """Ratio of rms and correlation of each mode."""
    return [(float(a.std() / b.std()), float(np.corrcoef(a, b)[0, 1])) for a, b in zip(one, other, strict=True)]


def finer(settings: Rod, factor: float) -> Rod:
    """The same rod with cells and steps smaller."""
    return replace(settings, fineness=settings.fineness.refined(factor), step=settings.step / factor)
