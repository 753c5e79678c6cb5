"""Profiles of whiskers whose motion is known."""

import numpy as np

from vibrissa.quantities import dataset

RATE, PIXEL = 500.0, 1e-4


def circle_profile(direction, curvature, *, base=(0.0, 0.0), length=10e-3, nodes=41, sd=None):
    """Make circular whiskers from directions (T,) [rad, x towards y], curvatures [1/m] and a base [m]."""
    direction = np.asarray(direction, float)
    arc = np.linspace(0, length, nodes)
    kappa = np.broadcast_to(curvature, direction.shape)[:, None]
    middle = direction[:, None] + kappa * arc / 2
    chord = arc * np.sinc(kappa * arc / 2 / np.pi)
    x, y = base[0] + chord * np.cos(middle), base[1] + chord * np.sin(middle)
    return profile_of(arc, [x], [y], sd=sd)


def profile_of(arc, x, y, sd=None, rate=RATE):
    """Label nodes (whisker, time, node) as a tracked profile."""
    x, y = np.array(x), np.array(y)
    more = {} if sd is None else {"y_sd": np.full(y.shape, sd)}
    return dataset(
        {"frame": "image", "pixel_size": PIXEL, "frame_rate": rate},
        lead=("whisker",),
        whisker=np.arange(len(x)),
        time=np.arange(x.shape[1]) / rate,
        node=np.arange(x.shape[2]),
        x=x,
        y=y,
        arc_length=np.tile(arc, (len(x), 1)),
        **more,
    )
