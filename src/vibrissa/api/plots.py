"""Figures for a notebook: of results, of tracks over their movie, of one unit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.api.shared.arguments import names_arguments
from vibrissa.api.studies import Results
from vibrissa.errors import FormatError, RangeError, UnknownError, did_you_mean
from vibrissa.quantities import require
from vibrissa.quantities.schema import conforming
from vibrissa.signals.frame_numbers import frame_numbers

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy.typing import NDArray


@names_arguments
def figure(number: int | str, results: Results | str | Path) -> Figure:
    """One of the paper's figures, or of the report's others, from the results of a study.

    Parameters
    ----------
    number : int or str
        1 to 9 as in the paper, ``"6ab"``, ``"7e"``; 10 for resonance and damping of every sweep; ``"surface"``;
        ``"base"``.
    results : Results or path
        Of :func:`vibrissa.run`, or the folder, or one dataset of it.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    InputError
        If the results do not hold what the figure needs.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import vibrissa as vb
    >>> surface, posture = vb.periodic_grating(0.05, period=2e-3), vb.Posture(contact=0.29, base_angle=1.2)
    >>> motion = vb.scan(vb.atlas("C2"), posture, surface, speed=0.1)
    >>> with TemporaryDirectory() as folder:
    ...     vb.save(motion.sample(), f"{folder}/scan.nc")
    ...     picture = vb.figure("surface", folder)
    >>> len(picture.axes) > 3
    True
    """
    from vibrissa.study.report.gallery import figure_of

    if not isinstance(results, Results | str | Path):
        raise FormatError("results", "must be of vb.run, or a path", f"a {type(results).__name__}")
    return figure_of(str(number), results.folder if isinstance(results, Results) else results)


@names_arguments
def plot_tracks(
    profile: xr.Dataset, movie: str | Path | NDArray[Any], *, frames: Sequence[int] | None = None
) -> Figure:
    """Frames of a movie with the tracked centrelines over them.

    Parameters
    ----------
    profile : Dataset
        Of :func:`vibrissa.track`.
    movie : path or (T, height, width) array
        The movie that was tracked.
    frames : sequence of int, optional
        Which frames of the movie, from 0, of those in the profile; six, evenly, by default.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    InputError
        If the movie cannot be read, or the profile does not state its pixel size.

    Examples
    --------
    >>> import vibrissa as vb
    >>> movie = vb.sample_data("movie.mkv")
    >>> profile = vb.track(movie, frame_rate=2000, pixel_size=95e-6, skin=[(50.5, 57)])
    >>> len(vb.plot_tracks(profile, movie, frames=[0, 200]).axes)
    2
    """
    from vibrissa.figures.others import preview
    from vibrissa.video.io.movie import read_blocks

    require(profile, "time", "x", "y", "arc_length")
    profile = conforming(profile)
    several = profile if "whisker" in profile.dims else profile.expand_dims(whisker=[0])
    numbers = frame_numbers(profile).tolist()
    first, last = min(numbers), max(numbers)
    if isinstance(movie, str | Path):
        blocks: Iterable[Any] = read_blocks(movie, start=first, drop_frames=profile.attrs.get("drop_frames"))
    else:
        blocks = [np.asarray(movie)[first:]]
    if frames is not None and not set(frames) <= set(numbers):
        rule = f"must be among the {len(numbers)} of the profile, {first} to {last}"
        raise RangeError("frames", rule, sorted(set(frames) - set(numbers)))
    rows = None if frames is None else [numbers.index(frame) for frame in frames]
    return preview.draw(preview.compute(blocks, several, rows))


@names_arguments
def plot_unit(units: xr.Dataset, name: str | None = None) -> Figure:
    """Page of one unit: raster, rate and envelope, tuning with its fit, correlation over lags, its own lags.

    Parameters
    ----------
    units : Dataset
        Of :func:`vibrissa.envelope_coupling`, which holds spikes and stimulus too.
    name : str, optional
        The unit; the one whose fit explains most by default.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    InputError
        If no unit has that name.

    Examples
    --------
    >>> import vibrissa as vb
    >>> spikes, stimulus = vb.sample_data("spikes.csv"), vb.sample_data("spikes-stimulus.csv")
    >>> units = vb.envelope_coupling(spikes, stimulus)
    >>> len(vb.plot_unit(units).axes) > 3
    True
    """
    from vibrissa.figures.spikes import unit_page
    from vibrissa.neural.coupling.analysis import EnvelopeAnalysis
    from vibrissa.neural.coupling.presentation import JOINED
    from vibrissa.neural.coupling.unit_view import UnitViews
    from vibrissa.neural.io.tables.selection import at_places
    from vibrissa.study.neurons.shown_unit import best_unit

    require(units, "unit_name", "spike_time", "spike_trial", "significant")
    units = at_places(units)
    names = units.unit_name.to_numpy().tolist()
    if name is not None and name not in names:
        raise UnknownError(
            "name", "must be one of the units", repr(name), did_you_mean(str(name), names, ", ".join(names))
        )
    gone = {"band", "spontaneous"} if JOINED in units.attrs else set()  # joined envelopes have no carrier and no before
    settings = {one.name for one in fields(EnvelopeAnalysis)} - gone
    known: dict[str, Any] = {name: value for name, value in units.attrs.items() if name in settings}
    for one in {"window", "band", "spontaneous", "delays"} & set(known):
        known[one] = tuple(map(float, np.atleast_1d(known[one])))  # netCDF has a tuple of one as a number
    spikes = units[["spike_time", "spike_unit", "spike_trial", "unit_name", *({"unit_observed"} & set(units))]]
    table = units.drop_dims(["spike", "time", "trial"], errors="ignore")
    views = UnitViews.of(table, spikes, units.drop_dims(["spike", "unit"]), EnvelopeAnalysis(**known))
    return unit_page.draw(unit_page.compute(views.of_unit(best_unit(units) if name is None else names.index(name))))
