"""Units whose rate falls with the envelope are not fitted, and the reason says so."""

import numpy as np
import pytest
from populations import ringing

from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope

TRIALS, WIDTH = 30, 0.001


@pytest.fixture(scope="module")
def recording():
    """Spikes of a unit that falls with the envelope, one that rises and one that does neither, and the stimulus."""
    rng = np.random.default_rng(5)
    time, displacement = ringing(rng)
    bins = np.arange(0, time[-1], WIDTH)
    envelope = np.interp(bins, time, analytic_envelope(displacement)[0])
    share = envelope / envelope.max()
    rates = np.array([30 * (1 - share), 30 * share, np.full(bins.size, 15.0)])  # [Hz]
    unit, trial, column = np.nonzero(rng.random((3, TRIALS, bins.size)) < rates[:, None] * WIDTH)
    spikes = spike_table(bins[column], unit, ["falls", "rises", "steady"], trial=trial)
    return spikes, dataset(time=time, point_displacement=displacement)


def test_a_rate_that_falls_with_the_envelope_is_named(recording):
    units = analyse_units(*recording, TRIALS)
    falls, rises, steady = units.reason.values.tolist()
    assert units.significant.values.tolist() == [False, True, False]
    assert falls.startswith("the rate falls with the envelope (r = -0.")
    assert falls.endswith("): only rises are fitted")
    assert "falls" not in rises
    assert steady == "no significant coupling to the envelope"


def test_the_correlation_named_is_the_lowest_over_the_lags_tested(recording):
    spikes, stimulus = recording
    how = EnvelopeAnalysis()
    reason = analyse_units(spikes, stimulus, TRIALS, how).reason.values[0]
    shown = how.presentation(stimulus)
    own = spikes.spike_time.values[spikes.spike_unit.values == 0]
    rate, envelope = np.histogram(own, shown.edges)[0], shown.binned()
    lowest = []
    for lag in range(how.lags[0], how.lags[1] + 1):
        valid = shown.rate_valid & np.roll(shown.envelope_valid, lag)
        lowest.append(np.corrcoef(rate[valid], np.roll(envelope, lag)[valid])[0, 1])
    assert f"(r = {min(lowest):.2f})" in reason
