"""The field of view without whiskers: the light, the things in it, and how they change from frame to frame."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from vibrissa.arrays import Array
from vibrissa.video.camera.camera import Camera, Frames, digitise, illumination
from vibrissa.video.camera.scenery import Fur, Led, Light, Scenery, Shadow
from vibrissa.video.camera.transmission import FWHM, Canvas

_TONES = 8  # sinusoids of a drift: enough that its values are spread as a Gaussian's, within four standard deviations
_HAIR_NODES = 12


def empty_field(camera: Camera, scenery: Scenery) -> Array:
    """The scene without whiskers, LED and drift.

    Parameters
    ----------
    camera : Camera
        The camera.
    scenery : Scenery
        What is in the field.

    Returns
    -------
    (height, width) array
        Grey levels, before noise and rounding.
    """
    light = illumination(camera) * _vignette(camera, scenery.light)
    if scenery.fur is not None:
        light = light * _past_head(camera, scenery.fur) * _past_hairs(camera, scenery.fur)
    if scenery.shadow is not None:
        light = light * _past_shadow(camera, scenery.shadow)
    return light


def render_background(camera: Camera, scenery: Scenery | None = None) -> Frames:
    """``empty_field`` without noise, as a user would record it by averaging a field without whiskers.

    Parameters
    ----------
    camera, scenery
        As in ``empty_field``; by default nothing is in the field.

    Returns
    -------
    (height, width) array
        Eight-bit grey levels, rounded.
    """
    return digitise(empty_field(camera, scenery or Scenery()))


def _places(camera: Camera) -> tuple[Array, Array]:
    """Return x (1, width) and y (height, 1) of the pixels [m]."""
    x, y = (camera.pixel_size * np.arange(size, dtype=float) for size in (camera.width, camera.height))
    return x[None], y[:, None]


def _vignette(camera: Camera, light: Light) -> Array:
    across, down = np.arange(camera.width) - (camera.width - 1) / 2, np.arange(camera.height) - (camera.height - 1) / 2
    corner = max(across[-1] ** 2 + down[-1] ** 2, 1.0)
    return 1 - light.vignette * (across**2 + down[:, None] ** 2) / corner


def _skin(camera: Camera, fur: Fur, y: Array) -> Array:
    """Distance of the skin from the head's side of the image, at heights y [m]."""
    middle = (camera.height - 1) / 2 * camera.pixel_size
    return fur.skin - fur.bulge * ((y - middle) / max(middle, camera.pixel_size)) ** 2


def _past_head(camera: Camera, fur: Fur) -> Array:
    """Share of the light past the head, whose border the optics blur."""
    x, y = _places(camera)
    inward = x if fur.side == "left" else x[:, ::-1]
    blur = camera.blur / FWHM * camera.pixel_size
    return 1 - fur.head * ndtr((_skin(camera, fur, y) - inward) / blur)


def hairs(camera: Camera, fur: Fur) -> tuple[Array, Array]:
    """Give x and y [m] of the hairs, (hair, node), from root to tip; x counts from the head's side of the image.

    Parameters
    ----------
    camera : Camera
        Its image, whose height the hairs fill.
    fur : Fur
        The head and its hairs.

    Returns
    -------
    x, y : (hair, node) arrays
        Places [m]; x counts from the head's side of the image.
    """
    rng = np.random.default_rng(fur.seed)
    top, bottom = -5 * fur.length, (camera.height - 1) * camera.pixel_size + 5 * fur.length
    count = rng.poisson(fur.density * (bottom - top))
    root, length = rng.uniform(top, bottom, count), rng.exponential(fur.length, count)
    angle, curvature = rng.normal(0, fur.spread, count), rng.normal(0, fur.curvature, count)
    along = length[:, None] * (np.arange(_HAIR_NODES - 1) + 0.5) / (_HAIR_NODES - 1)
    heading = angle[:, None] + curvature[:, None] * along
    step = length[:, None] / (_HAIR_NODES - 1)
    x, y = (np.cumsum(np.pad(step * side(heading), ((0, 0), (1, 0))), axis=1) for side in (np.cos, np.sin))
    return x + _skin(camera, fur, root)[:, None], y + root[:, None]


def _past_hairs(camera: Camera, fur: Fur) -> Array:
    x, y = hairs(camera, fur)
    opacity = np.broadcast_to(np.linspace(fur.opacity, 0, _HAIR_NODES), x.shape)
    columns, rows = (values[:, None] / camera.pixel_size for values in (x, y))
    spread = np.full(x.shape, (camera.blur / FWHM) ** 2)
    seen = Canvas(camera.height, camera.width).transmitted(columns, rows, np.ascontiguousarray(opacity), spread)
    return seen if fur.side == "left" else seen[:, ::-1]


def _past_shadow(camera: Camera, shadow: Shadow) -> Array:
    x, y = _places(camera)
    away = (x - shadow.substrate[0]) * np.cos(shadow.facing) + (y - shadow.substrate[1]) * np.sin(shadow.facing)
    return 1 - shadow.opacity * ndtr((shadow.depth - away) / shadow.penumbra)


def drift(light: Light, time: Array) -> Array:
    """Drift of the light: a sum of slow sinusoids, so that any instant's drift follows from the seed alone.

    Parameters
    ----------
    light : Light
        Its drift.
    time : (T,) array
        Instants [s].

    Returns
    -------
    (3, T) array
        Relative changes g of the light: g₀ + g₁X + g₂Y, where X and Y run from −1 at the first pixel to 1 at the last.
    """
    rng = np.random.default_rng([light.seed, _TONES])
    band = (np.arange(_TONES) + rng.uniform(size=(3, _TONES))) / _TONES  # one tone in each eighth: none equal, all slow
    phase = rng.uniform(0, 2 * np.pi, (3, _TONES))
    turns = band[:, None] / light.drift_time * np.asarray(time)[:, None]
    return light.drift * np.sqrt(2 / _TONES) * np.sin(2 * np.pi * turns + phase[:, None]).sum(-1)


def led_glow(camera: Camera, led: Led | None) -> Array:
    """Grey levels (height, width) that the LED adds once lit: an even disc, whose rim the optics blur.

    Parameters
    ----------
    camera : Camera
        The camera.
    led : Led or None
        The LED; None for none.

    Returns
    -------
    (height, width) array
        Grey levels.
    """
    if led is None:
        return np.zeros((camera.height, camera.width))
    x, y = _places(camera)
    distance = np.hypot(x - led.position[0], y - led.position[1])
    return led.brightness * ndtr((led.radius - distance) / (camera.blur / FWHM * camera.pixel_size))


def lit_share(camera: Camera, led: Led, frame: int) -> float:
    """Share of a frame's exposure during which the LED is lit.

    Parameters
    ----------
    camera : Camera
        Its frame rate and exposure count.
    led : Led
        When it is switched on.
    frame : int
        Number of the frame.

    Returns
    -------
    float, 0 to 1
        0 to 1.
    """
    closing = frame / camera.frame_rate + camera.exposure / 2
    return float(np.clip((closing - led.start) / camera.exposure, 0, 1))
