"""The 24 whiskers: circularly shifted copies of one loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, ShapeError, require_not_negative, require_positive
from vibrissa.quantities import dataset
from vibrissa.stimulus.band import RESONANCES, Band
from vibrissa.stimulus.delays import (
    WHISKERS,
    circular_correlation,
    correlation_note,
    even_shifts,
    largest_separation,
    least_shifts,
    pair_correlations,
    random_shifts,
)
from vibrissa.stimulus.limits import Limits, ramped, rate_of, refuse_beyond, refuse_ramps
from vibrissa.stimulus.loop import joined, samples, seam_note, seam_steps
from vibrissa.stimulus.waveform import PointMotion

Spread = Literal["even", "random", "least"]


def shifts_of(delays: Sequence[float], length: int, sampling_rate: float) -> Integers:
    """Shifts [samples] of given delays [s], one for each whisker, in [0, record).

    Parameters
    ----------
    delays : (W,) sequence of float
        Delay of each whisker [s].
    length : int
        Of the record [samples].
    sampling_rate : float
        [Hz].

    Returns
    -------
    (W,) array of int
        Shifts [samples].

    Raises
    ------
    InputError
        If they are not one for each whisker, or outside the record.
    """
    values = np.asarray(delays, float)
    if values.shape != (len(WHISKERS),):
        raise ShapeError("delays", f"must be {len(WHISKERS)} times in s, one for each whisker", values.size)
    wrong = ~((values >= 0) & (values < length / sampling_rate))
    if wrong.any():
        name, value = WHISKERS[int(np.argmax(wrong))], values[np.argmax(wrong)]
        rule = f"must lie in the record, 0 to below {length / sampling_rate:g} s"
        raise RangeError(f"delay of {name}", rule, f"{value:g} s")
    return np.round(values * sampling_rate).astype(np.int64) % length


def replay_command(
    motions: Sequence[PointMotion],
    *,
    duration: float = 10.0,
    sampling_rate: float = 20000.0,
    band: Band | None = None,
    fade: float = 0.05,
    ramp: float = 0.0,
    scale: float = 1.0,
    delays: Spread | Sequence[float] = "even",
    separation: float = 0.1,
    seed: int = 0,
    limits: Limits | None = None,
) -> xr.Dataset:
    """Command of the 24-whisker stimulator that replays the motion of one whisker on textures.

    As in the Methods of [Boubenec2014]_, "Multiwhisker stimulation": textures one after the other for 10 s, Bessel
    filtered to 0.1–83 Hz, shifted in time from whisker to whisker. Here the record is a loop and the shifts are
    circular: copy(t) = loop((t − delay) mod duration).

    Parameters
    ----------
    motions : sequence of PointMotion
        Motion 5 mm from the base, one for each texture.
    duration, sampling_rate : float
        Of the command [s], [Hz].
    band : Band, optional
        The filter; of order 4, −3 dB at its corners, causal by default.
    fade : float
        Overlap of neighbouring textures [s].
    ramp : float
        From rest into the loop and back [s], before time 0 and after ``duration``; 0 for a loop that is played on and
        on. Without it the command starts at ``start_value``, a step from rest that no limit is held against.
    scale : float
        Factor on the command.
    delays : {"even", "random", "least"} or sequence of float
        How the copies are spread, or the delay of each whisker [s].
    separation : float
        Least time between two delays that are random or searched for [s].
    seed : int
        Of random delays.
    limits : Limits, optional
        Of the stimulator.

    Returns
    -------
    Dataset
        ``command`` (whisker, time) [m], 0 at rest; ``delay``, ``start_value``, ``copy_correlation``;
        ``largest_correlation``, ``rms_correlation``, ``peak_travel``, ``peak_speed``, ``peak_acceleration``; at
        ``frequency`` what the filter does to resonances; at each ``seam`` its steps over the largest elsewhere, and
        ``seam_source_time``, the time of the motion that is replayed there [s].

    Raises
    ------
    InputError
        Names the setting that is out of range; if the motions are too short, or the stimulator cannot follow.
    """
    band, limits = band or Band(), limits or Limits()
    length = samples(duration, sampling_rate)
    _refuse_settings(motions, scale, separation, seed, band)
    if not 0 <= ramp <= duration:
        raise RangeError("ramp", f"must lie between 0 and the duration of {duration:g} s", ramp)
    raw, seams, begins = joined(motions, duration, sampling_rate, fade=fade)
    loop = scale * band.filtered(raw, sampling_rate)
    correlation = circular_correlation(loop)
    _refuse_separation(delays, separation, length, sampling_rate)
    shifts = _shifts(delays, correlation, sampling_rate, round(separation * sampling_rate), seed)
    refuse_beyond(loop, shifts, sampling_rate, limits, scale)
    lead = round(ramp * sampling_rate)
    command = ramped(loop[(np.arange(length) - shifts[:, None]) % length], lead)
    refuse_ramps(command, lead, sampling_rate, limits)
    pairs = _correlations(correlation, shifts)
    at_seams = _seams(raw, loop, seams, fade, sampling_rate)
    notes = {
        "correlation_note": correlation_note(correlation, pairs["largest_correlation"], len(WHISKERS)),
        "resonance_note": resonance_note(motions, band, sampling_rate),
        "seam_note": seam_note(at_seams["seam_step_unfiltered"], seams),
    }
    numbers = {"duration": duration, "sampling_rate": sampling_rate, "fade": fade, "ramp": ramp, "scale": scale}
    return dataset(
        _settings(motions, band, delays, separation, seed, limits) | numbers | notes,
        whisker=np.array(WHISKERS),
        time=np.arange(-lead, length + lead) / sampling_rate,
        command=command,
        delay=shifts / sampling_rate,
        start_value=command[:, 0],
        **pairs,
        **_peaks(loop, sampling_rate),
        **_on_resonances(motions, band, sampling_rate),
        **at_seams,
        seam_source_time=begins,
    )


def resonance_note(motions: Sequence[PointMotion], band: Band, sampling_rate: float) -> str:
    """Gain of the filter at the whisker's first resonance, in one line; empty where it is half or more.

    Parameters
    ----------
    motions : sequence of PointMotion
        Motions that are replayed.
    band : Band
        The filter.
    sampling_rate : float
        [Hz].

    Returns
    -------
    str
        The line.
    """
    known = [motion.resonance for motion in motions if 0 < motion.resonance < sampling_rate / 2]
    if not known:
        return ""
    gain = float(np.abs(band.response(np.array([max(known)]), sampling_rate))[0])
    if gain >= 0.5:
        return ""
    way = "" if band.causal and band.norm == "mag" else ", or filter less (`causal=True`, `norm='mag'`)"
    text = f"the whisker's first resonance, {max(known):.3g} Hz, passes the band with gain {gain:.2g}"
    return f"{text}: slower motion is replayed for the most part; take a whisker that rings lower{way}"


def _refuse_settings(motions: Sequence[PointMotion], scale: float, separation: float, seed: int, band: Band) -> None:
    if not motions:
        raise RangeError("inputs", "must be at least one")
    require_positive("scale", scale)
    require_not_negative("separation", separation, "s")
    require_not_negative("seed", seed)
    for motion in motions:
        if motion.sampling_rate < 4 * band.high:  # a cubic spline keeps 1 % up to a quarter of the rate
            rule = f"must be at least four times `high`, {4 * band.high:g} Hz"
            remedy = f"lower `high` to at most {motion.sampling_rate / 4:.6g} Hz, or sample the motion faster"
            raise RangeError(f"{motion.source}: sampling rate", rule, f"{motion.sampling_rate:g} Hz", remedy)


def _refuse_separation(delays: Spread | Sequence[float], separation: float, length: int, rate: float) -> None:
    """Refuse a separation of random or searched delays for which the record has no room."""
    if not isinstance(delays, str) or delays not in ("random", "least"):
        return
    largest = largest_separation(len(WHISKERS), length, searched=delays == "least") / rate
    if round(separation * rate) > round(largest * rate):
        rule = f"must be at most {largest:.4g} s, which leaves room for {len(WHISKERS)} copies in {length / rate:g} s"
        remedy = f"lower it, or lengthen `duration` to more than {len(WHISKERS) * separation:g} s"
        raise RangeError("separation", rule, f"{separation:g} s", remedy)


def _shifts(delays: Spread | Sequence[float], correlation: Array, rate: float, separation: int, seed: int) -> Integers:
    count, length = len(WHISKERS), len(correlation)
    if not isinstance(delays, str):
        return shifts_of(delays, length, rate)
    if delays == "even":
        return even_shifts(count, length)
    if delays == "random":
        return random_shifts(count, length, separation, rng=np.random.default_rng(seed))
    if delays == "least":
        return least_shifts(correlation, count, separation)
    raise ShapeError("delays", f"must be {', '.join(get_args(Spread))} or {count} times in s", repr(delays))


def _correlations(correlation: Array, shifts: Integers) -> dict[str, Any]:
    pairs = np.abs(pair_correlations(correlation, shifts))
    np.fill_diagonal(pairs, 0)
    rms = float(np.sqrt(np.mean(correlation**2)))
    return {"copy_correlation": pairs.max(1), "largest_correlation": float(pairs.max()), "rms_correlation": rms}


def _seams(raw: Array, loop: Array, seams: Array, fade: float, rate: float) -> dict[str, Any]:
    step, bend = seam_steps(loop, seams, fade, rate)
    raw_step, raw_bend = seam_steps(raw, seams, fade, rate)
    found = {"seam": np.arange(1, len(seams) + 1), "seam_time": seams, "seam_step": step, "seam_bend": bend}
    return found | {"seam_step_unfiltered": raw_step, "seam_bend_unfiltered": raw_bend}


def _peaks(loop: Array, rate: float) -> dict[str, Any]:
    speed, acceleration = (float(np.abs(rate_of(loop, rate, times)).max()) for times in (1, 2))
    return {"peak_travel": float(np.abs(loop).max()), "peak_speed": speed, "peak_acceleration": acceleration}


def _on_resonances(motions: Sequence[PointMotion], band: Band, rate: float) -> dict[str, Any]:
    known = [motion.resonance for motion in motions if 0 < motion.resonance < rate / 2 - 1]
    frequency = np.unique([band.high, *(one for one in RESONANCES if one < rate / 2 - 1), *known])
    response = band.response(frequency, rate)
    return {
        "frequency": frequency,
        "band_gain": np.abs(response),
        "band_phase": np.angle(response),
        "band_group_delay": band.group_delay(frequency, rate),
    }


def _settings(
    motions: Sequence[PointMotion],
    band: Band,
    delays: Spread | Sequence[float],
    separation: float,
    seed: int,
    limits: Limits,
) -> dict[str, Any]:
    spread = delays if isinstance(delays, str) else "given"
    chosen = {"separation": separation} if spread in ("random", "least") else {}
    return {
        "sources": ", ".join(motion.source for motion in motions),
        "filter": band.description,
        **{f"filter_{name}": int(value) if isinstance(value, bool) else value for name, value in asdict(band).items()},
        "delays": spread,
        **chosen,
        **({"seed": seed} if spread == "random" else {}),
        **{f"limit_{name}": "none" if value is None else value for name, value in asdict(limits).items()},
        "copies": "circular: copy(t) = loop((t - delay) mod duration)",
        "zero": "displacement 0 is the resting position",
    }
