"""Why a unit is not called driven."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vibrissa.neural.coupling.envelope_coupling import envelope_coupling
from vibrissa.neural.coupling.nulls import BinnedRecord, Circular
from vibrissa.neural.coupling.reasons import uncoupled


def test_a_short_stimulus_that_no_shift_equals_is_named():
    rng = np.random.default_rng(3)
    envelope = np.abs(gaussian_filter1d(rng.standard_normal(200), 2, mode="wrap"))
    rates = rng.poisson(2 + np.linspace(0, 8, 60)[:, None] * envelope).astype(float)
    record, chance = BinnedRecord.whole(rates, envelope), Circular()
    coupling = envelope_coupling(record, chance, lags=(0, 3))
    significant = coupling.tail_p_value <= 0.01
    found = uncoupled(record, coupling, chance, (0, 3), 0.01, significant=significant, level=0.01)
    short = {place for place, reason in found.items() if reason.startswith("no shift of the envelope")}
    highest = coupling.p_value == coupling.p_value.min()
    assert short == set(np.flatnonzero(highest & ~significant).tolist())
    assert 0 < len(short) < highest.sum()
    assert set(found) == set(np.flatnonzero(~significant).tolist())
