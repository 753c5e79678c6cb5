"""How far the model's assumptions hold: the free end, linearity, the fold, lift-off, the whisker's own weight."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.mechanics.modes.basis import contact_motion
from vibrissa.mechanics.modes.shift import resonance_shift, shift_remark
from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE
from vibrissa.mechanics.scan.free_end import TOUCH, free_end_facts, free_end_lines
from vibrissa.mechanics.scan.motion import PredictedMotion
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.mechanics.scan.verdict import verdict
from vibrissa.mechanics.statics.gap import unit_response
from vibrissa.quantities import dataset
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.texture.relief import HeightProfile


GRAVITY = 9.81  # [m/s²]
_CHORD = 17  # points from one place of a jump to the other
_WALL = 1.0  # slope of the ground that is a wall; a valley in which a shaft lies is gentler by far


def own_weight(whisker: Whisker) -> float:
    """Own weight in the unit of the contact force, 4ρgL(1 − s³)/(3Eα²): the weight down to the tip s over πEα⁴L²/4.

    Parameters
    ----------
    whisker : Whisker
        Gives ρ, E, α, L and the tip.

    Returns
    -------
    float
        Weight [1].
    """
    cone = 4 * whisker.density * GRAVITY * whisker.length / (3 * whisker.youngs_modulus * whisker.cone_angle**2)
    return cone * (1 - whisker.tip**3)


def diagnostics(prediction: Prediction, t: Array) -> xr.Dataset:
    """How far the assumptions of a prediction hold.

    Parameters
    ----------
    prediction : Prediction
        To be judged.
    t : (T,) array
        Times at which the load on the contact is looked at [s].

    Returns
    -------
    Dataset
        ``linearity`` (mode): exact over linear jump of the mode, root mean square over the gaps, with the sign of the
        mean; ``mechanism`` (mode): λω/v at the mean width: far above 1 the jumps (Eq. 13) drive the mode, far below 1
        the ramps (Eq. 12). ``free_end_length`` [m]; over the gaps (trough): ``free_end_dip`` [m], depth of the free end
        below the land behind the gap just after the jump, λ sin θ_ε, and ``single_contact``: whether the free end
        allows the jump, see :func:`vibrissa.mechanics.scan.free_end.gaps_allowed`; ``jump_count``, ``jumps_allowed``
        and ``jumps_allowed_share``, of all gaps. ``fold_determinant``; ``weight_ratio``, own weight over contact
        force; ``least_contact_load`` over its value at rest, and ``lift_off``, the share of times at which it is not
        positive; a jump sets all modes ringing, so the first depends on how many are taken. ``least_slip``, the least
        speed at which the vibrating contact slips over the ground, over the scanning speed, and ``slip_reversed``, the
        share of times at which it is not positive: there the contact would stick, which no law here follows (while an
        edge carries the contact along the shaft slips faster, which is left out). ``resonance_ratio`` and
        ``growth_rate`` (contact_law, mode): what modes about the curved profile would change, see
        :func:`vibrissa.mechanics.modes.shift.resonance_shift`.
    """
    width, exact = prediction.texture.width, prediction.exact
    before, after = prediction.events.gaps
    n = len(exact.c)
    angle = exact(after)[n + FOLLICLE.index("contact_angle")]
    return dataset(
        _attributes(prediction),
        lead=("contact_law",),
        **_of_motion(prediction, t),
        trough=np.arange(len(width)),
        linearity=_linearity(exact(before)[:n] - exact(after)[:n], exact.c[:, None] * (before - after)),
        mechanism=width.mean() * prediction.omega / prediction.scan.speed,
        free_end_dip=width * np.sin(angle),
        single_contact=prediction.allowed_jumps,
    )


def relief_diagnostics(prediction: ReliefPrediction, t: Array) -> xr.Dataset:
    """How far the assumptions of a prediction over any surface hold.

    Parameters
    ----------
    prediction : ReliefPrediction
        To be judged.
    t : (T,) array
        Times at which the load on the contact is looked at [s].

    Returns
    -------
    Dataset
        As :func:`diagnostics`, the contact's jumps in place of the gaps: ``linearity`` and ``mechanism`` are NaN where
        it never jumps. ``jumps_allowed``: after how many of them the straight free end clears the ground, see
        :func:`vibrissa.mechanics.scan.free_end.relief_allows`. ``single_contact`` and ``free_end_dip`` belong to gaps,
        whose land is level; for any ground see ``free_end_depth`` (time) of
        :func:`vibrissa.mechanics.scan.sampled.scanned_relief`.
        ``valley_steps``: how many jumps are steps through smooth valleys, see ``_through_valleys``, and
        ``longest_valley_step`` [m].
    """
    n, length = len(prediction.c), prediction.whisker.length
    before, after = prediction.jumps
    width = (after[2] - before[2]) * length
    exact, linear = (
        one(*before[:2])[:n] - one(*after[:2])[:n]
        for one in (replace(prediction.response, form=form) for form in ("exact", "linear"))
    )
    steps = width[_through_valleys(prediction, before, after)]
    return dataset(
        _attributes(prediction),
        lead=("contact_law",),
        **_of_motion(prediction, t),
        linearity=_linearity(exact, linear),
        mechanism=(width.mean() if width.size else np.nan) * prediction.omega / prediction.scan.speed,
        valley_steps=steps.size,
        longest_valley_step=steps.max(initial=0.0),
    )


def _attributes(prediction: PredictedMotion) -> dict[str, str]:
    scan = prediction.scan
    return {"response": scan.response, "jump": scan.jump, "modes": scan.modes}


def _of_motion(prediction: PredictedMotion, t: Array) -> dict[str, Any]:
    """Diagnostics of a motion over any ground."""
    whisker, posture, flat = prediction.whisker, prediction.posture, prediction.response.flat
    q, q_rate = prediction.vibration(t)
    load, slip = _contact_load(prediction, t, q), _slip(prediction, q_rate)
    shift = resonance_shift(posture, len(q))
    return {
        "contact_law": shift.contact_law.values,
        "mode": np.arange(1, len(q) + 1),
        "resonance_ratio": shift.resonance_ratio.values,
        "growth_rate": shift.growth_rate.values,
        **free_end_facts(prediction.free_end_length, prediction.allowed_jumps),
        "fold_determinant": unit_response(posture).determinant,
        "weight_ratio": own_weight(whisker) / flat.contact_force,
        "least_contact_load": load.min() / flat.normal_force,
        "lift_off": np.mean(load <= 0),
        "least_slip": slip.min(),
        "slip_reversed": np.mean(slip <= 0),
    }


def _through_valleys(prediction: ReliefPrediction, before: Array, after: Array) -> Mask:
    """Which jumps are steps through smooth valleys, an artefact of the one contact, (J,).

    A shaft that rises as K u³ ahead of its contact, K = Λ cos φ/6ε⁴, touches evenly bent ground again at such a
    distance λ that the ground between lies Kλ³/2 below the chord, and up to 1.3 Kλ³ at a corner of a sampled curve.
    Three times as deep it is no such valley: a gap, or the space between two hills, is deeper by far. Neither is
    the corner of a wall, of half that depth or more, in which no shaft lies.
    """
    flat, relief, length = prediction.response.flat, prediction.relief, prediction.whisker.length
    bend = flat.normal_force / (6 * flat.contact**4)
    share = np.linspace(0, 1, _CHORD)[1:-1]
    places = before[2][:, None] + (after[2] - before[2])[:, None] * share
    chord = before[1][:, None] + (after[1] - before[1])[:, None] * share
    depth = (chord - relief.at(places * length) / length).max(axis=1, initial=0.0)
    walled = _highest_walls(relief, before[2] * length, after[2] * length) > 0.5 * depth * length
    return np.asarray((depth < 1.5 * bend * (after[2] - before[2]) ** 3) & ~walled)


def _highest_walls(relief: HeightProfile, start: Array, end: Array) -> Array:
    """Highest wall between two places each [m], from one point of the ground to the next, (J,) [m]; 0 without one."""
    rise, run = np.abs(np.diff(relief.height)), np.diff(relief.position)
    wall = np.where(rise > _WALL * run, rise, 0.0)
    near = 1e-9  # [m] a contact is found on the edge of a wall to within rounding
    first = np.searchsorted(relief.position[1:], start - near)
    last = np.searchsorted(relief.position[:-1], end + near)
    return np.array([wall[i:j].max(initial=0.0) for i, j in zip(first, last, strict=True)])


def remarks(data: xr.Dataset) -> list[str]:
    """What :func:`diagnostics` say of a prediction, a sentence each: the verdict first, then the free end.

    Parameters
    ----------
    data : Dataset
        Of :func:`diagnostics`.

    Returns
    -------
    list of str
        Without capital and full stop, for one line of the screen each.
    """
    dip = data.free_end_dip.values[~data.single_contact.values]
    return [verdict(data), *free_end_lines(data, dip.max(initial=0.0)), *_motion_remarks(data)]


def relief_remarks(data: xr.Dataset) -> list[str]:
    """What :func:`relief_diagnostics` say of a scan of any surface, one line each: the verdict first.

    Parameters
    ----------
    data : Dataset
        Of :func:`vibrissa.mechanics.scan.sampled.scanned_relief`.

    Returns
    -------
    list of str
        The lines.
    """
    deepest = float(data.free_end_depth.max())
    kinds = "the contact sticks {sticks} times, glides {glides} times and jumps {jumps} times".format(**data.attrs)
    lines = [verdict(data), *free_end_lines(data, deepest), kinds]
    if steps := int(data.valley_steps):
        longest = 1e3 * float(data.longest_valley_step)
        why = "a shaft would lie in them and not jump, so what they excite is an artefact of the one contact"
        lines.append(f"{steps} of its jumps are steps through smooth valleys, of up to {longest:.2g} mm; {why}")
    if deepest > TOUCH:
        share = percent(float((data.free_end_depth > TOUCH).mean()))
        lines.append(f"the free end beyond the contact would be below ground in {share} of the time")
    return lines + _motion_remarks(data)


def _motion_remarks(data: xr.Dataset) -> list[str]:
    """Diagnostics of a motion over any ground."""
    lines = []
    if data.attrs["response"] == "linear":
        off = float(data.linearity[0])
        exact = (
            f"mode 1 jumps {off:.2f} times as far in the exact one"
            if off == off
            else "without a jump its error is not known"
        )
        lines.append(f"the response is linear; {exact}")
    whose = (
        "the straight shaft's" if data.attrs["modes"] == "straight" else f"about the profile ({data.attrs['modes']})"
    )
    lines.append(f"the modes are {whose}; {shift_remark(data)}")
    if float(data.lift_off) > 0:
        lines.append(
            f"the contact would lift off in {percent(float(data.lift_off))} of the time, "
            f"with {data.sizes['mode']} modes"
        )
    if float(data.slip_reversed) > 0:
        share = percent(float(data.slip_reversed))
        lines.append(f"the vibration would reverse the slip of the contact in {share} of the time; it would stick")
    if float(data.weight_ratio) > 0.2:
        lines.append(f"the whisker's own weight, left out, is {float(data.weight_ratio):.2g} of the contact force")
    return lines


def percent(share: float) -> str:
    """A share in per cent, to two digits and without exponents.

    Parameters
    ----------
    share : float
        From 0 to 1.

    Returns
    -------
    str
        With its sign.
    """
    value = 100 * share
    if 0 < value < 0.01:
        return "less than 0.01 %"
    return f"{value:.0f} %" if value >= 9.95 else f"{value:.2g} %"


def _linearity(jump: Array, linear: Array) -> Array:
    """Exact over linear jump of each mode, (M, J) each: root mean square, with the sign of the mean, (M,)."""
    if not jump.size:
        return np.full(len(jump), np.nan)
    size = np.sqrt(np.mean(jump**2, axis=1) / np.mean(linear**2, axis=1))
    return np.sign(np.mean(jump * linear, axis=1)) * size


def _contact_load(prediction: PredictedMotion, t: Array, q: Array) -> Array:
    """Vertical load on the contact, quasi-static and of the vibration, over πEα⁴L²/4, (T,)."""
    row = len(prediction.kappa) + FOLLICLE.index("contact_load")
    slow = prediction.drive(t)[row]
    return slow + prediction.response.basis.contact_load @ q


def _slip(prediction: PredictedMotion, q_rate: Array) -> Array:
    """Speed of the contact of the vibrating shaft over the ground, over the scanning speed, (T,)."""
    along = contact_motion(prediction.response.basis)
    return 1 + prediction.whisker.length * (along @ q_rate) / prediction.scan.speed
