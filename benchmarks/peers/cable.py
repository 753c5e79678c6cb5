"""The whisker as an ANCF cable in Exudyn, rubbing over moving edges, which are thin circles."""

from __future__ import annotations

from itertools import pairwise
from time import process_time

import exudyn as exu
import numpy as np
from case import SETTLE, STEP, Array, Case
from chain import HEAVY, MM, MS, Grain, PredictedMotion, joints
from exudyn.itemInterface import (
    CoordinateConstraint,
    MarkerBodyCable2DShape,
    MarkerNodeCoordinate,
    MarkerNodeRigid,
    NodeGenericData,
    NodePoint2DSlope1,
    NodePointGround,
    NodeRigidBody2D,
    ObjectANCFCable2D,
    ObjectContactFrictionCircleCable2D,
    ObjectRigidBody2D,
)

CIRCLE = 20e-3  # [mm]
STIFFNESS, DAMPING = 100.0, 1e-3  # [mN/mm], [mN ms/mm] of the contact
CREEP = 5.0  # [mN ms/mm] friction over slip, below sliding
SEGMENTS = 2  # straight pieces of an element, for the contact
STRIDE = 5e-6  # [s] time step


def shaft(mbs, case: Case, s: Array) -> list[int]:
    """Elements, clamped at the base, from our stationary profile; straight without load."""
    w = case.whisker
    L, E, rho = w.length / MM, w.youngs_modulus * 1e-3, w.density * 1e-3
    EI, A = E * np.pi / 4 * (w.cone_angle * L) ** 4, np.pi * (w.cone_angle * L) ** 2
    x, y = np.array(case.flat.position(s)) * L
    foot = np.array(case.flat.position(np.array([case.contact]))).ravel() * L
    x, y, angle = x - foot[0], y - foot[1], case.flat.angle(s)
    along = -np.cos(case.base_angle), -np.sin(case.base_angle)
    nodes = []
    for i, one in enumerate(s):
        rest = [x[0] + along[0] * (1 - one) * L, y[0] + along[1] * (1 - one) * L, *along]
        here = [x[i], y[i], -np.cos(angle[i]), -np.sin(angle[i])]
        moved = list(np.subtract(here, rest))
        nodes.append(mbs.AddNode(NodePoint2DSlope1(referenceCoordinates=rest, initialCoordinates=moved)))
    ground = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    for coordinate in range(4):
        held = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=coordinate))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[ground, held]))
    cables = []
    for i, (up, down) in enumerate(pairwise(s)):
        bending = EI * 3 * (up - down) / (down**-3 - up**-3)
        cable = ObjectANCFCable2D(
            length=(up - down) * L,
            massPerLength=rho * A * (up**3 - down**3) / 3 / (up - down),
            bendingStiffness=bending,
            axialStiffness=E * A * up * down,
            bendingDamping=case.lag / MS * bending,
            nodeNumbers=nodes[i : i + 2],
        )
        cables.append(mbs.AddObject(cable))
    return cables


def circle(mbs, case: Case, at: float, cables: list[int], velocity: list[float]) -> None:
    """A circle in contact with some of the elements, at constant velocity [x, y, turn].

    Its top stands at height 0, and as much higher as the contact gives under the load on the flat.
    """
    w, flat = case.whisker, case.flat
    unit = np.pi / 4 * w.youngs_modulus * w.cone_angle**4 * w.length**2 * 1e3
    sunk = unit * flat.contact_force * np.cos(case.posture.friction_angle) / STIFFNESS
    place = [at, sunk - CIRCLE, 0.0]
    node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=place, initialVelocities=velocity))
    mbs.AddObject(ObjectRigidBody2D(mass=HEAVY, inertia=HEAVY, nodeNumber=node))
    marker = mbs.AddMarker(MarkerNodeRigid(nodeNumber=node))
    for cable in cables:
        shape = mbs.AddMarker(MarkerBodyCable2DShape(bodyNumber=cable, numberOfSegments=SEGMENTS))
        data = [0.1] * SEGMENTS + [-2.0] * SEGMENTS + [0.0] * SEGMENTS
        state = mbs.AddNode(NodeGenericData(initialCoordinates=data, numberOfDataCoordinates=3 * SEGMENTS))
        contact = ObjectContactFrictionCircleCable2D(
            markerNumbers=[marker, shape],
            nodeNumber=state,
            numberOfContactSegments=SEGMENTS,
            contactStiffness=STIFFNESS,
            contactDamping=DAMPING,
            frictionVelocityPenalty=CREEP,
            frictionCoefficient=case.posture.friction,
            circleRadius=CIRCLE,
            useSegmentNormals=False,
        )
        mbs.AddObject(contact)


def simulate(case: Case, grain: Grain) -> PredictedMotion:
    """Run Exudyn over the two edges of a gap, without land, from when the far edge has reached the contact.

    The samples before are NaN.
    """
    mbs = exu.SystemContainer().AddSystem()
    s = joints(case, grain)
    cables = shaft(mbs, case, s)
    top = case.contact + 1.6 * case.gap / case.whisker.length
    near = [one for one, down in zip(cables, s[1:], strict=True) if down < top]
    for at in (0.0, case.gap / MM):
        circle(mbs, case, at, near, [-case.speed, 0.0, 0.0])
    mbs.Assemble()
    first = int(np.searchsorted(case.time, SETTLE - STEP / 2))
    x, y = np.full((2, len(case.time), len(s)), np.nan)

    def keep(mbs, t: float) -> bool:
        i = first + round(t * MS / STEP)
        if abs(t * MS + (first - i) * STEP) < STRIDE / 2 and i < len(x):
            now, rest = exu.ConfigurationType.Current, exu.ConfigurationType.Reference
            r = mbs.systemData.GetODE2Coordinates(now) + mbs.systemData.GetODE2Coordinates(rest)
            x[i], y[i] = r[0 : 4 * len(s) : 4], r[1 : 4 * len(s) : 4]
        return True

    mbs.SetPostStepUserFunction(keep)
    duration = case.time[-1] - case.time[first]
    start = process_time()
    mbs.SolveDynamic(settings(duration))
    cost, L = (process_time() - start) / duration, case.whisker.length / MM
    return PredictedMotion(s[::-1], x[:, ::-1] / L, y[:, ::-1] / L, cost)


def settings(duration: float) -> exu.SimulationSettings:
    """Generalised-alpha in even steps for a duration [s]."""
    chosen = exu.SimulationSettings()
    integration = chosen.timeIntegration
    integration.endTime, integration.numberOfSteps = duration / MS, round(duration / STRIDE)
    integration.generalizedAlpha.spectralRadius = 0.8
    integration.newton.useModifiedNewton = True
    integration.discontinuous.maxIterations = 5
    integration.discontinuous.ignoreMaxIterations = True
    integration.verboseMode = 0
    chosen.solutionSettings.writeSolutionToFile = False
    return chosen
