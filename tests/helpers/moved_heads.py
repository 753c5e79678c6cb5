"""Heads that move in a known way: simulated lines, and rendered scenes."""

import numpy as np

from vibrissa.head_pose import HeadPose
from vibrissa.video.camera.camera import Camera, exposure_times
from vibrissa.video.camera.pad.motion import head_path
from vibrissa.video.camera.pad.settings import Head, WhiskingScene

SIDE = 0.25e-3


def moved(segments, seed, shift=15.0, turn=5.0):
    """Lines moved as a whole about (180, 240), frame by frame, and the head that did it."""
    rng = np.random.default_rng([seed, 8])
    time = np.arange(segments.attrs["frames"]) / 200
    waves = [
        sum(np.sin(2 * np.pi * f * time + rng.uniform(0, 2 * np.pi)) for f in rng.uniform(0.3, 3, 6)) / np.sqrt(3)
        for _ in range(3)
    ]
    place = 180 + 240j + shift * (waves[0] + 1j * waves[1])
    angle = turn * waves[2]
    size = np.diff(np.append(segments.segment_start.values, segments.sizes["point"]))
    frame = np.repeat(segments.segment_frame.values, size)
    point = segments.column.values + 1j * segments.row.values - (180 + 240j)
    point = place[frame] + point * np.exp(1j * np.deg2rad(angle[frame]))
    out = segments.assign(column=("point", point.real), row=("point", point.imag))
    return out, HeadPose(place.real, place.imag, angle)


def scene(seed, shift=2e-3, turn=5.0, width=320, height=240):
    """Both pads of a head that moves."""
    camera = Camera(frame_rate=500.0, pixel_size=SIDE, width=width, height=height, exposure=3e-4, noise=2.0)
    head = Head(nose=(width / 2 * SIDE, 100 * SIDE), shift=shift, turn=np.deg2rad(turn))
    return WhiskingScene(camera=camera, head=head, seed=seed)


def head_error(found, scene, frames):
    """Frames in which the head is known, and rms errors of its place [px] and turn [°], but for constant ones."""
    path = head_path(scene, exposure_times(scene.camera, frames))
    known = found.known
    turn = np.deg2rad(found.angle) - path.heading
    # a place fixed to the head, in its own coordinates
    off = (found.column + 1j * found.row) - (path.nose[:, 0] + 1j * path.nose[:, 1]) / scene.camera.pixel_size
    own = (off * np.exp(-1j * path.heading))[known]
    return int(known.sum()), float(np.sqrt(np.var(own))), float(np.rad2deg(np.std(turn[known])))
