"""Spikes that `scan --simulate-units` adds: of units that the envelope near the base drives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import Beside, MaybeOut, tell
from vibrissa.cli.shared.options import Seed
from vibrissa.cli.shared.words.units import Length
from vibrissa.errors import ConflictError, FormatError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
    from vibrissa.mechanics.rod.rod_prediction import RodPrediction
    from vibrissa.mechanics.scan.motion import PredictedMotion
    from vibrissa.study.forward.forward import TrialSettings

SpikesOut = Annotated[MaybeOut, Beside(("{0.stem}-stimulus.csv", "{0.stem}-units.csv"))]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SpikeOptions:
    """Units that listen to the whisker, and how often it is scanned.

    Attributes
    ----------
    simulate_units : str, optional
        Predict spikes too: of a number of units, drawn from the paper's thresholds and slopes, or of the units in a
        CSV with columns unit,threshold,slope,baseline,latency (m, 1/(s m), Hz, s; or
        threshold_um,slope_per_um,latency_ms).
    spikes_out : Path, optional
        Spikes to write: NAME.csv or NAME.nwb, with NAME-stimulus.csv and NAME-units.csv, the units' truth.
    trials : int
        Presentations of the stimulus: repeats of the scan.
    seed : int
        Seed of units and spikes.
    distance : float
        Distance from the base of the point whose envelope drives the units [m].
    mean_envelope : float, optional
        Mean envelope to which the motion is scaled [m], as a stimulator may.
    """

    simulate_units: str | None = None
    spikes_out: SpikesOut = None
    trials: int = 40
    seed: Seed = 0
    distance: Length = 5e-3
    mean_envelope: Length | None = None

    def units(self) -> xr.Dataset | None:
        """The units, before any work; None where no spikes are wanted.

        Raises
        ------
        InputError
            If the options contradict each other, or a name cannot be written.
        """
        if self.simulate_units is None:
            for name, usual in vars(NO_SPIKES).items():
                if getattr(self, name) != usual:
                    option, value = "--" + name.replace("_", "-"), str(getattr(self, name))
                    raise ConflictError(option, "must go with --simulate-units", value)
            return None
        if self.spikes_out is not None:
            from vibrissa.study.forward.forward_files import refuse_name

            refuse_name(self.spikes_out)
        self._presentation()
        return self._population(self.simulate_units)

    def _population(self, word: str) -> xr.Dataset:
        import numpy as np

        from vibrissa.neural.simulated.driven import draw_driven, read_driven

        try:
            count = int(word)
        except ValueError:
            if not Path(word).is_file():
                raise FormatError("--simulate-units", "must be a number of units or a CSV of them", word) from None
            return read_driven(word)
        return draw_driven(count, rng=np.random.default_rng(self.seed))

    def _presentation(self) -> TrialSettings:
        from vibrissa.study.forward.forward import TrialSettings

        return TrialSettings(
            n_trials=self.trials, seed=self.seed, distance=self.distance, mean_envelope=self.mean_envelope
        )

    def added(
        self, data: xr.Dataset, prediction: PredictedMotion | RodPrediction | FreeEndPrediction, units: xr.Dataset
    ) -> xr.Dataset:
        """The scan's dataset with the spikes, which are written too if a file is named.

        Parameters
        ----------
        data : Dataset
            The scan.
        prediction : PredictedMotion, RodPrediction or FreeEndPrediction
            What it was sampled from.
        units : Dataset
            From :meth:`units`.

        Returns
        -------
        Dataset
            Both.
        """
        from vibrissa.study.forward.forward import remarks, spikes_of
        from vibrissa.study.forward.forward_files import write_spikes

        spikes = spikes_of(prediction, data.time.values, units, self._presentation())
        tell(*remarks(spikes))
        if self.spikes_out is not None:
            tell(f"the spikes are in {', '.join(map(str, write_spikes(spikes, self.spikes_out)))}")
        return data.merge(spikes).assign_attrs(data.attrs | spikes.attrs)


NO_SPIKES = SpikeOptions()
