"""The stationary profile by marching and shooting: knows nothing of the package's collocation or scaling."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root


def force_angle(posture, contact, load):
    """φ of the contact force: T = μN + b (Nε)^{2/3}, N² + T² = Λ², by bracketing N."""

    def excess(normal):
        return np.hypot(normal, posture.friction * normal + posture.adhesion * (normal * contact) ** (2 / 3)) - load

    if posture.adhesion == 0:
        return np.arctan(posture.friction)
    return np.arccos(brentq(excess, 0.0, load, xtol=1e-16, rtol=1e-15) / load)


def march(contact, contact_angle, load, friction_angle, s_end=1.0, points=None):
    """(θ, m, x, y) from the contact up: θ' = m/s⁴, m' = Λ cos(φ − θ + θ_ε)."""

    def slope(s, state):
        theta, m = state[:2]
        return [m / s**4, load * np.cos(friction_angle - theta + contact_angle), np.cos(theta), np.sin(theta)]

    start = [contact_angle, 0.0, 0.0, 0.0]
    return solve_ivp(slope, (contact, s_end), start, method="DOP853", rtol=1e-12, atol=1e-14, t_eval=points).y


def held_by_an_edge(posture, flat, excursion, points):
    """(x, y) relative to the base at given s, when an edge has carried the contact by d."""
    goal = np.array([posture.base_angle, float(flat.contact_distance) + excursion, float(flat.base_distance)])

    def mismatch(unknown):
        return march(*unknown, force_angle(posture, unknown[0], unknown[2]))[[0, 2, 3], -1] - goal

    guess = [posture.contact, 0.0, float(flat.contact_force)]
    found = root(mismatch, guess, tol=1e-13)
    contact = found.x[0]
    assert np.abs(mismatch(found.x)).max() < 1e-11
    # beyond the contact the end is straight; here the points asked for lie on the curve
    grid = np.concatenate([[contact], points, [1.0]]) if points[0] > contact else np.concatenate([points, [1.0]])
    assert grid[0] >= contact
    solved = march(*found.x, force_angle(posture, contact, found.x[2]), points=grid)
    return solved[2:, -1 - len(points) : -1] - solved[2:, -1:], found.x


def jump_over(posture, flat, width):
    """d₂: the profile from the far edge meets the near one at (λ, 0)."""

    def base(unknown):
        contact, turn, load, edge = unknown
        phi = force_angle(posture, contact, load)
        near = march(contact, turn, load, phi, s_end=edge)[:, -1]
        return near, march(contact, turn, load, phi)[:, -1]

    def mismatch(unknown):
        near, end = base(unknown)
        return [end[0] - posture.base_angle, end[3] - float(flat.base_distance), near[2] - width, near[3]]

    load = float(flat.contact_force)
    sag = -load * np.cos(force_angle(posture, posture.contact, load)) * width**2 / (6 * posture.contact**4)
    found = root(mismatch, [posture.contact, sag, load, posture.contact + width], tol=1e-13)
    assert np.abs(mismatch(found.x)).max() < 1e-10
    return base(found.x)[1][2] - float(flat.contact_distance)
