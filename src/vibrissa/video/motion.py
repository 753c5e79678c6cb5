"""Where a whisker has gone when it swings further between two frames than its neighbours are away.

The patch around the whisker, with its neighbours in it, is compared between the frames: whiskers of one
pad swing together, so the neighbours tell which of many alike lines this one is.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from vibrissa.video.band import contrast_band, smooth_along

CONTEXT = 25  # rows of neighbourhood on either side that are compared
EVERY = 4  # columns between those compared
STEPS = np.array([[2.0, 4.0, 8.0], [1.0, 2.0, 4.0], [0.5, 1.0, 2.0]])  # rows, from coarse to fine
WEIGHT = np.array([2e-4, 1e-4, 1e-4])  # likeness that a deviation of one row, squared, from the guess costs


@njit(cache=True)
def _patch(image, background, sign, centre, first, half, ceiling):  # type: ignore[no-untyped-def]
    """Contrast around a line, one column in ``EVERY``, cut at 0 and at a ceiling that silhouettes exceed."""
    _, contrast = contrast_band(image, background, sign, centre, first, half)
    contrast = smooth_along(contrast, 2)[:, ::EVERY]
    return np.minimum(np.maximum(contrast, np.float32(0)), np.float32(ceiling))


@njit(cache=True)
def _likeness(template, around, shift, thin):  # type: ignore[no-untyped-def]
    """Correlation, 0 to 1, of a patch with what stands ``shift`` rows (one per column) further in a larger one."""
    rows, n = template.shape
    margin = (around.shape[0] - rows) // 2
    product, norm_t, norm_a = 0.0, 1e-6, 1e-6
    for j in range(0, n, thin):
        s = min(max(margin + shift[j], 0), 2 * margin)
        for k in range(0, rows, thin):
            t, a = template[k, j], around[k + s, j]
            product += t * a
            norm_t += t * t
            norm_a += a * a
    return product / np.sqrt(norm_t * norm_a)


@njit(cache=True)
def _best(template, around, u, guess, centre, reach, step, thin):  # type: ignore[no-untyped-def]
    """Likeness less the cost of deviating from the guess, and the a, b, q where that is highest."""
    best = np.full(4, -np.inf)
    for i in range(-reach[0], reach[0] + 1):
        for j in range(-reach[1], reach[1] + 1):
            for k in range(-reach[2], reach[2] + 1):
                a, b, q = centre[0] + i * step[0], centre[1] + j * step[1], centre[2] + k * step[2]
                shift = np.floor(a + b * u + q * u * (u - 1) + 0.5).astype(np.int64)
                cost = WEIGHT[0] * (a - guess[0]) ** 2 + WEIGHT[1] * (b - guess[1]) ** 2
                cost += WEIGHT[2] * (q - guess[2]) ** 2
                score = _likeness(template, around, shift, thin) - cost
                if score > best[0]:
                    best[:] = score, a, b, q
    return best


@njit(cache=True)
def swing_of(before, image, background, sign, expected, guess, swing, ceiling):  # type: ignore[no-untyped-def]
    """Shift a + b u + q u (u − 1) [rows] of a whisker from one frame to the next.

    Parameters
    ----------
    before, image : (height, width) arrays
        The frame in which the line stood at ``expected``, and the next one.
    background, sign
        As in :func:`vibrissa.video.centreline.read_line`.
    expected : (width,) array
        Rows of the line [px], NaN in columns not to be read.
    guess : (3,) array
        Expected a, b, q, from the frame before.
    swing : int
        Largest shift of the far end [px].
    ceiling : float
        Contrast above which it is no whisker [grey levels].

    Returns
    -------
    shift : (width,) array
        Shift of every column [px].
    motion : (3,) array
        a, b, q.
    likeness : float
        Correlation of the two patches, less the cost of deviating from the guess.
    """
    columns = np.flatnonzero(~np.isnan(expected))
    first, stop = columns[0], columns[-1] + 1
    centre = np.floor(expected[first:stop] + 0.5).astype(np.int64)
    template = _patch(before, background, sign, centre, first, CONTEXT, ceiling)
    around = _patch(image, background, sign, centre, first, CONTEXT + swing, ceiling)
    span = max(stop - first - 1, 1)
    u = np.arange(0, stop - first, EVERY) / span
    reach = np.array([4, max(swing // 4, 1), 2])
    best = _best(template, around, u, guess, np.zeros(3), reach, STEPS[0], 2)
    for step in STEPS[1:]:
        best = _best(template, around, u, guess, best[1:], np.ones(3, np.int64), step, 1)
    along = (np.arange(expected.size) - first) / span
    return best[1] + best[2] * along + best[3] * along * (along - 1), best[1:], best[0]
