"""What `scan --spikes` adds: the spikes of units that the envelope near the base drives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from vibrissa.cli.output import tell
from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.motion import Motion
    from vibrissa.study.forward import Presentation


@dataclass(frozen=True, kw_only=True)
class SpikeOptions:
    """Units that listen to the whisker, and how often it is scanned.

    Attributes
    ----------
    spikes : str, optional
        Predict spikes too: of that many units, drawn from the paper's thresholds and slopes, or of the units in a CSV
        with columns unit,threshold,slope,baseline,latency (m, 1/(s m), Hz, s; or threshold_um,slope_per_um,latency_ms).
    spikes_out : Path, optional
        Write them: NAME.csv or NAME.nwb, and beside it NAME-stimulus.csv and NAME-units.csv, the units' truth.
    trials : int
        Repeats of the scan.
    seed : int
        Seed of units and spikes.
    distance : float
        Of the point from the base whose envelope drives the units [m].
    mean_envelope : float, optional
        Scale the motion so that its mean envelope is this [m], as a stimulator may.
    """

    spikes: str | None = None
    spikes_out: Path | None = None
    trials: int = 40
    seed: int = 0
    distance: float = 5e-3
    mean_envelope: float | None = None

    def units(self) -> xr.Dataset | None:
        """The units, before any work; None where no spikes are wanted."""
        from vibrissa.study.forward_files import refuse_name

        if self.spikes is None:
            if self.spikes_out is not None:
                raise InputError("--spikes-out", "must go with --spikes", str(self.spikes_out))
            return None
        if self.spikes_out is not None:
            refuse_name(self.spikes_out)
        self._presentation()
        return self._population(self.spikes)

    def _population(self, word: str) -> xr.Dataset:
        import numpy as np

        from vibrissa.neural.driven import draw_driven, read_driven

        try:
            count = int(word)
        except ValueError:
            if not Path(word).is_file():
                raise InputError("--spikes", "must be a number of units or a CSV of them", word) from None
            return read_driven(word)
        return draw_driven(count, rng=np.random.default_rng(self.seed))

    def _presentation(self) -> Presentation:
        from vibrissa.study.forward import Presentation

        return Presentation(
            n_trials=self.trials, seed=self.seed, distance=self.distance, mean_envelope=self.mean_envelope
        )

    def added(self, data: xr.Dataset, prediction: Motion, units: xr.Dataset) -> xr.Dataset:
        """The scan's dataset with the spikes, which are written too if asked."""
        from vibrissa.study.forward import remarks, spikes_of
        from vibrissa.study.forward_files import write_spikes

        spikes = spikes_of(prediction, data.time.values, units, self._presentation())
        for line in remarks(spikes):
            tell(line)
        if self.spikes_out is not None:
            tell(f"the spikes are in {', '.join(map(str, write_spikes(spikes, self.spikes_out)))}")
        return data.merge(spikes).assign_attrs(data.attrs | spikes.attrs)


NO_SPIKES = SpikeOptions()
OfSpikes = Annotated[SpikeOptions, Parameter(name="*")]
