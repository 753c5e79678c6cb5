"""Arrays that the page draws of one prediction: signals, spectrogram, resonances, firing, and the whisker's way."""

from __future__ import annotations

from functools import lru_cache
from itertools import count
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.signal import spectrogram

from vibrissa.arrays import Array
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.scan.follicle import base_curvature, base_moment
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction
from vibrissa.mechanics.scan.sampled import sampling_times
from vibrissa.neural.simulated.virtual import draw_spikes
from vibrissa.page.shaft_table import shaft_tables
from vibrissa.signals.envelope import MIRRORED, analytic_envelope

if TYPE_CHECKING:
    from vibrissa.mechanics.scan.sampled import Predicted
    from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
    from vibrissa.page.shaft_table import ShaftTables

Arrays = dict[str, NDArray[np.float32]]

RATE = 10_000.0  # [Hz] eight samples and more in a period of the third mode of any rat whisker
TRIALS = 12  # of the raster
POSITIONS = 800  # moments at which the shaft is placed, at most
WINDOW, MOST_COLUMNS = 512, 160  # samples of one spectrum, 51 ms; spectra over the record
ABOVE = 1.25  # highest frequency of the spectrogram over that of the last mode
CONTACTS = np.linspace(0.02, 0.95, 94)
DRAWN = 20_000  # points of a relief that are drawn


def live_arrays(prediction: Predicted, unit: ThresholdLinearUnit, known: ShaftTables | None = None) -> Arrays:
    """Everything drawn, as float32 arrays by name.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        From the session.
    unit : ThresholdLinearUnit
        Driven by the envelope of the shaft's displacement 5 mm from the base.
    known : ShaftTables, optional
        Of the same posture and surface.

    Returns
    -------
    dict
        At :func:`instants`, an even grid of 10 kHz: ``excursion`` d (T,) [m]; ``modes`` q + Q(d), ``envelopes`` (3, T)
        [m]; ``curvature`` (T,) [1/m], ``moment`` (T,) [N m]; ``displacement`` (T,) [m] 5 mm from the base, less its
        mean, and ``drive``, its envelope; ``firing`` (T,), rate [Hz]. ``spikes`` (2, N): times [s] and trials.
        ``spectrogram`` (F, W) [dB re 1 µm²/Hz] of the displacement, ``spectrogram_axes`` (2, 2): first and last
        frequency [Hz] and time [s]. ``resonance`` (4, E): ε and the three resonant frequencies [Hz] of this whisker
        pinned there. ``shaft`` (S,) from tip to base, ``shaft_x``, ``shaft_y`` (P, S) [m] from the base,
        ``shaft_time`` (P,) [s]. ``surface`` (2, N): corners of the surface, place and height [m].
    """
    t, length, known = instants(prediction), prediction.whisker.length, known or shaft_tables(prediction)
    quasi_static, q = prediction.drive(t), prediction.amplitudes(t)
    modes = (q + quasi_static[: len(q)]) * length
    bent = base_curvature(prediction.whisker, prediction.response.basis.base_curvature, q)
    curvature = quasi_static[len(q)] / length + bent
    moved, drive = _moved(prediction, t, q, known)
    arrays = {
        "excursion": prediction.excursion(t) * length,
        "modes": modes,
        "envelopes": analytic_envelope(modes)[0],
        "curvature": curvature,
        "moment": base_moment(prediction.whisker, curvature),
        "displacement": moved,
        "drive": drive,
        **_firing(unit, t, drive),
        **_spectrogram(moved, ABOVE * float(prediction.omega[-1]) / (2 * np.pi)),
        "resonance": _resonances_by_contact(prediction.whisker.timescale),
        **_shaft(prediction, t, q, known),
        "surface": _corners(prediction),
    }
    return {name: np.ascontiguousarray(values, "<f4") for name, values in arrays.items()}


def instants(prediction: Predicted) -> Array:
    """Times of the record [s]: as of `vibrissa scan`, and up to 3 % more, which transforms quickly.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        From the session.

    Returns
    -------
    (T,) array
        From 0, even.
    """
    n = len(sampling_times(prediction, RATE))
    if n > MIRRORED:
        n = next(more for more in count(n) if next_fast_len(more + 2 * MIRRORED) == more + 2 * MIRRORED)
    return np.arange(n) / RATE


def node_motion(prediction: Predicted, t: Array, known: ShaftTables | None = None) -> tuple[Array, Array]:
    """Displacement of the point 5 mm from the base, less its mean, and its envelope.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        From the session.
    t : (T,) array
        Times [s].
    known : ShaftTables, optional
        Of the same posture and surface.

    Returns
    -------
    displacement, envelope : (T,) arrays
        In [m].
    """
    return _moved(prediction, t, prediction.amplitudes(t), known or shaft_tables(prediction))


def _moved(prediction: Predicted, t: Array, q: Array, known: ShaftTables) -> tuple[Array, Array]:
    moved = known.node.across(prediction, t, q)[:, 0] * prediction.whisker.length
    moved -= moved.mean()
    return moved, analytic_envelope(moved)[0]


def _firing(unit: ThresholdLinearUnit, t: Array, drive: Array) -> dict[str, Array]:
    """Predicted rate [Hz] (T,), and spikes of twelve trials drawn from it (2, N)."""
    rate = unit.rate(t, drive)
    times, trials = draw_spikes(t, rate, TRIALS, rng=np.random.default_rng(0))
    return {"firing": rate, "spikes": np.stack([times, trials])}


def _spectrogram(signal: Array, highest: float) -> dict[str, Array]:
    """Spectra up to a frequency [Hz], of windows centred from the first sample to the last, the signal mirrored."""
    half = min(WINDOW // 2, len(signal) - 1)
    hop = max(1, len(signal) // MOST_COLUMNS)
    mirrored = np.pad(signal, half, mode="reflect")
    frequency, time, power = spectrogram(mirrored, RATE, window="hann", nperseg=2 * half, noverlap=2 * half - hop)
    kept = frequency <= highest
    decibels = 10 * np.log10(np.maximum(power[kept] * 1e12, 1e-9))
    axes = np.array([[0, frequency[kept][-1]], time[[0, -1]] - half / RATE])
    return {"spectrogram": decibels, "spectrogram_axes": axes}


@lru_cache(1)
def _kappa_by_contact() -> Array:
    return np.stack([cone_kappa(contact, 3) for contact in CONTACTS.tolist()], axis=1)


def _resonances_by_contact(timescale: float) -> Array:
    """Contacts ε, and the resonant frequencies of the first three modes there [Hz], (4, E)."""
    return np.concatenate([CONTACTS[None], _kappa_by_contact() / (2 * np.pi * timescale)])


def _shaft(prediction: Predicted, t: Array, q: Array, known: ShaftTables) -> dict[str, Array]:
    """Where the shaft is, from the physical tip to the base [m], at even moments."""
    some, length = slice(None, None, -(-len(t) // POSITIONS)), prediction.whisker.length
    x, y = known.shaft.at(prediction, t[some], q[:, some])
    return {"shaft": known.shaft.s, "shaft_x": length * x, "shaft_y": length * y, "shaft_time": t[some]}


def _corners(prediction: Predicted) -> Array:
    """Corners of the surface, place along the scan and height [m], (2, N)."""
    if isinstance(prediction, ReliefPrediction):
        relief = prediction.relief
        few = slice(None, None, -(-len(relief.position) // DRAWN))
        return np.stack([relief.position[few], relief.height[few]])
    texture = prediction.texture
    edges = np.stack([texture.position, texture.position, texture.end, texture.end], axis=1).ravel()
    return np.stack([edges, np.tile([0.0, -texture.depth, -texture.depth, 0.0], texture.position.size)])
