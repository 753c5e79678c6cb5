"""Where the model's assumptions stand: linearity, the free end, the fold, lift-off, the whisker's own weight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.mechanics.response import FOLLICLE, Response, quasi_static
from vibrissa.mechanics.shift import resonance_shift, shift_remark
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.superposition import Prediction
    from vibrissa.whisker import Whisker

Array = NDArray[np.float64]

GRAVITY = 9.81  # [m/s²]
_SHAFT = 400  # points from which the slip along the shaft is integrated
_SHIFTED = 0.02  # of the first resonance, worth a remark


def own_weight(whisker: Whisker) -> float:
    """Own weight in the unit of the contact force, 4ρgL/(3Eα²): the weight of the cone over πEα⁴L²/4."""
    return 4 * whisker.density * GRAVITY * whisker.length / (3 * whisker.youngs_modulus * whisker.cone_angle**2)


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
        below the land behind the gap just after the jump, λ sin θ_ε, and ``single_contact``: whether the free end is
        shorter than λ and hangs less deep than the gap. ``fold_determinant``; ``weight_ratio``, own weight over contact
        force; ``least_contact_load`` over its value at rest, and ``lift_off``, the share of times at which it is not
        positive; a jump sets all modes ringing, so the first depends on how many are taken. ``least_slip``, the least
        speed at which the vibrating contact slips over the ground, over the scanning speed, and ``slip_reversed``, the
        share of times at which it is not positive: there the contact would stick, which no law here follows (while an
        edge carries the contact along the shaft slips faster, which is left out). ``resonance_shift`` and
        ``growth_rate`` (contact_law, mode): what modes about the curved profile would change, see
        :func:`vibrissa.mechanics.shift.resonance_shift`.
    """
    whisker, scan, posture = prediction.whisker, prediction.scan, prediction.posture
    width = prediction.texture.width
    exact = _exact(prediction)
    before, after = prediction.events.gaps
    angle = exact(after)[len(exact.c) + FOLLICLE.index("contact_angle")]
    free = (posture.contact - whisker.tip) * whisker.length
    q, q_rate = prediction.vibration(t)
    load, slip = _contact_load(prediction, t, q), _slip(prediction, q_rate)
    shift = resonance_shift(posture, len(exact.c))
    return dataset(
        {"response": scan.response, "jump": scan.jump, "modes": scan.modes},
        lead=("contact_law",),
        contact_law=shift.contact_law.values,
        resonance_shift=shift.resonance_shift.values,
        growth_rate=shift.growth_rate.values,
        mode=np.arange(1, len(exact.c) + 1),
        trough=np.arange(len(width)),
        linearity=_linearity(exact, before, after),
        mechanism=width.mean() * prediction.omega / scan.speed,
        free_end_length=free,
        free_end_dip=width * np.sin(angle),
        single_contact=(free < width) & (free * np.sin(angle) < prediction.texture.depth),
        fold_determinant=prediction.response.unit.determinant,
        weight_ratio=own_weight(whisker) / exact.flat.contact_force,
        least_contact_load=load.min() / _at_rest(exact),
        lift_off=np.mean(load <= 0),
        least_slip=slip.min(),
        slip_reversed=np.mean(slip <= 0),
    )


def remarks(data: xr.Dataset) -> list[str]:
    """What :func:`diagnostics` say against a prediction, one line each; none if nothing."""
    lines = []
    touching = int((~data.single_contact.values).sum())
    if touching:
        deepest, gaps = 1e6 * float(data.free_end_dip.max()), data.sizes["trough"]
        where = f"at {touching} of {gaps} gaps, dipping by up to {deepest:.0f} µm"
        lines.append(f"the free end beyond the contact would touch ground {where}; the model has one contact")
    if data.attrs["response"] == "linear":
        lines.append(f"the linear response: mode 1 jumps {float(data.linearity[0]):.2f} times as far in the exact one")
    if data.attrs["modes"] == "straight" and np.any(np.abs(data.resonance_shift.values[:2, 0] - 1) > _SHIFTED):
        lines.append(f"modes are the straight shaft's; {shift_remark(data)}")
    if float(data.lift_off) > 0:
        share = 100 * float(data.lift_off)
        lines.append(f"the contact would lift off in {share:.2g} % of the time, with {data.sizes['mode']} modes")
    if float(data.slip_reversed) > 0:
        share = 100 * float(data.slip_reversed)
        lines.append(
            f"the vibration would reverse the slip of the contact in {share:.2g} % of the time; it would stick"
        )
    if float(data.weight_ratio) > 0.2:
        lines.append(f"the whisker's own weight, left out, is {float(data.weight_ratio):.2g} of the contact force")
    return lines


def relief_remarks(data: xr.Dataset) -> list[str]:
    """What a scan of any surface says against its own assumptions, and how the contact moved, one line each."""
    kinds = ", ".join(f"{name} {data.attrs[name]} times" for name in ("sticks", "glides", "jumps"))
    lines = [f"the contact {kinds}"]
    deepest = 1e6 * float(data.free_end_depth.max())
    if deepest > 0:
        share = 100 * float((data.free_end_depth > 0).mean())
        where = f"in {share:.2g} % of the time, by up to {deepest:.0f} µm"
        lines.append(f"the free end beyond the contact would touch ground {where}; the model has one contact")
    return lines


def _exact(prediction: Prediction) -> Response:
    """The exact response, whichever the prediction was made with."""
    response = prediction.response
    if response.form == "exact":
        return response
    before, after = prediction.events.gaps
    return quasi_static(
        response.posture, (float(after.min()), float(before.max())), n_modes=len(response.c), modes=response.modes
    )


def _linearity(exact: Response, before: Array, after: Array) -> Array:
    """Exact over linear jump of each mode, root mean square over the gaps, (M,)."""
    n = len(exact.c)
    jump, linear = exact(before)[:n] - exact(after)[:n], exact.c[:, None] * (before - after)
    size = np.sqrt(np.mean(jump**2, axis=1) / np.mean(linear**2, axis=1))
    return np.sign(np.mean(jump / linear, axis=1)) * size


def _contact_load(prediction: Prediction, t: Array, q: Array) -> Array:
    """Vertical load on the contact, quasi-static and of the vibration, over πEα⁴L²/4, (T,)."""
    row = len(prediction.kappa) + FOLLICLE.index("contact_load")
    slow = prediction.drive(t)[row]
    return slow + prediction.response.basis.contact_load @ q


def _slip(prediction: Prediction, q_rate: Array) -> Array:
    """Speed of the contact of the vibrating shaft over the ground, over the scanning speed, (T,)."""
    shaft = np.linspace(prediction.posture.contact, 1, _SHAFT)
    along = prediction.response.basis.displacement(shaft)[0, :, 0]
    return 1 + prediction.whisker.length * (along @ q_rate) / prediction.scan.speed


def _at_rest(response: Response) -> float:
    return float(response(np.zeros(1))[len(response.c) + FOLLICLE.index("contact_load"), 0])
