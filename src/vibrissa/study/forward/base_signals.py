"""A study's base signals: those of a robot or an isolated whisker, through the same analysis."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.across.comparison import compare_envelopes
from vibrissa.mechanics.modes.straight import resonances
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict_all
from vibrissa.mechanics.sensor.base_response import analyse_base_signal, band_envelopes, predicted_signal
from vibrissa.mechanics.sensor.base_signal import read_base_signal
from vibrissa.quantities import dataset
from vibrissa.study.spec.base_signal import BaseSignal
from vibrissa.texture.io import read_gaps
from vibrissa.texture.shuffled import shuffled
from vibrissa.whisker import DAMPING

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.scan.texture_prediction import Prediction
    from vibrissa.study.store.run_state import Run

READ = ("kind", "unit", "calibration", "sampling_rate", "column", "rest", "whisker")  # settings that the reader takes
_MORE_MODES = 4  # in a prediction above those fitted: at the base their quasi-static parts weigh
_PER_CYCLE = 8  # samples of the highest resonance that its envelope is compared at


def analyse_signal(signal: BaseSignal, folder: Path) -> xr.Dataset:
    """Read and analyse one base signal.

    Parameters
    ----------
    signal : BaseSignal
        The file and what is known.
    folder : Path
        Where relative paths start.

    Returns
    -------
    Dataset
        ``base_moment``, ``base_curvature`` or ``transverse_force`` (time) with its ``_envelope`` (mode, time);
        ``resonant_frequency_white``, ``damping_white`` (mode) with their intervals; ``base_power``,
        ``base_power_white_fit``. With a texture ``resonant_frequency``, ``damping``, ``base_power_fit``; the
        prediction, ``…_model`` and ``…_envelope_model``; ``correlation``, ``best_lag``, ``rms_ratio`` and, of shuffled
        textures, ``pseudo_p``, ``chance_mean``, ``chance_sd`` (mode) and their ``pseudo_count``. Attributes ``signal``,
        ``label``, ``absent``, ``clipped`` and ``stuck``, each with its ``_note``; of a prediction ``model_damping``,
        its ζ, and ``model_damping_note``, where it is from.

    Raises
    ------
    InputError
        If the file or what is known is bad.
    """
    follicle = read_base_signal(folder / signal.path, **{name: getattr(signal, name) for name in READ})
    follicle = follicle.assign_coords(time=follicle.time - signal.start)
    guess = _guess(signal)
    prediction, others = _predicted(signal, folder, len(guess))
    found = analyse_base_signal(follicle, guess, prediction=prediction)
    columns, model = fitted_columns(found["resonance_white"], "_white"), dict[str, Any]()
    if prediction is not None:
        fitted = float(found["resonance"].damping[0])
        model = _model_damping(signal, fitted)
        if model["model_damping"] != prediction.scan.damping:
            prediction, *others = (_damped(one, fitted) for one in (prediction, *others))
            found = analyse_base_signal(follicle, guess, prediction=prediction)
        columns |= fitted_columns(found["resonance"], "") | _modelled(found, guess, others)
    absent = "" if prediction is not None else "no texture: nothing is predicted, the forcing is assumed to be white"
    above = "" if prediction is not None else _without_interval(columns)
    absent = "; ".join(filter(None, [absent, _without_line(columns, guess), above]))
    attrs = {name: follicle.attrs[name] for name in ("kind", "unit", "calibration", "zero", "clipped", "stuck")}
    attrs["clipped_note"], attrs["stuck_note"] = _clipped(attrs["clipped"]), _stuck(attrs["stuck"])
    labelled = dataset(mode=found["envelope"].mode.values, time=follicle.time.values, **columns)
    whole = found["envelope"].drop_vars("phase").merge(found["spectra"]).merge(labelled, combine_attrs="override")
    return whole.assign_attrs(**attrs, **model, label=signal.label, absent=absent)


def _clipped(samples: int) -> str:
    """How many samples lie where the sensor's range seems to end, in words."""
    text = "lie at the ends of the range, perhaps clipped: resonance, damping and envelope are then wrong"
    return f"{samples} samples {text}" if samples else ""


def _stuck(samples: int) -> str:
    """How many samples seem to have been held or lost, in words."""
    text = "repeat the one before, in stretches that begin and end by a step, perhaps held or lost"
    return f"{samples} samples {text}: resonance, damping and envelope are then wrong" if samples else ""


def _without_line(columns: dict[str, Any], guess: Array) -> str:
    """Which modes have no line of their own about their guess, in words."""
    found = columns.get("resonant_frequency", columns["resonant_frequency_white"])
    lost = [f"{i} (about {at:.4g} Hz)" for i, at in enumerate(guess, 1) if not np.isfinite(found[i - 1])]
    return f"no line of its own was found for mode {', '.join(lost)}" if lost else ""


def _without_interval(columns: dict[str, Any]) -> str:
    """Which modes are biased by the flank of those below, in words."""
    found = columns["resonant_frequency_white"]
    biased = [str(i) for i in range(2, len(found) + 1) if np.isfinite(found[i - 1])]
    if not biased:
        return ""
    why = "with white forcing the flank of the modes below is fitted as its width, so frequency and damping are biased"
    return f"mode {', '.join(biased)} has no interval: {why}; a known texture, with whisker, posture and speed, helps"


def fitted_columns(fit: xr.Dataset, forcing: str) -> dict[str, Any]:
    """Frequencies and damping of a fit with the ends of their intervals, as columns.

    Parameters
    ----------
    fit : Dataset
        ``resonant_frequency`` [Hz] and ``damping`` (mode), each with ``_low`` and ``_high``.
    forcing : str
        End of the names: ``_white``, or "" for the texture's.

    Returns
    -------
    dict of arrays
        By name, (mode,).
    """
    names = ("resonant_frequency", "damping")
    return {f"{name}{forcing}{end}": fit[name + end].values for name in names for end in ("", "_low", "_high")}


def _guess(signal: BaseSignal) -> Array:
    if signal.guess is not None or signal.whisker is None:
        return np.array(signal.guess or ())
    found = (
        resonances(signal.whisker, signal.whisker.tip, signal.modes, boundary="free")
        if signal.posture is None
        else resonances(signal.whisker, signal.posture.contact, signal.modes)
    )
    return np.asarray(found.resonant_frequency.values)


def _predicted(signal: BaseSignal, folder: Path, modes: int) -> tuple[Prediction | None, list[Prediction]]:
    """Prediction for the texture, and for its gaps and lands in other orders."""
    if signal.texture is None or signal.whisker is None or signal.posture is None or signal.scan_speed is None:
        return None, []
    texture, rng = read_gaps(folder / signal.texture), np.random.default_rng(0)
    damping = DAMPING if signal.damping is None else signal.damping  # without one a first guess, from which ζ is fitted
    scan = Scan(speed=signal.scan_speed, damping=damping)
    textures = [texture, *(shuffled(texture, rng) for _ in range(signal.gratings))]
    first, *others = predict_all(signal.whisker, signal.posture, textures, scan, n_modes=modes + _MORE_MODES)
    return first, others


def _model_damping(signal: BaseSignal, fitted: float) -> dict[str, Any]:
    """Damping ratio of the prediction, and in words where it is from."""
    if signal.damping is not None:
        zeta, source = signal.damping, "as given"
    elif np.isfinite(fitted):
        zeta, source = fitted, "as fitted to mode 1"
    else:
        zeta, source = DAMPING, "the default, as mode 1 was not identified"
    return {"model_damping": zeta, "model_damping_note": f"the prediction has a damping ratio of {zeta:.3g}, {source}"}


def _damped(prediction: Prediction, damping: float) -> Prediction:
    return replace(prediction, scan=replace(prediction.scan, damping=damping))


def _modelled(found: dict[str, xr.Dataset], guess: Array, others: list[Prediction]) -> dict[str, Any]:
    """The prediction, how it agrees, and how those of shuffled textures do."""
    name, time = found["envelope"].attrs["signal"], found["envelope"].time.values
    rate = (len(time) - 1) / float(time[-1] - time[0])
    step = max(1, int(rate / (_PER_CYCLE * guess[-1])))  # an envelope needs no more; lags by the thousand cost time
    measured, predicted = (found[part][f"{name}_envelope"].values for part in ("envelope", "predicted"))
    chance = [band_envelopes(predicted_signal(one, name, time), rate, guess)[0][:, ::step] for one in others]
    held = compare_envelopes(measured[:, ::step], predicted[:, ::step], rate / step, np.array(chance))
    columns = {column: held[column].values for column in ("pseudo_p", "chance_mean", "chance_sd", "pseudo_count")}
    columns |= {column: found["agreement"][column].values for column in ("correlation", "best_lag", "rms_ratio")}
    return columns | {f"{name}_model": found["predicted"][name].values, f"{name}_envelope_model": predicted}


def base_signals(run: Run) -> dict[str, xr.Dataset]:
    """Analyse every base signal of a study: ``base_signal_1``, …; one that fails leaves the others.

    Parameters
    ----------
    run : Run
        The run.

    Returns
    -------
    dict of Datasets
        By name.
    """
    signals, results = run.study.base_signal, dict[str, "xr.Dataset"]()
    for number, signal in enumerate(signals, 1):
        run.progress("base signals", number - 1, len(signals))
        results |= run.attempt(f"base signal {signal.label}", partial(_named, f"base_signal_{number}", signal, run))
        run.progress("base signals", number, len(signals))
    return results


def _named(name: str, signal: BaseSignal, run: Run) -> dict[str, xr.Dataset]:
    return {name: analyse_signal(signal, run.study.folder)}
