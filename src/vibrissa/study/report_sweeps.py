"""What the report tells of many sweeps and of base signals, as text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.study.lines import sweep_lines
from vibrissa.study.sweep_measures import whiskers_of

if TYPE_CHECKING:
    import xarray as xr

Results = Mapping[str, "xr.Dataset"]


def sweeps_of(results: Results) -> dict[str, Any]:
    """Cells of the report's sections on sweeps; empty if there are none."""
    if "sweeps" not in results:
        return {}
    sweeps = results["sweeps"]
    rejected = Counter(str(reason) for reason in sweeps.rejected.values[~sweeps.accepted.values])
    shares = results.get("mode_shares")
    return {
        "words": _words(sweeps),
        "rejected": rejected.most_common(),
        "conditions": _conditions(sweeps, results.get("comparison")),
        "verdict": _verdict(results["sweep_verdict"]) if "sweep_verdict" in results else [],
        "shares": [] if shares is None else _shares(shares),
        "shares_words": "" if shares is None else _shares_words(shares),
    }


def _words(sweeps: xr.Dataset) -> str:
    accepted = int(sweeps.accepted.values.sum())
    animals, whiskers = len(np.unique(sweeps.animal.values)), len(np.unique(whiskers_of(sweeps)))
    text = (
        f"{_counted(sweeps.sizes['sweep'], 'sweep')} of {_counted(whiskers, 'whisker')} of "
        f"{_counted(animals, 'animal')}, {accepted} analysed to the end."
    )
    text += _lacking(sweeps)
    counts = {name: sweeps.attrs.get(f"impossible_{name}", 0) for name in ("height", "contact", "fold")}
    if any(counts.values()):
        text += (
            f" Conditions drawn anew, for they cannot be: {counts['height']} out of the whisker's reach, "
            f"{counts['contact']} with a contact that is not looked at, {counts['fold']} beyond the fold."
        )
    return text


def _lacking(sweeps: xr.Dataset) -> str:
    """Modes without a fit of white forcing in sweeps that were analysed."""
    lacks = ~np.isfinite(sweeps.damping_white.values[sweeps.accepted.values]).T
    each = [
        f"mode {mode} in {int(one.sum())}" for mode, one in zip(sweeps.mode.values, lacks, strict=True) if one.any()
    ]
    if not each:
        return ""
    lacking = ", ".join(each)
    return f" Not fitted with the forcing taken for white: {lacking}; the file of each sweep says why (not_fitted)."


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _conditions(sweeps: xr.Dataset, comparison: xr.Dataset | None) -> list[list[str]]:
    """Means over the textures and runs of each whisker's conditions."""
    lines, owner = sweep_lines(sweeps, comparison), whiskers_of(sweeps)
    key = list(zip(owner.tolist(), sweeps.condition.values.tolist(), strict=True))
    rows = []
    for name, condition in dict.fromkeys(key):
        some = np.array([one == (name, condition) for one in key]) & sweeps.accepted.values
        cells = [name, str(condition), f"{int(some.sum())}"]
        for values, scale, form in (
            (sweeps.scan_speed.values, 1e3, ".0f"),
            (sweeps.base_height.values, 1e3, ".1f"),
            (sweeps.contact.values, 1, ".3f"),
            (sweeps.base_angle.values, 1, ".2f"),
            (lines.first_resonance.values, 1, ".1f"),
            (lines.first_damping.values, 1, ".3f"),
            (lines.first_rms.values, 1e3, ".2f"),
            (lines.first_correlation.values, 1, ".2f"),
        ):
            told = values[some & np.isfinite(values)]
            cells.append(format(scale * told.mean(), form) if told.size else "")
        rows.append(cells)
    return rows


def _verdict(table: xr.Dataset) -> list[list[str]]:
    rows = []
    for i in range(table.sizes["entry"]):
        one = table.isel(entry=i)
        scale, unit, form = {"1": (100.0, "%", "+.3f"), "L": (1.0, "L", "+.5f")}.get(
            str(one.error_unit.values), (1.0, str(one.error_unit.values), "+.5f")
        )
        median, spread = (scale * float(one[name]) for name in ("error_median", "error_spread"))
        held, low, high = (100 * float(one[name]) for name in ("covered", "covered_low", "covered_high"))
        told = f"{held:.0f} % ({low:.0f} to {high:.0f})" if np.isfinite(held) else ""
        cells = [format(median, form), format(spread, form[1:]), unit] if np.isfinite(median) else ["no fit", "", ""]
        rows.append([str(one.quantity.values), *cells, told, str(int(one.entry_count))])
    return rows


def _shares(shares: xr.Dataset) -> list[list[str]]:
    rows = []
    for mode in shares.mode.values.tolist():
        one = {name: 100 * float(shares[name].sel(mode=mode)) for name in shares.data_vars}
        spread = f" ± {one['share_found_sd']:.2f}" if np.isfinite(one["share_found_sd"]) else ""  # one sweep has none
        known = np.isfinite(one["share_true"])  # else the motion is no model's: nothing to say of what that can give
        rows.append(
            [
                str(mode),
                f"{one['share_paper']:.1f} ± {one['share_paper_sd']:.1f} %",
                f"{one['share_found']:.2f}{spread} %",
                f"{one['share_true']:.2f} %" if known else "not known",
                f"{one['share_noisy']:.2f} %" if known else "",
                ("yes" if one["share_possible"] else "no") if known else "",
            ]
        )
    return rows


def _shares_words(shares: xr.Dataset) -> str:
    known = np.isfinite(shares.share_true.values).all()
    missing = [
        int(mode) for mode, able in zip(shares.mode.values, shares.share_possible.values, strict=True) if not able
    ]
    if not known:
        return "The paper's shares beside those of these sweeps, as tracked; what they are without noise is not known."
    text = (
        "Nothing is tuned to the paper's 66, 19 and 6 %. Noise that each node has by itself, the tracker's or the "
        "camera's, lowers all shares alike and leaves their ratios: with as much as brings mode 1 down to the paper's "
        "share, the others come out as the last but one column says. "
    )
    if missing:
        text += (
            f"The share of mode{'s' * (len(missing) > 1)} {' and '.join(map(str, missing))} is larger in the paper: "
            "the model, filmed with any such noise, cannot give it. What could, and is not in it, moves the whisker as "
            "a whole or in its upper modes: the pad, friction that fluctuates, an error of ε that mixes modes."
        )
    return text


def base_rows(results: Results) -> list[dict[str, str]]:
    """A line for every mode of every base signal."""
    rows = []
    for one in (data for name, data in results.items() if name.startswith("base_signal_")):
        for mode in one.mode.values.tolist():
            rows.append(_base_row(one.sel(mode=mode), one.attrs))
    return rows


def _base_row(one: xr.Dataset, attrs: Mapping[str, Any]) -> dict[str, str]:
    end = "" if "resonant_frequency" in one else "_white"

    def told(name: str, form: str) -> str:
        value, low, high = (float(one[f"{name}{end}{part}"]) for part in ("", "_low", "_high"))
        return f"{value:{form}} ({low:{form}} to {high:{form}})" if np.isfinite(value) else "no maximum"

    agreed = "correlation" in one
    return {
        "name": str(attrs["label"]),
        "mode": str(int(one.mode)),
        "frequency": told("resonant_frequency", ".1f"),
        "damping": told("damping", ".3f"),
        "forcing": "white (Eq. 5)" if end else "of the texture",
        "correlation": f"{float(one.correlation):.2f}" if agreed else "",
        "lag": f"{1e3 * float(one.best_lag):.1f}" if agreed else "",
        "p": f"{float(one.pseudo_p):.2g}" if agreed and np.isfinite(one.pseudo_p) else "",
        "absent": str(attrs["absent"]),
    }
