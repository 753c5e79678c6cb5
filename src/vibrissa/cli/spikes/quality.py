"""The verb quality: which units of a recording are kept by which rules, and why the others are not."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.options import Flag
from vibrissa.cli.shared.recorded import ALL_TRIALS, TrialOptions, Window
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.cli.shared.words.units import Duration, Rate

if TYPE_CHECKING:
    from vibrissa.neural.sorting.quality import Inclusion

TABLE = (
    "unit_name",
    "unit_class",
    "unit_rate",
    "unit_snr",
    "refractory_violations",
    "contamination",
    "contamination_low",
    "contamination_high",
    "presence_ratio",
    "rate_change",
    "amplitude_change",
    "kept",
    "reason",
)
RARE = ("amplitude_change",)  # a column of the table only where it is measured


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RuleOptions:
    """Rules by which units are kept; by default those that the paper states.

    Attributes
    ----------
    refractory_period : float
        Least interval of a single unit [s]; whole steps of the recording's clock are counted.
    least_rate : float
        Rate above which a unit is kept [Hz].
    most_violations : float
        Largest share of intervals below the refractory period; of good and unlabelled units, as --most-contamination.
    most_contamination : float, optional
        Largest share of foreign spikes of a unit that is kept.
    least_snr : float, optional
        Least signal to noise of a unit that is kept; 3.1 is the least of the paper's.
    least_presence : float, optional
        Least share of the recording in which a unit that is kept fires.
    most_change : float, optional
        Largest change of rate and amplitude from start to end, over their mean.
    need_measured : bool
        Leave out units for which the quantity of a rule is not measured.
    """

    refractory_period: Duration = 1e-3
    least_rate: Rate = 1.0
    most_violations: float = 0.0
    most_contamination: float | None = None
    least_snr: float | None = None
    least_presence: float | None = None
    most_change: float | None = None
    need_measured: Flag = False

    def rules(self) -> Inclusion:
        """The options as the package takes them."""
        from vibrissa.neural.sorting.quality import Inclusion

        return Inclusion(**vars(self))


def quality(
    spikes: Path,
    *,
    trials: int | None = None,
    cut: TrialOptions = ALL_TRIALS,
    window: Window | None = None,
    duration: Duration | None = None,
    rule: RuleOptions = RuleOptions(),
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Judge units by rate, refractoriness, signal to noise and stability: which are kept, and why others are not.

    Parameters
    ----------
    spikes
        Any recording that `vibrissa neural` reads; of a folder units of all labels are taken, each in its class.
    trials
        Presentations of the stimulus, those without a spike included.
    window
        START STOP of the part of each trial that counts [s].
    duration
        Length of the recording [s], where its file does not state it; from first to last spike by default.
    """
    from vibrissa.neural.sorting.quality import remarks_on_quality, unit_quality
    from vibrissa.study.neurons.observed_units import read_units
    from vibrissa.study.spec.given import SpikesInput

    rules = rule.rules()
    given = SpikesInput(spikes=str(spikes), trials=trials, **cut.words())
    seen, remarks = read_units(given, window=window, duration=duration)
    data = unit_quality(seen, rules=rules)
    tell(*map(in_options, [*remarks, *remarks_on_quality(data)]))
    drawing.draw("others.unit_quality", data)
    output.show(data, columns=[name for name in TABLE if name not in RARE or data[name].notnull().any()])
