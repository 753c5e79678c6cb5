"""The whisker as a chain of rigid links in MuJoCo, sliding with Coulomb friction over gaps, or over one fixed edge."""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time
from typing import Literal

import mujoco
import numpy as np
from case import DEPTH, SETTLE, STEP, Case

Array = np.ndarray
Ground = Literal["gaps", "ridge", "tip", "roller"]
MM, MS = 1e-3, 1e-3  # units mm, mg, ms: in SI MuJoCo refuses so light a body
RADIUS = 5e-3  # [mm] of what touches, everywhere the same: the shaft's lower side is parallel to its axis
CORNER = 2e-3  # [mm] radius of the edges
ROLLER = 20e-3  # [mm] radius of the fixed edge, which spins
RIDGE = 10e-3  # [mm] radius of a lone ridge, which spins
SPIN = 0.3  # [m/s] at which the surface of the ridge runs away from the base, so that the shaft always slips
HEAVY = 1e5  # [mg], [mg mm²] of the substrate, which nothing slows
REACH = 60.0  # [mm] of the land before the first gap and after the last
RIPPLE = 2e-4  # [ms] damping over stiffness of the joints: stills what the links alone have; ζ₁ of 8e-5
HELD = 1e-5  # [s] for which a drag force is held
PLUCK = 2e-2  # [rad] bend of one joint
SLIDE = 'type="slide" axis="-1 0 0"'
GROWTH = 1.25  # from link to link, away from the contact


@dataclass(frozen=True, kw_only=True)
class Grain:
    """How finely MuJoCo reckons.

    Attributes
    ----------
    fine, coarse : float
        Length of links where contact may be, and the longest [m].
    step, softness : float
        Time step, and time constant of a contact [s].
    """

    fine: float = 0.12e-3
    coarse: float = 1.5e-3
    step: float = 5e-7
    softness: float = 5e-6


@dataclass(frozen=True)
class PredictedMotion:
    """Nodes s over L, ascending, (S,); their positions over L, (T, S); CPU seconds per simulated second.

    ``left`` [s] is when the shaft left the land for a ridge.
    """

    s: Array
    x: Array
    y: Array
    cost: float
    left: float = np.nan


def joints(case: Case, grain: Grain) -> Array:
    """Ends of the links over L, from base to tip."""
    L, top = case.whisker.length, case.contact + 1.5 * case.gap / case.whisker.length
    fine, coarse = grain.fine / L, grain.coarse / L
    bottom = max(case.tip, case.contact - 3 * case.gap / L)
    middle = np.linspace(bottom, top, max(round((top - bottom) / fine), 1) + 1)
    return np.concatenate(
        [graded(top, 1.0, fine, coarse)[::-1], middle[::-1][1:-1], graded(bottom, case.tip, fine, coarse)]
    )


def graded(start: float, end: float, fine: float, coarse: float) -> Array:
    """From start to end in steps that grow from fine to coarse."""
    steps = [fine * GROWTH]
    while sum(steps) < abs(end - start):
        steps.append(min(GROWTH * steps[-1], coarse))
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    return start + (end - start) * reached / reached[-1] if end != start else np.array([start])


def shaft(case: Case, s: Array, ground: Ground, radius: float = RADIUS) -> str:
    """Links of a cone between the nodes s; each joint has the compliance ∫ ds/EI of the half links about it.

    What touches has a radius [mm].
    """
    w = case.whisker
    L, E, rho = w.length / MM, w.youngs_modulus * 1e-3, w.density * 1e-3
    EI, A = E * np.pi / 4 * (w.cone_angle * L) ** 4, np.pi * (w.cone_angle * L) ** 2
    middle = np.concatenate([[1.0], (s[1:] + s[:-1]) / 2])
    compliance = (middle[1:] ** -3 - middle[:-1] ** -3) / 3 * L / EI
    x, y = -np.array(case.flat.position(np.array([case.contact]))).ravel() * L
    place, turn = f"{x} {y + radius} 0", f'euler="0 0 {case.base_angle + np.pi}"'
    opened, touches = "", case.contact + 2 * case.gap / w.length
    for up, down, soft in zip(s[:-1], s[1:], compliance, strict=True):
        link, volume = (up - down) * L, (up**3 - down**3) / 3
        mean, square = (up**4 - down**4) / 4 / volume, (up**5 - down**5) / 5 / volume
        mass, spin = rho * A * L * volume, rho * A * L**3 * volume * (square - mean**2)
        opened += (
            f'<body pos="{place}" {turn}><joint type="hinge" axis="0 0 1" stiffness="{1 / soft}"/>'
            f'<inertial pos="{(up - mean) * L} 0 0" mass="{mass}" diaginertia="{spin} {spin} {spin}"/>'
            f'<site pos="{link} 0 0"/>'
        )
        if down < touches and ground != "tip":
            opened += f'<geom type="capsule" fromto="0 0 0 {link} 0 0" size="{radius}" contype="2" conaffinity="0"/>'
        if down < touches and (ground != "tip" or down == s[-1]):
            opened += f'<geom type="sphere" pos="{link} 0 0" size="{radius}" contype="1" conaffinity="0"/>'
        place, turn = f"{link} 0 0", ""
    return opened + "</body>" * (len(s) - 1)


def gapped(case: Case) -> str:
    """Boxes for lands and floors, thin cylinders for edges, on one heavy body that slides away from the base."""
    edges = np.stack([case.starts, case.starts + case.gap], axis=1) / MM
    lands = np.concatenate([[-REACH], edges.ravel(), [edges[-1, 1] + REACH]]).reshape(-1, 2)
    text = "".join(block(*land, 0.0) for land in lands) + "".join(block(*gap, -DEPTH / MM) for gap in edges)
    for x in np.concatenate([edges[:, 0] - CORNER, edges[:, 1] + CORNER]):
        text += edge(x, CORNER)
    return heavy(text, SLIDE)


def lone(case: Case) -> str:
    """A land, its edge, and a gap's width behind it a spinning ridge with nothing after it, on one heavy body."""
    first = case.starts[0] / MM
    return heavy(block(-REACH, first, 0.0) + edge(first - CORNER, CORNER) + ridge(first + case.gap / MM), SLIDE)


def yields(model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Take away the land once the shaft has left it for a ridge, so that one edge bears it, as in the model."""
    first = int(np.flatnonzero(model.geom_contype == 0)[0])  # the land, and its edge, come after the shaft
    touched = data.contact.geom[:, 1].min(initial=model.ngeom)
    left = first + 2 <= touched < model.ngeom
    if left:
        model.geom_conaffinity[first:touched] = 0
    return bool(left)


def ridge(x: float) -> str:
    """A thin cylinder across the scan that spins on its own, its top at height 0."""
    return heavy(edge(0.0, RIDGE, at=0.0), 'type="hinge" axis="0 0 1"', f"{x} {-RIDGE} 0")


def block(low: float, high: float, top: float) -> str:
    """A box from ``low`` to ``high`` along the scan."""
    size = f'pos="{(low + high) / 2} {top - 1} 0" size="{(high - low) / 2} 1 2"'
    return f'<geom type="box" {size} contype="0" conaffinity="1"/>'


def roller() -> str:
    """One fixed edge under the contact: a thin cylinder that spins, its upper side away from the base."""
    return heavy(edge(0.0, ROLLER, at=ROLLER), f'type="hinge" axis="0 0 1" pos="0 {-ROLLER} 0"')


def edge(x: float, radius: float, at: float = CORNER) -> str:
    """A cylinder across the scan whose top is at height 0."""
    return f'<geom type="capsule" fromto="{x} {-at} -1 {x} {-at} 1" size="{radius}" contype="0" conaffinity="2"/>'


def heavy(geoms: str, joint: str, place: str = "0 0 0") -> str:
    """A body so heavy that nothing slows it."""
    inertia = f'<inertial pos="0 0 0" mass="{HEAVY}" diaginertia="{HEAVY} {HEAVY} {HEAVY}"/>'
    return f'<body pos="{place}">{inertia}<joint {joint}/>{geoms}</body>'


def build(case: Case, s: Array, ground: Ground, grain: Grain) -> mujoco.MjModel:
    """The model; the substrate's joint follows the shaft's."""
    if ground == "tip":
        below = heavy(block(-REACH, REACH, 0.0), SLIDE)
    else:
        below = {"roller": lambda _: roller(), "gaps": gapped, "ridge": lone}[ground](case)
    return mujoco.MjModel.from_xml_string(f"""<mujoco><compiler angle="radian"/>
    <option timestep="{grain.step / MS}" gravity="0 0 0" cone="elliptic" integrator="Euler" impratio="10"
    tolerance="1e-11"/>
    <default><geom friction="{case.posture.friction} 0 0" solref="{grain.softness / MS} 1"
    solimp="0.99 0.99 0.001" condim="3"/></default>
    <worldbody>{shaft(case, s, ground)}{below}</worldbody></mujoco>""")


def simulate(case: Case, grain: Grain = Grain(), ground: Ground = "gaps") -> PredictedMotion:
    """Run MuJoCo from our stationary profile, at the case's times.

    Over ``gaps``; from a land to a ``ridge``; or plucked, by a torque on the shaft let go at ``SETTLE``, with its cut
    end alone on the flat (``tip``) or on one fixed edge (``roller``).
    """
    s = joints(case, grain)
    model = build(case, s, ground, grain)
    data = mujoco.MjData(model)
    angle = case.flat.angle(np.maximum((s[1:] + s[:-1]) / 2, case.contact))
    links = len(s) - 1
    data.qpos[:links] = np.diff(angle, prepend=case.base_angle)
    data.qvel[links] = case.speed / (ROLLER if ground == "roller" else 1.0)
    data.qvel[links + 1 :] = SPIN / RIDGE
    model.dof_damping[:links] = RIPPLE * model.jnt_stiffness[:links]
    torque = np.zeros(links)
    if ground in ("tip", "roller"):
        j = int(np.argmin(np.abs(s - 0.7)))
        torque[j] = PLUCK * model.jnt_stiffness[j]
    x, y = np.empty((2, len(case.time), len(s) - 1))
    seconds, left = 0.0, np.nan
    for i, t in enumerate(case.time):
        drag = case.drag * MS * (0.7 / case.damping if t < SETTLE / 2 else 1.0)
        seconds += advance(model, data, drag, torque if t < SETTLE else 0 * torque, round(HELD / grain.step))
        if ground == "ridge" and np.isnan(left) and yields(model, data):
            left = t
        x[i], y[i] = data.site_xpos[:, 0], data.site_xpos[:, 1]
    cost, L = seconds / case.time[-1], case.whisker.length / MM
    return PredictedMotion(s[:0:-1], x[:, ::-1] / L, (y[:, ::-1] - RADIUS) / L, cost, left)


def advance(model: mujoco.MjModel, data: mujoco.MjData, drag: float, torque: Array, steps: int) -> float:
    """One kept sample further, under drag proportional to mass, brought up to date every ``HELD``; MuJoCo's seconds."""
    momentum, seconds = np.zeros(model.nv), 0.0
    for _ in range(round(STEP / HELD)):
        mujoco.mj_mulM(model, data, momentum, data.qvel)
        data.qfrc_applied[: len(torque)] = torque - drag * momentum[: len(torque)]
        start = process_time()
        mujoco.mj_step(model, data, nstep=steps)
        seconds += process_time() - start
    return seconds
