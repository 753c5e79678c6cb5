"""Answers to the page: the picture, the model's remarks on its assumptions, two textures compared."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConvergenceError, FormatError, InputError
from vibrissa.mechanics.scan.diagnostics import diagnostics, relief_diagnostics, relief_remarks, remarks
from vibrissa.mechanics.scan.relief_prediction import free_end_depth
from vibrissa.mechanics.scan.sampled import sampling_times
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.page.answer.contrast import discrimination, expected_counts
from vibrissa.page.answer.frames import packed, sketched
from vibrissa.page.panel.state import read_state
from vibrissa.page.shaft_table import NODE
from vibrissa.page.signals import RATE, instants, live_arrays, node_motion
from vibrissa.page.whole.drawn import whole_arrays
from vibrissa.signals.envelope import analytic_envelope

if TYPE_CHECKING:
    from vibrissa.arrays import Array
    from vibrissa.mechanics.scan.sampled import Predicted
    from vibrissa.page.panel.state import PageState
    from vibrissa.page.session import PageSession

Arrays = Mapping[str, NDArray[np.float32]]
Answer = tuple[dict[str, Any], Arrays]  # what JSON can say, and arrays

SKETCHED, MOST = ("modes", "envelopes", "moment", "drive", "firing"), 4096  # drawn only, on fewer than 2,000 columns
LONGEST_ASK = 1 << 16  # bytes of one question: a state is a thirtieth of it


class GivenUpError(Exception):
    """The next message waits: this answer is no longer wanted."""


def _patient() -> bool:
    return False


def answer(session: PageSession, message: str | bytes, hurried: Callable[[], bool] = _patient) -> str | bytes:
    """Answer one message of the page; an error is answered with its one line.

    Parameters
    ----------
    session : PageSession
        That makes the predictions.
    message : str
        JSON with ``id`` (given back), ``want``: ``live``, ``notes`` or ``contrast``, and ``state``.
    hurried : callable
        Whether the next message waits: then notes and contrast, which take longer, are given up.

    Returns
    -------
    bytes or str
        A binary message, see :mod:`vibrissa.page.answer.frames`, or JSON.
    """
    ask: dict[str, Any] = {}
    arrays: Arrays = {}
    try:
        ask = _asked(message)
        said, arrays = ANSWERS[ask["want"]](session, read_state(ask["state"]), hurried)
    except GivenUpError:
        said = {"given_up": True}
    except (InputError, ConvergenceError) as error:
        said = {"error": str(error)}
    except Exception as error:  # the page and its other answers go on
        said, arrays = {"error": unforeseen(error)}, {}
    said = {"id": ask.get("id"), "want": ask.get("want"), **said}
    return packed(said, arrays) if arrays else json.dumps(said)


def unforeseen(error: Exception) -> str:
    """Line for an error that is nobody's bad input.

    Parameters
    ----------
    error : Exception
        Any.

    Returns
    -------
    str
        One line, of limited length.
    """
    words = " ".join(str(error).split())[:200]
    return (
        f"this could not be computed, which is a fault of vibrissa: please report it ({type(error).__name__}: {words})"
    )


def _asked(message: str | bytes) -> dict[str, Any]:
    if not isinstance(message, str) or len(message) > LONGEST_ASK:
        raise FormatError("message", f"must be text of at most {LONGEST_ASK} characters", len(message))
    try:
        ask = json.loads(message)
    except (ValueError, RecursionError) as error:
        raise FormatError("message", "must be JSON", remedy=str(error)[:80]) from error
    if not isinstance(ask, dict) or not isinstance(ask.get("state"), dict) or ask.get("want") not in list(ANSWERS):
        raise FormatError("message", f"must be an object with a state, wanting one of {', '.join(ANSWERS)}")
    number = ask.get("id")
    return {**ask, "id": number if isinstance(number, int) and 0 <= number < 2**53 else 0}


def _on(hurried: Callable[[], bool]) -> None:
    """Between two steps of a long answer."""
    if hurried():
        raise GivenUpError


def _live(session: PageSession, state: PageState, hurried: Callable[[], bool]) -> Answer:
    if state.whole:
        return _whole(session, state, hurried)
    prediction = session.predict(state)
    arrays = live_arrays(prediction, state.unit, session.shaft_tables(state))
    return {**facts(prediction), **_levels(arrays), "threshold": state.unit.threshold}, _drawn(arrays)


def _drawn(arrays: Arrays) -> Arrays:
    drawn = {name: values for name, values in arrays.items() if name != "curvature"}
    return drawn | {name: sketched(arrays[name], MOST) for name in SKETCHED}


def _whole(session: PageSession, state: PageState, hurried: Callable[[], bool]) -> Answer:
    """The whole whisker, and beside it the same one cut at its contact; or how far they are."""
    job = session.whole_job(state)
    found = session.whole.get([job.cut(), job], hurried)
    if isinstance(found, float):
        return {"progress": found}, {}
    cut, scan = found
    arrays = whole_arrays(scan, job, state.unit)
    said = {**scan.facts, **_levels(arrays), "threshold": state.unit.threshold, "cut_tip": cut.facts["tip"]}
    said["less"] = float(cut.record.displacement.std() / scan.record.displacement.std())
    more = {"excursion": cut.record.excursion, "displacement": cut.record.displacement, **cut.record.shaft}
    return said, {**_drawn(arrays), **{f"cut_{name}": values.astype("<f4") for name, values in more.items()}}


def _levels(arrays: Arrays) -> dict[str, Any]:
    """Means and standard deviations of the modes [m], and curvature over moment at the base [1/(N m²)]."""
    modes, moment = arrays["modes"].astype(float), np.abs(arrays["moment"])
    most = int(moment.argmax())
    bent = float(arrays["curvature"][most] / arrays["moment"][most]) if moment[most] else 0.0
    return {"mean": modes.mean(axis=1).tolist(), "rms": modes.std(axis=1).tolist(), "curvature_by_moment": bent}


def facts(prediction: Predicted) -> dict[str, Any]:
    """Numbers that the page shows of a prediction: SI, but adimensional where named so.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        Of a state.

    Returns
    -------
    dict
        Numbers, lists of numbers and flags by name.
    """
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


def _notes(session: PageSession, state: PageState, hurried: Callable[[], bool]) -> Answer:
    if state.whole:
        found = session.whole.get([session.whole_job(state)], hurried)
        return ({"progress": found} if isinstance(found, float) else {"notes": [found[0].verdict]}), {}
    return {"notes": notes(session.predict(state), hurried)}, {}


def notes(prediction: Predicted, hurried: Callable[[], bool] = _patient) -> list[str]:
    """Remarks of the model on its own assumptions, one line each.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        Of a state.
    hurried : callable
        Whether a newer question waits.

    Returns
    -------
    list of str
        The lines.
    """
    t = sampling_times(prediction, RATE)
    if isinstance(prediction, Prediction):
        return remarks(diagnostics(prediction, t))
    data = relief_diagnostics(prediction, t)
    _on(hurried)
    depth = free_end_depth(prediction, t)
    _on(hurried)
    counts = {f"{kind}s": count for kind, count in prediction.episodes.counts.items()}
    return relief_remarks(data.assign(free_end_depth=("time", depth)).assign_attrs(counts))


def _contrast(session: PageSession, state: PageState, hurried: Callable[[], bool]) -> Answer:
    found = _motions(session, state, hurried)
    if isinstance(found, float):
        return {"progress": found}, {}
    rates = [(t, state.unit.rate(t, drive)) for t, _, drive in found]
    moved = {f"displacement_{letter}": one[1].astype("<f4") for letter, one in zip("ab", found, strict=True)}
    duration = min(t[-1] for t, _ in rates)
    first, second = counts = [expected_counts(t, rate, duration) for t, rate in rates]
    said = {
        "rate": RATE,
        "node": NODE,
        "by_course": discrimination(first, second),
        "by_count": discrimination(first.sum(keepdims=True), second.sum(keepdims=True)),
        "duration": float(duration),
    }
    return said, moved | {f"counts_{letter}": one.astype("<f4") for letter, one in zip("ab", counts, strict=True)}


def _motions(
    session: PageSession, state: PageState, hurried: Callable[[], bool]
) -> list[tuple[Array, Array, Array]] | float:
    """Times, displacement 5 mm from the base and its envelope for either texture; or how far they are."""
    if state.whole:
        scans = session.whole.get([session.whole_job(state, letter) for letter in "ab"], hurried)
        if isinstance(scans, float):
            return scans
        moved = [scan.record.displacement for scan in scans]
        return [(np.arange(len(one)) / RATE, one, analytic_envelope(one)[0]) for one in moved]
    motions = []
    for letter in "ab":
        prediction = session.predict(state, letter)
        _on(hurried)
        known, t = session.shaft_tables(state, letter), instants(prediction)
        _on(hurried)
        motions.append((t, *node_motion(prediction, t, known)))
    return motions


ANSWERS: dict[str, Callable[[PageSession, PageState, Callable[[], bool]], Answer]] = {
    "live": _live,
    "notes": _notes,
    "contrast": _contrast,
}
