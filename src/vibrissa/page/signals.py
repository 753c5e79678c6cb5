"""Arrays that the page draws of one prediction: signals, spectrogram, resonances, firing, and the whisker's way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import count
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft, rfftfreq

from vibrissa.arrays import Array
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.scan.follicle import base_curvature, base_moment
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction
from vibrissa.mechanics.scan.sampled import sampling_times
from vibrissa.neural.simulated.virtual import draw_spikes
from vibrissa.page.shaft_table import shaft_tables
from vibrissa.signals.envelope import MIRRORED, analytic_envelope
from vibrissa.texture.relief import HeightProfile

if TYPE_CHECKING:
    from vibrissa.mechanics.scan.sampled import Predicted
    from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
    from vibrissa.page.shaft_table import ShaftTables
    from vibrissa.texture.surface import Gaps

Arrays = dict[str, NDArray[np.float32]]

RATE = 10_000.0  # [Hz] eight samples and more in a period of the third mode of any rat whisker
TRIALS = 12  # of the raster
POSITIONS = 800  # moments at which the shaft is placed, at most
WINDOW, MOST_COLUMNS = 512, 160  # samples of one spectrum, 51 ms; spectra over the record
ABOVE = 1.25  # highest frequency of the spectrogram over that of the last mode
CONTACTS = np.linspace(0.02, 0.95, 94)
DRAWN = 20_000  # points of a relief that are drawn


@dataclass(frozen=True)
class ScanRecord:
    """What a scan gives to be drawn, whichever model made it.

    Attributes
    ----------
    excursion : (T,) array
        d at even times from 0, 10 kHz [m]; NaN without contact.
    modes : (3, T) array
        What a movie shows of each mode [m].
    curvature, moment : (T,) arrays
        At the base [1/m], [N m].
    displacement : (T,) array
        5 mm from the base, less its mean [m].
    shaft : dict
        Points of the shaft and where they are, see :func:`live_arrays`.
    """

    excursion: Array
    modes: Array
    curvature: Array
    moment: Array
    displacement: Array
    shaft: Mapping[str, Array]


def live_arrays(prediction: Predicted, unit: ThresholdLinearUnit, known: ShaftTables | None = None) -> Arrays:
    """Everything drawn of a prediction, as float32 arrays by name.

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
        As of :func:`arrays_of`.
    """
    t, length, known = instants(prediction), prediction.whisker.length, known or shaft_tables(prediction)
    quasi_static, q = prediction.drive(t), prediction.amplitudes(t)
    bent = base_curvature(prediction.whisker, prediction.response.basis.base_curvature, q)
    curvature = quasi_static[len(q)] / length + bent
    record = ScanRecord(
        excursion=prediction.excursion(t) * length,
        modes=(q + quasi_static[: len(q)]) * length,
        curvature=curvature,
        moment=base_moment(prediction.whisker, curvature),
        displacement=_moved(prediction, t, q, known),
        shaft=_shaft(prediction, t, q, known),
    )
    surface = prediction.relief if isinstance(prediction, ReliefPrediction) else prediction.texture
    return arrays_of(record, unit, surface, float(prediction.omega[-1]) / (2 * np.pi), prediction.whisker.timescale)


def arrays_of(
    record: ScanRecord, unit: ThresholdLinearUnit, surface: Gaps | HeightProfile, third: float, timescale: float
) -> Arrays:
    """Everything drawn of a scan, as float32 arrays by name.

    Parameters
    ----------
    record : ScanRecord
        The scan.
    unit : ThresholdLinearUnit
        Driven by the envelope of the shaft's displacement 5 mm from the base.
    surface : Gaps or HeightProfile
        Under the whisker.
    third : float
        Resonant frequency of the third mode [Hz].
    timescale : float
        Of the whisker [s].

    Returns
    -------
    dict
        On an even grid of 10 kHz from 0: ``excursion`` d (T,) [m]; ``modes`` q + Q(d), ``envelopes`` (3, T)
        [m]; ``curvature`` (T,) [1/m], ``moment`` (T,) [N m]; ``displacement`` (T,) [m] 5 mm from the base, less its
        mean, and ``drive``, its envelope; ``firing`` (T,), rate [Hz]. ``spikes`` (2, N): times [s] and trials.
        ``spectrogram`` (F, W) [dB re 1 µm²/Hz] of the displacement, ``spectrogram_axes`` (2, 2): first and last
        frequency [Hz] and time [s]. ``resonance`` (4, E): ε and the three resonant frequencies [Hz] of this whisker
        pinned there. ``shaft`` (S,) from tip to base, ``shaft_x``, ``shaft_y`` (P, S) [m] from the base,
        ``shaft_time`` (P,) [s]. ``surface`` (2, N): corners of the surface, place and height [m].
    """
    drive = analytic_envelope(record.displacement)[0]
    arrays = {
        "excursion": record.excursion,
        "modes": record.modes,
        "envelopes": analytic_envelope(record.modes)[0],
        "curvature": record.curvature,
        "moment": record.moment,
        "displacement": record.displacement,
        "drive": drive,
        **_firing(unit, np.arange(len(drive)) / RATE, drive),
        **_spectrogram(record.displacement, ABOVE * third),
        "resonance": _resonances_by_contact(timescale),
        **record.shaft,
        "surface": _corners(surface),
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
    return np.arange(quick_count(len(sampling_times(prediction, RATE)))) / RATE


def quick_count(n: int) -> int:
    """Samples of a record that transforms quickly: up to 3 % more.

    Parameters
    ----------
    n : int
        Samples that it must have.

    Returns
    -------
    int
        At least as many.
    """
    if n <= MIRRORED:
        return n
    return next(more for more in count(n) if next_fast_len(more + 2 * MIRRORED) == more + 2 * MIRRORED)


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
    moved = _moved(prediction, t, prediction.amplitudes(t), known or shaft_tables(prediction))
    return moved, analytic_envelope(moved)[0]


def _moved(prediction: Predicted, t: Array, q: Array, known: ShaftTables) -> Array:
    moved = known.node.across(prediction, t, q)[:, 0] * prediction.whisker.length
    return moved - moved.mean()


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
    window = 0.5 - 0.5 * np.cos(np.pi * np.arange(2 * half) / half)  # of Hann
    parts = sliding_window_view(mirrored, 2 * half)[::hop]
    frequency = rfftfreq(2 * half, 1 / RATE)
    kept = frequency <= highest
    amplitude = rfft((parts - parts.mean(axis=1, keepdims=True)) * window)[:, kept].T
    power = 2 * np.abs(amplitude) ** 2 / (RATE * (window**2).sum())
    power[0] /= 2  # 0 Hz has no twin of negative frequency
    decibels = 10 * np.log10(np.maximum(power * 1e12, 1e-9))
    axes = np.array([[0, frequency[kept][-1]], [0, hop * (len(parts) - 1) / RATE]])
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


def _corners(surface: Gaps | HeightProfile) -> Array:
    """Corners of the surface, place along the scan and height [m], (2, N)."""
    if isinstance(surface, HeightProfile):
        few = slice(None, None, -(-len(surface.position) // DRAWN))
        return np.stack([surface.position[few], surface.height[few]])
    edges = np.stack([surface.position, surface.position, surface.end, surface.end], axis=1).ravel()
    return np.stack([edges, np.tile([0.0, -surface.depth, -surface.depth, 0.0], surface.position.size)])
