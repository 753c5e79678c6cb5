"""Cells of the report's sections on many sweeps and on base signals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.words import decimals
from vibrissa.quantities.kinds import Results
from vibrissa.stats import least_p
from vibrissa.study.paper.mode_shares import repeat_with_noise
from vibrissa.study.paper.paper_numbers import paper_number
from vibrissa.study.paper.printed import plain
from vibrissa.study.paper.sweep_measures import whiskers_of
from vibrissa.study.report.summary import sweep_lines
from vibrissa.study.report.validity import BIASED, allowed_jumps, is_biased

if TYPE_CHECKING:
    import xarray as xr


def sweeps_of(results: Results) -> dict[str, Any]:
    """Cells of the report's sections on sweeps; empty if there are none.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    dict
        By the names of the template.
    """
    if "sweeps" not in results:
        return {}
    sweeps = results["sweeps"]
    rejected = Counter(str(reason) for reason in sweeps.rejected.values[~sweeps.accepted.values])
    shares = results.get("mode_shares")
    return {
        "words": _words(sweeps),
        "rejected": rejected.most_common(),
        "conditions": _conditions(sweeps, results.get("comparison")),
        "biased": BIASED if is_biased(results) else "",
        "verdict": _verdict(results["sweep_verdict"]) if "sweep_verdict" in results else [],
        "shares": [] if shares is None else _shares(shares),
        "shares_words": "" if shares is None else _shares_words(shares),
    }


def _words(sweeps: xr.Dataset) -> str:
    accepted = int(sweeps.accepted.values.sum())
    animals, whiskers = len(np.unique(sweeps.animal.values)), len(np.unique(whiskers_of(sweeps)))
    text = f"{_counted(sweeps.sizes['sweep'], 'sweep')} of {_counted(whiskers, 'whisker')} of "
    text += f"{_counted(animals, 'animal')}, {accepted} analysed to the end.{_lacking(sweeps)}"
    counts = {name: sweeps.attrs.get(f"impossible_{name}", 0) for name in ("height", "contact", "fold")}
    if any(counts.values()):
        text += (
            f" Conditions drawn again, because they are impossible: {counts['height']} out of the whisker's reach, "
            f"{counts['contact']} with a contact outside the range that is analysed, {counts['fold']} beyond the fold."
        )
    return text


def _lacking(sweeps: xr.Dataset) -> str:
    """Modes without a fit of white forcing in sweeps that were analysed."""
    lacks = (~np.isfinite(sweeps.damping_white.values[sweeps.accepted.values])).sum(axis=0)
    pairs = zip(sweeps.mode.values, lacks, strict=True)
    lacking = ", ".join(f"mode {mode} in {count}" for mode, count in pairs if count)
    if not lacking:
        return ""
    return f" Not fitted with white forcing assumed: {lacking}; the file of each sweep says why (not_fitted)."


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


_COLUMNS = {  # of the table of conditions: scale and form of each mean
    "scan_speed": (1e3, ".0f"), "base_height": (1e3, ".1f"), "contact": (1, ".3f"), "base_angle": (1, ".2f"),
    "first_resonance": (1, ".1f"), "first_damping": (1, ".3f"), "first_rms": (1e3, ".3f"),
    "first_correlation": (1, ".2f"),
}  # fmt: skip


def _conditions(sweeps: xr.Dataset, comparison: xr.Dataset | None) -> list[list[str]]:
    """Means over the textures and runs of each whisker's conditions."""
    lines, owner = sweep_lines(sweeps, comparison), whiskers_of(sweeps)
    key = list(zip(owner.tolist(), sweeps.condition.values.tolist(), strict=True))
    rows = []
    for name, condition in dict.fromkeys(key):
        some = np.array([one == (name, condition) for one in key]) & sweeps.accepted.values
        cells = [name, str(condition), f"{int(some.sum())}"]
        for column, (scale, form) in _COLUMNS.items():
            values = (lines if column in lines else sweeps)[column].values
            known = values[some & np.isfinite(values)]
            cells.append(format(scale * known.mean(), form) if known.size else "")
        rows.append([*cells, allowed_jumps(sweeps.isel(sweep=np.flatnonzero(some)))])
    return rows


def _verdict(table: xr.Dataset) -> list[list[str]]:
    rows = []
    for i in range(table.sizes["entry"]):
        one = table.isel(entry=i)
        unit = str(one.error_unit.values)
        scale, unit = (100.0, "%") if unit == "1" else (1.0, unit)
        median, spread = (scale * float(one[name]) for name in ("error_median", "error_spread"))
        held, low, high = (100 * float(one[name]) for name in ("covered", "covered_low", "covered_high"))
        covered = f"{held:.0f} [{low:.0f}, {high:.0f}] %" if np.isfinite(held) else ""
        form = f".{decimals(spread)}f" if spread > 0 else ".2g"
        cells = [plain(median, f"+{form}"), plain(spread, form)] if np.isfinite(median) else ["no fit", ""]
        rows.append([f"{one.quantity.values} [{unit}]", *cells, covered, str(int(one.entry_count))])
    return rows


def _shares(shares: xr.Dataset) -> list[list[str]]:
    known = bool(np.isfinite(shares.share_true).all())  # else the motion is no model's: nothing to say of noise
    rows = []
    for mode in shares.mode.values.tolist():
        one = {name: 100 * float(shares[name].sel(mode=mode)) for name in _BY_MODE}
        spread = one["share_found_sd"]
        form = f".{decimals(spread)}f" if spread > 0 else ".2g"  # one sweep has none
        paper = f"{one['share_paper']:.1f} ± {one['share_paper_sd']:.1f} %"
        found = f"{one['share_found']:{form}}{f' ± {spread:{form}}' if spread > 0 else ''} %"
        model = [f"{one['share_true']:{form}} %", f"{one['share_noisy']:{form}} %"] if known else ["not known", ""]
        rows.append([str(mode), paper, found, *model])
    return rows


_BY_MODE = ("share_paper", "share_paper_sd", "share_found", "share_found_sd", "share_true", "share_noisy")


def _shares_words(shares: xr.Dataset) -> str:
    if not np.isfinite(shares.share_true.values).all():
        return "The paper's shares beside those of these sweeps, as tracked; their values without noise are not known."
    noise, repeat = float(shares.noise_share), float(shares.noise_repeat)
    text = (
        "Nothing is tuned to the paper's 66, 19 and 6 %. Noise that each node has by itself, the tracker's or the "
        "camera's, lowers all shares alike and leaves their ratios. To lower mode 1 to the paper's share it would need "
        f"{100 * noise:.0f} % of the variance; modes 2 and 3 would then have the shares of the last column. "
    )
    if shares.share_possible.all():
        return text
    left = 1 - paper_number("variance_sum").value
    return text + (
        f"Repeated runs would correlate at {repeat:.2f} with the mean of five, where the paper's correlate at 0.96; "
        f"noise of {100 * left:.1f} %, all that three modes leave there, gives {repeat_with_noise(left):.2f}. So such "
        "noise does not explain the paper's shares: its modes 2 and 3 are mostly motion. What could make it, and is "
        "not in the model, moves the whisker as a whole or in its upper modes: the pad, friction that fluctuates, the "
        "follicle."
    )


def base_rows(results: Results) -> list[dict[str, str]]:
    """A line for every mode of every base signal.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    list of dict
        One for each mode of each signal.
    """
    signals = (data for name, data in results.items() if name.startswith("base_signal_"))
    return [_base_row(one.sel(mode=mode), one.attrs) for one in signals for mode in one.mode.values.tolist()]


def _base_row(one: xr.Dataset, attrs: Mapping[str, Any]) -> dict[str, str]:
    end = "" if "resonant_frequency" in one else "_white"

    def found(name: str, form: str) -> str:
        value, low, high = (float(one[f"{name}{end}{part}"]) for part in ("", "_low", "_high"))
        if not np.isfinite(value):
            return "no maximum"
        return f"{value:{form}}" + (f" [{low:{form}}, {high:{form}}]" if np.isfinite(low) else "")

    agreed = "correlation" in one
    p = f"{float(one.pseudo_p):.2g} (least {float(least_p(one.pseudo_count)):.2g})" if agreed else ""
    return {
        "name": str(attrs["label"]),
        "mode": str(int(one.mode)),
        "frequency": found("resonant_frequency", ".1f"),
        "damping": found("damping", ".3f"),
        "forcing": "white (Eq. 5)" if end else "of the texture",
        "correlation": f"{float(one.correlation):.2f}" if agreed else "",
        "lag": f"{1e3 * float(one.best_lag):.1f}" if agreed else "",
        "p": p if agreed and np.isfinite(one.pseudo_p) else "",
        "absent": str(attrs["absent"]),
    }
