"""The paper's central claim: taught at one speed and height, the envelope identifies textures at others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import RangeError
from vibrissa.figures.canvas import add_caption, house_style, new_figure
from vibrissa.figures.others import robustness_chain as chain
from vibrissa.figures.others import robustness_panels as panels
from vibrissa.figures.others.robustness_chain import CLAIM, DECODERS, ScanWay
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Progress
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stats import jackknife_interval
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import DAMPING

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from vibrissa.whisker import Whisker

SPEEDS, HEIGHTS, ANGLES = (0.5, 0.7, 1.4, 2.0), (0.8, 0.9, 1.1, 1.2), (0.75, 0.875, 1.08, 1.16)  # over those that teach
LENGTH = 0.062  # [m] of every texture
FASTEST = 0.35  # [m/s] at which that lasts long enough to separate the bands of the spectrum
PERIODS = (0.6e-3,) * 5  # [m] mean periods of the gratings of a set: the paper's
MEAN_ENVELOPE = 55e-6  # [m] to which the motions that teach are scaled: the paper prints no amplitude
MOST = 10_000  # sets, or trials
ARMS = ("speed", "height", "angle")


def ways(
    posture: Posture,
    speed: float,
    *,
    speeds: Sequence[float] = SPEEDS,
    heights: Sequence[float] = HEIGHTS,
    angles: Sequence[float] = ANGLES,
) -> list[ScanWay]:
    """Ways to scan: the one that teaches, then those that differ from it in one respect, each relative to the first.

    Parameters
    ----------
    posture, speed
        Of the way that teaches; [m/s].
    speeds, heights, angles : sequence of float
        Other speeds, heights of the base (θ_b stays) and base angles (the height stays), over those that teach.

    Returns
    -------
    list of ScanWay
        The first teaches.

    Raises
    ------
    InputError
        If one of them is that which teaches, not positive, or a posture cannot be.
    """
    for name, factors in (("speeds", speeds), ("heights", heights), ("angles", angles)):
        wrong = [one for one in factors if not 0 < one < np.inf or np.isclose(one, 1)]
        if wrong:
            raise RangeError(
                f"other {name}", "must be positive, and other than the one that teaches", f"{wrong[0]:g} times it"
            )
    height, angle = float(on_the_flat(posture).base[1]), posture.base_angle

    def held(tall: float, leaning: float) -> Posture:
        return Posture.at_height(tall * height, leaning * angle, posture.friction)

    found = [ScanWay(arm="taught", posture=posture, height=height, speed=speed)]
    found += [ScanWay(arm="speed", posture=posture, height=height, speed=k * speed) for k in speeds]
    found += [ScanWay(arm="height", posture=held(k, 1), height=k * height, speed=speed) for k in heights]
    return found + [ScanWay(arm="angle", posture=held(1, k), height=height, speed=speed) for k in angles]


def compute(
    whisker: Whisker,
    scanned: Sequence[ScanWay],
    *,
    rng: np.random.Generator,
    damping: float = DAMPING,
    n_sets: int = 16,
    mean_periods: Sequence[float] = PERIODS,
    n_trials: int = 20,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Teach decoders of rival codes the textures scanned in one way, and ask them in all ways.

    Motions are those of the model, 5 mm from the base, scaled by one number for all ways so that the mean envelope of
    the way that teaches is 55 µm, which suits the paper's thresholds. Spikes are Poisson.

    Parameters
    ----------
    whisker : Whisker
        What scans.
    scanned : sequence of ScanWay
        The first teaches.
    rng : Generator
        Draws textures, units and spikes.
    damping : float
        ζ.
    n_sets, n_trials : int
        Sets of random gratings, each with a population of its own; trials of each grating to learn from, and as many to
        be asked in each way.
    mean_periods : sequence of float
        Mean period of each grating of a set [m]. Equal ones: the gratings differ in the order of their gaps alone.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    Dataset
        ``decoder_accuracy`` (decoder, tested) and ``accuracy_of_set``; ``envelope_lead``: that of the claim, the
        envelope over distance at any gain, over each other, and ``arm_lead``, its mean over an arm; ``kept_share``
        (decoder, arm). Intervals of 95 % over sets
        (Student's t). ``shown_envelope`` of one texture. Attributes ``chance``, ``verdict``, ``caption``.
    """
    if not (2 <= n_sets <= MOST and 2 <= n_trials <= MOST and len(mean_periods) >= 2):
        found = f"{n_sets}, {n_trials}, {len(mean_periods)}"
        raise RangeError("sets, trials and gratings of a set", f"must be 2 to {MOST:,} of each", found)
    fastest = max(way.speed for way in scanned)
    if fastest > FASTEST:
        raise RangeError(
            "speed", f"must be at most {FASTEST:.2g} m/s: faster scans are too short for a spectrum", fastest
        )
    n_textures = len(mean_periods)
    textures = [random_grating(LENGTH, rng=rng, mean_period=one) for _ in range(n_sets) for one in mean_periods]
    moved, resonance = [], []
    report = progress or (lambda *_: None)
    report("motions", 0, len(scanned))
    for k, way in enumerate(scanned):
        motion, first = chain.motions(whisker, textures, LENGTH, way, damping)
        moved.append(motion)
        resonance.append(first)
        report("motions", k + 1, len(scanned))
    scale = MEAN_ENVELOPE / analytic_envelope(moved[0])[0].mean()
    moved = [scale * one for one in moved]
    shares = np.empty((len(DECODERS), len(scanned), n_sets))
    report("decoders", 0, n_sets)
    for j in range(n_sets):
        of = slice(j * n_textures, (j + 1) * n_textures)
        shares[:, :, j] = _one_set([one[of] for one in moved], scanned, n_trials, rng)
        report("decoders", j + 1, n_sets)
    data = _labelled(shares, 1 / n_textures, scanned).assign(_conditions(scanned, moved, resonance))
    attrs: dict[str, Any] = {
        "n_sets": n_sets,
        "n_trials": n_trials,
        "damping": damping,
        "mean_periods": np.array(mean_periods),
    }
    attrs |= {"scale": scale, "whisker_length": whisker.length, "contact": scanned[0].posture.contact}
    data = data.assign_attrs(attrs)
    data = data.assign_attrs(verdict=" ".join(verdict(data)))
    return data.assign_attrs(caption=_caption(data))


def _one_set(moved: list[Array], scanned: Sequence[ScanWay], n_trials: int, rng: np.random.Generator) -> Array:
    """Accuracy of each decoder in each way, (D, W)."""
    base, people = scanned[0].speed, chain.populations(moved[0], rng=rng)
    expected = [
        chain.expected_everywhere(people, one, LENGTH, way.speed, base) for one, way in zip(moved, scanned, strict=True)
    ]
    shares = [
        chain.accuracies(expected[0], asked, base / way.speed, n_trials, rng=rng)
        for asked, way in zip(expected, scanned, strict=True)
    ]
    return np.array(shares).T


def _labelled(found: Array, chance: float, scanned: Sequence[ScanWay]) -> xr.Dataset:
    """Means and intervals over sets."""
    lead = found[list(DECODERS).index(CLAIM)] - found
    arms = np.array([way.arm for way in scanned])
    over = np.array([_mean(lead[:, arms == arm]) for arm in ARMS]).swapaxes(0, 1)
    ends, ahead, ahead_over = (np.apply_along_axis(_interval, -1, one) for one in (found, lead, over))
    kept = np.array([[kept_share(one, arms == arm, chance) for arm in ARMS] for one in found])
    return dataset(
        {"chance": chance, "claim": CLAIM},
        decoder=list(DECODERS),
        tested=np.arange(len(scanned)),
        arm=list(ARMS),
        accuracy_of_set=found,
        decoder_accuracy=found.mean(-1),
        decoder_accuracy_low=np.maximum(ends[..., 0], 0),
        decoder_accuracy_high=np.minimum(ends[..., 1], 1),
        envelope_lead=lead.mean(-1),
        envelope_lead_low=ahead[..., 0],
        envelope_lead_high=ahead[..., 1],
        arm_lead=over.mean(-1),
        arm_lead_low=ahead_over[..., 0],
        arm_lead_high=ahead_over[..., 1],
        kept_share=kept[..., 0],
        kept_share_low=kept[..., 1],
        kept_share_high=kept[..., 2],
    )


def _mean(of_arm: Array) -> Array:
    """Mean over the ways of an arm, (D, W, S) to (D, S); NaN where there is none."""
    return of_arm.mean(1) if of_arm.shape[1] else np.full(of_arm[:, 0:1].sum(1).shape, np.nan)


def _interval(values: Array) -> Array:
    return np.array(jackknife_interval(values, clusters=np.arange(values.size)))


def kept_share(found: Array, of_arm: Mask, chance: float) -> tuple[float, float, float]:
    """Share of a decoder's accuracy above chance that is kept, and its interval over sets.

    Parameters
    ----------
    found : (W, S) array
        Accuracy in each way, the first that which teaches, and set.
    of_arm : (W,) array of bool
        Ways that count.
    chance : float
        Accuracy by chance.

    Returns
    -------
    share, low, high : float
        (mean accuracy − chance)/(accuracy where taught − chance); NaN where that way was not tried, or nothing was
        learnt to be kept: accuracy where taught not above chance by its own interval.
    """
    if not of_arm.any() or not _interval(found[0])[0] > chance:
        return np.nan, np.nan, np.nan

    def share(sets: Array) -> float:
        part = found[:, sets.astype(int)]
        return float((part[of_arm].mean() - chance) / (part[0].mean() - chance))

    sets = np.arange(float(found.shape[1]))
    return share(sets), *jackknife_interval(sets, share, clusters=sets)


def _conditions(scanned: Sequence[ScanWay], moved: list[Array], resonance: list[float]) -> xr.Dataset:
    """What the ways are, and the envelope of the first texture in each, over distance."""
    place = np.linspace(chain.LEAD_IN, LENGTH, 901)
    envelopes = [analytic_envelope(one)[0] for one in moved]
    shown = [np.interp(place, np.linspace(chain.LEAD_IN, LENGTH, one.shape[1]), one[0]) for one in envelopes]
    return dataset(
        tested_arm=[way.arm for way in scanned],
        tested_speed=[way.speed for way in scanned],
        tested_height=[way.height for way in scanned],
        tested_angle=[way.posture.base_angle for way in scanned],
        tested_resonance=resonance,
        tested_envelope=[one.mean() for one in envelopes],
        shown_place=place,
        shown_envelope=shown,
    )


def verdict(data: xr.Dataset) -> list[str]:
    """Say in words how far the claim holds, arm by arm, and where it fails.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    list of str
        A sentence for each arm that was tried.
    """
    lines = []
    for arm in ARMS:
        kept, over = data.sel(decoder=CLAIM, arm=arm), data.sel(arm=arm)
        own = data.isel(tested=np.flatnonzero(data.tested_arm == arm))
        if not own.sizes["tested"]:
            continue
        if np.isnan(kept.kept_share):
            lines.append(f"{arm}: not determined; where taught, its accuracy is not surely above chance.")
            continue
        lost = own.isel(tested=np.flatnonzero(own.decoder_accuracy_low.sel(decoder=CLAIM) <= data.attrs["chance"]))
        words = [f"{arm}: keeps {kept.kept_share:.2f} [{kept.kept_share_low:.2f}, {kept.kept_share_high:.2f}]"]
        if lost.sizes["tested"]:
            words.append(f"not surely above chance in {lost.sizes['tested']} of {own.sizes['tested']} conditions")
        for word, behind in (("less", over.arm_lead_high < 0), ("more", over.arm_lead_low > 0)):
            names = [str(name) for name in data.decoder.values[behind.values]]
            quoted = ", ".join(f"“{name}”" for name in names)
            words += [f"{word} accurate than {quoted}"] if names else []
        lines.append("; ".join(words) + ".")
    return lines


def _caption(data: xr.Dataset) -> str:
    attrs, first = data.attrs, data.isel(tested=0)
    kept = {str(name): data.kept_share.sel(decoder=name).values for name in data.decoder.values}
    rivals = "; ".join(
        f"{name} " + ", ".join("–" if np.isnan(one) else f"{one:.2f}" for one in kept[name])
        for name in ("mean rate", "spectrum, any gain", "events over distance, any gain")
    )
    periods = [f"{1e3 * one:.2g}" for one in sorted(set(attrs["mean_periods"].tolist()))]
    return (
        f"Decoders learn {len(attrs['mean_periods'])} random gratings of mean period {', '.join(periods)} mm from "
        f"{attrs['n_trials']} trials each of {chain.UNITS} Poisson units at {first.tested_speed:.2g} m/s, H = "
        f"{first.tested_height:.2f} L, θ_b = {first.tested_angle:.2f} rad, and are asked at other speeds, heights and "
        f"angles. Whisker of {1e3 * attrs['whisker_length']:.0f} mm, first resonance {data.tested_resonance.min():.0f} "
        f"to {data.tested_resonance.max():.0f} Hz; motions 5 mm from the base, scaled by {attrs['scale']:.1f}. A: "
        "envelope of one grating over the distance scanned, each divided by its mean, at the ends of each range. B to "
        f"D: accuracy, mean and 95 % interval over {attrs['n_sets']} sets of gratings and units; dashed line, chance; "
        "dotted, where taught. Readers over distance know speed, start and latencies; any gain, they do not use the "
        "number of spikes. E: share kept of the accuracy above chance. "
        f"The envelope over distance at any gain: {attrs['verdict']} Kept over speed, height and angle by others: "
        f"{rivals}."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Envelopes over distance, accuracy along each arm, and the shares kept.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, ((whole,),) = new_figure(11.0, 10.2)
    whole.remove()
    cells = figure.add_gridspec(3, 1)
    top, middle, bottom = (figure.add_subfigure(cells[row]) for row in range(3))
    panels.draw_envelopes(top.subplots(), data)
    arms = (
        ("speed", data.tested_speed, "scanning speed [m/s]"),
        ("height", data.tested_height, "height of the base [L]"),
        ("angle", data.tested_angle, "base angle θ$_b$ [rad]"),
    )
    axes = middle.subplots(1, 3)
    for letter, (arm, values, label), axis in zip("BCD", arms, axes, strict=True):
        panels.draw_arm(axis, data, arm, values.values)
        axis.set(xlabel=label, ylabel="accuracy", ylim=(0, 1.02), title=f"{letter}  Asked at another {arm}")
    panels.draw_kept(bottom.subplots(), data)
    handles, labels = axes[0].get_legend_handles_labels()
    top.legend(handles, labels, loc="outside upper center", ncols=5)
    add_caption(bottom, data)
    return figure
