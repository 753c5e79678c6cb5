"""A study's surface without a movie: what the model says that it does to the whisker."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from vibrissa.mechanics.diagnostics import relief_remarks, remarks
from vibrissa.mechanics.sampled import scanned
from vibrissa.mechanics.superposition import predict
from vibrissa.mechanics.topography import predict_relief, scanned_relief
from vibrissa.study.model_figures import model_results
from vibrissa.texture.surface import Troughs

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from vibrissa.mechanics.motion import Motion
    from vibrissa.mechanics.profile import Posture
    from vibrissa.mechanics.superposition import Scan
    from vibrissa.study.settings import Study
    from vibrissa.texture.relief import Relief
    from vibrissa.whisker import Whisker

Datasets = dict[str, "xr.Dataset"]

SAMPLING_RATE = 20_000.0  # [Hz], as the verb scan
_LONG = frozenset({"time", "trough", "contact_law"})  # dimensions that no screen shows


def surface_results(study: Study) -> Datasets:
    """Predict what the texture of a study does to its whisker.

    Parameters
    ----------
    study : Study
        With ``only_surface``.

    Returns
    -------
    dict of Datasets
        ``scan``: vibration, envelopes, what the follicle feels and how far the assumptions hold, as
        :func:`vibrissa.mechanics.sampled.scanned` and :func:`vibrissa.mechanics.topography.scanned_relief` give them;
        the attribute ``remarks`` (JSON) holds a sentence for each assumption that does not. Of the same whisker and
        posture, ``gap``, ``gaps`` and ``gain_map``, see :func:`vibrissa.study.model_figures.model_results`.

    Raises
    ------
    InputError
        If the file of the texture is missing or bad, or the posture cannot cross it.
    """
    if study.whisker is None or study.posture is None or study.texture is None or study.scan is None:
        raise ValueError("a surface needs whisker, posture, texture and scan")
    held = study.whisker, study.posture
    _, data, told = scan_surface(study.texture.made(study.folder), *held, study.scan, n_modes=study.n_modes)
    data = data.assign_attrs(remarks=json.dumps(told, ensure_ascii=False))
    return {"scan": data} | model_results(*held, study.scan)


def scan_surface(
    texture: Troughs | Relief,
    whisker: Whisker,
    posture: Posture,
    scan: Scan,
    *,
    n_modes: int = 3,
    sampling_rate: float = SAMPLING_RATE,
    nodes: Sequence[float] | None = None,
) -> tuple[Motion, xr.Dataset, list[str]]:
    """Draw gaps, or any heights, past a whisker.

    Parameters
    ----------
    texture : Troughs or Relief
        The surface.
    whisker, posture, scan, n_modes
        As :func:`vibrissa.mechanics.superposition.predict` takes them.
    sampling_rate, nodes
        As :func:`vibrissa.mechanics.sampled.scanned` takes them.

    Returns
    -------
    prediction : Motion
        The motion, at any time.
    data : Dataset
        The same, sampled.
    remarks : list of str
        A sentence for each assumption that does not hold.

    Raises
    ------
    InputError
        If the posture cannot cross the surface, or the record would be too long.
    """
    if isinstance(texture, Troughs):
        gaps = predict(whisker, posture, texture, scan, n_modes=n_modes)
        data = scanned(gaps, sampling_rate, nodes=nodes)
        return gaps, data, remarks(data)
    relief = predict_relief(whisker, posture, texture, scan, n_modes=n_modes)
    data = scanned_relief(relief, sampling_rate, nodes=nodes)
    return relief, data, relief_remarks(data)


def surface_lines(scan: xr.Dataset) -> xr.Dataset:
    """What a run of a surface tells on the screen: a line for each mode, and how far the assumptions hold."""
    return scan[[str(name) for name in scan.data_vars if not _LONG & set(scan[name].dims)]]


def surface_rows(scan: xr.Dataset) -> list[dict[str, Any]]:
    """Cells of the report's table: resonance [Hz], rms [µm] and exact over linear jump of each mode."""
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
