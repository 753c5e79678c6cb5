"""What a run of a study would do, without doing it: stages, sizes, time, inputs and figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from vibrissa.study.spec.parts import Input, absent, given, inputs
from vibrissa.study.spec.settings import Study
from vibrissa.study.stages import costs
from vibrissa.study.stages.costs import Cost
from vibrissa.study.stages.figure_table import figures_of, left_out
from vibrissa.study.stages.sizes import Sizes
from vibrissa.study.stages.stages import STAGES, expected


class Planned(NamedTuple):
    """A stage that a run would do, and what it costs."""

    name: str
    cost: Cost


@dataclass(frozen=True)
class Plan:
    """What a run would do.

    Attributes
    ----------
    name : str
        The study's.
    given, absent : list of str
        Its parts, and those that it could have besides.
    inputs : list of Input
        Files that it reads.
    stages : list of Planned
        In the order of the work; of many sweeps those that are still to be done.
    figures, left_out : list of (str, str)
        Number, if it has one, and heading of each figure; number and reason of each that cannot be made.
    kept : int
        Sweeps that are there already.
    workers : int
        Processes that share the stages that can be shared.
    unstored : float
        What the movies would take that are filmed and tracked in memory [bytes].
    """

    name: str
    given: list[str]
    absent: list[str]
    inputs: list[Input]
    stages: list[Planned]
    figures: list[tuple[str, str]]
    left_out: list[tuple[str, str]]
    kept: int
    workers: int
    unstored: float

    def _at_once(self, cost: Cost) -> int:
        return min(self.workers, max(1, cost.tasks)) if cost.shared else 1

    @property
    def seconds(self) -> float:
        """Time by the clock [s]."""
        return sum(one.cost.seconds / self._at_once(one.cost) for one in self.stages)

    @property
    def memory(self) -> float:
        """Memory of all processes at once [bytes], at worst."""
        return max(one.cost.memory * self._at_once(one.cost) for one in self.stages)

    @property
    def written(self) -> float:
        """What is on disk in the end of this run [bytes]."""
        return sum(one.cost.written for one in self.stages)


def plan_study(study: Study, *, kept: int = 0, workers: int = 1) -> Plan:
    """Plan a run; nothing is done and nothing written.

    Parameters
    ----------
    study : Study
        From :func:`vibrissa.study.spec.settings.read_study`.
    kept : int
        Sweeps that are in the folder of results already.
    workers : int
        Processes.

    Returns
    -------
    Plan
        From the table ``vibrissa.study.stages.stages.STAGES``.

    Raises
    ------
    InputError
        If the table of sweeps, or the laboratory, is bad.
    """
    sizes, names = Sizes(study, kept), expected(study)
    asked = [stage for stage in STAGES if stage.cost is not None and stage.asked(study)]
    planned = [(stage.name, stage.cost(sizes)) for stage in asked if stage.cost is not None]
    figures = [(entry.number, heading) for entry, heading in figures_of(study, names)]
    stages = [("start", costs.start(sizes)), *planned, ("report", costs.report(len(figures)))]
    return Plan(
        name=study.name,
        given=given(study),
        absent=absent(study),
        inputs=inputs(study),
        stages=[Planned(name, cost) for name, cost in stages if cost is not None],
        figures=figures,
        left_out=left_out(study, names),
        kept=kept,
        workers=workers,
        unstored=sizes.unstored,
    )
