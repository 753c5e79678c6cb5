"""The verbs of whisker geometry: `whisker` and `atlas`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, names_without, tell
from vibrissa.cli.shared.options import Flag, Friction
from vibrissa.cli.shared.words.units import Angle, Length
from vibrissa.errors import ConflictError, MissingError


def whisker(
    diameters: Path | None = None,
    *,
    physical_length: Length | None = None,
    tracked: Path | None = None,
    resonance_file: Path | None = None,
    cone_angle: Annotated[Angle | None, Parameter(name="--whisker.cone-angle")] = None,
    friction: Friction = 0.4,
    output: OutputOptions = PRINTED,
) -> None:
    """Estimate a whisker's geometry from its diameters, or its length, timescale and stiffness from its tracks.

    Parameters
    ----------
    diameters
        CSV with columns distance,diameter in metres (or distance_mm, diameter_um), from the base.
    physical_length
        Length of the whisker from base to tip [m], if measured; the last measured distance by default.
    tracked
        Instead: profile (.nc) of one whisker from `track`, with --resonance-file.
    resonance_file
        Resonant frequencies and damping of its modes with intervals: resonance.nc of a study.
    cone_angle
        With tracks: cone angle [rad], without which Young's modulus is not identified.
    friction
        With tracks: coefficient of friction of the substrate.
    """
    if diameters is not None:
        if not (tracked is None and resonance_file is None):
            remedy = "either DIAMETERS, or --tracked and --resonance-file"
            raise ConflictError("whisker", "must be given once", remedy=remedy)
        from vibrissa.study.movie.geometry import fit_dataset

        return output.show(fit_dataset(diameters, physical_length))
    if tracked is None or resonance_file is None:
        raise MissingError("whisker", "must be given", remedy="DIAMETERS, or --tracked and --resonance-file")
    from vibrissa.mechanics.inverse.length_and_stiffness import fit_whisker
    from vibrissa.netcdf import load
    from vibrissa.quantities import one_whisker

    known = None if cone_angle is None else (cone_angle, 0.0)
    found = fit_whisker(one_whisker(load(tracked)), load(resonance_file), cone_angle=known, friction=friction)
    if found.attrs["not_identified"]:
        tell(f"not identified: {found.attrs['not_identified']}")
    return output.show(found, names_without(found))


def atlas(
    name: str | None = None,
    *,
    resonances: Flag = False,
    output: OutputOptions = PRINTED,
) -> None:
    """List measured rat whiskers by row and column, with the first resonance of each in air.

    Parameters
    ----------
    name
        One of them only: C2, beta, …
    resonances
        List the single whiskers whose resonances were measured instead, with the predictions from their geometry.
    """
    from vibrissa.study.movie.geometry import atlas_dataset, measured_resonances

    output.show(measured_resonances() if resonances else atlas_dataset(name))
