"""Figure 7E of the model: the gain over base angle and contact, in the linear and in the exact response."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.figures.canvas import add_caption, house_style, key_above, new_figure
from vibrissa.figures.colours import PAPER as PAPER_COLOUR
from vibrissa.figures.colours import ordered
from vibrissa.mechanics.quasi_static.response import Form
from vibrissa.quantities import dataset
from vibrissa.sweep.grid import Grid, Measure
from vibrissa.sweep.maps import REASONS, sweep
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import DAMPING

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    from vibrissa.whisker import Whisker

FORMS = get_args(Form)[::-1]  # the paper's first
GAP = 1e-3  # [m], the paper's
SPEED, FRICTION = 0.1, 0.4
CONTACTS, ANGLES = np.linspace(0.08, 0.4, 100), np.linspace(0.8, 1.5, 100)
LINES = {"contact": (0.15, 0.2, 0.29, 0.4), "base_angle": (0.8, 1.0, 1.2, 1.4)}  # drawn as lines
PAPER = (0.8, 1.4)  # [rad] between which the measured gain at most doubles
WIDE, NARROW = 0.29, 0.15  # contacts between which the caption follows the gain
LEAST_CONTACT = 0.1  # of the linear form, as the paper states; its largest angle is the same 1.4 rad
LOOKS = (("exact", "-"), ("linear", "--"))  # of lines
GREY = ("0.55", "0.8")  # beyond the fold; no profile across the gap


def compute(
    whisker: Whisker, *, contacts: ArrayLike = CONTACTS, base_angles: ArrayLike = ANGLES, gap_width: float = GAP
) -> xr.Dataset:
    """Largest displacement at s = 0.9 that one gap causes, in both forms of the response.

    Parameters
    ----------
    whisker : Whisker
        What crosses the gap, at 0.1 m/s, with ζ = 0.11 and μ = 0.4.
    contacts, base_angles : arrays
        Axes of the map, ε over L and θ_b [rad].
    gap_width : float
        Width λ [m].

    Returns
    -------
    Dataset
        ``peak_displacement`` (form, friction, speed, contact, base_angle), NaN where ``cell_reason`` says why;
        ``exact_over_linear`` of the two; ``line_gain_angle`` (form, line, base_angle) at the contacts ``line_contact``
        and ``line_gain_contact`` (form, line, contact) at the angles ``line_angle``. Attribute ``caption``.
    """
    maps = {form: _map(whisker, contacts, base_angles, gap_width, form) for form in FORMS}
    one = maps["exact"]
    peak = np.stack([maps[form].peak_displacement.values for form in FORMS])
    by_angle = [_map(whisker, LINES["contact"], base_angles, gap_width, form) for form in FORMS]
    by_contact = [_map(whisker, contacts, LINES["base_angle"], gap_width, form) for form in FORMS]
    columns: dict[str, Any] = {
        "peak_displacement": peak,
        "cell_reason": np.stack([maps[form].cell_reason.values for form in FORMS]),
        "exact_over_linear": (peak[FORMS.index("exact")] / peak[FORMS.index("linear")])[0, 0],
        "line_gain_angle": np.stack([each.peak_displacement.values[0, 0] for each in by_angle]),
        "line_gain_contact": np.stack([each.peak_displacement.values[0, 0].T for each in by_contact]),
    }
    data = dataset(
        one.attrs | {"scan_speed": SPEED, "response": "both"},
        lead=("form",),
        form=list(FORMS),
        friction=[FRICTION],
        speed=[SPEED],
        line_contact=LINES["contact"],
        line_angle=LINES["base_angle"],
        **columns,
    )
    data = data.assign_coords(contact=one.contact, base_angle=one.base_angle)
    return data.assign_attrs(caption=_caption(whisker, gap_width))


def _map(whisker: Whisker, contacts: ArrayLike, base_angles: ArrayLike, gap_width: float, form: Form) -> xr.Dataset:
    grid = Grid(contact=contacts, base_angle=base_angles, speed=[SPEED], friction=[FRICTION])
    gap = Gaps(position=np.zeros(1), width=np.array([gap_width]))
    return sweep(whisker, gap, grid, Measure(response=form, damping=DAMPING))


def _caption(whisker: Whisker, gap_width: float) -> str:
    """What rises with θ_b and with ε, from maps of a few cells."""
    contacts = [NARROW, 0.2, WIDE, 0.4]
    corners = {form: _map(whisker, contacts, PAPER, gap_width, form).peak_displacement[0, 0] for form in FORMS}

    def rise(form: str) -> str:
        return " | ".join(f"{float(row[1] / row[0]):.1f}" for row in corners[form][1:])

    def fall(form: str) -> str:
        return "{:.2f} and {:.2f}".format(*(corners[form].sel(contact=NARROW) / corners[form].sel(contact=WIDE)).values)

    over = " | ".join(f"{float(row[1]):.1f}" for row in corners["linear"] / corners["exact"])
    return (
        f"Figure 7E. Computed with the one-contact model (cone of {1e3 * whisker.length:.0f} mm, ζ = {DAMPING}, μ = "
        f"{FRICTION}, 12 modes). Largest transverse displacement at s = 0.9 when one gap of {1e3 * gap_width:g} mm is "
        f"crossed at {1e3 * SPEED:.0f} mm/s, over base angle and contact; one logarithmic scale of colours for both "
        "responses. Left, the linear response of the paper; middle, the exact one; right, "
        "exact over linear. Dark grey: beyond the fold, where there is no quasi-static response; light grey: the fold "
        "is met on the way across the gap. Dotted: the limits of validity that the paper states. Below, lines through "
        "the maps, exact full and linear dashed; grey band: the paper's measurement. "
        f"From θ_b = 0.8 to 1.4 rad the gain grows by × {rise('linear')} (linear) and × {rise('exact')} (exact) "
        "at ε = 0.2 | 0.29 | 0.4; measured in the paper: up to × 2. "
        f"From ε = {WIDE} to {NARROW}, at 0.8 and 1.4 rad, it changes by × {fall('linear')} (linear) and "
        f"× {fall('exact')} (exact); measured, but as rms of mode 1: a slight rise. "
        f"Linear over exact at 1.4 rad: {over} at ε = {NARROW} | 0.2 | 0.29 | 0.4."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Above, both maps on one scale and their ratio; below, lines of them.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    from matplotlib.colors import LogNorm, Normalize

    figure, axes = new_figure(9.0, 5.6, 2, 3)
    length = 1e6 * data.attrs["whisker_length"]
    both = LogNorm(*(length * float(end) for end in (data.peak_displacement.min(), data.peak_displacement.max())))
    for axis, form in zip(axes[0], FORMS, strict=False):
        mesh = _draw_map(axis, data, length * data.peak_displacement.sel(form=form)[0, 0], both, "viridis")
        axis.set_title(f"E  {str(form).capitalize()}" if form == FORMS[0] else str(form).capitalize())
    figure.colorbar(mesh, ax=axes[0, :2].tolist(), label="largest displacement [µm]")
    mesh = _draw_map(axes[0, 2], data, data.exact_over_linear, Normalize(0, 1), "cividis")
    axes[0, 2].set_title("Exact over linear")
    figure.colorbar(mesh, ax=axes[0, 2])
    axes[0, 0].set_ylabel("contact ε")
    axes[1, 1].sharey(axes[1, 0])
    _draw_lines(axes[1, 0], data, length * data.line_gain_angle, "line_contact")
    _draw_lines(axes[1, 1], data, length * data.line_gain_contact, "line_angle")
    axes[1, 0].set(xlabel="base angle θ$_b$ [rad]", title="At contacts ε")
    axes[1, 1].set(xlabel="contact ε", title="At base angles θ$_b$ [rad]")
    _draw_relative(axes[1, 2], data)
    for axis in axes[1]:
        key_above(axis, columns=4)
    return add_caption(figure, data)


def _draw_map(axis: Axes, data: xr.Dataset, values: xr.DataArray, scale: Normalize, colours: str) -> Any:
    """One map; grey where there is no value."""
    from matplotlib.colors import ListedColormap

    reason = data.cell_reason.sel(form="exact")[0]
    shade = np.where(reason == REASONS.index("beyond the fold"), 0.0, np.where(reason == 0, np.nan, 1.0))
    axis.pcolormesh(data.base_angle, data.contact, shade, cmap=ListedColormap(GREY), vmin=0, vmax=1, rasterized=True)
    mesh = axis.pcolormesh(data.base_angle, data.contact, values, cmap=colours, norm=scale, rasterized=True)
    axis.axvline(PAPER[1], color="black", lw=1.0, ls=":")
    axis.axhline(LEAST_CONTACT, color="black", lw=1.0, ls=":")
    axis.set(xlabel="base angle θ$_b$ [rad]")
    return mesh


def _draw_lines(axis: Axes, data: xr.Dataset, values: xr.DataArray, line: str) -> None:
    """Exact lines full, linear ones dashed."""
    along = data[str(values.dims[-1])]
    for i, colour in enumerate(ordered(data.sizes["line"])):
        for form, style in LOOKS:
            label = f"{float(data[line][i]):g}" if form == "exact" else None
            axis.plot(along, values.sel(form=form)[i], style, color=colour, label=label)
    axis.set(yscale="log", ylabel="largest displacement [µm]")


def _draw_relative(axis: Axes, data: xr.Dataset) -> None:
    """Gain over its value at the least base angle."""
    for i, colour in enumerate(ordered(data.sizes["line"])):
        for form, style in LOOKS:
            gain = data.line_gain_angle.sel(form=form)[i]
            axis.plot(data.base_angle, gain / gain[0], style, color=colour)
    for form, style in LOOKS:
        axis.plot([], [], style, color="k", label=form)
    axis.plot(PAPER, (1, 2), color=PAPER_COLOUR, lw=3, alpha=0.4, label="paper: up to × 2")
    axis.set(xlabel="base angle θ$_b$ [rad]", ylabel="gain over that at 0.8 rad", ylim=(0.9, 10), yscale="log")
    axis.set_yticks((1, 2, 3, 5, 10), ("1", "2", "3", "5", "10"))
    axis.set_yticks((), minor=True)
    axis.set_title("Gain over that at 0.8 rad")
