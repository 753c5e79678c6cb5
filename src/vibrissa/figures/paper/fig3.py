"""Figure 3: the set-up, a frame and its centrelines, the motion of the nodes, and how alike repeated runs are."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import InputError
from vibrissa.figures.canvas import add_caption, house_style, new_figure, split, whisker_names
from vibrissa.figures.paper.parts import fig3_panels as panels
from vibrissa.figures.paper.parts.fig3_caption import SHADOW, caption
from vibrissa.figures.paper.parts.fig3_motion import (
    NodeMotion,
    between,
    most_alike,
    motion_of_truth,
    node_motion,
    pooled_share_along,
    run_correlations,
    share_along,
)
from vibrissa.figures.sources import of_movie, of_sweeps
from vibrissa.quantities import dataset, measured_sd

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 0.3  # [s] of motion
PATH = 0.1  # [s] of the path of one node
NODES = 5
FRAMES = 16  # of the field of motion
LARGEST = 0.08  # largest motion drawn, over the length of the shaft shown


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Everything Figure 3 shows of a tracked movie, and of the experiment where it is known.

    Parameters
    ----------
    study : mapping
        ``still`` and ``profile``; the motion is that of the first whisker. Where there is ``modal``, its contact ends
        the shaft; ``true_profile`` gives the truth, ``apparatus`` the set-up, and ``repeats`` the runs of the same scan
        (``run_motion``, perhaps ``run_motion_true``).

    Returns
    -------
    Dataset
        B: ``image`` (image_row, image_column); ``line_column``, ``line_row`` (whisker, node) [pixels]. C: ``motion_x``,
        ``motion_y`` (instant, field_node) of successive frames about ``mean_x``, ``mean_y`` [m]; ``along_share`` as
        tracked, ``along_share_unstretched`` as it follows from the motion across the shaft, and ``along_share_true``
        (field_node), where arc length starts at a skin point; ``path_x``, ``path_y`` (path_time) [m] of the node of
        largest motion. D: ``run_motion``, ``run_correlation``, ``run_correlation_others`` (repetition, run), and
        ``run_mean`` (run_time) of the repetition ``run_shown``, whose runs are most alike; E: the same correlations.
        G: ``node_motion`` (time, trace) [m], the measured coordinate about its mean, ``trace_arc``. A: as in
        ``apparatus``.
        Attributes: ``share_across`` (pooled over the nodes of C), ``share_across_tracked``, ``share_across_true``,
        ``exaggeration``, ``measured`` (x or y), ``no_field`` (why C and D are missing, or empty), ``caption``.
    """
    still, profile = study["still"], study["profile"]
    pixel = profile.attrs["pixel_size"]
    attrs: dict[str, Any] = {"names": json.dumps(whisker_names(profile)), "pixel_size": pixel}
    attrs |= {"of_movie": of_movie(study), "of_runs": of_sweeps(study.get("sweeps"))}
    columns: dict[str, Any] = {
        "whisker": profile.whisker.values,
        "image_row": still.image_row.values,
        "image_column": still.image_column.values,
        "image": still.image.values,
        "line_column": profile.x.values[:, 0] / pixel,
        "line_row": profile.y.values[:, 0] / pixel,
    }
    for found, facts in (_apparatus(study), _motion(study), _runs(study)):
        columns |= found
        attrs |= facts
    return dataset(attrs | {"caption": caption(attrs)}, lead=("whisker",), **columns)


def _apparatus(study: Mapping[str, xr.Dataset]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Columns and attributes of A."""
    if "apparatus" not in study:
        return {}, {}
    given = study["apparatus"]
    names = ("shaft_x", "shaft_y", "field_x", "field_y", "trough_start", "trough_width")
    facts = ("base_height", "speed", "depth", "frame_rate")
    return {name: given[name].values for name in names}, {name: given.attrs[name] for name in facts}


def _motion(study: Mapping[str, xr.Dataset]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Columns and attributes of C and D."""
    first = study["profile"].isel(whisker=0)
    measured = "x" if measured_sd(first).name == "x_sd" else "y"
    try:
        motion = node_motion(first)
    except InputError as error:
        return {}, {"no_field": str(error), "measured": measured}
    shown = motion.measured & (motion.arc <= _shaft(study))
    if not shown.any():
        return {}, {"no_field": "no node was measured on the base side of the contact", "measured": measured}
    field, facts = _field(motion, shown)
    field |= _path(first.time.values, motion, shown, facts)
    if first.attrs.get("arc_length_from", "skin") == "skin":
        shares, of_all = _shares(study, motion, shown)
        field, facts = field | shares, facts | of_all
    true = study.get("true_profile")
    return field | _traces(first, motion, shown, true, measured), facts | {"no_field": "", "measured": measured}


def _shaft(study: Mapping[str, xr.Dataset]) -> float:
    """Arc length from the skin to the contact [m], or beyond all nodes where it is not known."""
    modal = study.get("modal")
    return np.inf if modal is None else float((1 - modal.contact) * modal.attrs["whisker_length"])


def _field(motion: NodeMotion, shown: Mask) -> tuple[dict[str, Any], dict[str, Any]]:
    """Displacements in some frames about the one of largest motion."""
    across, along = motion.across[:, shown], motion.along[:, shown]
    instant = int(np.argmax(np.nansum(across**2, axis=1)))
    start = max(0, min(instant - FRAMES // 2, len(across) - FRAMES))
    frames = slice(start, start + FRAMES)
    angle, u, w = motion.angle[shown], across[frames], along[frames]
    largest, reach = float(np.nanmax(np.hypot(u, w))), float(np.ptp(motion.arc[shown]))
    factor = LARGEST * reach / largest if largest > 0 else 1.0
    step = 10 ** np.floor(np.log10(factor))
    columns = {
        "field_arc": motion.arc[shown],
        "mean_x": motion.x[shown],
        "mean_y": motion.y[shown],
        "motion_x": w * np.cos(angle) - u * np.sin(angle),
        "motion_y": w * np.sin(angle) + u * np.cos(angle),
    }
    return columns, {"exaggeration": float(max(1, np.floor(factor / step) * step)), "shaft_shown": reach}


def _path(time: Array, motion: NodeMotion, shown: Mask, facts: dict[str, Any]) -> dict[str, Any]:
    """Displacements in x and y of the node that moves most; its place among the nodes shown, into the facts."""
    facts["path_node"] = node = int(np.nanargmax(np.nanstd(motion.across[:, shown], axis=0)))
    facts["path_arc"] = float(motion.arc[shown][node])
    u, w, angle = motion.across[:, shown][:, node], motion.along[:, shown][:, node], motion.angle[shown][node]
    excerpt = time - time[0] <= PATH
    return {
        "path_time": time[excerpt],
        "path_x": (w * np.cos(angle) - u * np.sin(angle))[excerpt],
        "path_y": (w * np.sin(angle) + u * np.cos(angle))[excerpt],
    }


def _shares(study: Mapping[str, xr.Dataset], motion: NodeMotion, shown: Mask) -> tuple[dict[str, Any], dict[str, Any]]:
    """Shares of the power along the shaft: of each node, and of all together."""
    moves = {"_tracked": (motion.across, motion.along), "": (motion.across, motion.along_unstretched)}
    if "true_profile" in study:
        moves["_true"] = motion_of_truth(study["true_profile"], motion)
    names = {"_tracked": "", "": "_unstretched", "_true": "_true"}
    columns = {f"along_share{names[which]}": share_along(*move)[shown] for which, move in moves.items()}
    pooled = {f"share_across{which}": _across(move, shown) for which, move in moves.items()}
    lit = shown & (motion.arc <= _shaft(study) - SHADOW)
    if "modal" in study and lit.any():
        pooled["share_across_lit"] = _across(moves[""], lit)
    return columns, pooled


def _across(move: tuple[Array, Array], nodes: Mask) -> float:
    """Share of the power across the shaft, of these nodes together."""
    return 1 - pooled_share_along(move[0][:, nodes], move[1][:, nodes])


def _traces(
    first: xr.Dataset, motion: NodeMotion, shown: Mask, true: xr.Dataset | None, measured: str
) -> dict[str, Any]:
    """The measured coordinate of a few nodes about its mean."""
    nodes = np.flatnonzero(shown)
    chosen = nodes[np.linspace(0.1 * len(nodes), 0.9 * len(nodes), NODES).astype(int).clip(0, len(nodes) - 1)]
    values = first[measured].values[:, motion.nodes[chosen]]
    time = first.time.values
    excerpt = slice(0, int(np.searchsorted(time - time[0], SHOWN)))
    columns = {
        "time": time[excerpt],
        "node_motion": (values - np.nanmean(values, axis=0))[excerpt],
        "trace_arc": motion.arc[chosen],
    }
    if true is not None:
        exact = between(true[measured].values, true.arc_length.values, motion.arc[chosen])
        columns["node_motion_true"] = exact[excerpt]
    return columns


def _runs(study: Mapping[str, xr.Dataset]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Columns and attributes of D and E."""
    repeats = study.get("repeats")
    if repeats is None:
        return {}, {}
    runs = repeats.run_motion.values
    with_mean, with_others = run_correlations(runs)
    shown = most_alike(with_mean)
    columns = {
        "run_time": repeats.run_time.values,
        "run_motion": runs,
        "run_mean": runs[shown].mean(axis=0),
        "run_correlation": with_mean,
        "run_correlation_others": with_others,
    }
    if "run_motion_true" in repeats:
        columns["run_correlation_true"] = run_correlations(repeats.run_motion_true.values)[0]
    columns |= {name: repeats[name].values for name in ("run_trough_start", "run_trough_width") if name in repeats}
    facts = {name: value for name, value in repeats.attrs.items() if name.startswith(("jitter_", "run_"))}
    facts |= {"run_shown": shown, "repetitions": runs.shape[0], "runs": runs.shape[1]}
    for name in ("run_correlation", "run_correlation_others", "run_correlation_true"):
        if name in columns:
            facts |= {f"{name}_mean": float(columns[name].mean()), f"{name}_sd": float(columns[name].std(ddof=1))}
    return columns, facts


@house_style
def draw(data: xr.Dataset) -> Figure:
    """A set-up, B frame; C field of motion and one node; D runs over one texture, E correlations; F shares, G nodes.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    given, repeated = "shaft_x" in data, "run_motion" in data
    heights = [1.05, 1.1, *([1.35] * repeated), 1.0]
    figure, axes = new_figure(9.0, 2.5 * sum(heights), len(heights), 1, height_ratios=heights)
    widths = [[1, 1.5] if given else [1], [1.3, 1], *([[2.6, 1]] * repeated), [1, 1.9]]
    rows = [split(figure, axis, widths=row) for axis, row in zip(axes[:, 0], widths, strict=True)]
    if given:
        panels.draw_apparatus(rows[0][0], data)
    panels.draw_frame(rows[0][-1], data)
    _draw_motion([*rows[1], *rows[-1]], data)
    if repeated:
        panels.draw_runs(rows[2][0], data)
        panels.draw_correlations(rows[2][1], data)
    return add_caption(figure, data)


def _draw_motion(axes: list[Axes], data: xr.Dataset) -> None:
    """Draw C, F and G, or say why not."""
    drawn = panels.draw_field, panels.draw_path, panels.draw_shares, panels.draw_traces
    titles = "C  Motion about the mean", "C  One node", "F  Share along the shaft", "G  Several nodes"
    for axis, draw_one, title in zip(axes, drawn, titles, strict=True):
        if data.attrs["no_field"]:
            panels.without(axis, title, data.attrs["no_field"])
        else:
            draw_one(axis, data)
