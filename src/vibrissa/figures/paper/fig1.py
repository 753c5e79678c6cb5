"""Figure 1: the whisker as a truncated cone, the cones behind measured diameters, the profile at rest and Eq. 1."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Complex
from vibrissa.figures.canvas import FOUND, OTHER, TRUTH, add_caption, house_style, new_figure
from vibrissa.mechanics.inverse.profile_fit import mean_course
from vibrissa.quantities import dataset
from vibrissa.video.profile.tangent import parabola
from vibrissa.whisker import Whisker, atlas, from_diameters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


PAPER_WHISKERS = ("beta", "C1", "C2")
WINDOW = 3e-3  # of the visible end that the paper's polynomial is fitted to [m]
CHORD = 1e-3  # over which the measured angle is taken [m]
OVER_A_TEXTURE = (
    "The mean profile is taken for the profile at rest. Over a texture the contact hangs back: in the model of one "
    "contact and on the paper's gratings ε is then too large by some 0.003 and θ_b too small by some 0.02 rad, which "
    "the errors given do not include."
)
_POINTS = 60
LINES = (  # of C, and their looks in D too
    ("course", "-", TRUTH, 4.0, "mean profile"),
    ("fitted", "-", FOUND, 1.2, "Eq. 1"),
    ("parabola", "--", OTHER, 1.2, "polynomial of degree 2"),
)
ANGLES = (("course_s", "course_angle"), ("s", "angle"), ("parabola_s", "parabola_angle"))
_THIN = {"arrowstyle": "-", "lw": 0.6, "color": "0.5"}


def compute(
    profile: xr.Dataset,
    found: xr.Dataset,
    whisker: Whisker,
    *,
    diameters: Mapping[str, xr.Dataset] | None = None,
    still: xr.Dataset | None = None,
    contact_true: float = np.nan,
) -> xr.Dataset:
    """Cones and profile of the figure.

    Parameters
    ----------
    profile : Dataset
        One whisker, tracked: ``x``, ``y`` (time, node), ``arc_length``; without the mean displacement by the texture
        where ``found`` has been fitted so.
    found : Dataset
        From :func:`vibrissa.mechanics.inverse.stationary_posture.fit_profile`; with ``mean_excursion`` the mean
        displacement by the texture was removed before.
    whisker : Whisker
        Its cone.
    diameters : mapping, optional
        Name → ``distance``, ``diameter`` (point), as :func:`vibrissa.whisker.read_diameters` gives them. By default β,
        C1 and C2 of the atlas, whose mean cones are known by both ends alone.
    still : Dataset, optional
        ``image`` (image_row, image_column) of the movie; then the profile has a ``pixel_size``.
    contact_true : float
        ε, where it is known.

    Returns
    -------
    Dataset
        ``cone_distance``, ``cone_diameter`` (cone, cone_point), ``cone_length``, ``cone_base`` (cone);
        ``course_x``, ``course_y``, ``course_s``, ``course_angle`` (course_node), the mean profile; ``fitted_x``,
        ``fitted_y``, ``angle`` (s), Eq. 1; ``parabola_x`` … (parabola_point), the paper's extrapolation, empty where
        it has no point along the substrate. Attributes: what was found, ``contact_parabola``, ``caption``.
    """
    course = mean_course(profile)
    place = course.place.conj() if course.mirrored else course.place
    curve = found.fitted_x.values + 1j * found.fitted_y.values
    frame = _Frame(curve)
    picture: dict[str, Any] = {
        name: still[name].values for name in ("image_row", "image_column", "image") if still is not None
    }
    extrapolated = _extrapolated(frame, place, course.arc, whisker.length)
    middle, angle = _angles(frame.from_image(place), course.arc)
    s = found.s.values
    facts = _facts(profile, found, whisker, extrapolated, contact_true, diameters is None)
    return dataset(
        {**facts, "caption": _caption(facts)},
        **_cones(diameters),
        **picture,
        course_x=place.real,
        course_y=place.imag,
        course_s=1 - middle / whisker.length,
        course_angle=angle,
        course_residual=_across(frame.from_image(place), frame.from_image(curve), s, 1 - course.arc / whisker.length),
        s=s,
        fitted_x=curve.real,
        fitted_y=curve.imag,
        angle=np.unwrap(np.angle(np.gradient(frame.from_image(curve)))),
        **extrapolated,
    )


class _Frame:
    """The frame of the substrate: real along it towards the base, imaginary above it, 0 at the contact."""

    def __init__(self, curve: Complex) -> None:
        self._contact, self._along = curve[0], (curve[1] - curve[0]) / abs(curve[1] - curve[0])
        self._mirrored = bool(((curve[-1] - curve[0]) / self._along).imag < 0)

    def from_image(self, z: Complex) -> Complex:
        turned = (z - self._contact) / self._along
        return np.conj(turned) if self._mirrored else turned

    def to_image(self, z: Complex) -> Complex:
        return (np.conj(z) if self._mirrored else z) * self._along + self._contact


def _cones(diameters: Mapping[str, xr.Dataset] | None) -> dict[str, Any]:
    """Diameters, padded with NaN, and the straight lines through them."""
    if diameters is None:
        entries = [entry for entry in atlas() if entry.name in PAPER_WHISKERS]
        names, lengths = [e.name for e in entries], [e.length for e in entries]
        bases = [2 * e.cone_angle * e.length for e in entries]
        rows = [([0, e.length * (1 - e.tip)], [base, base * e.tip]) for e, base in zip(entries, bases, strict=True)]
    else:
        fits = [from_diameters(d.distance.values, d.diameter.values).whisker for d in diameters.values()]
        rows = [(d.distance.values, d.diameter.values) for d in diameters.values()]
        names, lengths, bases = list(diameters), [f.length for f in fits], [2 * f.base_radius for f in fits]
    points = np.full((2, len(rows), max(len(x) for x, _ in rows)), np.nan)
    for i, (x, d) in enumerate(rows):
        points[:, i, : len(x)] = x, d
    columns = {"cone_distance": points[0], "cone_diameter": points[1]}
    return columns | {"cone": names, "cone_length": lengths, "cone_base": bases}


def _angles(z: Complex, arc: Array) -> tuple[Array, Array]:
    """Middle of chords of about a millimetre, and their angle to the substrate; NaN at the very ends."""
    step = max(1, round(CHORD / float(np.median(np.diff(arc)))) // 2)
    angle, middle = np.full(arc.size, np.nan), arc.copy()
    angle[step:-step] = np.unwrap(np.angle(z[: -2 * step] - z[2 * step :]))
    middle[step:-step] = (arc[: -2 * step] + arc[2 * step :]) / 2
    return middle, angle


def _across(place: Complex, curve: Complex, s: Array, at: Array) -> Array:
    way = np.interp(at, s, np.unwrap(np.angle(np.gradient(curve))))
    return np.asarray((np.exp(-1j * way) * (place - np.interp(at, s, curve))).imag)


def _extrapolated(frame: _Frame, place: Complex, arc: Array, length: float) -> dict[str, Any]:
    """The paper's polynomial from the visible end to where it runs along the substrate."""
    use = arc >= arc[-1] - WINDOW
    z = frame.from_image(place[use])
    end, at, height = parabola(z.real, z.imag, arc[use], np.ones(int(use.sum())))
    if not np.isfinite(end):
        return {f"parabola_{name}": np.zeros(0) for name in ("x", "y", "s", "angle")}
    u = np.linspace(z.real[0], at, _POINTS)
    bend = np.polyfit(z.real - at, z.imag, 2)[0]
    curve = u + 1j * (height + bend * (u - at) ** 2)
    image = frame.to_image(curve)
    back = np.append(0, np.cumsum(np.abs(np.diff(curve[::-1]))))[::-1]
    along = {"parabola_s": 1 - (end - back) / length, "parabola_angle": np.arctan(2 * bend * (u - at))}
    return {"parabola_x": image.real, "parabola_y": image.imag, **along}


def _facts(
    profile: xr.Dataset, found: xr.Dataset, whisker: Whisker, line: Mapping[str, Any], true: float, of_atlas: bool
) -> dict[str, Any]:
    names = ("contact", "contact_se", "base_angle", "base_angle_se", "base_height", "profile_r2")
    return {
        **{name: float(found[name]) for name in names},
        "mean_excursion": float(found["mean_excursion"]) if "mean_excursion" in found else np.nan,
        "contact_true": true,
        "contact_parabola": float(line["parabola_s"][-1]) if line["parabola_s"].size else np.nan,
        "whisker_length": whisker.length,
        "tip": whisker.tip,
        "pixel_size": float(profile.attrs.get("pixel_size", np.nan)),
        "of_atlas": of_atlas,
    }


def _caption(facts: Mapping[str, Any]) -> str:
    source = "both ends of the atlas's mean cones" if facts["of_atlas"] else "the points measured"
    miss = (facts["contact_parabola"] - facts["contact"]) * facts["whisker_length"] * 1e3
    parabola_text = (
        f"the second-degree polynomial through the last {WINDOW * 1e3:g} mm that are seen puts the contact "
        f"{abs(miss):.2f} mm {'nearer the base' if miss > 0 else 'nearer the tip'}"
        if np.isfinite(miss)
        else "the second-degree polynomial has no point along the substrate"
    )
    texture = (
        f"mean profile, without the mean displacement that the texture imposes in the model of one contact (mean "
        f"excursion {1e3 * facts['mean_excursion']:+.2f} mm),".replace("-", "−")
        if np.isfinite(facts["mean_excursion"])
        else "mean profile"
    )
    return (
        f"Figure 1. A, the whisker as a truncated cone (thickness not to scale). B, diameter against the distance "
        f"from the base: straight lines through {source}, carried on (dashed) to the cone's tip, which gives L. C, "
        f"{texture} and Eq. 1 fitted to it: ε = {facts['contact']:.4f} ± {facts['contact_se']:.1g}, θ_b = "
        f"{facts['base_angle']:.3f} ± {facts['base_angle_se']:.1g} rad, H = {1e3 * facts['base_height']:.1f} mm; "
        f"R² of the angle {facts['profile_r2']:.3f}; {parabola_text}. D, the same as angle to the substrate."
        + ("" if np.isfinite(facts["mean_excursion"]) else f" {OVER_A_TEXTURE}")
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Four panels.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(9.0, 6.6, 2, 2)
    _draw_sketch(axes[0, 0], data)
    _draw_cones(axes[0, 1], data)
    _draw_profile(axes[1, 0], data)
    _draw_angle(axes[1, 1], data)
    return add_caption(figure, data, 7)


def _draw_sketch(axis: Axes, data: xr.Dataset) -> None:
    tip, contact = data.attrs["tip"], data.attrs["contact"]
    axis.fill([tip, 1, 1, tip], np.array([tip, 1, -1, -tip]) / 2, color="0.85", ec="0.3", lw=0.8)
    axis.plot([0, tip, np.nan, 0, tip], np.array([0, tip, np.nan, 0, -tip]) / 2, "--", color="0.5", lw=0.8)
    axis.plot([0, 1], [0, 0], ":", color="0.5", lw=0.7)
    axis.plot([contact], [-contact / 2], "^", color=OTHER, ms=6)
    about: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "color": OTHER}
    axis.annotate("contact, s = ε", (contact, -contact / 2), (0, -14), **about)
    axis.annotate("", (0, -0.72), (1, -0.72), arrowprops={"arrowstyle": "<->", "lw": 0.8})
    axis.text(0.5, -0.7, "L", ha="center", va="bottom")
    axis.annotate("", (1.04, -0.5), (1.04, 0.5), arrowprops={"arrowstyle": "<->", "lw": 0.8})
    axis.text(1.06, 0, "2b = 2αL", va="center")
    axis.text(0, -0.12, "s = 0", ha="center")
    axis.annotate("physical tip", (tip, tip / 2), (6, 26), textcoords="offset points", color="0.3", arrowprops=_THIN)
    axis.text(1, 0.54, "s = 1, skin", ha="center")
    axis.text(0.62, 0.06, "α", color="0.3")
    axis.set(xlim=(-0.08, 1.28), ylim=(-0.85, 0.75), title="A  Truncated cone")
    axis.axis("off")


def _draw_cones(axis: Axes, data: xr.Dataset) -> None:
    for i, name in enumerate(data.cone.values):
        distance, diameter = 1e3 * data.cone_distance[i], 1e6 * data.cone_diameter[i]
        (line,) = axis.plot(distance, diameter, "-o", ms=2.5, label=str(name))
        length, base = 1e3 * float(data.cone_length[i]), 1e6 * float(data.cone_base[i])
        axis.plot([0, length], [base, 0], "--", color=line.get_color(), lw=0.8)
        axis.plot([length], [0], "o", color="k", ms=4, clip_on=False, zorder=3)
    axis.set(xlabel="distance from the base [mm]", ylabel="diameter [µm]", xlim=(0, None), ylim=(0, None))
    axis.set_title("B  Diameters and cones; black: L")
    axis.legend()


def _draw_profile(axis: Axes, data: xr.Dataset) -> None:
    if known := "image" in data:
        size = 1e3 * data.attrs["pixel_size"]
        rows, columns = data.image.shape
        extent = (-0.5 * size, (columns - 0.5) * size, (rows - 0.5) * size, -0.5 * size)
        axis.imshow(data.image, extent=extent, cmap="gray")
    for name, style, colour, width, label in LINES:
        axis.plot(1e3 * data[f"{name}_x"], 1e3 * data[f"{name}_y"], style, color=colour, lw=width, label=label)
    ends = np.array([1e3 * data.fitted_x.values[:2], 1e3 * data.fitted_y.values[:2]])
    along = (ends[:, 1] - ends[:, 0]) / np.hypot(*(ends[:, 1] - ends[:, 0]))
    line = ends[:, :1] + along[:, None] * np.array([-4.0, 8.0])
    axis.plot(*line, color="#009E73", lw=1, label="substrate")
    axis.plot(*ends[:, :1], "o", color=FOUND, ms=4)
    axis.set(xlabel="x [mm]", ylabel="y [mm]", title="C  Mean profile", aspect="equal")
    if not known:
        axis.invert_yaxis()
    axis.legend(loc="best", frameon=known, framealpha=0.8)


def _draw_angle(axis: Axes, data: xr.Dataset) -> None:
    for (_, style, colour, width, _), (s, angle) in zip(LINES, ANGLES, strict=True):
        axis.plot(data[s], data[angle], style, color=colour, lw=width)
    axis.axhline(0, color="0.3", lw=0.7)
    axis.plot([data.attrs["contact"]], [0], "o", color=FOUND, ms=4, clip_on=False)
    if np.isfinite(data.attrs["contact_true"]):
        axis.plot([data.attrs["contact_true"]], [0], "x", color="k", ms=7, label="true contact")
        axis.legend()
    axis.set(xlabel="s", ylabel="θ [rad]", xlim=(0, 1), title="D  Angle to the substrate")
