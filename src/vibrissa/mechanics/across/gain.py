"""Effects of speed and posture on the gain over sweeps, and envelopes compared by the distance scanned."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from vibrissa.arrays import Array
from vibrissa.errors import InputError, TooFewError
from vibrissa.quantities import dataset
from vibrissa.signals.correlation import lagged_correlation
from vibrissa.stats import Effect, clustered_model, linear_model

STEP = 20e-6  # [m] of the grid of distances: at 0.1 m/s a fiftieth of a cycle of 100 Hz
LARGEST_OFFSET = 15e-3  # [m]
SOURCES = ("mode_rms", "mode_rms_model")
RESTRICTED = ("beta", "C1")


def by_distance(signal: Array, time: Array, speed: float, distance: Array) -> Array:
    """Signal (T,) at distances scanned x = v t [m], by straight lines; NaN where it was not measured.

    Parameters
    ----------
    signal, time : (T,) arrays
        Any unit; [s].
    speed : float
        v [m/s].
    distance : array
        Distances [m].

    Returns
    -------
    array
        In the unit of the signal.
    """
    return np.interp(distance, speed * time, signal, left=np.nan, right=np.nan)


def distance_correlogram(
    first: tuple[Array, Array, float], second: tuple[Array, Array, float], largest: float = LARGEST_OFFSET
) -> tuple[Array, Array]:
    """Correlation of two envelopes as functions of the distance scanned, over offsets.

    Parameters
    ----------
    first, second : (envelope, time, speed)
        (T,) any unit, (T,) [s], v [m/s]; the texture starts at x = 0 in both.
    largest : float
        Largest offset [m].

    Returns
    -------
    offset, correlation : arrays
        [m], positive where the first comes after; of the stretch that both scanned.

    Raises
    ------
    InputError
        If they share less than twice the largest offset.
    """
    low = max(speed * time[0] for _, time, speed in (first, second))
    high = min(speed * time[-1] for _, time, speed in (first, second))
    if high - low < 2 * largest:
        raise TooFewError("sweeps", f"must share {2 * largest:g} m of the texture", f"{max(high - low, 0):.3g} m")
    x = np.linspace(low, high, int((high - low) / STEP) + 1)
    step = float(x[1] - x[0])
    a, b = (np.interp(x, speed * time, envelope) for envelope, time, speed in (first, second))
    lag, rho = lagged_correlation(a, b, int(largest / step))
    return np.asarray(lag * step, float), rho


def effects(response: ArrayLike, terms: Mapping[str, ArrayLike], clusters: ArrayLike) -> xr.Dataset:
    """Effect of each term on a response over sweeps, the others held: the paper's test, and one by cluster.

    Parameters
    ----------
    response : (N,) array
        NaN, not measured, is left out.
    terms : mapping of (N,) arrays
        Numbers, or names as groups.
    clusters : (N,) array
        Whisker of animal, the independent draw.

    Returns
    -------
    Dataset
        By ``term``: ``effect_n``; ``effect_slope`` per standard deviation of the term and its interval by cluster,
        ``effect_low`` and ``effect_high``, in units of the mean response (NaN for names); ``effect_p`` as if all
        sweeps were independent, ``effect_p_clustered``. NaN where it cannot be estimated: fewer values than the model
        needs, a term that does not vary, or too few clusters.
    """
    y = np.asarray(response, float)
    groups = np.asarray(clusters)
    try:
        naive = {one.name: one for one in linear_model(y, terms)}
        clustered = {one.name: one for one in clustered_model(y, terms, groups)}
    except InputError:
        naive, clustered = {}, {}
    mean = float(np.nanmean(y)) if np.isfinite(y).any() else np.nan
    lines = [_line(terms[name], naive.get(name), clustered.get(name), mean) for name in terms]
    names = ("effect_n", "effect_slope", "effect_low", "effect_high", "effect_p", "effect_p_clustered")
    values = np.array(lines, float).reshape(-1, len(names)).T  # of no terms too
    columns: dict[str, Any] = dict(zip(names, values, strict=True))
    return dataset(term=list(terms), **columns)


def _line(values: ArrayLike, naive: Effect | None, clustered: Effect | None, mean: float) -> list[float]:
    if naive is None or clustered is None:
        return [0, *[np.nan] * 5]
    column = np.asarray(values)
    scale = float(np.nanstd(column)) / mean if column.dtype.kind in "fiu" else np.nan
    slopes = [scale * value for value in (clustered.slope, clustered.low, clustered.high)]
    return [naive.n, *slopes, naive.p, clustered.p]


def _gain_effects(sweeps: xr.Dataset, name: str, whiskers: tuple[str, ...] | None = None) -> xr.Dataset:
    """Effects of v, ε and θ_b on the rms of mode 1; of some whiskers, as the paper restricts the test to β and C1."""
    keep = sweeps.accepted.values.astype(bool)
    if whiskers is not None:
        keep &= np.isin(sweeps.whisker_name.values, whiskers)
    some = sweeps.isel(sweep=keep)
    terms = {term: some[term].values for term in ("scan_speed", "contact", "base_angle")}
    return effects(some[name].values[:, 0], terms, whisker_of_animal(some))


def gain_table(sweeps: xr.Dataset) -> xr.Dataset:
    """Effects on the rms of mode 1, measured and of the model, of all whiskers and of β and C1 alone.

    Parameters
    ----------
    sweeps : Dataset
        The table of sweeps.

    Returns
    -------
    Dataset
        As :func:`effects`, (subset, source, term).
    """
    each = [[_gain_effects(sweeps, name, some) for name in SOURCES] for some in (None, RESTRICTED)]
    columns = {
        str(name): np.array([[one[name].values for one in row] for row in each]) for name in each[0][0].data_vars
    }
    labels: dict[str, Any] = {"subset": ["all", "β and C1"], "source": ["measured", "model"], **columns}
    return dataset(lead=("subset", "source"), term=each[0][0].term.values, **labels)


def whisker_of_animal(sweeps: xr.Dataset) -> NDArray[np.str_]:
    """Animal and whisker of each sweep: the independent draw that it belongs to, (sweep,).

    Parameters
    ----------
    sweeps : Dataset
        The table of sweeps.

    Returns
    -------
    (sweep,) array of str
        Animal and whisker.
    """
    return np.char.add(np.char.add(sweeps.animal.values.astype(str), " "), sweeps.whisker_name.values.astype(str))
