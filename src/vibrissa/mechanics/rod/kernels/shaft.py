"""The shaft as the rod sees it: segments that stretch, nodes that bend and carry mass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array


class RodShaft(NamedTuple):
    """A discretised shaft of N segments and N + 1 nodes, from the tip to the base.

    Units: lengths over L, times over the whisker's timescale k, forces over πEα⁴L²/4. The bending stiffness of the cone
    is then s⁴, its mass per length s², its axial stiffness 4s²/α².

    Attributes
    ----------
    s : (N + 1,) array
        Positions of the nodes.
    rest : (N,) array
        Lengths of the segments.
    mass : (N + 1,) array
        Of the half cells about the nodes.
    axial : (N,) array
        Axial stiffness over length of each segment.
    bending : (N + 1,) array
        Bending stiffness over the length of the cell about each node: moment per angle between the two segments; of the
        last node between the last segment and the base; 0 at the tip.
    rest_angle : (N + 1,) array
        Those angles of the free shaft: its intrinsic curvature times the cells.
    radius : (N + 1,) array
        Of the shaft, where the ground touches it: zero for the midline.
    """

    s: Array
    rest: Array
    mass: Array
    axial: Array
    bending: Array
    rest_angle: Array
    radius: Array


def shaft(s: Array, cone_angle: float, *, curvature: Array | float = 0.0, thick: bool = False) -> RodShaft:
    """The cone with nodes at s.

    Parameters
    ----------
    s : (N + 1,) array
        Positions of the nodes, ascending to 1.
    cone_angle : float
        α [rad].
    curvature : (N + 1,) array or float
        Intrinsic curvature at the nodes, over 1/L; positive where the shaft bends as a pressed one does.
    thick : bool
        The ground touches the surface of the shaft, not its midline.

    Returns
    -------
    RodShaft
        The arrays that the kernels take.
    """
    middle = (s[1:] + s[:-1]) / 2
    faces = np.concatenate([s[:1], middle, s[-1:]])
    cells = np.diff(faces)
    bending = s**4 / cells
    bending[0] = 0.0
    return RodShaft(
        s=s,
        rest=np.diff(s),
        mass=np.diff(faces**3) / 3,
        axial=4 / cone_angle**2 * middle**2 / np.diff(s),
        bending=bending,
        rest_angle=np.broadcast_to(curvature, s.shape) * cells,
        radius=cone_angle * s if thick else np.zeros_like(s),
    )
