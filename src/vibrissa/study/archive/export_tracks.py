"""What one movie gave, for an archive: tracks, modes in time, resonances, posture, prediction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.quantities.kinds import Results
from vibrissa.study.archive.export_series import add_row, add_series, add_table

if TYPE_CHECKING:
    import xarray as xr

FRAMES = {
    "image": "Frame of reference: the image; x to the right along its rows, y down along its columns, in metres, from "
    "the centre of the top left pixel.",
    "substrate": "Frame of reference: the substrate; x along it, y up from it, in metres.",
}
TRUE = "_true"
FORCINGS = ("", "_true", "_white")  # of the resonances: the texture's, the same on the true signal, white


def add_tracks(module: Any, profile: xr.Dataset, time: Array, suffix: str = "") -> None:
    """Add where the nodes of each whisker were, with standard deviations, and the nodes' distances from the skin.

    Parameters
    ----------
    module : ProcessingModule
        Of pynwb.
    profile : Dataset
        ``x``, ``y`` (whisker, time, node) [m] and what goes with them.
    time : (T,) array
        On the session's clock [s].
    suffix : str
        After the names of the series.
    """
    frame = str(profile.attrs.get("frame", "not known"))
    about = FRAMES.get(frame, f"Frame of reference: {frame}.")
    if suffix == TRUE:
        about = f"Truth of the simulation. {about}"
    if "pixel_size" in profile.attrs:
        about += f" A pixel is {float(profile.attrs['pixel_size']):.9g} m."
    whiskers = profile if "whisker" in profile.dims else profile.expand_dims("whisker")
    for k in range(whiskers.sizes["whisker"]):
        one = whiskers.isel(whisker=k)
        name = f"whisker_{one.whisker.item() if 'whisker' in one.coords else k}"
        add_series(module, one, time, prefix=f"{name}_", suffix=suffix, comments=about)
        add_table(module, f"{name}_nodes{suffix}", "nodes along the shaft, columns of the series", one, "node")
    if not suffix:
        add_table(module, "whiskers", "whiskers tracked", whiskers, "whisker")


def add_modes(module: Any, results: Results, time: Array) -> None:
    """Add displacement and envelope of each mode, its κ, and the resonances and damping found by each forcing.

    Parameters
    ----------
    module : ProcessingModule
        Of pynwb; takes what is added.
    results : mapping of Datasets
        ``modal`` and what was fitted to it.
    time : (T,) array
        On the session's clock [s].
    """
    modal = results["modal"]
    about = f"Modes: {modal.attrs.get('modes', 'straight')}."
    if "whisker_length" in modal.attrs:
        about += f" L is {float(modal.attrs['whisker_length']):.9g} m."
    add_series(module, modal, time, comments=about)
    table = modal[[name for name in modal.data_vars if modal[name].dims == ("mode",)]]
    for forcing in FORCINGS:
        if f"resonance{forcing}" in results:
            fit = results[f"resonance{forcing}"]
            named = fit.rename({name: f"{name}{forcing}" for name in fit.data_vars})
            table = table.merge(named, combine_attrs="override")
    text = "modes: resonances and damping found with the texture's forcing, with white forcing (_white), on the true"
    add_table(module, "modes", f"{text} signal (_true); 95 % intervals", table, "mode")


def add_posture(module: Any, posture: xr.Dataset) -> None:
    """Add contact and base angle with their intervals, and the curve of Eq. 1 laid on the mean profile.

    Parameters
    ----------
    module : ProcessingModule
        Of pynwb; takes what is added.
    posture : Dataset
        ``contact``, ``base_angle``, and the curve by ``s``.
    """
    add_row(module, "posture", "contact, over L, and base angle by Eq. 1 laid on the mean profile", posture)
    add_table(module, "posture_curve", "curve of Eq. 1 laid on the mean profile", posture, "s")


def add_prediction(module: Any, prediction: xr.Dataset, time: Array, prefix: str = "") -> None:
    """Add what the model predicts, and the modes it took.

    Parameters
    ----------
    module : ProcessingModule
        Of pynwb; takes what is added.
    prediction : Dataset
        Predicted signals by ``time`` and ``mode``.
    time : (T,) array
        On the session's clock [s].
    prefix : str
        Before the names.
    """
    add_series(module, prediction, time, prefix=prefix, suffix="_model", comments="Predicted by the model.")
    add_table(module, f"{prefix}modes_model", "modes of the prediction", prediction, "mode")


def add_base_signal(module: Any, number: int, signal: xr.Dataset, time: Array) -> None:
    """Add a signal measured at a whisker's base, its envelope by mode, what was predicted, and the modes found.

    Parameters
    ----------
    module : ProcessingModule
        Of pynwb; takes what is added.
    number : int
        Of the signal, from 1.
    signal : Dataset
        From :func:`vibrissa.study.forward.base_signals.analyse_signal`.
    time : (T,) array
        On the session's clock [s].
    """
    name, kind = f"base_signal_{number}_", signal.attrs.get("kind", "not known")
    label = signal.attrs.get("label", number)
    add_series(module, signal, time, prefix=name, comments=f"Base signal {label}; sensor: {kind}.")
    add_table(module, f"{name}modes", f"resonances and damping in base signal {label}, agreement", signal, "mode")


def shown_time(profile: xr.Dataset, own: Array, laid: Array) -> Array | None:
    """Times of the tracks of a sweep whose series has these ``own`` times, laid on the clock; None if it has others.

    Parameters
    ----------
    profile : Dataset
        Tracks of the sweep.
    own : (T,) array
        Times of its series [s].
    laid : (T,) array
        The same on the clock [s].

    Returns
    -------
    (T,) array or None
        On the session's clock [s].
    """
    time = profile.time.values
    same = time.shape == own.shape and np.abs((time - time[0]) - (own - own[0])).max() <= 1e-6
    return laid if same else None
