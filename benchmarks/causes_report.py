"""Tables and figures of docs/when-it-holds.md from the runs of benchmarks/causes.py.

.venv/bin/python benchmarks/causes_report.py DIR

Values are means over postures of a texture; intervals are Student's t over textures at 95 %. Of rms, motion at 5 mm and
gain the geometric mean is taken. Prints Markdown, draws docs/when-it-holds-alone.png and …-together.png.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from causes import ALONE, BASE, LEVELS, Case, name
from matplotlib.ticker import FormatStrFormatter
from scipy.stats import t as student

from vibrissa.figures.canvas import FOUND, OTHER, house_style, new_figure

DOCS = Path(__file__).parents[1] / "docs"
FACTORS = list(LEVELS)


class Measure(NamedTuple):
    """A number of the paper: its column, title, unit, value and spread, and whether it is compared by ratio."""

    column: str
    title: str
    paper: tuple[float, float]
    by_ratio: bool
    form: str = "{:.2g}"


MEASURES = (
    Measure("rms", "rms of mode 1 [10⁻³ L]", (2.64, 2.64), True),
    Measure("share_1", "share of mode 1 [%]", (55.7, 77.1), False, "{:.1f}"),
    Measure("share_2", "share of mode 2 [%]", (13.0, 24.2), False, "{:.1f}"),
    Measure("share_3", "share of mode 3 [%]", (2.7, 8.5), False, "{:.1f}"),
    Measure("gain", "gain, 0.8 to 1.4 rad", (1.0, 2.0), True, "{:.2f}"),
    Measure("rho", "ρ, best lag", (0.10, 0.40), False, "{:.2f}"),
    Measure("rho_0", "ρ, lag 0", (0.10, 0.40), False, "{:.2f}"),
    Measure("near", "envelope at 5 mm [µm]", (42.3, 43.5), True),
    Measure("repeats", "repeats", (0.91, 1.0), False, "{:.3f}"),
)
DRAWN = ("rms", "share_1", "share_2", "gain", "rho", "near")
NAMES = {
    "free_end": "free end {:g} mm", "curvature": "curved {:+g} /m", "friction": "friction {:g}",
    "edge": "edges {:g} µm", "rotation": "follicle turns", "translation": "follicle yields",
}  # fmt: skip
FACTOR_NAMES = {
    "free_end": "free end\n0.04, 5.6 mm", "curvature": "curvature\n−15, +15 /m", "friction": "friction\n0.2, 0.8",
    "edge": "edges\nsharp, 17 µm", "rotation": "follicle turns\nno, 3 EI/L",
    "translation": "follicle yields\nno, 100 EI/L³",
}  # fmt: skip
UNIT = {"free_end": 1e3, "edge": 1e6}


def table(folder: Path) -> pd.DataFrame:
    """Every run, a line each; those of textures that are complete in their kind."""
    runs = pd.DataFrame([json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))])
    runs["case"] = [name(Case(*line)) for line in runs[FACTORS].to_numpy()]
    sizes = runs.groupby(["kind", "texture"]).size()
    whole = sizes[sizes == sizes.groupby("kind").transform("max")].index
    return runs[pd.MultiIndex.from_frame(runs[["kind", "texture"]]).isin(whole)]


def values(runs: pd.DataFrame, measure: Measure) -> pd.Series:
    """One value for each case and texture; a logarithm where ratios are compared."""
    by = ["case", "texture"]
    if measure.column != "gain":
        column = np.log(runs[measure.column]) if measure.by_ratio else runs[measure.column]
        return column.groupby([runs[key] for key in by]).mean()
    logs = runs.assign(log=np.log(runs.rms)).groupby([*by, "angle"]).log.mean().unstack()
    return logs[1.4] - logs[0.8]


def interval(sample: np.ndarray, by_ratio: bool) -> tuple[float, float, float]:
    """Mean and its ends over textures."""
    sample = sample[np.isfinite(sample)]
    mean = sample.mean() if sample.size else np.nan
    half = (
        student.ppf(0.975, sample.size - 1) * sample.std(ddof=1) / np.sqrt(sample.size) if sample.size > 1 else np.nan
    )
    ends = np.array([mean, mean - half, mean + half])
    return tuple(np.exp(ends) if by_ratio else ends)


def cases_alone() -> dict[str, Case]:
    """The base case, each factor alone, and both springs, by what the figure calls them."""
    rows = {"base": BASE}
    for factor, levels in ALONE.items():
        for level in levels:
            label = NAMES[factor].format(level * UNIT.get(factor, 1)).replace("-", "−")
            rows[label] = replace(BASE, **{factor: level})
    return rows | {"turns and yields": replace(BASE, rotation=3.0, translation=100.0)}


def cell(found: tuple[float, float, float], measure: Measure) -> str:
    if np.isnan(found[0]):
        return "–"
    low, high = measure.paper
    if np.isnan(found[1]):
        return measure.form.format(found[0])
    meets = found[1] <= high and found[2] >= low
    text = f"{measure.form.format(found[0])} ({measure.form.format(found[1])} to {measure.form.format(found[2])})"
    return f"**{text}**" if meets else text


def alone(runs: pd.DataFrame) -> Iterator[str]:
    """One factor at a time."""
    yield "| | " + " | ".join(one.title for one in MEASURES) + " |\n|" + "---|" * (len(MEASURES) + 1)
    found = dict(each_alone(runs))
    for row, case in cases_alone().items():
        lost = int(runs[(runs.case == name(case)) & (runs.kind == "alone")].lost.notna().sum()) if "lost" in runs else 0
        note = f" ({lost} runs lost)" if lost else ""
        yield f"| {row}{note} | " + " | ".join(cell(found[row, one.column], one) for one in MEASURES) + " |"
    single = runs[(runs.case == name(BASE)) & (runs.kind == "alone")]
    logs = np.log(single.predicted_rms).groupby(single.texture).mean()
    by_angle = single.assign(log=np.log(single.predicted_rms)).groupby(["texture", "angle"]).log.mean().unstack()
    sizes = {"rms": interval(logs.to_numpy(), True), "gain": interval((by_angle[1.4] - by_angle[0.8]).to_numpy(), True)}
    none = (np.nan,) * 3
    yield "| single-contact model | " + " | ".join(cell(sizes.get(one.column, none), one) for one in MEASURES) + " |"


def each_alone(runs: pd.DataFrame) -> Iterator[tuple[tuple[str, str], tuple[float, float, float]]]:
    for measure in MEASURES:
        kind = "repeats" if measure.column == "repeats" else "alone"
        by_case = values(runs[runs.kind == kind], measure)
        for row, case in cases_alone().items():
            sample = by_case.get(name(case), pd.Series(dtype=float)).to_numpy(dtype=float)
            yield (row, measure.column), interval(sample, measure.by_ratio)


class Effect(NamedTuple):
    """Mean at the low and at the high level, and their difference (or ratio) with its ends."""

    low: float
    high: float
    change: tuple[float, float, float]


def effect(by_case: pd.Series, levels: pd.DataFrame, factor: str, by_ratio: bool, free_end: float | None) -> Effect:
    """Main effect of a factor, at one level of the free end or over both."""
    kept = levels if free_end is None else levels[levels.free_end == free_end]
    wide = by_case.unstack().loc[kept.index]
    parts = [wide[kept[factor] == level].mean() for level in LEVELS[factor]]
    ends = [float(np.exp(part.mean()) if by_ratio else part.mean()) for part in parts]
    return Effect(*ends, interval((parts[1] - parts[0]).to_numpy(), by_ratio))


def together(runs: pd.DataFrame) -> Iterator[str]:
    """Main effects of the factorial: ratios (×) or differences, over textures."""
    made = runs[runs.kind == "together"]
    levels = made.drop_duplicates("case").set_index("case")[FACTORS]
    shown = [one for one in MEASURES if one.column != "repeats"]
    yield "\n| factor | free end | " + " | ".join(one.title for one in shown) + " |\n|" + "---|" * (len(shown) + 2)
    for factor in FACTORS:
        for at in (None,) if factor == "free_end" else LEVELS["free_end"]:
            cells = []
            for one in shown:
                found = effect(values(made, one), levels, factor, one.by_ratio, at).change
                sign = "× " if one.by_ratio else ""
                form = "{:.2f}" if one.by_ratio or "rho" in one.column else "{:+.1f}"
                text = f"{sign}{form.format(found[0])} ({form.format(found[1])} to {form.format(found[2])})"
                null = 1.0 if one.by_ratio else 0.0
                cells.append(f"**{text}**" if not found[1] <= null <= found[2] else text)
            where = "both" if at is None else f"{1e3 * at:g} mm"
            yield f"| {FACTOR_NAMES[factor].replace(chr(10), ' ')} | {where} | " + " | ".join(cells) + " |"
    yield from combinations(made, levels)


def combinations(made: pd.DataFrame, levels: pd.DataFrame) -> Iterator[str]:
    """How many of the whiskers come to each number, and the range over them; a number without spread within a fifth."""
    yield "\n| | smallest to largest of the 32 | of 32 that come to the paper's |\n|---|---|---|"
    met, means = pd.DataFrame(index=levels.index), pd.DataFrame(index=levels.index)
    for one in MEASURES[:-1]:
        mean = values(made, one).unstack().loc[levels.index].mean(axis=1)
        means[one.column] = np.exp(mean) if one.by_ratio else mean
        low, high = one.paper if one.paper[1] > 1.05 * one.paper[0] else (one.paper[0] / 1.2, one.paper[1] * 1.2)
        met[one.column] = means[one.column].between(low, high)
        span = f"{one.form.format(means[one.column].min())} to {one.form.format(means[one.column].max())}"
        yield f"| {one.title} | {span} | {int(met[one.column].sum())} |"
    best = met.sum(axis=1)
    yield f"\nat most {best.max()} of {met.shape[1]} at once:"
    for case in best.index[best == best.max()]:
        facts = ", ".join(f"{key} {levels.loc[case, key]:g}" for key in FACTORS)
        found = ", ".join(f"{one.column} {one.form.format(means.loc[case, one.column])}" for one in MEASURES[:-1])
        yield f"- {facts}: {', '.join(met.columns[met.loc[case]])} ({found})"


@house_style
def draw_alone(runs: pd.DataFrame):
    """Every case a row, every measure a panel; the paper's number is the grey band."""
    found, rows = dict(each_alone(runs)), list(cases_alone())
    figure, axes = new_figure(6.6, 9.2, 2, 3, sharey=True)
    for axis, measure in zip(axes.flat, (one for one in MEASURES if one.column in DRAWN), strict=True):
        points = np.array([found[row, measure.column] for row in rows])
        mark_paper(axis, measure)
        for k, (mean, low, high) in enumerate(points):
            axis.plot([low, high], [k, k], color=FOUND, lw=1.5)
            axis.plot(mean, k, "o", color=OTHER if k == 0 else FOUND, ms=5)
        axis.axvline(points[0, 0], color=OTHER, lw=0.8, ls=":")
        finish(axis, measure, rows)
    return figure


@house_style
def draw_together(runs: pd.DataFrame):
    """Every factor a row: from its low level (open) to its high one (full), at both free ends."""
    made = runs[runs.kind == "together"]
    levels = made.drop_duplicates("case").set_index("case")[FACTORS]
    figure, axes = new_figure(6.6, 7.0, 2, 3, sharey=True)
    for axis, measure in zip(axes.flat, (one for one in MEASURES if one.column in DRAWN), strict=True):
        mark_paper(axis, measure)
        for k, factor in enumerate(FACTORS):
            halves = ((None, "0.3", 0.0),) if factor == "free_end" else HALVES
            for at, colour, off in halves:
                one = effect(values(made, measure), levels, factor, measure.by_ratio, at)
                axis.annotate(
                    "", (one.high, k + off), (one.low, k + off), arrowprops={"arrowstyle": "-", "color": colour}
                )
                ends = [one.low * end if measure.by_ratio else one.low + end for end in one.change[1:]]
                axis.plot(ends, [k + off, k + off], color=colour, lw=5, alpha=0.3, solid_capstyle="butt")
                axis.plot(one.low, k + off, "o", color=colour, mfc="white", ms=6)
                axis.plot(one.high, k + off, "o", color=colour, ms=6)
        finish(axis, measure, [FACTOR_NAMES[factor] for factor in FACTORS])
    handles = [axes[0, 0].plot([], [], "-o", color=colour)[0] for _, colour, _ in HALVES]
    figure.legend(handles, ["tip touches", "free end of 5.6 mm"], loc="outside upper center", ncols=2)
    return figure


HALVES = ((LEVELS["free_end"][0], OTHER, -0.15), (LEVELS["free_end"][1], FOUND, 0.15))


def mark_paper(axis, measure: Measure) -> None:
    low, high = measure.paper
    if high > 1.05 * low:
        axis.axvspan(low, high, color="0.88", lw=0, zorder=0)
    else:
        axis.axvline(low, color="0.75", lw=5, zorder=0)


def finish(axis, measure: Measure, rows: list[str]) -> None:
    axis.set(xlabel=measure.title, yticks=range(len(rows)), yticklabels=rows, ylim=(len(rows) - 0.5, -0.5))
    axis.grid(axis="y", color="0.93", lw=0.6)
    if measure.column in ("rms", "near"):
        axis.set_xscale("log")
        axis.xaxis.set_major_formatter(FormatStrFormatter("%g"))


def main() -> None:
    runs = table(Path(sys.argv[1]))
    print(
        runs.groupby("kind").texture.nunique().to_dict(),
        "textures;",
        int(runs.get("lost", pd.Series()).notna().sum()),
        "lost",
    )
    for line in [*alone(runs), *together(runs)]:
        print(line)
    draw_alone(runs).savefig(DOCS / "when-it-holds-alone.png", dpi=150)
    draw_together(runs).savefig(DOCS / "when-it-holds-together.png", dpi=150)


if __name__ == "__main__":
    main()
