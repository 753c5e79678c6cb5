"""Figure 5C–D over sweeps: κ = kω against ε with one E for all, and that E by forcing, modes and identity."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, InputError
from vibrissa.exact import cone_kappa
from vibrissa.figures.canvas import P_VALUES, bars, key_above, p_words
from vibrissa.figures.colours import MEASURED, PAPER, PREDICTED, TRUTH
from vibrissa.figures.sources import printed_name
from vibrissa.figures.words import with_interval
from vibrissa.mechanics.across.collapse import USED, Forcing, collapse, expected_kappa
from vibrissa.mechanics.modes.basis import Modes
from vibrissa.quantities import dataset
from vibrissa.whisker import YOUNGS_MODULUS, atlas_whisker

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

FORCINGS: tuple[Forcing, ...] = ("texture", "white")
WORDS = {"texture": "the texture known", "white": "Eq. 5"}
KINDS: tuple[Modes, ...] = ("straight", "curved")
VARIANTS = {f"{forcing}, {modes}": (forcing, modes) for modes in KINDS for forcing in FORCINGS}
AIR = (8.72, 21.15)  # κ of the free cone, as the paper prints them
RIGHT = "C1"  # the whisker whose frequencies are on the right axis, the atlas's mean
_POINTS = 60


def collapsed(sweeps: xr.Dataset) -> xr.Dataset:
    """The collapse by the best forcing that is there, E by every variant, and κ_i(ε) to draw.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    Dataset
        As :func:`vibrissa.mechanics.across.collapse.collapse` of straight modes; ``variant`` (forcing, modes) with
        ``variant_modulus`` and its interval, ``variant_r2`` (variant, mode); ``curve_contact`` with ``curve_kappa`` and
        ``curve_kappa_curved`` (mode, curve_contact), the latter about the profile of the median base angle,
        ``base_angle`` [rad]; ``contact`` (sweep); ``identity_modulus_true`` (identity) where the sweeps are virtual.
        Empty if no sweep has a resonance.
    """
    found: dict[str, xr.Dataset] = {}
    for name, (forcing, modes) in VARIANTS.items():
        try:
            found[name] = collapse(sweeps, forcing=forcing, modes=modes)
        except InputError:  # no texture is known, or no posture has such modes
            continue
    if not found:
        return dataset(mode=np.arange(1, USED + 1))
    whole = next(iter(found.values()))
    some = sweeps.sel(sweep=whole.sweep.values)
    angle, contact = float(np.nanmedian(some.base_angle)), some.contact.values
    low, high = max(0.9 * np.nanmin(contact), 0.05), min(1.08 * np.nanmax(contact), 0.85)
    grid = np.linspace(low, high, _POINTS)
    ends = ("", "_low", "_high")
    columns: dict[str, Any] = {
        f"variant_modulus{end}": [float(one[f"youngs_modulus{end}"]) for one in found.values()] for end in ends
    }
    curves = dataset(
        base_angle=angle,
        mode=whole.mode.values,
        variant=list(found),
        variant_r2=[one.collapse_r2.values for one in found.values()],
        curve_contact=grid,
        curve_kappa=np.array([cone_kappa(float(one), USED) for one in grid]).T,
        curve_kappa_curved=_curved(grid, angle),
        **columns,
    )
    data = whole.merge(curves, combine_attrs="override").assign(contact=("sweep", contact))
    if "youngs_modulus_true" in some:
        names, true = some.whisker_name.values.astype(str), np.log(some.youngs_modulus_true.values)
        mean = [float(np.exp(true[names == name].mean())) for name in whole.identity.values]
        known = dataset(identity=whole.identity.values, identity_modulus_true=mean)
        data = data.merge(known, combine_attrs="override")
    return data


def _curved(grid: Array, angle: float) -> Array:
    """κ_i(ε) about the profile, one point sliding, (mode, ε); NaN where such a posture cannot be."""
    out = np.full((USED, len(grid)), np.nan)
    for k, contact in enumerate(grid.tolist()):
        try:
            out[:, k] = expected_kappa(contact, angle, "curved")
        except (InputError, ConvergenceError):
            continue
    return out


def each(values: Array, form: str) -> str:
    """Numbers as a caption lists them; a dash where not measured.

    Parameters
    ----------
    values : array
        Numbers; NaN where not measured.
    form : str
        Of a number, as ``format`` takes it.

    Returns
    -------
    str
        Separated by commas.
    """
    return ", ".join(format(one, form) if np.isfinite(one) else "–" for one in values.tolist())


def collapse_words(data: xr.Dataset) -> str:
    """E, its interval, R² and the identities, beside the paper's.

    Parameters
    ----------
    data : Dataset
        With what :func:`collapsed` gives.

    Returns
    -------
    str
        Of the caption.
    """
    r2 = "; ".join(
        f"{each(one.variant_r2.values[:USED], '.2f')} with {WORDS[forcing]}"
        for forcing in FORCINGS
        for one in [data.sel(variant=name) for name in data.variant.values if name == f"{forcing}, straight"]
    )
    p = [float(data[name].sel(term="whisker_name")) if "whisker_name" in data.term else np.nan for name in P_VALUES]
    kinds = np.array([str(one).rpartition(" ")[2] for one in data.variant.values])
    straight, curved = (data.variant_modulus.values[kinds == kind] for kind in KINDS)
    known = curved.size and np.isfinite(curved[0] / straight[0])
    more = f" Curved modes: {_gpa(curved[0])} GPa, {100 * (curved[0] / straight[0] - 1):+.0f} %." if known else ""
    pairs = zip(data.identity.values, data.identity_modulus.values, strict=True)
    names = "; ".join(f"{printed_name(str(name))} {_gpa(value)}" for name, value in pairs)
    true = "; grey, the truth" if "identity_modulus_true" in data else ""
    count = int(np.isfinite(data.kappa.values[:, 0]).sum())
    ends = (1e-9 * float(data[f"youngs_modulus{end}"]) for end in ("", "_low", "_high"))
    return (
        f" C, κ = kω with one E for {count} sweep{'s' * (count != 1)}, R² of modes 1, 2: {r2} (paper 0.98, 0.97); "
        f"lines: the model, full for mode 1, dashed for mode 2; arrows: the free cone, {AIR[0]} and {AIR[1]}. Not in "
        f"the paper: D, E = {with_interval(*ends)} GPa (95 %, whiskers the draws; paper 3.74); open, all sweeps, by "
        f"forcing (texture known; white, Eq. 5) and modes; full, by identity{true}.{more} By identity: {names}, p "
        f"of a difference {p_words(p[0])} with every sweep a draw, {p_words(p[1])} with every whisker one."
    )


def _gpa(value: Any) -> str:
    return f"{1e-9 * float(value):.2f}" if np.isfinite(float(value)) else "not determined"


def draw_collapse(axis: Axes, data: xr.Dataset) -> None:
    """C: both modes, κ_i(ε) straight and curved, the free cone's arrows; hertz of the average C1 on the right.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        With what :func:`collapsed` gives.
    """
    look: dict[str, Any] = {"color": MEASURED, "mfc": "none", "ms": 4, "ls": "none"}
    for i, mark in enumerate("ox"):
        axis.plot(data.contact, data.kappa[:, i], mark, label=f"mode {i + 1}", **look)
        left = float(data.curve_contact[0])
        axis.annotate("", (left, AIR[i]), (left - 0.02, AIR[i]), arrowprops={"arrowstyle": "->"})
    words = ("κ(ε), straight", f"curved, θ$_b$ = {float(data.base_angle):.2f}")
    for name, width, label in zip(("curve_kappa", "curve_kappa_curved"), (1.4, 0.7), words, strict=True):
        axis.plot(data.curve_contact, data[name][0], color=PREDICTED, lw=width, label=label)
        axis.plot(data.curve_contact, data[name][1], color=PREDICTED, lw=width, ls="--")
    whisker = replace(atlas_whisker(RIGHT), youngs_modulus=float(data.youngs_modulus))
    scale = 1 / (2 * np.pi * whisker.timescale)
    right = axis.secondary_yaxis("right", functions=(partial(np.multiply, scale), partial(np.multiply, 1 / scale)))
    right.set_ylabel(f"an average {RIGHT} [Hz]")
    axis.set(xlabel="contact ε", ylabel="κ = kω", title="C  Collapse; arrows: free cone")
    axis.set_ylim(0, 1.1 * float(np.nanmax(data.kappa)))
    key_above(axis)


def draw_modulus(axis: Axes, data: xr.Dataset) -> None:
    """D: E of all sweeps by variant, then by identity.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        With what :func:`collapsed` gives.
    """
    labels = [*data.variant.values, *(printed_name(str(one)) for one in data.identity.values)]
    values, low, high = (
        1e-9 * np.concatenate([data[f"variant_modulus{end}"].values, data[f"identity_modulus{end}"].values])
        for end in ("", "_low", "_high")
    )
    y, first = np.arange(len(labels))[::-1], data.sizes["variant"]
    reach = np.nan_to_num(bars(values, low, high))
    for k, place in enumerate(y):
        look: dict[str, Any] = {
            "fmt": "o",
            "color": MEASURED,
            "mfc": "none" if k < first else MEASURED,
            "ms": 4,
            "capsize": 2,
        }
        axis.errorbar(values[k], place, xerr=reach[:, [k]], **look)
    axis.axvline(1e-9 * YOUNGS_MODULUS, color=PAPER, ls=":", lw=0.8)
    place = (1e-9 * YOUNGS_MODULUS, len(labels) - 0.5)
    axis.annotate("paper 3.74", place, (4, 0), textcoords="offset points", color=PAPER)
    if "identity_modulus_true" in data:
        axis.plot(1e-9 * data.identity_modulus_true, y[first:], "|", color=TRUTH, ms=14, mew=3, zorder=0)
    axis.set_yticks(y, labels)
    axis.set(xlabel="E [GPa]", title="D  Young's modulus", ylim=(-0.6, len(labels) - 0.1))
    axis.set_xlim(0, 1.05 * np.nanmax(np.concatenate([values, high])))
