"""A straight cone that is pushed against a frictionless pole: shapes of Eq. 1, for a base that stays where it is."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from vibrissa.mechanics.statics.profile import Posture, stationary_profile

LENGTH = 0.03
CHORD = 0.6  # of base and pole, over L


def pushed(contact):
    """Find the shape whose base lies CHORD from the contact: s from the base, x, y, push angle, κL at the base.

    x runs along the shaft at the base, y to the side to which the pole bends the whisker; all over L.
    """

    def posture(base_angle):
        return Posture(contact=contact, base_angle=base_angle, friction=0.0)

    def excess(base_angle):
        profile = stationary_profile(posture(base_angle))
        return np.hypot(profile.contact_distance.item(), profile.base_distance.item()) - CHORD

    shape = stationary_profile(posture(brentq(excess, 0.02, 1.45, xtol=1e-12)))
    x, y = shape.profile_x.values[::-1], shape.profile_y.values[::-1]
    theta = shape.base_angle.item()
    # from the base towards the contact the shaft runs along (−cos θ, −sin θ), and bends towards −x, that is upwards
    dx, dy = x - x[0], y - y[0]
    along, across = -dx * np.cos(theta) - dy * np.sin(theta), -dx * np.sin(theta) + dy * np.cos(theta)
    push = np.arctan2(across[-1], along[-1])
    # moment of the force, which is normal to the shaft at the contact, about the base; its units make it κL
    curvature = shape.contact_force.item() * shape.contact_distance.item()
    return 1 - shape.s.values[::-1], along, across, push, curvature


def swung(direction, place, nodes=101, length=0.95):
    """Nodes (T, N) [m] of a whisker whose base, at the origin, turns; the pole lies CHORD away in direction ``place``.

    Gives arc length (N,), x, y (T, N), and the curvature at the base (T,) [1/m], negative as the tip is held back.
    """
    arc = np.linspace(0, length, nodes)
    shapes = [pushed(contact) for contact in 1 - CHORD - np.linspace(1e-4, 0.03, 30)]
    push = np.array([0.0, *(shape[3] for shape in shapes)])
    along = np.array([arc, *(carried_on(arc, shape, 0) for shape in shapes)])
    across = np.array([0 * arc, *(carried_on(arc, shape, 1) for shape in shapes)])
    pressed = np.clip(direction - place, 0, None)
    u, v = (CubicSpline(push, table)(pressed) for table in (along, across))
    curvature = CubicSpline(push, [0.0, *(shape[4] for shape in shapes)])(pressed)
    cos, sin = np.cos(direction)[:, None], np.sin(direction)[:, None]
    return arc * LENGTH, LENGTH * (u * cos + v * sin), LENGTH * (u * sin - v * cos), -curvature / LENGTH


def carried_on(arc, shape, axis):
    """One coordinate of a shape at arc lengths from the base; straight beyond the contact."""
    s, place = shape[0], shape[1 + axis]
    slope = np.gradient(place, s, edge_order=2)[-1]
    inside = CubicSpline(s, place)(np.minimum(arc, s[-1]))
    return inside + slope * np.maximum(arc - s[-1], 0)
