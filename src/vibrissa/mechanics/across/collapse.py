"""Young's modulus from resonances on textures: the E with which κ = kω falls on κ_i(ε) over whiskers (Fig. 5C)."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import TooFewError, UnknownError
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.across.gain import effects, whisker_of_animal
from vibrissa.mechanics.modes.basis import CURVED, Modes
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.modes.straight import CONTACT_RANGE
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset, require
from vibrissa.stats import jackknife_interval
from vibrissa.whisker import YOUNGS_MODULUS

Forcing = Literal["texture", "white"]

USED = 2  # modes: the paper's third is too small to be estimated
FRICTION = 0.4
_ENDS = "", "_low", "_high"  # of a value and its interval


class _Estimate(NamedTuple):
    """A mean with the ends of its 95 % interval."""

    value: float
    low: float
    high: float


def collapse(
    sweeps: xr.Dataset, *, forcing: Forcing = "texture", modes: Modes = "straight", friction: float = FRICTION
) -> xr.Dataset:
    """Young's modulus of all sweeps and of each whisker's identity, and how well κ = kω then follows κ_i(ε).

    Each sweep gives ln E, the mean over modes 1 and 2 of 2 ln(kω/κ_i) with k of the nominal E. The mean over sweeps
    takes whole whiskers of animals for the draws (jackknife, Student's t), since those share L, α, E and their errors;
    the interval by whole animals is given too, and is wide with few. Errors of L, α and ρ go into E in full
    (E ∝ (ρ L²/α²) ω²): where they are common to all whiskers no interval can know them.

    Parameters
    ----------
    sweeps : Dataset
        The table of sweeps: ``contact``, ``base_angle``, ``timescale`` k with the nominal E, ``resonant_frequency`` (or
        ``resonant_frequency_white``), ``animal``, ``whisker_name``; ``accepted``, if it is there.
    forcing : {"texture", "white"}
        Which fits: with the texture's forcing known, or Eq. 5, the paper's.
    modes : {"straight", "curved", "curved-coulomb", "curved-edge"}
        Whose κ_i: the paper's, of a straight shaft; or about the curved profile of each sweep's posture, see
        :func:`vibrissa.mechanics.modes.basis.basis`.
    friction : float
        μ, for curved modes.

    Returns
    -------
    Dataset
        ``youngs_modulus`` [Pa] with ``_low`` and ``_high`` (95 %, by whisker) and ``_animal_low``, ``_animal_high`` (by
        animal); ``modulus_sd``, the standard deviation of ln E over sweeps. By ``identity`` (the whisker's name):
        ``identity_modulus`` [Pa] with ``_low``, ``_high`` (animals the draws; NaN with one). By ``sweep``:
        ``sweep_modulus`` [Pa], ``kappa`` and ``kappa_model`` (mode), κ with the E of all sweeps and by the modes.
        By ``mode``: ``collapse_r2``, the share of the variance of κ over sweeps that κ_i(ε) explains, with ``_low``,
        ``_high`` (by whisker). ``effect_p`` … (term) of identity, ε and v on ln E, see
        :func:`vibrissa.mechanics.across.gain.effects`.

    Raises
    ------
    InputError
        If no sweep has a resonance.
    """
    require(sweeps, "contact", "base_angle", "timescale", "animal", "whisker_name")
    some = sweeps.isel(sweep=np.flatnonzero(sweeps.accepted.values.astype(bool))) if "accepted" in sweeps else sweeps
    nominal, model = _measured(some, forcing), _expected(some, modes, friction)
    log_e = _log_modulus(nominal, model)
    if not np.isfinite(log_e).any():
        raise TooFewError("sweeps", "must have one with a resonance at least")
    whisker = whisker_of_animal(some)
    whole, by_animal = _mean(log_e, whisker), _mean(log_e, some.animal.values)
    kappa = nominal / np.exp(whole.value / 2)
    known = {name: some[name].values for name in ("whisker_name", "contact", "scan_speed") if name in some.variables}
    terms = {name: values for name, values in known.items() if len(np.unique(values)) > 1}
    columns: dict[str, Any] = {
        **{f"youngs_modulus{end}": _pascal(one) for end, one in zip(_ENDS, whole, strict=True)},
        "youngs_modulus_animal_low": _pascal(by_animal.low),
        "youngs_modulus_animal_high": _pascal(by_animal.high),
        "modulus_sd": np.nanstd(log_e),
        "sweep_modulus": _pascal(log_e),
        **_by_identity(some, log_e),
        **_r2(kappa, model, whisker),
    }
    found = dataset(
        {"forcing": forcing, "modes": modes},
        lead=("sweep",),
        sweep=some.sweep.values,
        mode=np.arange(1, USED + 1),
        kappa=kappa,
        kappa_model=model,
        **columns,
    )
    return found.merge(effects(log_e, terms, whisker), combine_attrs="override")


def _by_identity(sweeps: xr.Dataset, log_e: Array) -> dict[str, Any]:
    """E of the whiskers of each name, animals the draws."""
    own, animal = sweeps.whisker_name.values.astype(str), sweeps.animal.values
    names = np.unique(own)
    each = [_mean(np.where(own == name, log_e, np.nan), animal) for name in names]
    ends = dict(zip(_ENDS, np.transpose(each), strict=True))
    return {"identity": names} | {f"identity_modulus{end}": _pascal(values) for end, values in ends.items()}


def modulus_in_air(measured: Array, predicted: Array) -> tuple[Array, tuple[float, float, float]]:
    """Young's modulus of isolated whiskers from their resonances in air, each whisker a draw.

    Parameters
    ----------
    measured, predicted : (N, M) arrays
        Resonances as measured (NaN where not) and of the free cone with the nominal E [Hz].

    Returns
    -------
    modulus : (N,) array
        E of each whisker [Pa], the mean of ln E over its modes.
    whole : (value, low, high)
        Geometric mean over whiskers with its 95 % interval [Pa].
    """
    log_e = _log_modulus(measured, predicted)
    return _pascal(log_e), tuple(_pascal(_mean(log_e, np.arange(len(log_e)))).tolist())


def _measured(sweeps: xr.Dataset, forcing: Forcing) -> Array:
    """kω with k of the nominal E, (sweep, mode)."""
    if forcing not in ("texture", "white"):
        raise UnknownError("forcing", "must be 'texture' or 'white'", repr(forcing))
    found = sweeps["resonant_frequency" if forcing == "texture" else "resonant_frequency_white"].values[:, :USED]
    return np.asarray(2 * np.pi * sweeps.timescale.values[:, None] * found, float)


def _expected(sweeps: xr.Dataset, modes: Modes, friction: float) -> Array:
    """κ_i of each sweep's posture, (sweep, mode); NaN where it was not found, is out of range or has no stable mode."""
    postures = zip(sweeps.contact.values.tolist(), sweeps.base_angle.values.tolist(), strict=True)
    return np.array([expected_kappa(contact, angle, modes, friction) for contact, angle in postures]).reshape(-1, USED)


@lru_cache(maxsize=4096)
def _straight(contact: float) -> Array:
    return np.asarray(cone_kappa(contact, USED), float)


def expected_kappa(contact: float, angle: float, modes: Modes, friction: float = FRICTION) -> Array:
    """κ of the first two modes of a posture, (2,); NaN if it is out of range or they are not stable.

    Parameters
    ----------
    contact, angle : float
        Contact s_c, over L; base angle θ_b [rad].
    modes : str
        As in :func:`collapse`.
    friction : float
        μ, for curved modes.

    Returns
    -------
    (2,) array
        κ; NaN if the contact is out of range or the modes are not stable.

    Raises
    ------
    InputError
        If ``modes`` has another name.
    """
    if not CONTACT_RANGE[0] <= contact <= CONTACT_RANGE[1]:
        return np.full(USED, np.nan)
    if modes == "straight":
        return _straight(contact)
    if modes not in CURVED:
        raise UnknownError("modes", f"must be 'straight' or one of {', '.join(CURVED)}", repr(modes))
    condition, law = CURVED[modes]
    posture = Posture(contact=contact, base_angle=angle, friction=friction)
    found = curved_modes(posture, USED, condition=condition, law=law)
    return np.where(found.growth > 0, np.nan, found.kappa)


def _log_modulus(nominal: Array, model: Array) -> Array:
    """Logarithm of E over its nominal value that brings the modes measured onto κ_i, (sweep,)."""
    ratio = 2 * np.log(nominal / model)
    made = np.isfinite(ratio)
    total = np.where(made, ratio, 0).sum(axis=1)
    return np.where(made.any(axis=1), total / np.maximum(made.sum(axis=1), 1), np.nan)


def _mean(values: Array, clusters: NDArray[Any]) -> _Estimate:
    if not np.isfinite(values).any():
        return _Estimate(np.nan, np.nan, np.nan)
    return _Estimate(float(np.nanmean(values)), *jackknife_interval(values, clusters=clusters))


def _pascal(log_ratio: Any) -> Array:
    return np.asarray(YOUNGS_MODULUS * np.exp(np.asarray(log_ratio, float)))


def _r2(kappa: Array, model: Array, whisker: NDArray[Any]) -> dict[str, list[float]]:
    """Share of the variance of each mode's κ that lies on κ_i(ε), with its interval by whisker."""
    rows = []
    for found, expected in zip(kappa.T, model.T, strict=True):
        index = np.where(np.isfinite(found) & np.isfinite(expected), np.arange(len(found)), np.nan)

        def r2(chosen: Array, found: Array = found, expected: Array = expected) -> float:
            k = chosen.astype(int)
            return float(1 - np.sum((found[k] - expected[k]) ** 2) / np.sum((found[k] - found[k].mean()) ** 2))

        made = index[np.isfinite(index)]
        several = made.size > 2 and len(np.unique(whisker[made.astype(int)])) > 2
        ends = jackknife_interval(index, r2, clusters=whisker, scale="r2") if several else (np.nan, np.nan)
        rows.append((r2(made) if made.size > 2 else np.nan, *ends))
    return {f"collapse_r2{end}": list(column) for end, column in zip(_ENDS, zip(*rows, strict=True), strict=True)}
