"""What these sweeps give for each number that the paper prints."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.exact import cone_kappa
from vibrissa.quantities import measured_sd
from vibrissa.quantities.kinds import Results
from vibrissa.stats import clustered_model, reaches, significant
from vibrissa.study.paper.paper_modulus import collapse_here, least_collapse, measured_kappa, modulus_here
from vibrissa.study.paper.paper_scale import amplitude_here
from vibrissa.study.paper.sweep_measures import (
    WHITE,
    Measure,
    MeasuredNumber,
    column,
    count,
    effect,
    extent,
    mean,
    mean_of,
    of_sweeps,
    share,
    whiskers_of,
)

if TYPE_CHECKING:
    import xarray as xr

UNKNOWN = "not in the table of sweeps"
_TRAVEL = 0.02  # [L] of the contact in a gap: the paper's bound


def _variance_sum(sweeps: xr.Dataset) -> MeasuredNumber:
    summed = sweeps["variance_explained"].sel(mode=[1, 2, 3]).values.sum(axis=1)
    return mean(summed, whiskers_of(sweeps), scale="share")


def _damping(mode: int, sweeps: xr.Dataset) -> MeasuredNumber:
    white, informed = (mean(column(sweeps, f"damping{end}", mode), whiskers_of(sweeps)) for end in (WHITE, ""))
    return white._replace(informed=informed)


def _frequency(mode: int, term: str, sweeps: xr.Dataset) -> MeasuredNumber:
    response = column(sweeps, "resonant_frequency_white", mode)
    return effect(sweeps, response, term, ("scan_speed", "contact"), True)


def _gain(term: str, sweeps: xr.Dataset, names: tuple[str, ...] = ()) -> MeasuredNumber:
    if names:
        sweeps = sweeps.isel(sweep=np.flatnonzero(np.isin(sweeps.whisker_name.values, names)))
    if not sweeps.sizes["sweep"]:
        return MeasuredNumber(note=f"no sweeps of {names[0]} and {names[-1]}")
    terms = ("scan_speed", "contact", "base_angle")
    return effect(sweeps, column(sweeps, "mode_rms", 1), term, terms, False)


def _gain_ratio(name: str, sweeps: xr.Dataset) -> MeasuredNumber:
    """How much larger the gain is at 1.4 than at 0.8 rad, ε held: the logarithm taken to be linear in the angle."""
    terms = {term: column(sweeps, term) for term in ("contact", "base_angle")}
    whisker = whiskers_of(sweeps)
    angle = clustered_model(np.log(column(sweeps, name, 1)), terms, whisker)[1]
    with np.errstate(over="ignore"):  # of few whiskers an interval may have no end
        ends = np.exp(0.6 * np.array([angle.slope, angle.low, angle.high]))
    value, low, high = ends.tolist()
    return MeasuredNumber(value, low, high, angle.n, "ln rms linear in θ_b and ε", draws=float(len(np.unique(whisker))))


def _air(mode: int, _: Results) -> MeasuredNumber:
    kappa = float(cone_kappa(0.0, mode, "free")[mode - 1])
    return MeasuredNumber(kappa, kappa, kappa, note="exact, of a whole cone")


def _over_air(sweeps: xr.Dataset) -> MeasuredNumber:
    """The largest ratio of a frequency on the texture to that of the same whisker in air."""
    found = measured_kappa(sweeps, 1)[0] / cone_kappa(0.0, 1, "free")[0]
    made = np.isfinite(found)
    if not made.any():
        return MeasuredNumber(note="not measured in any sweep")
    most = float(found[made].max())
    return MeasuredNumber(most, most, most, float(made.sum()), "the largest")


def _with_comparison(measure: Callable[[xr.Dataset, xr.Dataset], MeasuredNumber]) -> Measure:
    def on(results: Results) -> MeasuredNumber:
        if "comparison" not in results:
            return MeasuredNumber(note="no prediction was compared with the sweeps")
        held = results["comparison"]
        return of_sweeps(lambda sweeps: measure(sweeps, held.sel(sweep=sweeps.sweep.values)))(results)

    return on


def _agreement(mode: int, sweeps: xr.Dataset, held: xr.Dataset) -> MeasuredNumber:
    return mean(column(held, "correlation", mode), whiskers_of(sweeps), scale="correlation")


def _significant(mode: int, sweeps: xr.Dataset, held: xr.Dataset) -> MeasuredNumber:
    p = column(held, "pearson_p", mode)
    passed = np.where(np.isfinite(p), significant(p), np.nan)
    note = f"{int(np.nansum(passed))} of {int(np.isfinite(p).sum())}; {_by_gratings(mode, held)}"
    return share(passed, whiskers_of(sweeps), note)


def _by_gratings(mode: int, held: xr.Dataset) -> str:
    """How many are significant against predictions for new gratings, of those compared with enough of them."""
    count = held["pseudo_count"].values
    able = np.isfinite(column(held, "correlation", mode)) & reaches(count)
    if not able.any():
        return f"new gratings, at most {int(count.max(initial=0))}, cannot reach that level"
    passed = int(significant(column(held, "pseudo_p", mode)[able]).sum())
    return f"{passed} of {int(able.sum())} against the predictions for new gratings"


def _agreement_effect(term: str, sweeps: xr.Dataset, held: xr.Dataset) -> MeasuredNumber:
    return effect(sweeps, column(held, "correlation", 1), term, ("contact", "base_angle"), True)


def _repeats(results: Results) -> MeasuredNumber:
    if "repeats" not in results:
        return MeasuredNumber(note="no sweep was repeated")
    found = results["repeats"].run_correlation
    repetition = np.broadcast_to(np.arange(found.shape[0])[:, None], found.shape)
    return mean(found.values.ravel(), repetition.ravel(), scale="correlation")


def _noise(results: Results) -> MeasuredNumber:
    if "profile" not in results:
        return MeasuredNumber(note="no tracked profile kept; see the page on tracking")
    if not {"x_sd", "y_sd"} & set(results["profile"].data_vars):
        return MeasuredNumber(note="the tracks of another program have none")
    every = measured_sd(results["profile"]).values
    sd = np.nanmedian(every[np.isfinite(every).any(axis=-1)], axis=-1)  # not of frames in which a whisker is lost
    middle, low, high = np.nanquantile(sd, [0.5, 0.025, 0.975]).tolist()
    return MeasuredNumber(middle, low, high, note="standard deviation of a node as tracked, over frames")


def _contact_travel(sweeps: xr.Dataset) -> MeasuredNumber:
    """How far the contact moves along the shaft in a gap: each sweep's median over its gaps."""
    travel = column(sweeps, "contact_travel")
    below, made = np.sum(travel < _TRAVEL), travel[np.isfinite(travel)]
    if not made.size:
        return MeasuredNumber(note="no texture known, so no gap of which it could be computed")
    note = f"the median gap of a sweep; below {_TRAVEL} in {below} of {made.size} sweeps, at most {made.max():.3f}"
    return mean(travel, whiskers_of(sweeps), note)


def _textures(sweeps: xr.Dataset) -> MeasuredNumber:
    key = [f"{one} {c}" for one, c in zip(whiskers_of(sweeps), sweeps["condition"].values, strict=True)]
    counts = [len(np.unique(sweeps["texture"].values[np.array(key) == name])) for name in np.unique(key)]
    return MeasuredNumber(float(np.median(counts)), min(counts), max(counts), len(counts), "N conditions")


def _laboratory(results: Results) -> dict[str, Any]:
    """Settings of the virtual laboratory; none where the sweeps are recorded, or absent."""
    return json.loads(results["sweeps"].attrs.get("laboratory", "{}")) if "sweeps" in results else {}


def _setting(*path: str) -> Measure:
    """A setting of the virtual laboratory."""

    def of(results: Results) -> MeasuredNumber:
        value: Any = _laboratory(results)
        for key in path:
            value = value.get(key) if isinstance(value, dict) else None
        return MeasuredNumber(note=UNKNOWN) if value is None else MeasuredNumber(float(value))

    return of


def _written(setting: Measure, text: Callable[[float], str]) -> Measure:
    """A setting as the paper writes it."""

    def of(results: Results) -> MeasuredNumber:
        found = setting(results)
        return found._replace(text=text(found.value)) if np.isfinite(found.value) else found

    return of


def _of_recording(setting: Measure, found: Callable[[Results], float]) -> Measure:
    """A setting of the virtual laboratory; of recorded sweeps, that of the one shown."""

    def of(results: Results) -> MeasuredNumber:
        chosen, value = setting(results), np.nan
        if np.isnan(chosen.value) and "profile" in results:
            value = found(results)
        return chosen if np.isnan(value) else MeasuredNumber(value, note="of the sweep shown")

    return of


def _rate_of_profile(results: Results) -> float:
    return 1 / float(np.median(np.diff(results["profile"].time.values)))


def _pixel_of_profile(results: Results) -> float:
    return float(results["profile"].attrs.get("pixel_size", np.nan))


def _field(results: Results) -> MeasuredNumber:
    camera = _laboratory(results).get("camera") or {}
    width, height = camera.get("width"), camera.get("height")
    note = ""
    if width is None and {"profile", "still"} <= set(results):
        width, height = (results["still"].sizes[f"image_{axis}"] for axis in ("column", "row"))
        note = "of the sweep shown"
    if width is None or height is None:
        return MeasuredNumber(note=UNKNOWN)
    return MeasuredNumber(float(width), note=note, text=f"{width:.0f} × {height:.0f} pixels")


def _frames_of_profile(results: Results) -> float:
    return float(results["profile"].sizes["time"])


def _frames(results: Results) -> MeasuredNumber:
    if _laboratory(results).get("n_frames") != "plate":
        return _setting("n_frames")(results)
    plate = _setting("texture_length")(results).value * _setting("camera", "frame_rate")(results).value
    count = plate / results["sweeps"].scan_speed.values
    return MeasuredNumber(
        float(np.median(count)), float(count.min()), float(count.max()), count.size, "as the plate lasts"
    )


MEASURES: dict[str, Measure] = {
    "animals": count(lambda sweeps: sweeps.animal.values),
    "whiskers": count(whiskers_of),
    "speeds": extent("scan_speed"),
    "heights": extent("base_height"),
    "length": extent("length"),
    "cone_angle": extent("cone_angle"),
    "friction": _setting("friction"),
    "textures": of_sweeps(_textures),
    "plate_length": _setting("texture_length"),
    "period": _setting("mean_period"),
    "frame_rate": _of_recording(_setting("camera", "frame_rate"), _rate_of_profile),
    "exposure": _written(_setting("camera", "exposure"), lambda value: f"1/{1 / value:.0f} s"),
    "pixel": _of_recording(_setting("camera", "pixel_size"), _pixel_of_profile),
    "field": _field,
    "shadow": _setting("shadow"),
    "frames": _of_recording(_frames, _frames_of_profile),
    "density": _setting("density"),
    "noise": _noise,
    "profile_r2": mean_of("profile_r2", scale="r2"),
    "contact_change": of_sweeps(_contact_travel),
    "repeats": _repeats,
    "variance_sum": of_sweeps(_variance_sum),
    **{name: of_sweeps(modulus_here) for name in ("modulus", "modulus_bracket", "modulus_literature")},
    "collapse_least": of_sweeps(least_collapse),
    "contact_over_air": of_sweeps(_over_air),
    "gain_mean": mean_of("mode_rms", 1),
    **{f"gain_{part}{norm}": of_sweeps(partial(amplitude_here, part))
       for part in ("antinode", "near_base") for norm in ("", "_max")},
    "gain_ratio": of_sweeps(partial(_gain_ratio, "mode_rms")),
    "gain_ratio_model": of_sweeps(partial(_gain_ratio, "mode_rms_model")),
    "gain_speed": of_sweeps(partial(_gain, "scan_speed")),
    "gain_contact": of_sweeps(partial(_gain, "contact")),
    "gain_angle": of_sweeps(partial(_gain, "base_angle")),
    "gain_angle_two": of_sweeps(partial(_gain, "base_angle", names=("beta", "β", "C1"))),
    "agreement_contact": _with_comparison(partial(_agreement_effect, "contact")),
    "agreement_angle": _with_comparison(partial(_agreement_effect, "base_angle")),
    "agreement_identity": _with_comparison(partial(_agreement_effect, "whisker")),
    **{f"variance_{mode}": mean_of("variance_explained", mode, "share") for mode in (1, 2, 3)},
    **{f"lorentzian_r2_{mode}": mean_of("fit_r2_white", mode, "r2") for mode in (1, 2)},
    **{f"damping_{mode}": of_sweeps(partial(_damping, mode)) for mode in (1, 2)},
    **{f"frequency_speed_{mode}": of_sweeps(partial(_frequency, mode, "scan_speed")) for mode in (1, 2)},
    **{f"frequency_contact_{mode}": of_sweeps(partial(_frequency, mode, "contact")) for mode in (1, 2)},
    **{f"collapse_r2_{mode}{where}": of_sweeps(partial(collapse_here, mode))
       for mode in (1, 2) for where in ("", "_caption")},
    **{f"kappa_air_{mode}": partial(_air, mode) for mode in (1, 2)},
    **{f"agreement_{mode}": _with_comparison(partial(_agreement, mode)) for mode in (1, 2)},
    **{f"significant_{mode}": _with_comparison(partial(_significant, mode)) for mode in (1, 2)},
}  # fmt: skip
