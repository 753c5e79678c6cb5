"""Means, shares and p-values of a table of sweeps, whole whiskers taken for the draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import require
from vibrissa.stats import Effect, clustered_model, jackknife_interval, linear_model

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Results = Mapping[str, "xr.Dataset"]


class Here(NamedTuple):
    """A number found here: its 95 % interval, how many values it is of, what must be known, the slope of an effect."""

    value: float = np.nan
    low: float = np.nan
    high: float = np.nan
    n: float = np.nan
    note: str = ""
    slope: float = np.nan


Measure = Callable[[Results], Here]


def is_virtual(sweeps: xr.Dataset) -> bool:
    """Whether the truth of the sweeps is known, so that it was put in."""
    return "contact_true" in sweeps


def accepted(results: Results) -> xr.Dataset | None:
    """The sweeps that were analysed to the end, or None if there are none."""
    if "sweeps" not in results:
        return None
    sweeps = results["sweeps"]
    require(sweeps, "animal", "whisker_name", "contact", "base_angle", "accepted")
    kept = sweeps.isel(sweep=np.flatnonzero(sweeps.accepted.values.astype(bool)))
    return kept if kept.sizes["sweep"] else None


def whiskers_of(sweeps: xr.Dataset) -> NDArray[np.str_]:
    """Whisker of each sweep, one name for each animal's."""
    pairs = zip(sweeps.animal.values, sweeps.whisker_name.values, strict=True)
    return np.array([f"{animal} {name}" for animal, name in pairs])


def of_sweeps(measure: Callable[[xr.Dataset], Here]) -> Measure:
    """Measure of the accepted sweeps; says so where there are none, or they lack a column."""

    def on(results: Results) -> Here:
        sweeps = accepted(results)
        if sweeps is None:
            return Here(note="no sweep was analysed to the end")
        try:
            return measure(sweeps)
        except KeyError as error:
            return Here(note=f"the table of sweeps has no {error.args[0]}")
        except InputError as error:  # too few sweeps, or all alike
            return Here(note=str(error))

    return on


def mean(values: Array, clusters: NDArray[Any], note: str = "") -> Here:
    """Mean of the values measured, with the interval by cluster; the note begins with their standard deviation."""
    made = np.isfinite(values)
    if not made.any():
        return Here(note="not measured in any sweep")
    low, high = jackknife_interval(values, clusters=clusters)
    spread = f"SD {values[made].std(ddof=1):.3g}" if made.sum() > 1 else ""
    return Here(
        float(values[made].mean()), low, high, float(made.sum()), "; ".join(part for part in (spread, note) if part)
    )


def column(sweeps: xr.Dataset, name: str, mode: int | None = None) -> Array:
    """Numbers of one column, (sweep,), of one mode where it has several."""
    whole = sweeps[name] if mode is None else sweeps[name].sel(mode=mode)
    return np.asarray(whole.values, float)


def mean_of(name: str, mode: int | None = None, note: str = "") -> Measure:
    """Measure: the mean of one column."""
    return of_sweeps(lambda sweeps: mean(column(sweeps, name, mode), whiskers_of(sweeps), note))


def effect(sweeps: xr.Dataset, response: Array, term: str, names: tuple[str, ...], identity: bool) -> Here:
    """p-value of one term: the paper's way, with that by whisker beside it."""
    whisker = whiskers_of(sweeps)
    columns: dict[str, Any] = {name: column(sweeps, name) for name in names}
    made = np.isfinite([response, *columns.values()]).all(axis=0)
    if not made.any():
        return Here(note="not measured in any sweep")
    terms = {name: values for name, values in columns.items() if np.ptp(values[made]) > 0}
    if identity and len(np.unique(whisker[made])) > 1:
        terms["whisker"] = whisker
    if term not in terms:
        return Here(note=f"{term} is the same in all sweeps")

    def of(effects: list[Effect]) -> Effect:
        return next(effect for effect in effects if effect.name == term)

    pooled, clustered = of(linear_model(response, terms)), of(clustered_model(response, terms, whisker))
    apart = (
        f"whiskers as the draws: p = {clustered.p:.2g}" if np.isfinite(clustered.p) else "by whisker: not identified"
    )
    sense = {1.0: "rises", -1.0: "falls"}.get(float(np.sign(pooled.slope)), "")
    apart = f"{sense}; {apart}" if sense else apart
    return Here(pooled.p, n=pooled.n, slope=pooled.slope, note=f"least squares with {', '.join(terms)}; {apart}")


def extent(name: str) -> Measure:
    """Measure: the median of one column, with its least and largest value for ends."""

    def of(sweeps: xr.Dataset) -> Here:
        values = column(sweeps, name)
        made = values[np.isfinite(values)]
        return (
            Here(note="not told") if not made.size else Here(float(np.median(made)), made.min(), made.max(), made.size)
        )

    return of_sweeps(of)


def count(names: Callable[[xr.Dataset], NDArray[Any]]) -> Measure:
    """Measure: how many different names there are."""
    return of_sweeps(lambda sweeps: Here(float(len(np.unique(names(sweeps))))))
