"""Whisking scenes at random by kind, for ``benchmarks/whisking_truth.py``."""

import dataclasses
from collections.abc import Callable

import numpy as np

from vibrissa.video.camera.camera import Camera
from vibrissa.video.camera.pad.layout import draw_whiskers
from vibrissa.video.camera.pad.motion import head_path
from vibrissa.video.camera.pad.settings import FilmedPole, Head, Paw, WhiskingScene, Whisks
from vibrissa.video.camera.scenery import Light

WIDTH, HEIGHT, RATE = 640, 480, 500.0
PIXEL, COARSE = 0.13e-3, 0.2e-3  # of one pad, of both [m]
Rng = np.random.Generator


def one_pad(seed: int, rng: Rng, pixel: float = PIXEL) -> WhiskingScene:
    """Twelve whiskers of a fixed head at the left edge of the image."""
    camera = Camera(
        width=WIDTH,
        height=HEIGHT,
        pixel_size=pixel,
        frame_rate=RATE,
        exposure=rng.uniform(2e-4, 1.2e-3),
        blur=rng.uniform(1.6, 2.2),
        noise=rng.uniform(1.5, 3.5),
        shot=0.9,
        gradient=(rng.uniform(-30, 30), rng.uniform(-30, 30)),
    )
    whisks = Whisks(amplitude=np.deg2rad(rng.uniform(10, 30)), set_point=np.deg2rad(rng.uniform(-8, 8)))
    light = Light(vignette=rng.uniform(0, 0.25), drift=0.01, seed=seed)
    nose = (rng.uniform(20, 50) * pixel, rng.uniform(270, 310) * pixel)
    hair = rng.uniform(0.3, 0.95)
    head, sides = Head(nose=nose), ("left",)
    return WhiskingScene(
        camera=camera, head=head, sides=sides, whisks=whisks, light=light, hair_opacity=hair, seed=seed
    )


def one_row(seed: int, rng: Rng) -> WhiskingScene:
    """Four whiskers of row C alone, the others trimmed."""
    return dataclasses.replace(one_pad(seed, rng), names=("C1", "C2", "C3", "C4"))


def two_pads(seed: int, rng: Rng) -> WhiskingScene:
    """Twenty-four whiskers on both sides of a fixed head."""
    head = Head(nose=(WIDTH / 2 * COARSE, rng.uniform(190, 230) * COARSE))
    return dataclasses.replace(one_pad(seed, rng, COARSE), head=head, sides=("left", "right"))


def moving_head(seed: int, rng: Rng) -> WhiskingScene:
    """Both pads of a head that moves by 2 mm and turns by 5° (standard deviations)."""
    scene = two_pads(seed, rng)
    return dataclasses.replace(scene, head=dataclasses.replace(scene.head, shift=2e-3, turn=np.deg2rad(5)))


def paw(seed: int, rng: Rng) -> WhiskingScene:
    """One pad, over which a paw comes for a quarter of a second."""
    start = rng.uniform(0.1, 0.25)
    return dataclasses.replace(one_pad(seed, rng), paw=Paw(start=start, stop=start + 0.25, side="left"))


def pole(seed: int, rng: Rng) -> WhiskingScene:
    """One pad, two of whose whiskers bend at a pole when they protract."""
    scene = one_pad(seed, rng)
    whiskers, nose = draw_whiskers(scene), head_path(scene, np.zeros(1)).nose[0]
    angle = whiskers.rest[0] + scene.whisks.set_point + 0.3 * scene.whisks.amplitude + whiskers.bend[0, 40]
    reach = 0.55 * whiskers.length[0]
    forward, sideward = whiskers.base[0] + reach * np.array([-np.cos(angle), -np.sin(angle)])
    place = (nose[0] - sideward, nose[1] + forward)  # the head looks down
    return dataclasses.replace(scene, pole=FilmedPole(position=place, touched_by=(0, 1)))


def bright(seed: int, rng: Rng) -> WhiskingScene:
    """Both pads, lit before a dark floor."""
    return dataclasses.replace(two_pads(seed, rng), polarity="bright")


KINDS: dict[str, Callable[[int, Rng], WhiskingScene]] = {
    one.__name__: one for one in (one_row, one_pad, two_pads, moving_head, paw, pole, bright)
}


def scene_of(kind: str, seed: int) -> WhiskingScene:
    """Scene of a kind; the seed decides all of it."""
    return KINDS[kind](seed, np.random.default_rng([seed, sorted(KINDS).index(kind)]))
