"""A stage of a study: what it reads and makes, its function, what it costs and which figures it draws."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from vibrissa.quantities.kinds import Results, Series
from vibrissa.study.stages.costs import Cost
from vibrissa.study.stages.sizes import Sizes
from vibrissa.study.store.run_state import Work

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vibrissa.study.spec.settings import Study


def always(study: Study) -> bool:
    """Whether a study has what a stage, or an output, needs: any study.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    bool
        True.
    """
    return True


def one_name(study: Study) -> list[str]:
    """Ends of an output's names: one name without an end.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    list of str
        One, empty.
    """
    return [""]


class Output(NamedTuple):
    """A result of a stage: a dataset, or a file where the name has a suffix.

    Attributes
    ----------
    name : str
        As in the folder of results, without ``.nc``.
    made_by : callable
        Function that makes it, for the provenance.
    made_from : (str, ...)
        Other results, the "study", its "inputs", files of "sweeps/" or "comparison/".
    when : callable
        Study → whether the stage makes it of this study.
    ends : callable
        Study → ends of its names, where there are several.
    absent : str
        Why figures that need it are left out where it is not there.
    """

    name: str
    made_by: Callable[..., object]
    made_from: tuple[str, ...] = ("study",)
    when: Callable[[Study], bool] = always
    ends: Callable[[Study], list[str]] = one_name
    absent: str = ""


class FigureEntry(NamedTuple):
    """A figure of the report and of ``vibrissa figure``.

    Attributes
    ----------
    number : str
        By which it is asked for, and its place in the report; "" for a figure of the report alone.
    heading : str
        In the report.
    needs : (str, ...)
        Names of the results that it is made of.
    make : callable
        Results and the time series of a sweep by its number → figure.
    each : str
        Heading of one of several, with ``{label}``, where its results are numbered (``units_1``); "" if it has one.
    optional : bool
        Whether the report passes over it in silence where its results are absent.
    """

    number: str
    heading: str
    needs: tuple[str, ...]
    make: Callable[[Results, Series], Figure]
    each: str = ""
    optional: bool = False


class Stage(NamedTuple):
    """One stage of a run.

    Attributes
    ----------
    name : str
        On the screen and in the plan.
    asked : callable
        Study → whether it has this stage.
    function : callable
        Run → datasets, by name; reports its own progress.
    outputs : (Output, ...)
        Everything that it may make.
    inputs : (str, ...)
        Results without which it is passed over.
    part : str
        Part of the study to which a failure belongs: later stages of that part are passed over. "" where the function
        itself attempts each of several parts.
    after : (str, ...)
        Other parts that come first: those whose results are needed. Parts that come after none of each other may be
        done at the same time.
    follows : bool
        Whether a failure is noted even where it is the only part of the study, since its inputs remain.
    cost : callable, optional
        Sizes of a study → what the plan says, None where there is nothing to do.
    figures : (FigureEntry, ...)
        Figures that its outputs complete.
    """

    name: str
    asked: Callable[[Study], bool]
    function: Work
    outputs: tuple[Output, ...]
    inputs: tuple[str, ...] = ()
    part: str = ""
    after: tuple[str, ...] = ()
    follows: bool = False
    cost: Callable[[Sizes], Cost | None] | None = None
    figures: tuple[FigureEntry, ...] = ()
