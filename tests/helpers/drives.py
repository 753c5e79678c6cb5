"""Drives that follow any motion: through samples, or by piecewise polynomials."""

import numpy as np
from scipy.interpolate import CubicSpline

from vibrissa.mechanics.vibration.dynamics import Drive


def piecewise_drive(amplitude, before=None):
    """Make a drive of piecewise polynomials of time, an event at each breakpoint; at rest before the first."""
    pieces = amplitude.c.reshape(*amplitude.c.shape[:2], -1)[::-1].transpose(2, 1, 0)
    return Drive(amplitude.x[:-1], pieces, pieces[:, 0, 0] if before is None else np.asarray(before))


def sampled_drive(time, amplitude):
    """Make a drive through samples (M, T), by a cubic spline: error of order 4 in their spacing."""
    return piecewise_drive(CubicSpline(time, amplitude, axis=1))
