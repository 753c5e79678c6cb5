"""The verbs of whisker geometry: `whisker` and `atlas`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from vibrissa.cli.options import Json, Out
from vibrissa.cli.output import show


def whisker(diameters: Path, *, physical_length: float | None = None, out: Out = None, json: Json = False) -> None:
    """Geometry of a whisker from measured diameters: length of the cone and cone angle, with standard errors.

    Parameters
    ----------
    diameters
        CSV with columns distance,diameter in metres (or distance_mm, diameter_um), from the base.
    physical_length
        Length of the whisker itself [m], if measured; the last measured distance by default.
    """
    from vibrissa.study.geometry import fit_dataset

    show(fit_dataset(diameters, physical_length), None, json, out)


def atlas(
    name: str | None = None,
    *,
    resonances: Annotated[bool, Parameter(negative="")] = False,
    out: Out = None,
    json: Json = False,
) -> None:
    """Measured rat whiskers by row and column, with the first resonance of each in air.

    Parameters
    ----------
    name
        One of them only: C2, beta, …
    resonances
        Instead, the single whiskers whose resonances were measured, beside what their own geometry predicts.
    """
    from vibrissa.study.geometry import atlas_dataset, measured_resonances

    show(measured_resonances() if resonances else atlas_dataset(name), None, json, out)
