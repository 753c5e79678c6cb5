"""Figure 1: the whisker as a truncated cone, cones through measured diameters, profiles at rest and Eq. 1."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Complex
from vibrissa.figures.canvas import add_caption, house_style, new_figure, split
from vibrissa.figures.paper.parts import fig1_panels as panels
from vibrissa.figures.sources import MODEL, MOVIE, of_sweeps, printed_name
from vibrissa.figures.words import with_error
from vibrissa.mechanics.inverse.profile_fit import mean_course
from vibrissa.mechanics.inverse.substrate_frame import SubstrateFrame
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Series
from vibrissa.video.profile.tangent import parabola
from vibrissa.whisker import Whisker, from_diameters, isolated_whiskers

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


PAPER_WHISKERS = ("beta", "C1", "C2")
MOST = 3  # whiskers of the sweeps
WINDOW = 3e-3  # of the visible end that the paper's polynomial is fitted to [m]
CHORD = 1e-3  # over which the measured angle is taken [m]
OVER_A_TEXTURE = (
    "The mean profile is assumed to be the profile at rest. Over a texture the contact hangs back: in the model of one "
    "contact and on the paper's gratings ε is then too large by some 0.003 and θ_b too small by some 0.02 rad, which "
    "the errors given do not include."
)
ENDS = ("", "_contact", "_r2")
_POINTS = 60


def compute(
    profile: xr.Dataset,
    found: xr.Dataset,
    whisker: Whisker,
    *,
    diameters: Mapping[str, xr.Dataset] | None = None,
    still: xr.Dataset | None = None,
    contact_true: float = np.nan,
    sweeps: xr.Dataset | None = None,
    series: Series | None = None,
) -> xr.Dataset:
    """Cones and profiles of the figure.

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
        Name → ``distance``, ``diameter`` (point), as ``vibrissa.whisker.read_diameters`` gives them. By default β,
        C1 and C2 of one animal, measured at base and tip by [Hartmann2003]_.
    still : Dataset, optional
        ``image`` (image_row, image_column) of the movie; then the profile has a ``pixel_size``.
    contact_true : float
        ε, where it is known.
    sweeps : Dataset, optional
        Table of sweeps of several whiskers.
    series : callable, optional
        Number of a sweep → its ``course_along``, ``course_height``; needed with ``sweeps``.

    Returns
    -------
    Dataset
        ``cone_distance``, ``cone_diameter`` (cone, cone_point), ``cone_length``, ``cone_base`` (cone);
        ``course_x``, ``course_y``, ``course_s``, ``course_angle`` (course_node), the mean profile; ``fitted_x``,
        ``fitted_y``, ``angle`` (s), Eq. 1; ``parabola_x`` … (parabola_point), the paper's extrapolation, empty where
        it has no point along the substrate. Of up to three whiskers of the sweeps (other) ``other_course_x``,
        ``other_course_y`` (other, other_node), ``other_fitted_x``, ``other_fitted_y`` (other, other_s), along the
        substrate from the contact and above it, and ``other_contact``, ``other_r2``. Attributes: what was found,
        ``contact_parabola``, ``caption``.
    """
    course = mean_course(profile)
    place = course.place.conj() if course.mirrored else course.place
    curve = found.fitted_x.values + 1j * found.fitted_y.values
    frame = SubstrateFrame(curve)
    picture: dict[str, Any] = {
        name: still[name].values for name in ("image_row", "image_column", "image") if still is not None
    }
    extrapolated = _extrapolated(frame, place, course.arc, whisker.length)
    middle, angle = _angles(frame.from_image(place), course.arc)
    s = found.s.values
    facts = _facts(profile, found, whisker, extrapolated, contact_true, diameters is None)
    others = {} if sweeps is None or series is None else _others(sweeps, series)
    return dataset(
        {**facts, "caption": _caption(facts, others, of_sweeps(sweeps))},
        **others,
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


def _cones(diameters: Mapping[str, xr.Dataset] | None) -> dict[str, Any]:
    """Diameters, padded with NaN, and the straight lines through them."""
    if diameters is None:
        ends = [one for one in isolated_whiskers() if one.name in PAPER_WHISKERS]
        names, lengths, bases = zip(*((one.name, one.length, one.base_diameter) for one in ends), strict=True)
        rows = [(np.array([0, one.arc_length]), np.array([one.base_diameter, one.tip_diameter])) for one in ends]
    else:
        fits = [from_diameters(d.distance.values, d.diameter.values).whisker for d in diameters.values()]
        rows = [(d.distance.values, d.diameter.values) for d in diameters.values()]
        names = tuple(diameters)
        lengths, bases = tuple(f.length for f in fits), tuple(2 * f.base_radius for f in fits)
    points = np.full((2, len(rows), max(len(x) for x, _ in rows)), np.nan)
    for i, (x, d) in enumerate(rows):
        points[:, i, : len(x)] = x, d
    columns = {"cone_distance": points[0], "cone_diameter": points[1]}
    return columns | {"cone": list(names), "cone_length": list(lengths), "cone_base": list(bases)}


def _others(sweeps: xr.Dataset, series: Series) -> dict[str, Any]:
    """Mean profile and Eq. 1 of the first accepted sweep of each whisker; nothing where none is stored."""
    first = {str(sweeps.whisker_name[i].values): i for i in np.flatnonzero(sweeps.accepted.values)[::-1]}
    pairs = [(name, sweeps.isel(sweep=i), series(int(sweeps.sweep[i]))) for name, i in sorted(first.items())]
    pairs = [(name, row, one) for name, row, one in pairs if "course_along" in one][:MOST]
    if not pairs:
        return {}
    rows = [row for _, row, _ in pairs]
    nodes = max(one.course_along.size for *_, one in pairs)
    course = np.full((2, len(pairs), nodes), np.nan)
    for k, (*_, one) in enumerate(pairs):
        course[:, k, : one.course_along.size] = one.course_along, one.course_height
    fitted = np.array([_laid_out(row) for row in rows])
    return {
        "other": [name for name, *_ in pairs],
        "other_course_x": course[0],
        "other_course_y": course[1],
        "other_fitted_x": fitted[:, 0],
        "other_fitted_y": fitted[:, 1],
        "other_contact": [float(row.contact) for row in rows],
        "other_r2": [float(row.profile_r2) for row in rows],
    }


def _laid_out(row: xr.Dataset) -> Array:
    """Profile of Eq. 1 of a sweep, along the substrate from the contact and above it [m], (2, S)."""
    posture = Posture(contact=float(row.contact), base_angle=float(row.base_angle))
    curve = stationary_profile(posture, np.linspace(posture.contact, 1, _POINTS))
    place = np.array([curve.profile_x.values, curve.profile_y.values])
    return float(row.length) * (place - place[:, :1])


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


def _extrapolated(frame: SubstrateFrame, place: Complex, arc: Array, length: float) -> dict[str, Any]:
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
    profile: xr.Dataset, found: xr.Dataset, whisker: Whisker, line: Mapping[str, Any], true: float, of_one_rat: bool
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
        "of_one_rat": of_one_rat,
        "source": MODEL if np.isfinite(true) else MOVIE,
    }


def _caption(facts: Mapping[str, Any], others: Mapping[str, Any], of_others: str) -> str:
    source = (
        "β, C1 and C2 of one rat, measured at two points each, base and tip, so that they do not test whether the "
        "whisker is a cone (Hartmann et al. 2003; the whiskers of a virtual study are given by L and α)"
        if facts["of_one_rat"]
        else "as measured"
    )
    miss = (facts["contact_parabola"] - facts["contact"]) * facts["whisker_length"] * 1e3
    parabola_text = (
        f"the paper's second-degree polynomial through the last {WINDOW * 1e3:g} mm that are seen puts the contact "
        f"{abs(miss):.2f} mm {'nearer the base' if miss > 0 else 'nearer the tip'}"
        if np.isfinite(miss)
        else "the paper's polynomial of degree 2 is not drawn: it is nowhere tangent to the substrate"
    )
    texture = (
        f"mean profile, without the mean displacement that the texture imposes in the model of one contact (mean "
        f"excursion {1e3 * facts['mean_excursion']:+.2f} mm),".replace("-", "−")
        if np.isfinite(facts["mean_excursion"])
        else "mean profile"
    )
    return (
        f"Figure 1. C{', left,' if others else ''} and D: {facts['source']}; {_of_others(others, of_others)}B: "
        "measured. A, the whisker as a truncated cone; thickness not to scale. B, diameter against the distance from "
        f"the base, {source}; dashed: the line continued beyond the last point to the cone's tip (black dot), which "
        f"gives L, and its slope gives α; inset: the longest whiskers there. C, {texture} and Eq. 1 fitted to it: ε = "
        f"{with_error(facts['contact'], facts['contact_se'])}, θ_b = "
        f"{with_error(facts['base_angle'], facts['base_angle_se'])} rad, H = {1e3 * facts['base_height']:.1f} mm; R² "
        f"of the angle {facts['profile_r2']:.3f}; {parabola_text}. {_others_words(others)} Not in the "
        "paper: D, the profile of C as angle to the substrate, which is 0 at the contact."
        + _truth_words(facts["contact_true"])
        + ("" if np.isfinite(facts["mean_excursion"]) else f" {OVER_A_TEXTURE}")
    )


def _of_others(others: Mapping[str, Any], source: str) -> str:
    return f"C, right: {source}; " if others else ""


def _truth_words(true: float) -> str:
    return f" Cross: the true contact, ε = {true:.4f}." if np.isfinite(true) else ""


def _others_words(others: Mapping[str, Any]) -> str:
    if not others:
        return "One whisker is followed: there are no sweeps of others."
    each = (
        f"{printed_name(n)} ε = {e:.3f}, R² = {r:.2f}"
        for n, e, r in zip(*(others[f"other{k}"] for k in ENDS), strict=True)
    )
    return (
        f"Right: one sweep of each whisker ({'; '.join(each)}), mean profiles and Eq. 1 in the frame of the substrate, "
        "each from its contact; what lies on the substrate is the free end."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A and B above; C, its other whiskers if there are any, and D below.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(9.0, 6.0, 2, 1)
    above = split(figure, axes[0, 0], widths=[1.2, 1])
    several = "other" in data
    below = split(figure, axes[1, 0], widths=[1.3, 1, 1] if several else [1.4, 1])
    panels.draw_sketch(above[0], data)
    panels.draw_cones(above[1], data)
    panels.draw_profile(below[0], data)
    if several:
        panels.draw_others(below[1], data)
    panels.draw_angle(below[-1], data)
    return add_caption(figure, data)
