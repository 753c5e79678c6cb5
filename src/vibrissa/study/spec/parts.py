"""The parts of a study: which are there, what the absent ones would give, which files they read."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from vibrissa.errors import MissingError
from vibrissa.study.spec.checked import keys_of
from vibrissa.study.spec.inputs import input_files
from vibrissa.study.spec.recorded_sweeps import RecordedSweep, read_sweeps
from vibrissa.study.spec.settings import Study

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


class Input(NamedTuple):
    """A file that a study reads: its name there, its path, its size [bytes], and the rule that it breaks, if any."""

    name: str
    path: Path
    size: int
    problem: str


def has_rod(study: Study) -> bool:
    """Whether the truth of a study's virtual sweeps is the rod.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    bool
        False where it has none.
    """
    return study.laboratory is not None and study.laboratory.truth == "rod"


def every_by_modes(study: Study) -> int:
    """Every how many-th virtual sweep is also filmed with the paper's model as the truth.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    int
        ``comparison.modes`` where the truth of the laboratory is the rod, else 0: none.
    """
    return study.comparison.modes if has_rod(study) else 0


def given(study: Study) -> list[str]:
    """Keys of the parts that a study has.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    list of str
        In the order of ``GIVES``.
    """
    return [name for name in _parts(study) if getattr(study, name)]


def absent(study: Study) -> list[str]:
    """Keys of the parts that a study could have besides: not those that exclude one that it has.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    list of str
        In the order of ``GIVES``.
    """
    instead = {"movie": "film", "film": "movie", "laboratory": "sweeps", "sweeps": "laboratory"}
    return [name for name in _parts(study) if not getattr(study, name) and not getattr(study, instead.get(name, name))]


def _parts(study: Study) -> list[str]:
    return [name for name in GIVES if name in keys_of(study)]


def table_of(study: Study) -> list[RecordedSweep]:
    """Lines of the study's table of sweeps; none where there is no such table.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    list of RecordedSweep
        One for each line.

    Raises
    ------
    InputError
        If the table is bad.
    """
    return [] if study.sweeps is None else read_sweeps(study.folder / study.sweeps)


def inputs(study: Study) -> list[Input]:
    """Every file that a study reads, with its size or what is wrong with it.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    list of Input
        One for each file.

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

    Parameters
    ----------
    found : list of Input
        From :func:`inputs`.

    Raises
    ------
    InputError
        Names the first, and how many more there are.
    """
    bad = [one for one in found if one.problem]
    if bad:
        more = f"; so must {len(bad) - 1} more of the {len(found)}" if len(bad) > 1 else ""
        raise MissingError(str(bad[0].path), f"{bad[0].problem}{more}")
