"""Figure 2: one gap crossed, from the flat to the edge, over the jump, and back to the flat."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, get_args

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, house_style, key_above, new_figure
from vibrissa.figures.colours import PREDICTED, ordered
from vibrissa.mechanics.quasi_static.response import Form
from vibrissa.mechanics.scan.free_end import TOO_LARGE, free_end_facts
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.edge_contact import Held, hold, on_the_flat
from vibrissa.quantities import dataset
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vibrissa.mechanics.scan.texture_prediction import Prediction
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.whisker import Whisker

FORMS = get_args(Form)
MODES = 3
LEAD, AFTER = 0.25, 4.0  # shown before t₁ and after t₃, in units of t₃ − t₁
ALONG = "from the far edge [mm]"
STRETCH = 12  # of the heights in the close-up
STAGES = ordered(3)  # U₁, U₂, U₃
BESIDE = 0.01  # of s, beside the contact: there a point passes into the free end
PASSAGES = 5  # profiles of each ramp in C


def compute(posture: Posture, whisker: Whisker, gap_width: float, scan: Scan, *, n_modes: int = 12) -> xr.Dataset:
    """Profiles, excursion and first modes of one gap crossed.

    Parameters
    ----------
    posture, whisker, scan
        What crosses the gap, and how; both forms of the response are computed, whichever ``scan`` names.
    gap_width : float
        λ [m].
    n_modes : int
        Number of modes of the whisker; three are given.

    Returns
    -------
    Dataset
        ``stage_x``, ``stage_height`` (stage, s) [m], x = 0 at the far edge of the gap and λ at the near one;
        ``stage_contact``, ``stage_excursion``, ``event_time``; ``stage_displacement`` U − U₁, and ``stage_response``
        (U − U₁)/d beside ``unit_response`` Ū, the same all along the gap as ``passage_response`` (passage, s) at
        ``passage_excursion``; ``excursion`` from t₁ = 0 on; ``mode_amplitude``, ``mode_displacement``
        and ``mode_jump`` for each ``form``; ``free_end_length`` and whether it allows the jump (``jumps_allowed`` of
        1). Attribute ``caption``.
    """
    texture = Gaps(position=np.zeros(1), width=np.array([gap_width]))
    crossings = [predict(whisker, posture, texture, replace(scan, response=f), n_modes=n_modes) for f in FORMS]
    events, t = crossings[0].events, _times(crossings[0].events.time)
    stages = _stages(crossings[0])
    s = _points(whisker, stages)
    x, height = _on_the_substrate(stages, gap_width / whisker.length, s)
    passed = _passages(stages, s)
    linear = _against_linear(crossings, stages, s)
    shaft = s >= stages[0].contact + BESIDE
    away = np.abs(passed["passage_response"] - linear["unit_response"])[:, shaft].max()
    facts = _facts(crossings[0], stages)
    facts["collapse_residual"] = float(away / np.abs(linear["unit_response"][shaft]).max())
    return dataset(
        {**facts, "caption": _caption(facts)},
        lead=("form",),
        form=list(FORMS),
        s=s,
        stage=np.arange(1, 4),
        stage_contact=[held.contact for held in stages],
        stage_excursion=[held.excursion for held in stages],
        stage_x=x * whisker.length,
        stage_height=height * whisker.length,
        passage=np.arange(2 * PASSAGES),
        **linear,
        **passed,
        event=np.arange(1, 4),
        event_time=events.time,
        time=t,
        excursion=events.excursion(t),
        mode=np.arange(1, MODES + 1),
        mode_amplitude=[one.amplitudes(t)[:MODES] for one in crossings],
        mode_displacement=[one.mode_displacement(t)[:MODES] for one in crossings],
        mode_jump=[_jump(one)[:MODES] for one in crossings],
        **free_end_facts(crossings[0].free_end_length, crossings[0].allowed_jumps),
    )


def _stages(crossing: Prediction) -> list[Held]:
    """U₁, U₂ and U₃."""
    flat = on_the_flat(crossing.posture)
    return [flat, *(hold(flat, float(d[0])) for d in crossing.events.gaps)]


def _points(whisker: Whisker, stages: list[Held]) -> Array:
    """Points from the tip to the base, dense near the contact, with all three contacts among them."""
    contact = stages[0].contact
    near = contact + (1 - contact) * np.linspace(0, 1, 200) ** 2
    return np.unique(np.concatenate([np.linspace(whisker.tip, 1, 60), near, [held.contact for held in stages]]))


def _on_the_substrate(stages: list[Held], width: float, s: Array) -> tuple[Array, Array]:
    """Positions (stage, s) over L, along the substrate from the far edge of the gap, and above it."""
    edge, base = np.array([0.0, 0.0, width]), np.array([held.base for held in stages])
    along, up = np.array([held.position(s) for held in stages]).swapaxes(0, 1)
    return (edge + base[:, 0])[:, None] + along, base[:, 1:] + up


def _against_linear(crossings: list[Prediction], stages: list[Held], s: Array) -> dict[str, Array]:
    """U − U₁ whole and over d, and Ū."""
    displacement = np.array([stages[0].displaced(*held.position(s), s) for held in stages])
    d = np.array([held.excursion for held in stages])[:, None]
    over_d = np.divide(displacement, d, out=np.full_like(displacement, np.nan), where=d != 0)
    unit = crossings[FORMS.index("linear")].response.displacement(np.ones(1), s)[0]
    return {"stage_displacement": displacement, "stage_response": over_d, "unit_response": unit}


def _passages(stages: list[Held], s: Array) -> dict[str, Array]:
    """(U − U₁)/d at excursions from near 0 to d₂ before the jump, and from d₂ − λ to near 0 after it."""
    flat, before, after = stages
    parts = np.arange(1, PASSAGES + 1) / PASSAGES
    excursions = np.append(before.excursion * parts, after.excursion * parts[::-1])
    held = [hold(flat, d) for d in excursions.tolist()]
    response = [flat.displaced(*one.position(s), s) / one.excursion for one in held]
    return {"passage_excursion": excursions, "passage_response": np.array(response)}


def _times(events: Array) -> Array:
    """Even times from before t₁ to after t₃, and both sides of every event."""
    span = events[2] - events[0]
    even = np.linspace(events[0] - LEAD * span, events[2] + AFTER * span, 1500)
    return np.unique(np.concatenate([even, events, events - 1e-9 * span]))


def _jump(crossing: Prediction) -> Array:
    """−ΔQ_i at t₂: the jump of the vibration amplitudes, over L."""
    before, after = crossing.events.gaps
    modes = slice(len(crossing.kappa))
    return np.asarray(crossing.response(before)[modes, 0] - crossing.response(after)[modes, 0], float)


def _facts(crossing: Prediction, stages: list[Held]) -> dict[str, float]:
    """Numbers of the caption, in SI units."""
    length, last = crossing.whisker.length, stages[2]
    free = (last.contact - crossing.whisker.tip) * length
    return {
        "whisker_length": length,
        "contact": stages[0].contact,
        "base_angle": crossing.posture.base_angle,
        "scan_speed": crossing.scan.speed,
        "damping": crossing.scan.damping,
        "gap_width": float(crossing.texture.width[0]),
        "gap_depth": crossing.texture.depth,
        "excursion_at_jump": stages[1].excursion * length,
        "free_length": free,
        "jump_allowed": float(crossing.allowed_jumps.all()),
        "dip_at_far_edge": float(crossing.texture.width[0] * np.tan(last.contact_angle)),
        "dip_at_tip": float(free * np.sin(last.contact_angle)),
    }


def _caption(facts: dict[str, float]) -> str:
    """What is shown, where the paper prints otherwise, and where the model ends."""
    mm, um = ({name: scale * value for name, value in facts.items()} for scale in (1e3, 1e6))
    free = "longer" if facts["free_length"] > facts["gap_width"] else "shorter"
    deep = "more" if facts["dip_at_far_edge"] > facts["gap_depth"] else "less"
    allowed = (
        "so this free end allows the jump to U₃."
        if facts["jump_allowed"]
        else "so this free end does not allow the jump to U₃: the shaft bridges the gap, and the vibration shown is up "
        f"to {TOO_LARGE} times too large."
    )
    collapse = facts["collapse_residual"]
    return (
        f"Figure 2. Computed with the one-contact model: one gap of λ = {mm['gap_width']:.2g} mm, "
        f"{um['gap_depth']:.0f} µm deep, crossed at {mm['scan_speed']:.0f} mm/s by a whisker of "
        f"{mm['whisker_length']:.0f} mm (ε = {facts['contact']:.2f}, θ_b = {facts['base_angle']:.1f} rad, ζ = "
        f"{facts['damping']:.2g}). A, profiles on the flat, U₁, before the jump, U₂, and after it, U₃, to scale. B, "
        f"close-up at the contact, heights × {STRETCH}, with the gap's true depth; centrelines without thickness; "
        f"dots: contact; dashed: free end. C, (U − U₁)/d at {2 * PASSAGES} excursions, dark (t₁) to pale (t₃), and the "
        f"linear response Ū (black dashes); on the shaft the profiles differ from Ū by up to {100 * collapse:.0f} % of "
        "its largest value. D, the excursion d(t). Its slope is +v; the paper's caption prints −v, its text and the "
        f"geometry give +v. The contact jumps early, at d₂ = {um['excursion_at_jump']:.1f} µm = "
        f"{facts['excursion_at_jump'] / facts['gap_width']:.3f} λ. Not in the paper: E, the vibration q₁ jumps, the "
        "displacement q₁ + Q₁ does not. F, jump of q in both forms of the response; numbers: exact over linear. The "
        f"model has one contact. After the jump the straight free end, {mm['free_length']:.1f} mm long and so {free} "
        f"than the gap is wide, would pass {um['dip_at_far_edge']:.0f} µm below the far edge, {deep} than the gap is "
        f"deep, and its tip {um['dip_at_tip']:.0f} µm below the land; {allowed}"
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Profiles above, what follows in time below, and the caption.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(9.0, 5.8, 2, 3)
    panels = (_draw_profiles, _draw_close_up, _draw_response, _draw_excursion, _draw_mode, _draw_jumps)
    for draw_panel, axis in zip(panels, axes.flat, strict=True):
        draw_panel(axis, data)
    return add_caption(figure, data)


def _draw_stages(axis: Axes, data: xr.Dataset, height_scale: float) -> None:
    """The three profiles, solid from the contact to the base, dashed their free ends."""
    s = data.s.values
    for i, (name, colour) in enumerate(zip("₁₂₃", STAGES, strict=True)):
        x, y = 1e3 * data.stage_x.values[i], height_scale * data.stage_height.values[i]
        shaft, free = s >= float(data.stage_contact[i]), s <= float(data.stage_contact[i])
        axis.plot(x[shaft], y[shaft], color=colour, lw=1.4, label=f"U{name}")
        axis.plot(x[free], y[free], "--", color=colour, lw=0.9)
        axis.plot(x[shaft][0], y[shaft][0], "o", color=colour, ms=4.5 if i else 7, zorder=3 if i else 2)


def _draw_substrate(axis: Axes, data: xr.Dataset, left: float, right: float, floor: float, height_scale: float) -> None:
    """The substrate with its gap from x = 0 to λ; left, right [mm] and floor in the axis' units."""
    width, depth = 1e3 * data.attrs["gap_width"], height_scale * data.attrs["gap_depth"]
    edge, ground = [left, 0, 0, width, width, right], [0, 0, -depth, -depth, 0, 0]
    axis.fill_between(edge, ground, floor, color="0.88", lw=0, zorder=0)
    axis.plot(edge, ground, color="0.45", lw=0.8, zorder=1)


def _draw_profiles(axis: Axes, data: xr.Dataset) -> None:
    """Whole profiles with D and H."""
    x, y = 1e3 * data.stage_x.values, 1e3 * data.stage_height.values
    left, right, both = x.min() - 1.5, x.max() + 5, {"arrowstyle": "<->", "lw": 0.7, "shrinkA": 0, "shrinkB": 0}
    _draw_substrate(axis, data, left, right, -2.5, 1e3)
    _draw_stages(axis, data, 1e3)
    base, top = x.max(), y.max()
    axis.annotate("", (base + 1.5, 0), (base + 1.5, top), arrowprops=both)
    axis.text(base + 2.2, top / 2, "H", va="center")
    axis.annotate("", (0, -4), (base, -4), arrowprops=both)
    axis.text(base / 2, -4.4, "D", ha="center", va="top")
    axis.annotate("", (0.55 * base, 0.72 * top), (0.1 * base, 0.72 * top), arrowprops={"arrowstyle": "->"})
    axis.text(0.1 * base, 0.78 * top, "base, v", color="0.3")
    axis.text(base - 0.5, top + 0.4, "θ$_b$", ha="right")
    axis.set(aspect="equal", anchor="N", xlim=(left, right), ylim=(-8, top + 2.5))
    axis.set(xlabel=ALONG, ylabel="height [mm]", title="A  Profiles")
    key_above(axis)


def _draw_close_up(axis: Axes, data: xr.Dataset) -> None:
    width, depth = 1e3 * data.attrs["gap_width"], 1e6 * data.attrs["gap_depth"]
    left, right, floor = -0.75 * width, 1.9 * width, -2.0 * depth
    _draw_substrate(axis, data, left, right, floor, 1e6)
    _draw_stages(axis, data, 1e6)
    for place, name, side, away in ((0.0, "far", "right", -5), (width, "near", "left", 5)):
        middle = (place, -depth / 2)
        axis.annotate(name, middle, (away, 0), textcoords="offset points", ha=side, va="center", color="0.3")
    low = -1.45 * depth
    axis.annotate("", (0, low), (width, low), arrowprops={"arrowstyle": "<->", "lw": 0.7, "shrinkA": 0, "shrinkB": 0})
    axis.text(width / 2, low - 4, "λ", ha="center", va="top", bbox={"fc": "0.88", "ec": "none", "pad": 0.5}, zorder=4)
    axis.set(xlim=(left, right), ylim=(floor, 1.6 * depth), aspect=STRETCH / 1e3, anchor="N")
    axis.set(xlabel=ALONG, ylabel="height [µm]", title=f"B  At the contact, heights × {STRETCH}")


def _draw_response(axis: Axes, data: xr.Dataset) -> None:
    beyond = data.s.values >= data.attrs["contact"]
    s = data.s.values[beyond]
    for colour, line in zip(ordered(data.sizes["passage"]), data.passage_response.values[:, beyond], strict=True):
        axis.plot(s, line, color=colour, lw=0.9)
    axis.plot(s, data.unit_response.values[beyond], "k--", lw=1.1, label="linear, Ū")
    axis.plot([], [], color=STAGES[0], lw=0.9, label="exact, t₁")
    axis.plot([], [], color=STAGES[2], lw=0.9, label="t₃")
    axis.set(xlabel="s, from the cone's tip on", ylabel="(U − U₁)/d", title="C  Displacement over d")
    key_above(axis)


def _draw_excursion(axis: Axes, data: xr.Dataset) -> None:
    t, events = 1e3 * data.time.values, 1e3 * data.event_time.values
    scale = data.attrs["whisker_length"] / data.attrs["gap_width"]
    axis.plot(t, scale * data.excursion.values, color="0.1")
    d2 = data.attrs["excursion_at_jump"] / data.attrs["gap_width"]
    for time, side, number in zip(events, ("right", "left", "left"), "₁₂₃", strict=True):
        axis.axvline(time, color="0.7", lw=0.7, zorder=0)
        axis.text(time, 0.2, f" t{number} ", ha=side, color="0.3")
    places = ((events[0], 0.0), (events[1], d2), (events[1], d2 - 1))
    offsets = ((-16, -13), (5, -3), (6, -4))
    for place, offset, colour, number in zip(places, offsets, STAGES, "₁₂₃", strict=True):
        axis.plot(*place, "o", color=colour, ms=4.5, zorder=3)
        axis.annotate(f"U{number}", place, offset, textcoords="offset points", color=colour)
    axis.text(events[1] + 0.4 * np.ptp(events), d2 - 0.72, "slope +v", color="0.3", ha="left", va="top")
    axis.set(xlim=(t[0], events[2] + (events[0] - t[0])), ylim=(-1.1, 0.28), xlabel="time after t₁ [ms]")
    axis.set(ylabel="excursion d / λ", title=f"D  Excursion: d₂ = {d2:.3f} λ")


def _draw_mode(axis: Axes, data: xr.Dataset) -> None:
    t = 1e3 * data.time.values
    exact, linear = data.sel(form="exact"), data.sel(form="linear")
    axis.plot(t, 1e3 * exact.mode_displacement[0], color=PREDICTED, lw=1.3, label="q₁ + Q₁, exact")
    axis.plot(t, 1e3 * linear.mode_displacement[0], "--", color=PREDICTED, lw=0.9, label="q₁ + Q₁, linear")
    axis.plot(t, 1e3 * exact.mode_amplitude[0], ":", color=PREDICTED, lw=1.3, label="q₁, exact")
    axis.set(xlim=(t[0], t[-1]), xlabel="time after t₁ [ms]", ylabel="mode 1 [10⁻³ L]", title="E  First mode")
    key_above(axis, columns=2)


def _draw_jumps(axis: Axes, data: xr.Dataset) -> None:
    mode, jump = data["mode"].values, 1e3 * data.mode_jump
    exact, linear = jump.sel(form="exact").values, jump.sel(form="linear").values
    axis.bar(mode - 0.19, linear, 0.36, facecolor="white", edgecolor=PREDICTED, label="linear")
    axis.bar(mode + 0.19, exact, 0.36, color=PREDICTED, label="exact")
    for x, value, other in zip(mode + 0.03, exact, linear, strict=True):
        words = f"{value / other:.2f}".replace("-", "−")
        axis.annotate(words, (x, max(value, 0)), (0, 3), textcoords="offset points")
    axis.axhline(0, color="0.3", lw=0.7)
    axis.set(xticks=mode, xlabel="mode", ylabel="jump of q [10⁻³ L]", title="F  Jump at t₂; exact over linear")
    key_above(axis)
