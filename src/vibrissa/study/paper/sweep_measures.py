"""Means, shares and p-values of a table of sweeps, whole whiskers as the draws."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import InputError
from vibrissa.quantities import require
from vibrissa.quantities.kinds import Results
from vibrissa.stats import Effect, Scale, clustered_model, jackknife_interval, linear_model, share_interval

if TYPE_CHECKING:
    import xarray as xr

WHITE = "_white"  # ends the columns of fits whose forcing is taken for white, Eq. 5; others know the texture's


class MeasuredNumber(NamedTuple):
    """A number found here.

    Its 95 % interval; how many values it is of; what must be known; the slope of an effect; how many independent draws
    (whiskers, sessions, repeated experiments) the interval rests on; the same number with the texture's forcing, where
    this one is by Eq. 5; the standard deviation of its values; how a setting is written that is no plain number.
    """

    value: float = np.nan
    low: float = np.nan
    high: float = np.nan
    n: float = np.nan
    note: str = ""
    slope: float = np.nan
    draws: float = np.nan
    informed: MeasuredNumber | None = None
    sd: float = np.nan
    text: str = ""


Measure = Callable[[Results], MeasuredNumber]


def is_virtual(sweeps: xr.Dataset) -> bool:
    """Whether the truth of the sweeps is known, so that it was put in.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    bool
        By the column ``contact_true``.
    """
    return "contact_true" in sweeps


def accepted(results: Results) -> xr.Dataset | None:
    """The sweeps that were analysed to the end, or None if there are none.

    Parameters
    ----------
    results : mapping of Datasets
        Of a study.

    Returns
    -------
    Dataset or None
        Rows of the table.
    """
    if "sweeps" not in results:
        return None
    sweeps = results["sweeps"]
    require(sweeps, "animal", "whisker_name", "contact", "base_angle", "accepted")
    kept = sweeps.isel(sweep=np.flatnonzero(sweeps.accepted.values.astype(bool)))
    return kept if kept.sizes["sweep"] else None


def whiskers_of(sweeps: xr.Dataset) -> NDArray[np.str_]:
    """Whisker of each sweep, one name for each animal's.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.

    Returns
    -------
    (S,) array of str
        Animal and whisker.
    """
    pairs = zip(sweeps.animal.values, sweeps.whisker_name.values, strict=True)
    return np.array([f"{animal} {name}" for animal, name in pairs])


def of_sweeps(measure: Callable[[xr.Dataset], MeasuredNumber]) -> Measure:
    """Measure of the accepted sweeps; says so where there are none, or they lack a column.

    Parameters
    ----------
    measure : callable
        Accepted sweeps → number found.

    Returns
    -------
    callable
        Results of a study → number found.
    """

    def on(results: Results) -> MeasuredNumber:
        sweeps = accepted(results)
        if sweeps is None:
            return MeasuredNumber(note="no sweep was analysed to the end")
        try:
            return measure(sweeps)
        except KeyError as error:
            return MeasuredNumber(note=f"the table of sweeps has no {error.args[0]}")
        except InputError as error:  # too few sweeps, or all alike
            return MeasuredNumber(note=str(error))

    return on


def mean(values: Array, clusters: NDArray[Any], note: str = "", scale: Scale = "plain") -> MeasuredNumber:
    """Mean of the values measured, with the interval by cluster and their standard deviation.

    Parameters
    ----------
    values : (N,) array
        NaN where not measured.
    clusters : (N,) array
        Whisker, or session, of each.
    note : str
        What a reader must know of it.
    scale : Scale
        On which the interval is symmetric; see ``vibrissa.stats.jackknife_interval``.

    Returns
    -------
    MeasuredNumber
        The number and its interval, or a note why there is none.
    """
    made = np.isfinite(values)
    if not made.any():
        return MeasuredNumber(note="not measured in any sweep")
    ends = jackknife_interval(values, clusters=clusters, scale=scale)
    spread = float(values[made].std(ddof=1)) if made.sum() > 1 else np.nan
    return _found(values, clusters, ends, note)._replace(sd=spread)


def share(passed: Array, clusters: NDArray[Any], note: str = "") -> MeasuredNumber:
    """Share of the cases that pass (1; 0 where not), with Wilson's interval by cluster.

    Parameters
    ----------
    passed : (N,) array
        1, 0, or NaN where not measured.
    clusters : (N,) array
        Whisker, or session, of each.
    note : str
        What a reader must know of it.

    Returns
    -------
    MeasuredNumber
        The number and its interval, or a note why there is none.
    """
    if not np.isfinite(passed).any():
        return MeasuredNumber(note="not measured in any sweep")
    return _found(passed, clusters, share_interval(passed, clusters=clusters), note)


def _found(values: Array, clusters: NDArray[Any], ends: tuple[float, float], note: str) -> MeasuredNumber:
    made = np.isfinite(values)
    draws = float(len(np.unique(np.asarray(clusters)[made])))
    return MeasuredNumber(float(values[made].mean()), *ends, float(made.sum()), note, draws=draws)


def column(sweeps: xr.Dataset, name: str, mode: int | None = None) -> Array:
    """Numbers of one column, (sweep,), of one mode where it has several.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.
    name : str
        Of the column.
    mode : int, optional
        Counted from 1.

    Returns
    -------
    (S,) array
        Floats.
    """
    whole = sweeps[name] if mode is None else sweeps[name].sel(mode=mode)
    return np.asarray(whole.values, float)


def mean_of(name: str, mode: int | None = None, scale: Scale = "plain") -> Measure:
    """Measure: the mean of one column.

    Parameters
    ----------
    name : str
        Of the column.
    mode : int, optional
        Counted from 1.
    scale : Scale
        On which the interval is symmetric; see ``vibrissa.stats.jackknife_interval``.

    Returns
    -------
    callable
        Results of a study → number found.
    """
    return of_sweeps(lambda sweeps: mean(column(sweeps, name, mode), whiskers_of(sweeps), scale=scale))


def effect(sweeps: xr.Dataset, response: Array, term: str, names: tuple[str, ...], identity: bool) -> MeasuredNumber:
    """p-value of one term: the paper's way, with that by whisker beside it.

    Parameters
    ----------
    sweeps : Dataset
        A table of sweeps.
    response : (S,) array
        What is explained.
    term : str
        Whose effect is wanted.
    names : (str, ...)
        Columns that explain it.
    identity : bool
        Whether the whisker explains it too.

    Returns
    -------
    MeasuredNumber
        The number and its interval, or a note why there is none.
    """
    whisker = whiskers_of(sweeps)
    columns: dict[str, Any] = {name: column(sweeps, name) for name in names}
    made = np.isfinite([response, *columns.values()]).all(axis=0)
    if not made.any():
        return MeasuredNumber(note="not measured in any sweep")
    terms = {name: values for name, values in columns.items() if np.ptp(values[made]) > 0}
    if identity and len(np.unique(whisker[made])) > 1:
        terms["whisker"] = whisker
    if term not in terms:
        return MeasuredNumber(note=f"{term} is the same in all sweeps")

    def of(effects: list[Effect]) -> Effect:
        return next(effect for effect in effects if effect.name == term)

    pooled, clustered = of(linear_model(response, terms)), of(clustered_model(response, terms, whisker))
    known = np.isfinite(clustered.p)
    apart = f"whiskers as the draws: p = {clustered.p:.2g}" if known else "by whisker: not identified"
    sense = {1.0: "rises; ", -1.0: "falls; "}.get(float(np.sign(pooled.slope)), "")
    note = f"least squares with {', '.join(terms)}; {sense}{apart}"
    return MeasuredNumber(pooled.p, n=pooled.n, slope=pooled.slope, note=note)


def extent(name: str) -> Measure:
    """Measure: the median of one column, with its least and largest value for ends.

    Parameters
    ----------
    name : str
        Of the column.

    Returns
    -------
    callable
        Results of a study → number found.
    """

    def of(sweeps: xr.Dataset) -> MeasuredNumber:
        values = column(sweeps, name)
        made = values[np.isfinite(values)]
        if not made.size:
            return MeasuredNumber(note="not known")
        return MeasuredNumber(float(np.median(made)), made.min(), made.max(), made.size)

    return of_sweeps(of)


def count(names: Callable[[xr.Dataset], NDArray[Any]]) -> Measure:
    """Measure: how many different names there are.

    Parameters
    ----------
    names : callable
        Table of sweeps → names (S,).

    Returns
    -------
    callable
        Results of a study → number found.
    """
    return of_sweeps(lambda sweeps: MeasuredNumber(float(len(np.unique(names(sweeps))))))
