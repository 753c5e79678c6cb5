"""Line pieces of a whisking pad with known truth, without pictures: what a finder of lines would give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr

from vibrissa.quantities import dataset

WIDTH, HEIGHT = 640, 480
MERGED = 1.5  # px between two whiskers below which a finder sees one line


@dataclass(frozen=True, kw_only=True)
class Pad:
    """A pad: where it is, how many whiskers, how it whisks, how it is seen."""

    whiskers: int = 12
    frames: int = 400
    rate: float = 200.0
    direction: float = 0.0  # of the middle whisker [°], down from the right
    centre: tuple[float, float] = (180.0, 240.0)
    spread: float = 90.0  # of the whiskers' directions [°]
    amplitude: float = 20.0  # [°]
    own: float = 1.5  # standard deviation of each whisker's own motion [°]
    missing: float = 0.1
    broken: float = 0.1
    junk: float = 3.0  # lines per frame that are no whiskers
    head: float = 0.0  # slow motion of the head: standard deviation [px], and as many tenths of a degree
    paw: bool = False
    mirror: bool = False  # protracts the other way
    opening: float = 0.15  # growth of the gain from the middle of the pad to its edge
    drift: float = 0.0  # standard deviation of a slow motion of each whisker, and of the width of the fan [°]
    carried: float = 0.0  # px by which follicles move along the snout when the pad swings by 1°
    lag: float = 0.0  # of a whisker at the edge of the pad behind the middle one [rad of a whisk]


class Truth(NamedTuple):
    """``segment`` (S,) whisker of each segment, −1 junk; ``visible`` (whisker, frame); ``base`` and ``angle``."""

    segment: np.ndarray
    visible: np.ndarray
    angle: np.ndarray


def _smooth_noise(rng: np.random.Generator, shape: tuple[int, ...], frames: float) -> np.ndarray:
    """Noise of unit standard deviation along the last axis with this correlation time [frames]."""
    keep = np.exp(-1 / frames)
    out = rng.standard_normal(shape)
    for t in range(1, shape[-1]):
        out[..., t] = keep * out[..., t - 1] + np.sqrt(1 - keep**2) * out[..., t]
    return out


def _angles(pad: Pad, rng: np.random.Generator) -> np.ndarray:
    """Direction of each whisker at its base in each frame [°]."""
    k, t = pad.whiskers, np.arange(pad.frames) / pad.rate
    rest = np.linspace(-0.5, 0.5, k) * pad.spread + rng.normal(0, 0.2 * pad.spread / k, k)
    strength = np.clip(0.7 + 0.4 * _smooth_noise(rng, (pad.frames,), 0.5 * pad.rate), 0, 1.2)
    whisk = strength * np.sin(2 * np.pi * 8 * t + rng.uniform(0, 6)) + 0.3 * _smooth_noise(rng, (pad.frames,), pad.rate)
    across = np.linspace(-1, 1, k)[:, None]
    whisk = np.stack([np.interp(t - pad.lag * late / (2 * np.pi * 8), t, whisk) for late in across[:, 0]])
    gain = rng.normal(1, 0.1, k)[:, None] * (1 + pad.opening * across)
    own = pad.own * _smooth_noise(rng, (k, pad.frames), 0.05 * pad.rate)
    if pad.drift:
        own += pad.drift * _smooth_noise(rng, (k, pad.frames), 0.75 * pad.rate)
        own += pad.drift * across * _smooth_noise(rng, (1, pad.frames), 0.5 * pad.rate)
    return rest[:, None] + pad.amplitude * gain * whisk * (-1 if pad.mirror else 1) + own


def _courses(pad: Pad, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of all whiskers, (whisker, frame, point), 1 px apart; NaN beyond the tip; and the angles."""
    k, n = pad.whiskers, pad.frames
    angle = _angles(pad, rng)
    turn = 0.1 * pad.head * _smooth_noise(rng, (n,), pad.rate)
    shift = pad.head * _smooth_noise(rng, (2, n), pad.rate)
    along = np.linspace(-0.5, 0.5, k) * 60 + rng.normal(0, 1.5, k)  # two staggered rows of follicles along the snout
    out = 12 * np.sqrt(np.maximum(0, 1 - (along / 45) ** 2)) + 10 * (np.arange(k) % 2) + rng.normal(0, 1.5, k)
    lead = np.deg2rad(pad.direction + turn)
    place = along[:, None] + pad.carried * (angle - angle.mean(axis=1, keepdims=True))
    x = pad.centre[0] + shift[0] + np.cos(lead) * out[:, None] - np.sin(lead) * place
    y = pad.centre[1] + shift[1] + np.sin(lead) * out[:, None] + np.cos(lead) * place
    length = rng.uniform(70, 170, k)
    bend = rng.normal(0.002, 0.002, k)[:, None] * (1 + 0.2 * _smooth_noise(rng, (k, n), 0.02 * pad.rate))
    s = np.arange(175.0)
    course = np.deg2rad(angle)[..., None] + lead[None, :, None] + bend[..., None] * s
    step = np.exp(1j * course)
    points = (x + 1j * y)[..., None] + np.cumsum(step, axis=2) - step
    seen = length[:, None] * np.clip(1 - 0.1 * np.abs(_smooth_noise(rng, (k, n), 3)), 0.4, 1)
    start = rng.uniform(3, 12, (k, n))
    points[(s > seen[..., None]) | (s < start[..., None])] = np.nan
    return points, angle, bend


def _inside(points: np.ndarray) -> np.ndarray:
    return (points.real > 0) & (points.real < WIDTH - 1) & (points.imag > 0) & (points.imag < HEIGHT - 1)


def _merged(points: np.ndarray, strength: np.ndarray) -> np.ndarray:
    """Which whiskers of a frame are seen as part of a stronger one's line."""
    gone = np.zeros(len(points), bool)
    for i in np.argsort(strength):
        mine = points[i][np.isfinite(points[i])][::6]
        for j in np.flatnonzero((strength > strength[i]) & ~gone):
            other = points[j][np.isfinite(points[j])]
            if mine.size and other.size:
                off = np.abs(mine[:, None] - other[None, ::2]).min(axis=1)
                gone[i] |= bool((off < MERGED).mean() > 0.6)
    return gone


def _pieces(line: np.ndarray, others: np.ndarray, pad: Pad, rng: np.random.Generator) -> list[np.ndarray]:
    """One whisker in one frame, broken where it is crossed or by chance."""
    line = line[np.isfinite(line) & _inside(line)]
    if line.size < 12:
        return []
    cuts = []
    if rng.random() < pad.broken:
        cuts.append(int(rng.integers(5, line.size - 5)))
    crossing = np.flatnonzero(np.abs(line[5:-5:2, None] - others[None, ::3]).min(axis=1) < 1.6) if others.size else []
    if len(crossing) and rng.random() < 0.3:
        cuts.append(5 + 2 * int(crossing[0]))
    out, last = [], 0
    for cut in [*sorted(cuts), line.size]:
        out.append(line[last : max(cut - 2, last)])
        last = cut + 2
    return [one for one in out if one.size >= 12]


def _junk(pad: Pad, rng: np.random.Generator, fur: np.ndarray) -> list[np.ndarray]:
    """Fur at fixed places, and lines anywhere."""
    lines = []
    for _ in range(rng.poisson(pad.junk)):
        x, y, way, size = fur[rng.integers(len(fur))]
        if rng.random() < 0.5:
            x, y, way = rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT), rng.uniform(0, 2 * np.pi)
        way += rng.normal(0, 0.05)
        line = x + 1j * y + np.arange(size) * np.exp(1j * way)
        line = line[_inside(line)]
        if line.size >= 12:
            lines.append(line)
    return lines


def _hidden(pad: Pad, rng: np.random.Generator, points: np.ndarray) -> np.ndarray:
    """Whisker points behind a paw that is there for some frames."""
    if not pad.paw:
        return np.zeros(points.shape, bool)
    first, last = np.sort(rng.integers(0.2 * pad.frames, 0.8 * pad.frames, 2))
    last = min(last, first + 40)
    way = np.deg2rad(pad.direction + rng.uniform(-20, 20))
    place = complex(*pad.centre) + 70 * np.exp(1j * way)
    hidden = np.abs(points - place) < 60
    hidden[:, :first] = hidden[:, last:] = False
    return hidden


def simulate(pads: list[Pad], seed: int) -> tuple[xr.Dataset, Truth]:
    """Segments of one or more pads, and who they are; whiskers are numbered over all pads."""
    rng = np.random.default_rng(seed)
    courses, angles, strength = [], [], []
    for pad in pads:
        points, angle, _ = _courses(pad, rng)
        points[_hidden(pad, rng, points)] = np.nan
        courses.append(points)
        angles.append(angle)
        strength.append(rng.uniform(15, 60, pad.whiskers))
    everything, contrast = np.concatenate(courses), np.concatenate(strength)
    pad = pads[0]
    angle_of = [rng.uniform(0, 2 * np.pi, 20), rng.uniform(15, 45, 20)]
    place = complex(*pad.centre) + rng.uniform(10, 40, 20) * np.exp(1j * angle_of[0])
    fur = np.stack([place.real, place.imag, angle_of[0], angle_of[1]], axis=1)
    frames, lines, who, visible = [], [], [], np.zeros((len(everything), pad.frames), bool)
    for t in range(pad.frames):
        gone = _merged(everything[:, t], contrast)
        found = []
        for k in np.flatnonzero(~gone):
            if rng.random() < pad.missing:
                continue
            rest = np.delete(everything[:, t], k, axis=0).ravel()
            mine = _pieces(everything[k, t], rest[np.isfinite(rest)], pad, rng)
            found += [(k, one) for one in mine]
            visible[k, t] = max((one.size for one in mine), default=0) >= 30
        found += [(-1, one) for one in _junk(pad, rng, fur)]
        for i in rng.permutation(len(found)):
            frames.append(t)
            who.append(found[i][0])
            lines.append(found[i][1] if rng.random() < 0.5 else found[i][1][::-1])
    segments = _labelled(frames, lines, np.array(who), contrast, everything, rng, pad.frames)
    return segments, Truth(np.array(who), visible, np.concatenate(angles))


def _labelled(frames, lines, who, contrast, everything, rng, count: int) -> xr.Dataset:
    start = np.concatenate([[0], np.cumsum([one.size for one in lines])[:-1]])
    column, row, width, depth = [], [], [], []
    for line, k, t in zip(lines, who, frames, strict=True):
        noise = np.convolve(rng.normal(0, 0.35, line.size + 4), np.ones(5) / 5, "valid")
        tangent = np.gradient(line)
        line = line + 1j * tangent / np.abs(tangent) * noise
        base = everything[k, t][np.isfinite(everything[k, t])][0] if k >= 0 else line[0]
        taper = np.clip(1 - np.abs(line - base) / 200, 0.2, 1)
        column.append(line.real)
        row.append(line.imag)
        width.append(1.2 + 1.5 * taper * rng.normal(1, 0.05))
        depth.append((contrast[k] if k >= 0 else rng.uniform(8, 40)) * taper * rng.normal(1, 0.1))
    parts = [np.concatenate(x) for x in (column, row, width, depth)]
    return dataset(
        {"frames": count, "width": WIDTH, "height": HEIGHT, "source": "simulated"},
        segment_frame=np.array(frames),
        segment_start=start,
        column=parts[0],
        row=parts[1],
        line_width=parts[2],
        line_contrast=parts[3],
        position_sd=np.full(parts[0].size, 0.2),
    )


class Score(NamedTuple):
    """Share of visible frames followed, share of claimed frames under a wrong name, switches per 1,000 frames."""

    followed: float
    wrong: float
    switches: float
    found: int


def main_segment(segments: xr.Dataset, whisker: np.ndarray, count: int) -> np.ndarray:
    """Longest segment of each whisker in each frame (count, frames); −1 where there is none."""
    frame, start = segments.segment_frame.values, segments.segment_start.values
    size = np.diff(np.append(start, segments.sizes["point"]))
    out = np.full((count, segments.attrs["frames"]), -1)
    for i in np.argsort(size, kind="stable"):
        if whisker[i] >= 0:
            out[whisker[i], frame[i]] = i
    return out


def score(segments: xr.Dataset, truth: Truth, whisker: np.ndarray) -> Score:
    """How well segments were named."""
    from scipy.optimize import linear_sum_assignment

    count = int(whisker.max(initial=-1)) + 1
    claimed = main_segment(segments, whisker, count)
    named = np.where(claimed >= 0, truth.segment[claimed], -2)  # −2: not claimed
    many = len(truth.visible)
    table = np.array([[(named[j] == k).sum() for j in range(count)] for k in range(many)]).reshape(many, count)
    right, claims, switches = 0, 0, 0
    for k, j in zip(*linear_sum_assignment(-table), strict=True):
        right += np.count_nonzero((named[j] == k) & truth.visible[k])
        claims += np.count_nonzero(named[j] > -2)
    wrong = sum(np.count_nonzero(named[j] > -2) for j in range(count)) - table[linear_sum_assignment(-table)].sum()
    for j in range(count):
        run = named[j][named[j] >= 0]
        switches += np.count_nonzero(np.diff(run))
    total = max(np.count_nonzero(named > -2), 1)
    return Score(right / truth.visible.sum(), wrong / total, 1000 * switches / truth.visible.shape[1], count)


def nearest_angle(segments: xr.Dataset, count: int) -> np.ndarray:
    """The lower bound: the longest lines of the first frame, each followed to the nearest direction in the next."""
    frame, start = segments.segment_frame.values, segments.segment_start.values
    stop = np.append(start[1:], segments.sizes["point"])
    x, y = segments.column.values, segments.row.values
    line = (x[stop - 1] - x[start]) + 1j * (y[stop - 1] - y[start])
    inward = np.abs(x[stop - 1] + 1j * y[stop - 1] - complex(180, 240)) < np.abs(x[start] + 1j * y[start] - 180 - 240j)
    way = np.where(inward, -line, line)
    out = np.full(frame.size, -1)
    first = np.flatnonzero(frame == 0)
    known = way[first[np.argsort(-np.abs(line[first]))][:count]]
    for t in range(segments.attrs["frames"]):
        here = np.flatnonzero((frame == t) & (np.abs(line) > 30))
        if not here.size:
            continue
        off = np.abs(np.angle(way[here][None] / known[:, None]))
        for _ in range(min(len(known), here.size)):
            k, i = np.unravel_index(np.argmin(off), off.shape)
            if off[k, i] > 0.5:
                break
            out[here[i]], known[k] = k, way[here[i]]
            off[k], off[:, i] = np.inf, np.inf
    return out
