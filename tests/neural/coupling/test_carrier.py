"""Envelope or carrier's phase: units of either kind under a motion whose envelope carries its phase."""

import numpy as np
import pytest
from populations import ringing
from refusals import refusal

from vibrissa.neural.coupling.analysis import EnvelopeAnalysis, analyse_units
from vibrissa.neural.coupling.carrier import (
    ALIKE,
    ELSEWHERE,
    REASONS,
    PhaseTest,
    phase_in_envelope,
    settled_by,
    share_remark,
)
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.io.tables.stimuli import labelled_stimulus
from vibrissa.neural.simulated.virtual import PhaseUnit, ThresholdLinearUnit, simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope

TRIALS = 60


@pytest.fixture(scope="module")
def lopsided():
    """A motion of 50 Hz that rises faster than it falls, as a whisker's that was released does."""
    time, motion = ringing(np.random.default_rng(4), frequency=50.0, events=60.0)
    return dataset(time=time, point_displacement=motion)


@pytest.fixture(scope="module")
def units(lopsided):
    time, rng = lopsided.time.values, np.random.default_rng(5)
    envelope, phase = analytic_envelope(lopsided.point_displacement.values)
    tables = {
        f"envelope {k}": simulate_spikes(ThresholdLinearUnit(), time, envelope, TRIALS, rng=rng) for k in range(3)
    }
    tables |= {
        f"phase {k}": simulate_spikes(PhaseUnit(baseline=15.0, preferred=one), time, phase, TRIALS, rng=rng)
        for k, one in enumerate((0.0, 2.0, 4.0))
    }
    return analyse_units(join_units(tables), lopsided, TRIALS, EnvelopeAnalysis(n_resamples=100))


def test_verdicts_are_those_of_the_truth(units):
    assert units.attrs["phase_in_envelope"] > ALIKE
    passed = units.significant.values
    assert passed[:3].all()
    assert passed[3:].any()  # units of the phase pass the test of the envelope
    assert units.envelope_verdict.values[:3].tolist() == ["envelope"] * 3
    assert set(units.envelope_verdict.values[3:][passed[3:]]) == {"phase"}
    assert not units.identified.values[3:].any()
    assert "carrier's phase" in units.reason.values[3:][passed[3:]][0]


def test_the_share_is_given_with_and_without_them(units):
    n = int(units.significant.sum())
    said = share_remark(units)
    assert said.startswith(
        f"{n} of 6 units pass the test of the envelope ({100 * n / 6:.1f} %); {n - 3} of them follow"
    )
    assert said.endswith("without these 3 units pass (50.0 %)")
    assert share_remark(units.isel(unit=slice(0, 3))) == ""
    assert share_remark(units.drop_vars("envelope_verdict")) == ""


def test_an_envelope_that_carries_no_phase_needs_no_second_test():
    time = np.arange(40000) / 4000
    slow = 1 + 0.5 * np.sin(2 * np.pi * 1.7 * time)
    tone = dataset(time=time, point_displacement=5e-5 * slow * np.cos(2 * np.pi * 200 * time))
    assert phase_in_envelope(Presentation.of(tone)) < ALIKE


def test_an_envelope_has_no_phase_whatever_zeros_its_carrier_holds():
    time = np.arange(20000) / 2000
    slow = 3 + np.sin(2 * np.pi * 1.7 * time) * np.cos(2 * np.pi * 0.31 * time)
    level = labelled_stimulus(time, slow, "rad", envelope=True)
    assert phase_in_envelope(Presentation.of(level, bin_width=0.01)) == 0.0


def test_a_stimulus_sampled_too_coarsely_cannot_be_told(lopsided):
    coarse = lopsided.isel(time=slice(None, None, 10))  # 200 samples a second, four in a period
    assert PhaseTest.of(Presentation.of(coarse)) is None


def test_a_second_stimulus_decides(units):
    told = [REASONS.get(verdict, "") for verdict in units.envelope_verdict.values]
    rest = [str(a).removeprefix(b).removeprefix("; ") for a, b in zip(units.reason.values, told, strict=True)]
    reasons = ["; ".join(filter(None, [REASONS["cannot tell"], one])) for one in rest]
    open_ = units.assign(
        envelope_verdict=("unit", np.repeat("cannot tell", 6)),
        identified=("unit", np.zeros(6, bool)),
        reason=("unit", reasons),
    )
    found = settled_by(open_, units.isel(unit=slice(None, None, -1)))
    passed = units.significant.values
    assert found.envelope_verdict.values[passed].tolist() == units.envelope_verdict.values[passed].tolist()
    assert set(found.envelope_verdict.values[~passed]) <= {"cannot tell"}
    driven = passed & (units.envelope_verdict.values == "envelope")
    assert found.identified.values[driven].tolist() == units.identified.values[driven].tolist()
    assert found.reason.values[passed].tolist() == units.reason.values[passed].tolist()
    with refusal("missing", "second stimulus"):
        settled_by(units, units.isel(unit=[0]))


@pytest.mark.parametrize(("after", "identified"), [("", True), ("; 4 trials: intervals are too narrow", False)])
def test_a_peak_outside_of_the_lags_alone_leaves_a_unit_identified(after, identified, units):
    one = units.isel(unit=[0]).assign(envelope_verdict=("unit", ["envelope"]))
    reason = f"{REASONS['cannot tell']}; {ELSEWHERE} 40 ms, outside the lags tested (0 to 30 ms){after}"
    doubtful = {"envelope_verdict": "cannot tell", "identified": False, "reason": reason}
    found = settled_by(one.assign({name: ("unit", [value]) for name, value in doubtful.items()}), one)
    assert found.identified.values.tolist() == [identified]
