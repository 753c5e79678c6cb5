"""Draw docs/two-channels.png: the slow moment shows the shape of a surface, the envelope the texture on it (a minute).

python docs/two_channels.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from vibrissa.figures.canvas import add_caption, house_style, key_above, new_figure, split
from vibrissa.figures.colours import LAND, PREDICTED, TRUTH
from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction, predict_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.report.pages import write_picture
from vibrissa.texture.generators import riding, wave
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction

Array = NDArray[np.float64]

LENGTH = 0.15  # [m] of every surface
SHAPES = {"long waves": 0.03, "short waves": 0.02}  # periods [m]
AMPLITUDE = 0.3e-3  # [m] of the shapes
TEXTURES = 20
RATE, SETTLED = 4000.0, 0.1  # sampling [Hz], and what is left away at both ends [s]
CUT = 0.5  # between the channels, over the first resonance
CHANNELS, CAUSES = ("slow moment", "fast envelope"), ("shape", "texture")
INCLINES = np.linspace(-0.1, 0.1, 11)


def compute(
    posture: Posture, whisker: Whisker, scan: Scan, *, rng: np.random.Generator, n_textures: int = TEXTURES
) -> xr.Dataset:
    """Random gratings on two shapes, what each channel explains of shape and texture, and how far the channels mix.

    Parameters
    ----------
    posture, whisker, scan
        What crosses the surfaces.
    rng : Generator
        Draws the gratings, 35 µm deep.
    n_textures : int
        Number of gratings; each rides on both shapes.

    Returns
    -------
    Dataset
        Of three surfaces (two shapes with one texture, the first shape with another): ``surface_height``,
        ``slow_moment``, ``fast_envelope`` and what shape and texture give alone. ``share_told`` and ``separation``
        of each texture (:func:`separation`); ``envelope_gain`` against the slope of the shape at x = vt. Attributes
        ``separation_mean``, ``separation_low``, ``separation_high`` (95 % interval of the mean), ``caption``.
    """
    shapes = [wave(LENGTH, amplitude=AMPLITUDE, period=period, spacing=100e-6) for period in SHAPES.values()]
    textures = [HeightProfile.from_gaps(random_grating(LENGTH, rng=rng)) for _ in range(n_textures)]
    both = [riding(texture, shape) for shape in shapes for texture in textures]
    predictions: list[ReliefPrediction] = []
    for relief in [*both, *shapes, *textures]:
        table = predictions[-1].episodes.table if predictions else None
        predictions.append(predict_relief(whisker, posture, relief, scan, n_modes=3, table=table))
    t = np.arange(0, LENGTH / scan.speed, 1 / RATE)
    inside = (t > SETTLED) & (t < t[-1] - SETTLED)
    slow, fast = (x[..., inside] for x in channels(predictions, t))
    count = len(both)
    both_channels = (slow[:count].reshape(2, n_textures, -1), fast[:count].reshape(2, n_textures, -1))
    alone = (slow[count : count + 2], fast[count + 2 :])
    share = shares(both_channels, alone)
    gain = _gain(both_channels[1], alone[1], shapes, scan.speed * t[inside])
    data = dataset(
        _attributes(posture, whisker, scan, predictions, share),
        time=t[inside],
        surface=["30 mm, grating 1", "20 mm, grating 1", "30 mm, grating 2"],
        surface_height=[both[i].at(scan.speed * t[inside]) for i in (0, n_textures, 1)],
        slow_moment=[both_channels[0][0, 0], both_channels[0][1, 0], both_channels[0][0, 1]],
        slow_moment_alone=[alone[0][0], alone[0][1], alone[0][0]],
        fast_envelope=[both_channels[1][0, 0], both_channels[1][1, 0], both_channels[1][0, 1]],
        fast_envelope_alone=[alone[1][0], alone[1][0], alone[1][1]],
        channel=list(CHANNELS),
        cause=list(CAUSES),
        draw=np.arange(n_textures),
        share_told=share,
        separation=separation(share),
        **gain,
    )
    return data.assign_attrs(caption=_caption(data))


def channels(predictions: list[ReliefPrediction], t: Array) -> tuple[Array, Array]:
    """Moment at the base below half the first resonance [N m], and envelope of mode 1 above it, over L, (P, T) each."""
    first = predictions[0].omega[0] / (2 * np.pi)
    below, above = (butter(4, CUT * first, kind, fs=RATE, output="sos") for kind in ("lowpass", "highpass"))
    moment = np.array([follicle_signals(one, t)["base_moment"] for one in predictions])
    mode = np.array([one.mode_displacement(t)[0] for one in predictions])
    envelope = analytic_envelope(sosfiltfilt(above, mode))[0]
    return sosfiltfilt(below, moment), sosfiltfilt(below, envelope)


def shares(both_channels: tuple[Array, Array], alone: tuple[Array, Array]) -> Array:
    """Share of each cause's variance that each channel explains, (J textures, channel, cause), in [0, 1].

    The cause "shape" is the slow moment that the shape gives without texture, "texture" the envelope of the texture on
    level ground. Of each cause a line in one channel is fitted to the surfaces of all other textures; the share is
    1 − (mean square miss)/variance on those of the texture left out, on both shapes, and 0 where the line is worse than
    the mean.

    Parameters
    ----------
    both_channels : two (2, J, T) arrays
        Slow moments and envelopes of every shape and texture.
    alone : (2, T) and (J, T) arrays
        Slow moments of the shapes, envelopes of the textures.
    """
    count = both_channels[0].shape[1]
    causes = (
        np.broadcast_to(alone[0][:, None], both_channels[0].shape),
        np.broadcast_to(alone[1], both_channels[0].shape),
    )
    share = np.empty((count, 2, 2))
    for j in range(count):
        rest = np.arange(count) != j
        for c, s in np.ndindex(2, 2):
            line = np.polynomial.Polynomial.fit(both_channels[c][:, rest].ravel(), causes[s][:, rest].ravel(), 1)
            truth = causes[s][:, j]
            share[j, c, s] = max(0.0, 1 - np.mean((line(both_channels[c][:, j]) - truth) ** 2) / truth.var())
    return share


def separation(share: Array) -> Array:
    """Separation of the two channels, (J,), in [−1, 1].

    Mean over channels of the share explained of the own cause less the share explained of the other. 1: each channel
    explains its cause wholly and nothing of the other. 0: none, as where both explain both alike, or nothing. −1:
    swapped.

    Parameters
    ----------
    share : (J, 2, 2) array
        From :func:`shares`: texture, channel, cause.
    """
    own, other = share[:, [0, 1], [0, 1]], share[:, [0, 1], [1, 0]]
    return np.asarray((own - other).mean(axis=1))


def _gain(both_channels: Array, alone: Array, shapes: list[HeightProfile], x: Array) -> dict[str, Any]:
    """Envelope on the shape over that on level ground, by the slope at x = vt: means of classes of slope."""
    step = 1e-4
    slope = np.array([(shape.at(x + step) - shape.at(x - step)) / (2 * step) for shape in shapes])
    group = np.digitize(slope, INCLINES)
    ratio = np.array(
        [
            [
                both_channels[:, j][group == k].sum() / np.broadcast_to(alone[j], slope.shape)[group == k].sum()
                for k in _classes()
            ]
            for j in range(len(alone))
        ]
    )
    return {
        "incline": (INCLINES[1:] + INCLINES[:-1]) / 2,
        "envelope_gain": ratio.mean(axis=0),
        "envelope_gain_se": ratio.std(axis=0, ddof=1) / np.sqrt(len(alone)),
    }


def _classes() -> range:
    return range(1, len(INCLINES))


def _attributes(
    posture: Posture, whisker: Whisker, scan: Scan, predictions: list[ReliefPrediction], share: Array
) -> dict[str, float]:
    index = separation(share)
    half = 1.96 * index.std(ddof=1) / np.sqrt(len(index))
    return {
        "scan_speed": scan.speed,
        "damping": scan.damping,
        "contact": posture.contact,
        "base_angle": posture.base_angle,
        "whisker_length": whisker.length,
        "first_resonance": float(predictions[0].omega[0] / (2 * np.pi)),
        "separation_mean": float(index.mean()),
        "separation_low": float(index.mean() - half),
        "separation_high": float(index.mean() + half),
    }


def _caption(data: xr.Dataset) -> str:
    """Caption: what each channel explains, from the numbers computed."""
    attrs, share = data.attrs, data.share_told.mean("draw").values
    gain = data.envelope_gain.values
    return (
        f"A: random gratings 35 µm deep ride on waves of ± {1e3 * AMPLITUDE:.1f} mm; whisker of "
        f"{1e3 * attrs['whisker_length']:.0f} mm, ε = {attrs['contact']:.2f}, θ_b = {attrs['base_angle']:.1f} rad, "
        f"{attrs['scan_speed']:.2g} m/s, ζ = {attrs['damping']:.2g}, exact response. B: moment at the base below "
        f"{CUT:g} × the first resonance of {attrs['first_resonance']:.0f} Hz; pale: the shape without texture. "
        "C: envelope of mode 1 above that frequency; pale: the texture on level ground. D: share of each cause's "
        "variance that a line in each channel explains, on textures not used to fit it. The moment explains "
        f"{share[0, 0]:.2f} of the shape and {share[0, 1]:.2f} of the texture, the envelope {share[1, 1]:.2f} of the "
        f"texture and {share[1, 0]:.2f} of the shape; separation (own less other, mean of both) "
        f"{attrs['separation_mean']:.2f}, 95 % interval {attrs['separation_low']:.2f} to "
        f"{attrs['separation_high']:.2f} over {data.sizes['draw']} textures. E: what mixes them: the envelope's gain "
        f"lies between {gain.min():.2f} and {gain.max():.2f} with the shape's slope at x = vt (mean and its error); "
        "besides, slopes carry the contact away from x = vt and so shift the envelope in time, and below the cut the "
        "gratings' own slow part stays in the moment. The model has one contact: in valleys it steps "
        "where a real free end may lie on the ground."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Surfaces, slow moment and envelope of three surfaces; below, shares explained and the envelope's gain."""
    figure, axes = new_figure(9.0, 9.0, 4, 1, height_ratios=[1, 1.1, 1.2, 1.1])
    for axis in axes[:3, 0]:
        axis.set_xlim(0.15, 0.85)
    slow, slow_alone = 1e9 * data.slow_moment, 1e9 * data.slow_moment_alone
    fast, fast_alone = 1e3 * data.fast_envelope, 1e3 * data.fast_envelope_alone
    _draw_traces(axes[0, 0], data, 1e3 * data.surface_height, None, 0.8)
    axes[0, 0].set(title="A  Surfaces, each 0.8 mm lower", ylabel="height [mm]")
    _draw_traces(axes[1, 0], data, slow, slow_alone, 110)
    axes[1, 0].set(title="B  Slow moment, each 110 nN m lower", ylabel="moment [nN m]")
    _draw_traces(axes[2, 0], data, fast, fast_alone, 2)
    axes[2, 0].set(title="C  Envelope of mode 1, each 2 lower", ylabel="mode 1 [10⁻³ L]", xlabel="time [s]")
    left, right = split(figure, axes[3, 0], widths=(1, 1))
    _draw_shares(left, data)
    _draw_gain(right, data)
    return add_caption(figure, data)


def _draw_traces(axis: Axes, data: xr.Dataset, values: xr.DataArray, alone: xr.DataArray | None, apart: float) -> None:
    """One trace of each surface below the other, named at its right end; behind it what its cause gives alone."""
    for i, name in enumerate(data.surface.values):
        if alone is not None:
            axis.plot(data.time, alone[i] - i * apart, color=TRUTH, lw=2.5)
        axis.plot(data.time, values[i] - i * apart, color=LAND if alone is None else PREDICTED)
        middle = float(values[i].mean()) - i * apart
        axis.annotate(str(name).replace(", ", "\n"), (1.01, middle), xycoords=("axes fraction", "data"), va="center")


def _draw_shares(axis: Axes, data: xr.Dataset) -> None:
    mean, sd = data.share_told.mean("draw"), data.share_told.std("draw", ddof=1)
    for c, face in enumerate((PREDICTED, "white")):
        at, label = np.arange(2) + 0.36 * c - 0.18, str(data.channel.values[c])
        axis.bar(at, mean[c], 0.34, yerr=sd[c], color=face, edgecolor=PREDICTED, label=label, capsize=3)
    axis.set_xticks([0, 1], [str(cause) for cause in data.cause.values])
    axis.set(ylim=(0, 1.05), ylabel="share explained", xlabel="cause", title="D  Share explained, mean and SD")
    key_above(axis)


def _draw_gain(axis: Axes, data: xr.Dataset) -> None:
    axis.errorbar(data.incline, data.envelope_gain, data.envelope_gain_se, fmt="o-", color=PREDICTED, ms=4)
    axis.axhline(1, color="0.6", lw=0.8)
    axis.set(
        xlabel="slope of the shape",
        ylabel="gain",
        xticks=[-0.08, -0.04, 0, 0.04, 0.08],
        title="E  Envelope over that on level ground",
    )


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    whisker, posture = Whisker(length=0.040, cone_angle=1.5e-3, tip=0.05), Posture(contact=0.29, base_angle=1.2)
    found = compute(posture, whisker, Scan(speed=0.1, damping=0.11), rng=np.random.default_rng(1))
    write_picture(draw(found), folder / "two-channels.png")
