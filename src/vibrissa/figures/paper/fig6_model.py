"""Figure 6A–B of the model: gaps of several widths, what collapses over λ, and the gain against speed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, get_args

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, house_style, new_figure
from vibrissa.mechanics.contact.gap_events import Events, trough_events
from vibrissa.mechanics.quasi_static.response import Form, quasi_static
from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.mechanics.vibration.dynamics import Drive, amplitudes
from vibrissa.quantities import dataset
from vibrissa.texture.surface import Gaps, Reading, random_grating

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.whisker import Whisker

FORMS, READINGS = get_args(Form), get_args(Reading)
GAPS = (0.3e-3, 0.6e-3, 1.0e-3)  # [m]
NODE = 0.9  # s of the paper's Fig. 6A
BEFORE, AFTER = 2e-3, 36e-3  # [s] shown about the jump
SPEEDS = (0.05, 0.075, 0.1, 0.15, 0.2, 0.25, 0.3)  # [m/s]
TEXTURES, GRATING = 10, 0.2  # number, and length of each [m]
RATE, SETTLED = 4000.0, 0.05  # sampling [Hz] of the gain, from this time on [s]
SIGNALS = {  # what is compared, and the unit of its peak over λ
    "q + Q": "1",
    "q": "1",
    "jump alone": "1",
    "ramps alone": "1",
    "moment, vibration": "N",
    "displacement at s = 0.9": "1",
}
OVER_L = ("q + Q", "q", "jump alone", "ramps alone")  # λ is then over L as well
COLOURS = ("#0072B2", "#009E73", "#D55E00")  # safe for the colour-blind


def compute(
    posture: Posture,
    whisker: Whisker,
    scan: Scan,
    *,
    rng: np.random.Generator,
    gap_widths: Sequence[float] = GAPS,
    n_modes: int = 12,
    n_textures: int = TEXTURES,
) -> xr.Dataset:
    """Responses to single gaps, their spread over λ, and the gain of random gratings against speed.

    Parameters
    ----------
    posture, whisker, scan
        What crosses the gaps, and how; both forms of the response are computed, whichever ``scan`` names.
    rng : Generator
        Draws the gratings.
    gap_widths : sequence of float
        λ of the single gaps [m].
    n_modes : int
        Number of modes of the whisker; the first is given, the moment sums all.
    n_textures : int
        Number of random gratings of each reading.

    Returns
    -------
    Dataset
        For each ``form`` and ``gap``, in ``time`` from the jump t₂: ``mode_displacement``, ``mode_amplitude`` and
        ``jump_response`` of mode 1, ``base_moment_vibration``. ``peak_over_width`` and ``collapse_spread`` of each
        ``signal``. ``gain_displacement``, ``gain_vibration`` (form, reading, speed) and their standard errors.
        Attribute ``caption``.
    """
    crossings = [
        [_crossing(whisker, posture, width, replace(scan, response=form), n_modes) for width in gap_widths]
        for form in FORMS
    ]
    time = np.linspace(-BEFORE, AFTER, 3801)
    single = _single_gaps(crossings, time)
    gains = gain(posture, whisker, scan, rng=rng, n_textures=n_textures)
    data = single.merge(gains, combine_attrs="override")
    return data.assign_attrs(n_modes=n_modes, n_textures=n_textures, caption=_caption(data, n_modes, n_textures))


def _crossing(whisker: Whisker, posture: Posture, width: float, scan: Scan, n_modes: int) -> Prediction:
    gap = Gaps(position=np.zeros(1), width=np.array([width]))
    return predict(whisker, posture, gap, scan, n_modes=n_modes)


def _single_gaps(crossings: list[list[Prediction]], time: Array) -> xr.Dataset:
    """Signals of every form and gap, and their peaks over λ."""
    first = crossings[0][0]
    signals = [[_signals(crossing, time) for crossing in row] for row in crossings]
    width = np.array([float(crossing.texture.width[0]) for crossing in crossings[0]])
    peak = np.array([[[np.abs(one[name]).max() for one in row] for name in SIGNALS] for row in signals])
    peak /= width * np.where([name in OVER_L for name in SIGNALS], 1 / first.whisker.length, 1.0)[:, None]
    return dataset(
        {
            "scan_speed": first.scan.speed,
            "damping": first.scan.damping,
            "contact": first.posture.contact,
            "base_angle": first.posture.base_angle,
            "whisker_length": first.whisker.length,
            "ramp_kick": float(abs(first.c[0]) * first.scan.speed / first.whisker.length / first.omega[0]),
        },
        lead=("form", "gap"),
        form=list(FORMS),
        gap=width,
        time=time,
        mode=[1],
        mode_displacement=[[[one["q + Q"]] for one in row] for row in signals],
        mode_amplitude=[[[one["q"]] for one in row] for row in signals],
        jump_response=[[[one["jump alone"]] for one in row] for row in signals],
        base_moment_vibration=[[one["moment, vibration"] for one in row] for row in signals],
        signal=list(SIGNALS),
        signal_unit=list(SIGNALS.values()),
        peak_over_width=peak,
        collapse_spread=np.ptp(peak, axis=-1) / peak.mean(axis=-1),
    )


def _signals(crossing: Prediction, time: Array) -> dict[str, Array]:
    """``SIGNALS`` at times from the jump, (T,) each; of the modes the first."""
    t = crossing.events.time[1] + time
    q, jump = crossing.amplitudes(t)[0], _jump_alone(crossing, t)[0]
    return {
        "q + Q": crossing.mode_displacement(t)[0],
        "q": q,
        "jump alone": jump,
        "ramps alone": q - jump,
        "moment, vibration": follicle_signals(crossing, t)["base_moment_vibration"],
        "displacement at s = 0.9": crossing.displacement(t, np.array([NODE]))[:, 0] * crossing.whisker.length,
    }


def _jump_alone(crossing: Prediction, t: Array) -> Array:
    """Vibration that the jump at t₂ leaves without the ramps before and after, (M, T): q is a sum of the two."""
    modes = slice(len(crossing.kappa))
    before, after = (crossing.response(d)[modes] for d in crossing.events.gaps)
    drive = Drive(crossing.events.time[1:2], after[:, :, None], before[:, 0])
    return amplitudes(t, drive, crossing.omega, crossing.scan.damping, crossing.scan.jump)


def gain(
    posture: Posture, whisker: Whisker, scan: Scan, *, rng: np.random.Generator, n_textures: int = TEXTURES
) -> xr.Dataset:
    """Root mean square of mode 1 over random gratings, against speed, for both readings and both forms.

    Parameters
    ----------
    posture : Posture
        How the whisker touches the gratings.
    whisker : Whisker
        What is drawn over them.
    scan : Scan
        How; its speed and form are replaced.
    rng : Generator
        Draws the gratings.
    n_textures : int
        Gratings of each reading.

    Returns
    -------
    Dataset
        ``gain_displacement``, of q + Q about its mean, ``gain_vibration``, of q, and their standard errors.
    """
    rms = np.empty((len(READINGS), len(FORMS), len(SPEEDS), n_textures, 2))
    for r, reading in enumerate(READINGS):
        textures = [random_grating(GRATING, rng=rng, reading=reading) for _ in range(n_textures)]
        slow = [trough_events(texture, whisker, posture, 1.0) for texture in textures]
        reach = min(e.gaps[1].min() for e in slow), max(e.gaps[0].max() for e in slow)
        for f, form in enumerate(FORMS):
            response = quasi_static(posture, reach, form=form, n_modes=1)
            for v, speed in enumerate(SPEEDS):
                swept, met = replace(scan, speed=speed, response=form), [_at(events, speed) for events in slow]
                pairs = zip(textures, met, strict=True)
                rms[r, f, v] = [_rms(Prediction(whisker, posture, swept, *pair, response)) for pair in pairs]
    mean, error = rms.mean(axis=-2), rms.std(axis=-2, ddof=1) / np.sqrt(n_textures)
    return dataset(
        form=list(FORMS),
        reading=list(READINGS),
        speed=np.array(SPEEDS),
        gain_displacement=mean[..., 0].swapaxes(0, 1),
        gain_displacement_se=error[..., 0].swapaxes(0, 1),
        gain_vibration=mean[..., 1].swapaxes(0, 1),
        gain_vibration_se=error[..., 1].swapaxes(0, 1),
    )


def _at(events: Events, speed: float) -> Events:
    """Events of a texture met at 1 m/s, at another speed."""
    return Events(events.time / speed, events.drop, events.rate * speed)


def _rms(prediction: Prediction) -> tuple[float, float]:
    """Standard deviation in time of q₁ + Q₁ and of q₁, over L."""
    t = np.arange(SETTLED, prediction.events.time[-1], 1 / RATE)
    return float(prediction.mode_displacement(t)[0].std()), float(prediction.amplitudes(t)[0].std())


def _caption(data: xr.Dataset, n_modes: int, n_textures: int) -> str:
    """What collapses over λ and what does not, from the numbers computed."""

    def percent(name: str) -> str:
        exact, linear = (float(100 * data.collapse_spread.sel(form=form, signal=name)) for form in FORMS)
        return f"{exact:.0f} % exact, {linear:.0f} % linear"

    def ratio(reading: str) -> str:
        rms = data.gain_displacement.sel(reading=reading, form="exact")
        return f"{reading} × {float(rms.sel(speed=0.2) / rms.sel(speed=0.1)):.2f}"

    attrs = data.attrs
    return (
        f"A: gaps of several widths λ at {attrs['scan_speed']:.2g} m/s; whisker of {1e3 * attrs['whisker_length']:.0f} "
        f"mm, ε = {attrs['contact']:.2f}, θ_b = {attrs['base_angle']:.1f} rad, ζ = {attrs['damping']:.2g}, {n_modes} "
        "modes (the burst in the moment just after the jump is the higher ones). B: the same over λ. Range of the "
        f"peaks over λ among the gaps, over their mean: q₁ + Q₁ {percent('q + Q')}; moment of the vibration "
        f"{percent('moment, vibration')}; the paper's displacement at s = {NODE} {percent('displacement at s = 0.9')}. "
        f"C: what the jump alone leaves collapses, in the linear form only ({percent('jump alone')}). What the ramps "
        f"add does not ({percent('ramps alone')}): kicks of |c₁|v/(ω₁L) = {1e3 * attrs['ramp_kick']:.2f} × 10⁻³, which "
        "grow with v and not with λ; and the flat is reached at λ/v after t₁, in another phase for every λ. D: mean "
        f"and standard error over {n_textures} random gratings of {GRATING:g} m; rms of q₁ + Q₁ about its mean, exact, "
        f"from 0.1 to 0.2 m/s: {ratio('telegraph')}, {ratio('widths')}. The model has one contact: a free end longer "
        "than a gap would meet the ground behind it, which is not resolved."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Rows A and B: mode 1 and moment, exact and linear. Last row: the jump alone, and the gain.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(11.5, 9.0, 3, 4)
    per_gap = data.gap / data.attrs["whisker_length"]
    mode, jump = data.mode_displacement.isel(mode=0), data.jump_response.isel(mode=0)
    moment = data.base_moment_vibration
    _draw_pair(axes[0, :2], data, 1e3 * mode, "A  q₁ + Q₁", "mode 1 [10⁻³ L]")
    _draw_pair(axes[0, 2:], data, 1e9 * moment, "A  Moment", "base moment, vibration [nN m]")
    _draw_pair(axes[1, :2], data, mode / per_gap, "B  (q₁ + Q₁)/λ", "mode 1 / λ")
    _draw_pair(axes[1, 2:], data, 1e6 * moment / data.gap, "B  Moment/λ", "base moment, vibration / λ [µN]")
    _draw_pair(axes[2, :2], data, jump / per_gap, "C  Jump alone, q₁/λ", "mode 1 / λ")
    axes[2, 3].sharey(axes[2, 2])
    for axis, reading in zip(axes[2, 2:], data.reading.values, strict=True):
        _draw_gain(axis, data.sel(reading=reading), str(reading))
    axes[2, 2].set_ylabel("rms of mode 1 [10⁻³ L]")
    axes[0, 0].legend(title="gap λ")
    axes[2, 2].legend(loc="lower right")
    return add_caption(figure, data)


def _draw_pair(axes: Sequence[Axes], data: xr.Dataset, values: xr.DataArray, title: str, unit: str) -> None:
    """Exact on the left, linear on the right, on one scale."""
    axes[1].sharey(axes[0])
    for axis, form in zip(axes, data.form.values, strict=True):
        for colour, gap in zip(COLOURS, data.gap.values, strict=True):
            axis.plot(1e3 * data.time, values.sel(form=form, gap=gap), color=colour, label=f"{1e3 * gap:.1f} mm")
        axis.set(xlabel="time after the jump t₂ [ms]", title=f"{title}, {form}", xlim=(-2, 30))
    axes[0].set_ylabel(unit)


def _draw_gain(axis: Axes, data: xr.Dataset, reading: str) -> None:
    """Gain against speed: displacement and vibration, exact and linear."""
    looks = (("gain_displacement", "q₁ + Q₁", COLOURS[0], "o"), ("gain_vibration", "q₁", COLOURS[2], "s"))
    for name, label, colour, marker in looks:
        for form, line in zip(data.form.values, ("-", "--"), strict=True):
            rms, error = 1e3 * data[name].sel(form=form), 1e3 * data[name + "_se"].sel(form=form)
            (points, *_) = axis.errorbar(data.speed, rms, error, color=colour, ls=line, label=f"{label}, {form}")
            points.set(marker=marker, markersize=3.5, markerfacecolor=colour if line == "-" else "white")
    axis.set(xlabel="speed v [m/s]", ylim=(0, None), title=f"D  Gain, {reading}")
