"""What these sweeps give for each number that the paper prints."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.exact import cone_kappa
from vibrissa.quantities import measured_sd
from vibrissa.stats import clustered_model, jackknife_interval
from vibrissa.study.sweep_measures import (
    Here,
    Measure,
    Results,
    column,
    count,
    effect,
    extent,
    mean,
    mean_of,
    of_sweeps,
    whiskers_of,
)
from vibrissa.whisker import YOUNGS_MODULUS

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

UNTOLD = "not told by the table of sweeps"


def _variance_sum(sweeps: xr.Dataset) -> Here:
    return mean(sweeps["variance_explained"].sel(mode=[1, 2, 3]).values.sum(axis=1), whiskers_of(sweeps))


def _damping(mode: int, sweeps: xr.Dataset) -> Here:
    told = mean(column(sweeps, "damping", mode), whiskers_of(sweeps))
    note = "by Eq. 5, as the paper; with the texture's forcing "
    note += f"{told.value:.3g} ({told.low:.3g} to {told.high:.3g})" if np.isfinite(told.value) else "not measured"
    return mean(column(sweeps, "damping_white", mode), whiskers_of(sweeps), note)


def _frequency(mode: int, term: str, sweeps: xr.Dataset) -> Here:
    response = column(sweeps, "resonant_frequency_white", mode)
    return effect(sweeps, response, term, ("scan_speed", "contact"), True)


def _gain(term: str, sweeps: xr.Dataset, names: tuple[str, ...] = ()) -> Here:
    if names:
        sweeps = sweeps.isel(sweep=np.flatnonzero(np.isin(sweeps.whisker_name.values, names)))
    if not sweeps.sizes["sweep"]:
        return Here(note=f"no sweeps of {names[0]} and {names[-1]}")
    terms = ("scan_speed", "contact", "base_angle")
    return effect(sweeps, column(sweeps, "mode_rms", 1), term, terms, False)


def _gain_ratio(sweeps: xr.Dataset) -> Here:
    """How much larger the gain is at 1.4 than at 0.8 rad, ε held: the logarithm taken for linear in the angle."""
    terms = {name: column(sweeps, name) for name in ("contact", "base_angle")}
    angle = clustered_model(np.log(column(sweeps, "mode_rms", 1)), terms, whiskers_of(sweeps))[1]
    with np.errstate(over="ignore"):  # of few whiskers an interval may have no end
        ends = np.exp(0.6 * np.array([angle.slope, angle.low, angle.high]))
    return Here(float(ends[0]), float(ends[1]), float(ends[2]), angle.n, "ln rms linear in θ_b and ε")


def _kappa(sweeps: xr.Dataset, mode: int) -> tuple[Array, Array]:
    """κ measured with the nominal E, kω, and κ(ε) of the straight pinned cone."""
    contact, timescale = column(sweeps, "contact"), column(sweeps, "timescale")
    found = 2 * np.pi * timescale * column(sweeps, "resonant_frequency_white", mode)
    inside = (contact > 0) & (contact < 1)
    model = [_pinned(float(e))[mode - 1] if ok else np.nan for e, ok in zip(contact, inside, strict=True)]
    return found, np.array(model)


@lru_cache(maxsize=10_000)
def _pinned(contact: float) -> Array:
    return cone_kappa(contact, 2)


def _modulus_ratio(sweeps: xr.Dataset) -> Array:
    """E over its nominal value that brings each sweep's modes 1 and 2 onto κ(ε), (sweep,)."""
    ratios = np.log([found / model for found, model in (_kappa(sweeps, 1), _kappa(sweeps, 2))])
    made = np.isfinite(ratios)
    total = np.where(made, ratios, 0).sum(axis=0)
    return np.exp(2 * np.where(made.any(axis=0), total / np.maximum(made.sum(axis=0), 1), np.nan))


def _modulus(sweeps: xr.Dataset) -> Here:
    whole = mean(np.log(_modulus_ratio(sweeps)), whiskers_of(sweeps))
    value, low, high = (YOUNGS_MODULUS * float(np.exp(one)) for one in whole[:3])
    return Here(value, low, high, whole.n, "modes 1 and 2 by Eq. 5 on κ(ε) of straight modes, ρ as printed")


def _collapse(mode: int, sweeps: xr.Dataset) -> Here:
    """Share of the variance of κ that κ(ε) explains, one E for all sweeps."""
    found, model = _kappa(sweeps, mode)
    made = np.isfinite(found) & np.isfinite(model)
    if made.sum() < 3:
        return Here(note="fewer than 3 sweeps")
    found = found / np.exp(np.nanmean(np.log(_modulus_ratio(sweeps))) / 2)
    index = np.flatnonzero(made).astype(float)

    def r2(chosen: Array) -> float:
        k = chosen.astype(int)
        return float(1 - np.sum((found[k] - model[k]) ** 2) / np.sum((found[k] - found[k].mean()) ** 2))

    ends = jackknife_interval(index, r2, clusters=whiskers_of(sweeps)[made])
    return Here(r2(index), *ends, float(made.sum()))


def _least_collapse(sweeps: xr.Dataset) -> Here:
    both = [_collapse(mode, sweeps) for mode in (1, 2)]
    return min(both, key=lambda one: one.value)._replace(low=np.nan, high=np.nan)


def _air(mode: int, _: Results) -> Here:
    kappa = float(cone_kappa(0.0, mode, "free")[mode - 1])
    return Here(kappa, kappa, kappa, note="exact, of a whole cone")


def _over_air(sweeps: xr.Dataset) -> Here:
    """The largest ratio of a frequency on the texture to that of the same whisker in air."""
    found = _kappa(sweeps, 1)[0] / cone_kappa(0.0, 1, "free")[0]
    made = np.isfinite(found)
    if not made.any():
        return Here(note="not measured in any sweep")
    most = float(found[made].max())
    return Here(most, most, most, float(made.sum()), "the largest")


def _with_comparison(measure: Callable[[xr.Dataset, xr.Dataset], Here]) -> Measure:
    def on(results: Results) -> Here:
        if "comparison" not in results:
            return Here(note="no prediction was held against the sweeps")
        held = results["comparison"]
        return of_sweeps(lambda sweeps: measure(sweeps, held.sel(sweep=sweeps.sweep.values)))(results)

    return on


def _agreement(mode: int, sweeps: xr.Dataset, held: xr.Dataset) -> Here:
    return mean(column(held, "correlation", mode), whiskers_of(sweeps))


def _significant(mode: int, sweeps: xr.Dataset, held: xr.Dataset) -> Here:
    p, pseudo = (column(held, name, mode) for name in ("pearson_p", "pseudo_p"))
    share = np.where(np.isfinite(p), p < 0.05, np.nan)
    apart = pseudo[np.isfinite(pseudo)]
    note = f"{100 * np.mean(apart < 0.05):.0f} % against other textures' predictions" if apart.size else ""
    return mean(share, whiskers_of(sweeps), note)


def _agreement_effect(term: str, sweeps: xr.Dataset, held: xr.Dataset) -> Here:
    return effect(sweeps, column(held, "correlation", 1), term, ("contact", "base_angle"), True)


def _repeats(results: Results) -> Here:
    if "repeats" not in results:
        return Here(note="no sweep was repeated")
    found = results["repeats"].run_correlation
    repetition = np.broadcast_to(np.arange(found.shape[0])[:, None], found.shape)
    return mean(found.values.ravel(), repetition.ravel())


def _noise(results: Results) -> Here:
    if "profile" not in results:
        return Here(note="no tracked profile kept; see the page on tracking")
    if not {"x_sd", "y_sd"} & set(results["profile"].data_vars):
        return Here(note="the tracks of another program tell none")
    sd = np.nanmedian(measured_sd(results["profile"]).values, axis=-1).ravel()
    ends = np.nanquantile(sd, [0.025, 0.975])
    return Here(
        float(np.nanmedian(sd)),
        float(ends[0]),
        float(ends[1]),
        note="standard deviation of a node as tracked, over frames",
    )


def _contact_change(results: Results) -> Here:
    if "gap" not in results or "stage_contact" not in results["gap"]:
        return Here(note="no single gap was computed")
    stage = results["gap"].stage_contact.values
    return Here(float(np.ptp(stage)), note="of the gap of Figure 2")


def _textures(sweeps: xr.Dataset) -> Here:
    key = [f"{one} {c}" for one, c in zip(whiskers_of(sweeps), sweeps["condition"].values, strict=True)]
    counts = [len(np.unique(sweeps["texture"].values[np.array(key) == name])) for name in np.unique(key)]
    return Here(float(np.median(counts)), min(counts), max(counts), len(counts), "N conditions")


def _told(*path: str) -> Measure:
    """A setting of the virtual laboratory."""

    def of(results: Results) -> Here:
        value: Any = json.loads(results["sweeps"].attrs.get("laboratory", "{}")) if "sweeps" in results else {}
        for key in path:
            value = value.get(key) if isinstance(value, dict) else None
        return Here(note=UNTOLD) if value is None else Here(float(value))

    return of


def _of_recording(setting: Measure, found: Callable[[Results], float]) -> Measure:
    """A setting of the virtual laboratory; of recorded sweeps, what the one that is shown tells."""

    def of(results: Results) -> Here:
        told, value = setting(results), np.nan
        if np.isnan(told.value) and "profile" in results:
            value = found(results)
        return told if np.isnan(value) else Here(value, note="of the sweep shown")

    return of


def _rate_of_profile(results: Results) -> float:
    return 1 / float(np.median(np.diff(results["profile"].time.values)))


def _pixel_of_profile(results: Results) -> float:
    return float(results["profile"].attrs.get("pixel_size", np.nan))


def _field_of_still(results: Results) -> float:
    return float(results["still"].sizes["column"]) if "still" in results else np.nan


def _frames_of_profile(results: Results) -> float:
    return float(results["profile"].sizes["time"])


def _frames(results: Results) -> Here:
    told = _told("n_frames")
    if (
        "sweeps" not in results
        or json.loads(results["sweeps"].attrs.get("laboratory", "{}")).get("n_frames") != "plate"
    ):
        return told(results)
    plate = _told("texture_length")(results).value * _told("camera", "frame_rate")(results).value
    count = plate / results["sweeps"].scan_speed.values
    return Here(float(np.median(count)), float(count.min()), float(count.max()), count.size, "as the plate lasts")


MEASURES: dict[str, Measure] = {
    "animals": count(lambda sweeps: sweeps.animal.values),
    "whiskers": count(whiskers_of),
    "speeds": extent("scan_speed"),
    "heights": extent("base_height"),
    "length": extent("length"),
    "cone_angle": extent("cone_angle"),
    "friction": _told("friction"),
    "textures": of_sweeps(_textures),
    "plate_length": _told("texture_length"),
    "period": _told("mean_period"),
    "frame_rate": _of_recording(_told("camera", "frame_rate"), _rate_of_profile),
    "exposure": _told("camera", "exposure"),
    "pixel": _of_recording(_told("camera", "pixel_size"), _pixel_of_profile),
    "field": _of_recording(_told("camera", "width"), _field_of_still),
    "shadow": _told("shadow"),
    "frames": _of_recording(_frames, _frames_of_profile),
    "density": _told("density"),
    "noise": _noise,
    "profile_r2": mean_of("profile_r2"),
    "contact_change": _contact_change,
    "repeats": _repeats,
    "variance_sum": of_sweeps(_variance_sum),
    "modulus": of_sweeps(_modulus),
    "modulus_bracket": of_sweeps(_modulus),
    "modulus_literature": of_sweeps(_modulus),
    "collapse_least": of_sweeps(_least_collapse),
    "contact_over_air": of_sweeps(_over_air),
    "gain_mean": mean_of("mode_rms", 1),
    "gain_ratio": of_sweeps(_gain_ratio),
    "gain_speed": of_sweeps(partial(_gain, "scan_speed")),
    "gain_contact": of_sweeps(partial(_gain, "contact")),
    "gain_angle": of_sweeps(partial(_gain, "base_angle")),
    "gain_angle_two": of_sweeps(partial(_gain, "base_angle", names=("beta", "β", "C1"))),
    "agreement_contact": _with_comparison(partial(_agreement_effect, "contact")),
    "agreement_angle": _with_comparison(partial(_agreement_effect, "base_angle")),
    "agreement_identity": _with_comparison(partial(_agreement_effect, "whisker")),
    **{f"variance_{mode}": mean_of("variance_explained", mode) for mode in (1, 2, 3)},
    **{f"lorentzian_r2_{mode}": mean_of("fit_r2_white", mode) for mode in (1, 2)},
    **{f"damping_{mode}": of_sweeps(partial(_damping, mode)) for mode in (1, 2)},
    **{f"frequency_speed_{mode}": of_sweeps(partial(_frequency, mode, "scan_speed")) for mode in (1, 2)},
    **{f"frequency_contact_{mode}": of_sweeps(partial(_frequency, mode, "contact")) for mode in (1, 2)},
    **{f"collapse_r2_{mode}": of_sweeps(partial(_collapse, mode)) for mode in (1, 2)},
    **{f"collapse_r2_{mode}_caption": of_sweeps(partial(_collapse, mode)) for mode in (1, 2)},
    **{f"kappa_air_{mode}": partial(_air, mode) for mode in (1, 2)},
    **{f"agreement_{mode}": _with_comparison(partial(_agreement, mode)) for mode in (1, 2)},
    **{f"significant_{mode}": _with_comparison(partial(_significant, mode)) for mode in (1, 2)},
}
