"""The verb discriminate: textures decoded from spikes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.options import Seed
from vibrissa.cli.shared.recorded import ALL_TRIALS, TrialOptions
from vibrissa.cli.shared.words.units import Duration

if TYPE_CHECKING:
    import xarray as xr

TABLE = ("accuracy", "accuracy_low", "accuracy_high", "chance_accuracy_high", "code_adjusted_p_value")
Code = Literal["mean rate", "rate variance", "time course", "pattern"]


def discriminate(
    spikes: Path,
    *,
    window: tuple[Duration, Duration],
    textures: Path | None = None,
    cut: TrialOptions = ALL_TRIALS,
    code: list[Code] | None = None,
    bin_width: Duration = 0.02,
    folds: int = 5,
    permutations: int = 400,
    level: float = 0.05,
    units: list[int] | None = None,
    seed: Seed = 0,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Decode the texture of each trial from mean rate, rate variance, time course or pattern, with cross-validation.

    Parameters
    ----------
    spikes
        CSV with columns unit,trial,spike_time: any name, from 0, seconds from the trial's onset. Or any other format
        that `vibrissa neural` reads.
    window
        START STOP of the part of each trial that is decoded [s].
    textures
        CSV with columns trial,texture, one line for every trial, silent ones included. Without it, the column stimulus
        of the table of trials.
    code
        Feature of the spikes that is read: mean rate, rate variance, time course, pattern (when they came, given how
        many); once for each, all by default.
    bin_width
        Width of the bins [s]; the window must be whole bins.
    folds
        Parts of the trials; each is decoded after learning from the others.
    permutations
        Random assignments of textures to trials, for the level of chance.
    level
        Largest p-value, adjusted over codes, at which textures count as discriminated.
    units
        Also the accuracy from this number of units, drawn at random; once for each number.
    seed
        Seed of folds, permutations and draws.
    """
    from vibrissa.neural.coding import discrimination
    from vibrissa.neural.coupling.response import trial_counts
    from vibrissa.neural.io.tables.textures import read_textures, textures_of

    how = discrimination.Discrimination(
        codes=tuple(code) if code else discrimination.Discrimination.codes,
        bin_width=bin_width,
        n_folds=folds,
        n_permutations=permutations,
        level=level,
        seed=seed,
    )
    known = None if textures is None or cut.period is None else len(read_textures(textures))
    table, _, remarks = cut.read(spikes, window, known, bin_width, needs_count=False)
    with progress_bars() as progress:
        names = textures_of(table, textures)
        counts, read = trial_counts(table, len(names), window, bin_width)
        curve = discrimination.accuracy_by_units(counts, names, units, how, progress=progress) if units else None
        data = discrimination.discriminate(counts, names, how, progress=progress)
    data = data if curve is None else data.merge(curve, combine_attrs="override")
    tell(*remarks, *_remarks(data, table.sizes["unit"] - len(read)))
    drawing.draw("spikes.discrimination", {"discrimination": data})
    output.show(data, columns=[*TABLE, "code_verdict"])


def _remarks(data: xr.Dataset, left_out: int) -> list[str]:
    """Remarks that a reader needs before the numbers."""
    lines = [f"{left_out} units are left out, as they were not observed in every trial"] if left_out else []
    if data.attrs["blocked"]:
        lines.append(
            f"textures came in blocks ({data.attrs['changes_of_texture']} changes in {data.attrs['n_trials']} trials): "
            "a slow drift would separate them as well"
        )
    return lines
