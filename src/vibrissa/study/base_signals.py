"""A study's base signals: what a robot's or an isolated whisker's sensor told, through the same analysis."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.mechanics.base_response import analyse_base_signal, band_envelopes, predicted_signal
from vibrissa.mechanics.base_signal import Kind, read_base_signal
from vibrissa.mechanics.comparison import compare_envelopes
from vibrissa.mechanics.modes import resonances
from vibrissa.mechanics.profile import Posture
from vibrissa.mechanics.superposition import Scan, predict_all
from vibrissa.quantities import dataset
from vibrissa.texture.io import read_troughs
from vibrissa.texture.shuffled import shuffled
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.superposition import Prediction

Array = NDArray[np.float64]

_MORE_MODES = 4  # in a prediction above those fitted: at the base their quasi-static parts weigh
_PER_CYCLE = 8  # samples of the highest resonance that its envelope is compared at


@dataclass(frozen=True, kw_only=True)
class BaseSignal:
    """A signal measured at the base of a whisker, and what is known of the whisker.

    Attributes
    ----------
    path : str
        ``.wav`` or a table (CSV), relative to the study file.
    name : str
        For the report; the file's by default.
    kind, unit, calibration, sampling_rate, column, rest
        See :func:`vibrissa.mechanics.base_signal.read_base_signal`.
    guess : (float, ...), optional
        About where the resonances stand [Hz]; by default those of whisker and posture, or of the whisker in air.
    modes : int
        Resonances that are looked for, if they are not guessed.
    whisker : Whisker, optional
        The whisker.
    posture : Posture, optional
        How it touches the texture.
    texture : str, optional
        CSV of gaps, relative to the study file: with whisker, posture and speed, the signal is predicted.
    scan_speed : float, optional
        v [m/s].
    start : float
        When x = 0 of the texture meets the contact, in the file's time [s]; to some 50 ms.
    damping : float
        ζ of the prediction; fitted where the texture is known.
    gratings : int
        Shuffled textures whose predictions tell how well chance agrees; 0 for none.
    """

    path: str
    kind: Kind
    unit: str
    name: str = ""
    calibration: float | None = None
    sampling_rate: float | None = None
    column: str | None = None
    rest: tuple[float, float] | None = None
    guess: tuple[float, ...] | None = None
    modes: int = 2
    whisker: Whisker | None = None
    posture: Posture | None = None
    texture: str | None = None
    scan_speed: float | None = None
    start: float = 0.0
    damping: float = 0.11
    gratings: int = 39

    def __post_init__(self) -> None:
        if self.guess is None and self.whisker is None:
            remedy = "give guess, in Hz, or the whisker, and the posture if it touches something"
            raise InputError("base signal", "must tell where its resonances are about", remedy=remedy)
        if not self.modes >= 1:
            raise InputError("BaseSignal.modes", "must be at least 1", self.modes)
        if self.texture is not None:
            needed = {"whisker": self.whisker, "posture": self.posture, "scan_speed": self.scan_speed}
            missing = [name for name, part in needed.items() if part is None]
            if missing:
                raise InputError("base signal with a texture", f"must come with {', '.join(missing)}")

    @property
    def label(self) -> str:
        """Name in the report."""
        return self.name or Path(self.path).stem


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
        textures, ``pseudo_p``, ``chance_mean``, ``chance_sd`` (mode). Attributes ``signal``, ``label``, ``absent``.

    Raises
    ------
    InputError
        If the file or what is known is bad.
    """
    follicle = read_base_signal(
        folder / signal.path,
        kind=signal.kind,
        unit=signal.unit,
        calibration=signal.calibration,
        sampling_rate=signal.sampling_rate,
        column=signal.column,
        rest=signal.rest,
        whisker=signal.whisker,
    )
    follicle = follicle.assign_coords(time=follicle.time - signal.start)
    guess = _guess(signal)
    prediction, others = _predicted(signal, folder, len(guess))
    found = analyse_base_signal(follicle, guess, prediction=prediction)
    columns = _resonances(found, "resonance_white", "_white")
    if prediction is not None:
        columns |= _resonances(found, "resonance", "") | _modelled(found, guess, others)
    absent = "" if prediction is not None else "no texture: nothing is predicted, the forcing is taken for white"
    told = {name: follicle.attrs[name] for name in ("kind", "unit", "calibration", "zero", "clipped")}
    labelled = dataset(mode=found["envelope"].mode.values, time=follicle.time.values, **columns)
    whole = found["envelope"].drop_vars("phase").merge(found["spectra"]).merge(labelled, combine_attrs="override")
    return whole.assign_attrs(**told, label=signal.label, absent=absent)


def _guess(signal: BaseSignal) -> Array:
    if signal.guess is not None or signal.whisker is None:
        return np.array(signal.guess or ())
    if signal.posture is None:
        free = resonances(signal.whisker, signal.whisker.tip, signal.modes, boundary="free")
        return np.asarray(free.resonant_frequency.values)
    pinned = resonances(signal.whisker, signal.posture.contact, signal.modes)
    return np.asarray(pinned.resonant_frequency.values)


def _predicted(signal: BaseSignal, folder: Path, modes: int) -> tuple[Prediction | None, list[Prediction]]:
    """Prediction for the texture, and for its gaps and lands in other orders."""
    if signal.texture is None or signal.whisker is None or signal.posture is None or signal.scan_speed is None:
        return None, []
    texture, rng = read_troughs(folder / signal.texture), np.random.default_rng(0)
    scan = Scan(speed=signal.scan_speed, damping=signal.damping)
    textures = [texture, *(shuffled(texture, rng) for _ in range(signal.gratings))]
    first, *others = predict_all(signal.whisker, signal.posture, textures, scan, n_modes=modes + _MORE_MODES)
    return first, others


def _resonances(found: dict[str, xr.Dataset], which: str, suffix: str) -> dict[str, Any]:
    return {
        f"{name}{suffix}{end}": found[which][name + end].values
        for name in ("resonant_frequency", "damping")
        for end in ("", "_low", "_high")
    }


def _modelled(found: dict[str, xr.Dataset], guess: Array, others: list[Prediction]) -> dict[str, Any]:
    """The prediction, how it agrees, and how those of shuffled textures do."""
    name, time = found["envelope"].attrs["signal"], found["envelope"].time.values
    rate = (len(time) - 1) / float(time[-1] - time[0])
    step = max(1, int(rate / (_PER_CYCLE * guess[-1])))  # an envelope needs no more; lags by the thousand cost time
    measured, predicted = (found[part][f"{name}_envelope"].values for part in ("envelope", "predicted"))
    chance = [band_envelopes(predicted_signal(one, name, time), rate, guess)[0][:, ::step] for one in others]
    held = compare_envelopes(measured[:, ::step], predicted[:, ::step], rate / step, np.array(chance))
    told = {column: held[column].values for column in ("pseudo_p", "chance_mean", "chance_sd")}
    told |= {column: found["agreement"][column].values for column in ("correlation", "best_lag", "rms_ratio")}
    return told | {f"{name}_model": found["predicted"][name].values, f"{name}_envelope_model": predicted}
