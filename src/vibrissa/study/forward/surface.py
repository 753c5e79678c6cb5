"""A study's surface without a movie: what the model says that it does to the whisker."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
from vibrissa.mechanics.free_end.validity import Model, chosen
from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.scan.diagnostics import relief_remarks, remarks
from vibrissa.mechanics.scan.sampled import node_distances, scanned, scanned_relief
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.mechanics.scan.undersampling import contact_lines, surface_remarks
from vibrissa.quantities.kinds import Datasets, Progress
from vibrissa.study.spec.textures import predict_surface
from vibrissa.texture.surface import Gaps

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from vibrissa.mechanics.rod.rod_settings import Rod
    from vibrissa.mechanics.scan.motion import PredictedMotion
    from vibrissa.mechanics.scan.scan_settings import Scan
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.study.store.run_state import Run
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.whisker import Whisker

SAMPLING_RATE = 20_000.0  # [Hz], as the verb scan
_LONG = frozenset({"time", "trough", "contact_law"})  # dimensions that no screen shows


def study_surface(run: Run) -> Datasets:
    """Predict what the texture of a study does to its whisker: ``scan``.

    Parameters
    ----------
    run : Run
        Its study has a texture without a movie.

    Returns
    -------
    dict of Datasets
        ``scan``: vibration, envelopes, what the follicle feels and how far the assumptions hold, as
        :func:`vibrissa.mechanics.scan.sampled.scanned` and
        :func:`vibrissa.mechanics.scan.sampled.scanned_relief` give them; the attribute ``remarks`` (JSON)
        holds a sentence for each assumption that does not.

    Raises
    ------
    InputError
        If the file of the texture is missing or bad, or the posture cannot cross it.
    """
    study = run.study
    if study.whisker is None or study.posture is None or study.texture is None or study.scan is None:
        raise ValueError("a surface needs whisker, posture, texture and scan")
    held = study.whisker, study.posture
    texture = study.texture.made(study.folder)
    _, data, lines = scan_surface(texture, *held, study.scan, n_modes=study.n_modes, progress=run.progress)
    run.modelled = *held, study.scan
    return {"scan": data.assign_attrs(remarks=json.dumps(lines, ensure_ascii=False))}


def scan_surface(
    texture: Gaps | HeightProfile,
    whisker: Whisker,
    posture: Posture,
    scan: Scan,
    *,
    n_modes: int = 3,
    sampling_rate: float = SAMPLING_RATE,
    nodes: Sequence[float] | None = None,
    model: Model = "modes",
    rod: Rod | None = None,
    progress: Progress | None = None,
) -> tuple[PredictedMotion | RodPrediction | FreeEndPrediction, xr.Dataset, list[str]]:
    """Draw gaps, or any heights, past a whisker.

    Parameters
    ----------
    texture : Gaps or HeightProfile
        The surface.
    whisker, posture, scan, n_modes
        As :func:`vibrissa.mechanics.scan.texture_prediction.predict` takes them.
    sampling_rate, nodes
        As :func:`vibrissa.mechanics.scan.sampled.scanned` takes them.
    model : {"modes", "free-end", "auto"}
        Of what predicts; ``auto`` is as of :func:`vibrissa.mechanics.free_end.validity.chosen`.
    rod : Rod, optional
        The whole whisker as a rod, instead of either.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    prediction : PredictedMotion, RodPrediction or FreeEndPrediction
        The motion.
    data : Dataset
        The same, sampled.
    remarks : list of str
        A sentence for each assumption that does not hold.

    Raises
    ------
    InputError
        If the posture cannot cross the surface, a node is not on the whisker, or the record would be too long.
    """
    report = progress or (lambda *_: None)
    node_distances(whisker, nodes)  # refused before the work
    if rod is not None:
        whole = RodPrediction(whisker, posture, texture, scan, n_modes, rod)
        data = whole.sampled(sampling_rate, nodes, progress=lambda done, of: report("the whole whisker", done, of))
        return whole, data, [data.attrs["verdict"], *surface_remarks(texture, scan.speed, sampling_rate)]
    report("scan of the surface", 0, 0)
    if model == "auto":
        model = chosen(posture, texture)
    if model == "free-end":
        bearing = FreeEndPrediction(whisker, posture, texture, scan, n_modes)  # type: ignore[arg-type]
        data = bearing.sampled(sampling_rate, nodes)
        return bearing, data, [data.attrs["verdict"], *surface_remarks(texture, scan.speed, sampling_rate)]
    motion = predict_surface(whisker, posture, texture, scan, n_modes=n_modes)
    report("signals of the scan", 0, 0)
    if isinstance(motion, Prediction):
        data = scanned(motion, sampling_rate, nodes=nodes)
        lines = remarks(data)
    else:
        data = scanned_relief(motion, sampling_rate, nodes=nodes)
        lines = relief_remarks(data)
    return motion, data, [*lines, *contact_lines(motion, sampling_rate)]


def surface_lines(scan: xr.Dataset) -> xr.Dataset:
    """Table that a run of a surface prints: a line for each mode, and how far the assumptions hold.

    Parameters
    ----------
    scan : Dataset
        From :func:`scan_surface`.

    Returns
    -------
    Dataset
        Without what goes by time or trough.
    """
    return scan[[str(name) for name in scan.data_vars if not _LONG & set(scan[name].dims)]]


def surface_rows(scan: xr.Dataset) -> list[dict[str, Any]]:
    """Cells of the report's table: resonance [Hz], rms [µm] and exact over linear jump of each mode.

    Parameters
    ----------
    scan : Dataset
        From :func:`scan_surface`.

    Returns
    -------
    list of dict
        One for each mode.
    """
    um = 1e6 * float(scan.attrs["whisker_length"])
    return [
        {
            "mode": int(one.mode),
            "frequency": f"{float(one.resonant_frequency):.1f}",
            "rms": f"{um * float(one.mode_sd):.3g}",
            "linearity": f"{float(one.linearity):.2f}",
        }
        for one in (scan[["resonant_frequency", "mode_sd", "linearity"]].sel(mode=mode) for mode in scan.mode.values)
    ]
