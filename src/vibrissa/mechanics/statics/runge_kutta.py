"""Explicit Runge–Kutta methods as data, and the one compiled step that takes them.

A method is its Butcher tableau. :func:`stepper` joins it to the equations of a problem; who calls the step chooses its
length, fixed (:mod:`vibrissa.mechanics.statics.shooting`) or from the estimated error
(:mod:`vibrissa.mechanics.statics.elastica_kernels`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853

from vibrissa.arrays import Array
from vibrissa.loops import njit


class Tableau(NamedTuple):
    """A Runge–Kutta method of S stages.

    Attributes
    ----------
    nodes : (S,) array
        Where each stage is, as a share of the step.
    stages : (S, S) array
        Weights of the earlier slopes in the state of each stage.
    weights : (S,) array
        Weights of all slopes in the state after the step.
    errors : (2, S + 1) array, optional
        Weights of all slopes, the last one after the step, in two estimates of the error, of order 5 and 3.
    """

    nodes: Array
    stages: Array
    weights: Array
    errors: Array = np.empty((2, 0))


# Butcher's method of order 6 in seven stages
BUTCHER_6 = Tableau(
    np.array([0, 1 / 3, 2 / 3, 1 / 3, 1 / 2, 1 / 2, 1]),
    np.array(
        [
            [0, 0, 0, 0, 0, 0, 0],
            [1 / 3, 0, 0, 0, 0, 0, 0],
            [0, 2 / 3, 0, 0, 0, 0, 0],
            [1 / 12, 1 / 3, -1 / 12, 0, 0, 0, 0],
            [-1 / 16, 9 / 8, -3 / 16, -3 / 8, 0, 0, 0],
            [0, 9 / 8, -3 / 8, -3 / 4, 1 / 2, 0, 0],
            [9 / 44, -9 / 11, 63 / 44, 18 / 11, 0, -16 / 11, 0],
        ]
    ),
    np.array([11 / 120, 0, 27 / 40, 27 / 40, -4 / 15, -4 / 15, 11 / 120]),
)

# Dormand and Prince's method of order 8
DORMAND_PRINCE_853 = Tableau(
    np.ascontiguousarray(DOP853.C, float),
    np.ascontiguousarray(DOP853.A, float),
    np.ascontiguousarray(DOP853.B, float),
    np.ascontiguousarray([DOP853.E5, DOP853.E3], float),
)


def stepper(tableau: Tableau, slope: Callable[..., None], size: int) -> Callable[..., Any]:
    """Compiled step of a method for the equations of one problem.

    Parameters
    ----------
    tableau : Tableau
        The method; its numbers become constants of the compiled step.
    slope : compiled function
        ``slope(place, state, constants, out)`` writes the derivatives (N,) of a state (N,) at a place.
    size : int
        N.

    Returns
    -------
    compiled function
        ``step(places, h, state, constants, slopes, out)``: the state after a step of length h into ``out`` (N,), with
        the stages at ``places`` (S,). Of ``slopes`` (S or more, N) the first row is given, the others are written.
    """
    stages, weights, count = tableau.stages, tableau.weights, len(tableau.weights)

    @njit(nogil=True, error_model="numpy")
    def step(places: Any, h: float, state: Array, constants: Any, slopes: Array, out: Array) -> None:
        for stage in range(1, count):
            out[:] = state
            for k in range(stage):
                if stages[stage, k] != 0:
                    for i in range(size):
                        out[i] += h * stages[stage, k] * slopes[k, i]
            slope(places[stage], out, constants, slopes[stage])
        out[:] = state
        for k in range(count):
            for i in range(size):
                out[i] += h * weights[k] * slopes[k, i]

    return step
