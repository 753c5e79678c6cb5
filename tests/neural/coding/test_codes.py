"""Rival codes on motions whose answers are known."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.neural.coding.codes import EnvelopeCode, EventCode, SpectrumCode, kinetic_events
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit

RATE = 4000.0
TIME = np.arange(4000) / RATE
TONE = 80e-6 * np.sin(2 * np.pi * 70 * TIME)


def test_envelope_code_fires_above_its_threshold():
    units = (ThresholdLinearUnit(threshold=30e-6, slope=2e5), ThresholdLinearUnit(threshold=90e-6, slope=2e5))
    drive = EnvelopeCode(units=units).drive(TONE, RATE, 10)
    assert drive.shape == (2, 10)
    np.testing.assert_allclose(drive[0, 1:-1], 2e5 * 50e-6 * 0.1, rtol=0.01)  # 10 Hz for a tenth of a second
    assert np.all(drive[1, 1:-1] == 0)


def test_spectrum_code_finds_a_tone_in_its_band_whatever_the_bins():
    code = SpectrumCode(edges=np.array([30.0, 60.0, 100.0, 300.0]))
    drive = code.drive(TONE, RATE, 5)
    np.testing.assert_allclose(drive[1].sum(), 80e-6 / np.sqrt(2), rtol=0.01)  # rms times one second
    assert drive[[0, 2]].max() < 1e-3 * drive[1].max()
    assert np.ptp(drive[1]) == 0
    np.testing.assert_allclose(code.drive(3 * TONE, RATE, 5), 3 * drive, atol=1e-15)
    with refusal("range", "SpectrumCode.edges"):
        SpectrumCode(edges=np.array([0.0, 100.0, 0.6 * RATE])).drive(TONE, RATE, 4)
    assert SpectrumCode(edges=np.array([0.0, 100.0, 0.5 * RATE])).drive(TONE, RATE, 4).shape == (2, 4)
    odd = SpectrumCode(edges=np.array([0.0, 0.5 * RATE])).drive(TONE[:-1], RATE, 1)
    assert float(odd[0, 0]) == pytest.approx(TONE[:-1].std() * (TONE.size - 1) / RATE, rel=0.01)  # all of the motion
    with refusal("conflict", "SpectrumCode.edges"):
        SpectrumCode(edges=np.array([30.0, 30.5, 31.0])).drive(TONE[:400], RATE, 5)
    with refusal("range", "SpectrumCode.edges"):
        SpectrumCode(edges=np.array([60.0, 30.0]))


def test_events_are_the_kinks_that_were_put_in():
    places, sizes = np.array([400, 1500, 1504, 3000]), np.array([1.0, 3.0, 2.0, 5.0])
    kicks = np.zeros(TIME.size)
    kicks[places] = sizes
    moved = np.cumsum(np.cumsum(kicks)) / RATE**2  # every kick is an acceleration of so many m/s²
    place, size = kinetic_events(moved, RATE)
    kept = size > 1e-6
    np.testing.assert_allclose(size[kept], [1, 3, 5], rtol=1e-6)  # the fourth follows within 2 ms
    np.testing.assert_allclose(place[kept] * TIME.size, [399, 1499, 2999])
    drive = EventCode(thresholds=np.array([0.5, 2.0, 4.0, 6.0])).drive(moved, RATE, 4)
    np.testing.assert_array_equal(drive, [[1, 1, 1, 0], [0, 1, 1, 0], [0, 0, 1, 0], [0, 0, 0, 0]])
