"""Figure 6A–B of the model: gaps of several widths near the base, what collapses over λ, the gain against speed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, get_args

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, house_style, key_above, merged, new_figure
from vibrissa.figures.paper.parts import fig6_model_panels as panels
from vibrissa.figures.paper.parts.fig6_model_panels import NODE
from vibrissa.mechanics.contact.gap_events import Events, trough_events
from vibrissa.mechanics.quasi_static.response import Form, quasi_static
from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.vibration.dynamics import Drive, amplitudes
from vibrissa.quantities import dataset
from vibrissa.texture.surface import Gaps, Reading, random_grating

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr
    from matplotlib.figure import Figure

    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.whisker import Whisker

FORMS, READINGS = get_args(Form), get_args(Reading)
GAPS = (0.3e-3, 0.6e-3, 1.0e-3)  # [m]
BEFORE, AFTER = 2e-3, 36e-3  # [s] shown about the jump
SHOWN = 45e-3  # [s] shown from the first edge on
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
TITLES = {"telegraph": "edges at random places", "widths": "Gaussian widths"}  # of gratings
OVER_L = ("q + Q", "q", "jump alone", "ramps alone")  # λ is then over L as well


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
        For each ``form`` and ``gap``, in ``edge_time`` from t₁, when the first edge meets the contact:
        ``node_displacement`` at s = 0.9 and ``node_response``, the same over λ. In ``time`` from the jump t₂:
        ``mode_displacement``, ``mode_amplitude`` and
        ``jump_response`` of mode 1, ``base_moment_vibration``. ``peak_over_width`` and ``collapse_spread`` of each
        ``signal``. ``shaft_x``, ``shaft_y`` (shaft),
        the profile at t₁. ``gain_displacement``, ``gain_vibration`` (form, reading, speed) and their standard errors.
        Attribute ``caption``.
    """
    crossings = [
        [_crossing(whisker, posture, width, replace(scan, response=form), n_modes) for width in gap_widths]
        for form in FORMS
    ]
    time = np.linspace(-BEFORE, AFTER, 3801)
    single = _single_gaps(crossings, time).merge(_near_the_base(crossings), combine_attrs="no_conflicts")
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


def _near_the_base(crossings: list[list[Prediction]]) -> xr.Dataset:
    """Displacement of the node at s = 0.9 from t₁ on, whole and over λ, and the profile at t₁."""
    first, node = crossings[0][0], np.array([NODE])
    time = np.linspace(-BEFORE, SHOWN, 1881)
    moved = np.array([[one.displacement(one.events.time[0] + time, node)[:, 0] for one in row] for row in crossings])
    width = np.array([float(one.texture.width[0]) for one in crossings[0]]) / first.whisker.length
    flat, s = on_the_flat(first.posture), np.linspace(first.whisker.tip, 1, 200)
    (x, y), (node_x, node_y) = flat.position(s), flat.position(node)
    length, (distance, height) = first.whisker.length, flat.base
    return dataset(
        {"node_x": length * float(node_x[0] + distance), "node_y": length * float(node_y[0] + height)},
        lead=("form", "gap"),
        form=list(FORMS),
        gap=width * length,
        edge_time=time,
        node_displacement=moved,
        node_response=moved / width[:, None],
        shaft_x=length * (x + distance),
        shaft_y=length * (y + height),
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
        return f"× {float(rms.sel(speed=0.2) / rms.sel(speed=0.1)):.2f} ({TITLES[reading]})"

    attrs = data.attrs
    return (
        "Figure 6A–B. Computed with the one-contact model: one gap crossed, of several widths λ "
        f"({1e3 * attrs['scan_speed']:.0f} mm/s, whisker of {1e3 * attrs['whisker_length']:.0f} mm, ε = "
        f"{attrs['contact']:.2f}, θ_b = {attrs['base_angle']:.1f} rad, "
        f"ζ = {attrs['damping']:.2g}, {n_modes} modes). A, transverse displacement of the node at s = {NODE}, which is "
        "0.1 L from the base; t = 0: the first edge of the gap meets the contact; left in units of L, right in µm. "
        "Inset: the profile at t = 0, and the node. B, the same over λ. The exact response is what the model predicts, "
        "the linear one is the paper's (Eq. 11). Range of the largest displacement over λ among the gaps, over its "
        f"mean: {percent(f'displacement at s = {NODE}')}; the curves collapse only in part, since the ramps kick alike "
        "at every λ. Not in the paper: F, bending moment of the vibration at the base over λ, from the jump at t₂ on "
        f"(range {percent('moment, vibration')}); the burst just after the jump is that of the higher modes. G, what "
        f"the jump alone leaves of mode 1 collapses, in the linear form only ({percent('jump alone')}). What the ramps "
        f"add does not ({percent('ramps alone')}): each start and end of a ramp kicks mode 1 by "
        f"{1e3 * attrs['ramp_kick']:.2f} × 10⁻³ L, which grows with the speed and not with λ. "
        f"H, rms of mode 1 over {n_textures} random gratings of {GRATING:g} m, in the two readings of the paper, "
        "against the scanning speed, mean and standard error; q₁, the vibration; q₁ + Q₁, with the quasi-static "
        "displacement, as a movie shows it, about its mean; from 100 to 200 mm/s this changes, exact, by "
        f"{ratio('telegraph')} and {ratio('widths')}. The model has one contact: a free end longer than a gap would "
        "meet the ground behind it, which is not resolved."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A and B, exact and linear; then moment and jump alone over λ, and the gain.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(9.0, 9.4, 4, 4)
    first, second, last = ([figure.add_subplot(merged(axes[row, k : k + 2])) for k in (0, 2)] for row in (0, 1, 3))
    jump = data.jump_response.isel(mode=0) / (data.gap / data.attrs["whisker_length"])
    moment = 1e6 * data.base_moment_vibration / data.gap
    panels.draw_node(first, data, 1e3 * data.node_displacement, "A")
    panels.draw_node(second, data, data.node_response, "B")
    panels.draw_pair(axes[2, :2], data, moment, "F  Moment / λ", "base moment / λ [µN]")
    panels.draw_pair(axes[2, 2:], data, jump, "G  Jump alone / λ", "mode 1 / λ")
    last[1].sharey(last[0])
    for axis, reading, letter in zip(last, data.reading.values, ("H  ", ""), strict=True):
        words = TITLES[str(reading)]
        panels.draw_gain(axis, data.sel(reading=reading), f"{letter}{words[0].upper()}{words[1:]}")
    last[0].set_ylabel("rms of mode 1 [10⁻³ L]")
    panels.draw_inset(first[0], data)
    for axis in (first[0], last[0]):
        key_above(axis, columns=4)
    figure.align_ylabels([first[0], second[0]])
    return add_caption(figure, data)
