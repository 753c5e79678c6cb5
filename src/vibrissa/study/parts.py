"""The parts of a study: which are there, what the absent ones would give, which results and files they stand for."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from vibrissa.errors import InputError
from vibrissa.study.checked import keys_of
from vibrissa.study.inputs import input_files
from vibrissa.study.recorded_sweeps import RecordedSweep, read_sweeps
from vibrissa.study.settings import Study

GIVES = {  # by the key of a study: what a part adds to the report
    "movie": "centrelines of a recorded movie, and how sure they are (Figure 3)",
    "film": "a virtual movie and its centrelines, with the truth beside what is found",
    "whisker": "the whisker's posture from its mean profile (Figure 1)",
    "posture": "with the whisker, its modes, envelopes and resonances (Figures 4 and 5)",
    "scan": "with whisker, posture and texture, the vibration that is predicted",
    "texture": "what the surface does to the whisker, or, with a film, prediction against what is found (Figure 6)",
    "recording": "spikes of one simulated unit that the envelope drives (Figure 8)",
    "laboratory": "many virtual sweeps (Figures 1 to 7), and paper | here | same?",
    "sweeps": "many recorded sweeps (Figures 1 to 7), and paper | here | same?",
    "base_signal": "resonance, damping and envelope of signals at the base, of a robot or an isolated whisker",
    "cortex": "a simulated population at the stimulator (Figures 8 and 9)",
    "neural": "whether the envelope drives each recorded unit (Figures 8 and 9)",
}
_TRACKED = ("profile", "posture", "modal", "resonance_white", "spectra_white")
_MODEL = ("gap", "gaps", "gain_map")


class Input(NamedTuple):
    """A file that a study reads: its name there, its path, its size [bytes], and the rule that it breaks, if any."""

    name: str
    path: Path
    size: int
    problem: str


def given(study: Study) -> list[str]:
    """Keys of the parts that a study has."""
    return [name for name in _parts(study) if getattr(study, name)]


def absent(study: Study) -> list[str]:
    """Keys of the parts that a study could have besides: not those that would stand in another's place."""
    instead = {"movie": "film", "film": "movie", "laboratory": "sweeps", "sweeps": "laboratory"}
    return [name for name in _parts(study) if not getattr(study, name) and not getattr(study, instead.get(name, name))]


def _parts(study: Study) -> list[str]:
    return [name for name in GIVES if name in keys_of(study)]


def expected(study: Study) -> set[str]:
    """Names of the datasets that a study comes to, if nothing in it fails."""
    names = {f"base_signal_{number}" for number in range(1, len(study.base_signal) + 1)}
    if study.only_surface:
        names |= {"scan", *_MODEL}
    if study.laboratory is not None or study.sweeps is not None:
        names |= _of_many(study)
    if study.movie is not None or study.film is not None:
        names |= _of_one(study)
    return names | set(_of_neurons(study))


def _of_neurons(study: Study) -> Iterator[str]:
    """As :func:`vibrissa.study.populations.populations_of` names them; ``unit`` comes only if one is driven."""
    shown = ("spikes", "response", "motion")
    if study.cortex is not None:
        yield from ("units", *(shown if study.recording is None else ()))
    alone = study.cortex is None and study.recording is None and len(study.neural) == 1
    for number in range(1, len(study.neural) + 1):
        yield from (name if alone else f"{name}_{number}" for name in ("units", *shown))


def _of_one(study: Study) -> set[str]:
    names = {"profile", "still"} | ({"posture"} if study.whisker is not None else set())
    if study.whisker is not None and study.posture is not None:
        names |= set(_TRACKED) | ({"spikes", "response"} if study.recording is not None else set())
    if study.film is not None:
        names |= {"prediction", "apparatus", "true_profile", "verdict"}
        names |= {"resonance", "spectra", "resonance_true", "spectra_true"}
    return names


def _of_many(study: Study) -> set[str]:
    names = {"sweeps", "mode_shares", "gain", *_TRACKED, *_MODEL}
    if study.laboratory is not None:
        names |= {"comparison", "sweep_verdict", "apparatus", "still"}
    else:
        table = table_of(study)
        names |= {"comparison"} if any(one.texture is not None for one in table) else set()
        names |= {"still"} if any(one.movie is not None for one in table) else set()
    names |= {"repeats"} if study.comparison.repeats and study.laboratory is not None else set()
    return names | ({"jitter"} if study.comparison.jitter and "comparison" in names else set())


def table_of(study: Study) -> list[RecordedSweep]:
    """Lines of the study's table of sweeps; none where there is no such table.

    Raises
    ------
    InputError
        If the table is bad.
    """
    return [] if study.sweeps is None else read_sweeps(study.folder / study.sweeps)


def inputs(study: Study) -> list[Input]:
    """Every file that a study reads, with its size or what is wrong with it.

    Raises
    ------
    InputError
        If the table of sweeps is missing or bad: then what it names is not known.
    """
    return [_looked_at(name, path) for name, path in input_files(study).items()]


def _looked_at(name: str, path: Path) -> Input:
    if path.is_dir():  # a folder of images, or of another program
        return Input(name, path, sum(one.stat().st_size for one in path.iterdir() if one.is_file()), "")
    if not path.is_file():
        return Input(name, path, 0, "must be an existing file")
    try:
        path.open("rb").close()
    except OSError as error:
        return Input(name, path, 0, f"must be a file that can be read ({error.strerror or error})")
    return Input(name, path, path.stat().st_size, "")


def refuse_missing(found: list[Input]) -> None:
    """Refuse a study whose inputs are not all there.

    Raises
    ------
    InputError
        Names the first, and how many more there are.
    """
    bad = [one for one in found if one.problem]
    if bad:
        more = f"; so must {len(bad) - 1} more of the {len(found)}" if len(bad) > 1 else ""
        raise InputError(str(bad[0].path), f"{bad[0].problem}{more}")
