"""What the page asks for, answered: the picture, what the model says of itself, two textures side by side."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.diagnostics import diagnostics, relief_diagnostics, relief_remarks, remarks
from vibrissa.mechanics.sampled import sampling_times
from vibrissa.mechanics.superposition import Prediction
from vibrissa.mechanics.topography import free_end_depth
from vibrissa.page.contrast import discrimination, expected_counts
from vibrissa.page.frames import packed, sketched
from vibrissa.page.shaft import NODE
from vibrissa.page.signals import RATE, instants, live_arrays, node_motion
from vibrissa.page.state import read_state

if TYPE_CHECKING:
    from vibrissa.page.bench import Bench, Motion

SKETCHED, MOST = ("modes", "envelopes", "moment", "firing"), 4096  # drawn only, on fewer than 2,000 columns
LONGEST_ASK = 1 << 16  # bytes of one question: a state is a thirtieth of it


class GivenUpError(Exception):
    """Nobody waits for this answer any longer."""


def _patient() -> bool:
    return False


def answer(bench: Bench, message: str | bytes, hurried: Callable[[], bool] = _patient) -> str | bytes:
    """Answer one message of the page; an error is answered with its one line.

    Parameters
    ----------
    bench : Bench
        That makes the predictions.
    message : str
        JSON with ``id`` (given back), ``want``: ``live``, ``notes`` or ``contrast``, and ``state``.
    hurried : callable
        Whether the next message waits: then notes and contrast, which take longer, are given up.

    Returns
    -------
    bytes or str
        A binary message, see :mod:`vibrissa.page.frames`, or JSON.
    """
    ask: dict[str, Any] = {}
    try:
        ask = _asked(message)
        return ANSWERS[ask["want"]](bench, ask, hurried)
    except GivenUpError:
        return json.dumps({"id": ask["id"], "want": ask["want"], "given_up": True})
    except (InputError, ConvergenceError) as error:
        return json.dumps({"id": ask.get("id"), "want": ask.get("want"), "error": str(error)})


def _asked(message: str | bytes) -> dict[str, Any]:
    if not isinstance(message, str) or len(message) > LONGEST_ASK:
        raise InputError("message", f"must be text of at most {LONGEST_ASK} characters", len(message))
    try:
        ask = json.loads(message)
    except (ValueError, RecursionError) as error:
        raise InputError("message", "must be JSON", remedy=str(error)[:80]) from error
    if not isinstance(ask, dict) or not isinstance(ask.get("state"), dict) or ask.get("want") not in list(ANSWERS):
        raise InputError("message", f"must be an object with a state, wanting one of {', '.join(ANSWERS)}")
    number = ask.get("id")
    return {**ask, "id": number if isinstance(number, int) and 0 <= number < 2**53 else 0}


def _on(hurried: Callable[[], bool]) -> None:
    """Between two steps of a long answer."""
    if hurried():
        raise GivenUpError


def _live(bench: Bench, ask: Mapping[str, Any], hurried: Callable[[], bool]) -> bytes:
    state = read_state(ask["state"])
    prediction = bench.predict(state)
    arrays = live_arrays(prediction, state.unit, bench.ways(state))
    told = {"id": ask["id"], "want": "live", **facts(prediction), **_levels(arrays)}
    drawn = {name: values for name, values in arrays.items() if name not in ("curvature", "drive")}
    return packed(told, drawn | {name: sketched(arrays[name], MOST) for name in SKETCHED})


def _levels(arrays: Mapping[str, NDArray[np.float32]]) -> dict[str, Any]:
    """Means and standard deviations of the modes [m], and curvature over moment at the base [1/(N m²)]."""
    modes, moment = arrays["modes"].astype(float), np.abs(arrays["moment"])
    most = int(moment.argmax())
    bent = float(arrays["curvature"][most] / arrays["moment"][most]) if moment[most] else 0.0
    return {"mean": modes.mean(axis=1).tolist(), "rms": modes.std(axis=1).tolist(), "curvature_by_moment": bent}


def facts(prediction: Motion) -> dict[str, Any]:
    """What the page says of a prediction in numbers: SI, but adimensional where named so."""
    flat, length = prediction.response.flat, prediction.whisker.length
    return {
        "rate": RATE,
        "speed": prediction.scan.speed,
        "length": length,
        "contact": prediction.posture.contact,
        "tip": prediction.whisker.tip,
        "height": flat.base[1] * length,
        "distance": flat.base[0] * length,
        "frequency": (prediction.omega / (2 * np.pi)).tolist(),
        "timescale": prediction.whisker.timescale,
        "gaps": isinstance(prediction, Prediction),
        **prediction.surface,
    }


def _notes(bench: Bench, ask: Mapping[str, Any], hurried: Callable[[], bool]) -> str:
    state = read_state(ask["state"])
    return json.dumps({"id": ask["id"], "want": "notes", "notes": notes(bench.predict(state), hurried)})


def notes(prediction: Motion, hurried: Callable[[], bool] = _patient) -> list[str]:
    """What the model says of its own assumptions, one line each."""
    t = sampling_times(prediction, RATE)
    if isinstance(prediction, Prediction):
        return remarks(diagnostics(prediction, t))
    data = relief_diagnostics(prediction, t)
    _on(hurried)
    depth = free_end_depth(prediction, t)
    _on(hurried)
    counts = {f"{kind}s": count for kind, count in prediction.episodes.counts.items()}
    return relief_remarks(data.assign(free_end_depth=("time", depth)).assign_attrs(counts))


def _contrast(bench: Bench, ask: Mapping[str, Any], hurried: Callable[[], bool]) -> bytes:
    state = read_state(ask["state"])
    sounds, rates, counts = {}, {}, []
    ends = []
    for letter in "ab":
        prediction = bench.predict(state, letter)
        _on(hurried)
        known, t = bench.ways(state, letter), instants(prediction)
        _on(hurried)
        moved, drive = node_motion(prediction, t, known)
        rates[letter] = (t, state.unit.rate(t, drive))
        sounds[f"displacement_{letter}"] = moved.astype("<f4")
        ends.append(t[-1])
    counts = [expected_counts(*rates[letter], min(ends)) for letter in "ab"]
    told = {
        "id": ask["id"],
        "want": "contrast",
        "rate": RATE,
        "node": NODE,
        "by_course": discrimination(*counts),
        "by_count": discrimination(*(np.array([one.sum()]) for one in counts)),
        "duration": float(min(ends)),
    }
    binned = {f"counts_{letter}": one.astype("<f4") for letter, one in zip("ab", counts, strict=True)}
    return packed(told, {**sounds, **binned})


ANSWERS: dict[str, Callable[[Bench, Mapping[str, Any], Callable[[], bool]], str | bytes]] = {
    "live": _live,
    "notes": _notes,
    "contrast": _contrast,
}
