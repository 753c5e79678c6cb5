"""Linear equations of a band matrix of half width five: what couples a node of the rod to its neighbours but one."""

from __future__ import annotations

from vibrissa.arrays import Array
from vibrissa.loops import njit

HALF = 5  # two unknowns for each node, neighbours but one: 2·2 + 1
WIDTH = 2 * HALF + 1


@njit(cache=True, nogil=True, error_model="numpy")
def add_block(matrix: Array, row: int, column: int, block: tuple[float, float, float, float]) -> None:
    """Add what couples the motion of one node to the force on another.

    Parameters
    ----------
    matrix : (U, 11) array
        Row i holds the columns i − 5 to i + 5; changed.
    row, column : int
        Numbers of the nodes.
    block : tuple of 4 floats
        xx, xy, yx, yy.
    """
    first = HALF + 2 * (column - row)
    matrix[2 * row, first] += block[0]
    matrix[2 * row, first + 1] += block[1]
    matrix[2 * row + 1, first - 1] += block[2]
    matrix[2 * row + 1, first] += block[3]


@njit(cache=True, nogil=True, error_model="numpy")
def solve_band(matrix: Array, right: Array) -> None:
    """Solve in place by elimination without pivots: the mass over the step squared dominates the diagonal.

    Parameters
    ----------
    matrix : (U + 5, 11) array
        Row i holds the columns i − 5 to i + 5; the five last rows only make room for loops of fixed length. Destroyed.
    right : (U + 5,) array
        Right side, becomes the solution; the five last must be 0.
    """
    size = right.size - HALF
    for k in range(size):
        pivot = 1 / matrix[k, HALF]
        for below in range(1, HALF + 1):
            share = matrix[k + below, HALF - below] * pivot
            for beside in range(1, HALF + 1):
                matrix[k + below, HALF - below + beside] -= share * matrix[k, HALF + beside]
            right[k + below] -= share * right[k]
    right[size:] = 0.0
    for i in range(size - 1, -1, -1):
        rest = right[i]
        for beside in range(1, HALF + 1):
            rest -= matrix[i, HALF + beside] * right[i + beside]
        right[i] = rest / matrix[i, HALF]
