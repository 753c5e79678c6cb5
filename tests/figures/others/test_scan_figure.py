"""Figure of a surface drawn past a whisker: its numbers are those of the scan."""

import numpy as np
import pytest

from vibrissa.figures.others import scan
from vibrissa.mechanics.scan.sampled import scanned
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

LENGTH = 0.04


@pytest.fixture(scope="module")
def data():
    whisker, posture = Whisker(length=LENGTH, cone_angle=1.5e-3, tip=0.05), Posture(contact=0.29, base_angle=1.2)
    texture = random_grating(0.2, rng=np.random.default_rng(0))
    return scanned(predict(whisker, posture, texture, Scan(speed=0.1, damping=0.11), n_modes=3), 20_000.0)


@pytest.fixture(scope="module")
def drawn(data):
    return scan.compute(data)


def test_power_of_a_mode_sums_to_its_variance(data, drawn):
    """Parseval; the taper weighs some stretches more than others, and the band ends above the modes."""
    total = drawn.power.values.sum(axis=1) * float(drawn.frequency[1] - drawn.frequency[0])
    np.testing.assert_allclose(total[0], data.mode_displacement.values[0].var(), rtol=0.25)


def test_power_of_a_tone_stands_where_the_tone_is(data):
    tone = data.copy()
    tone["mode_displacement"] = data.mode_displacement * 0 + np.sin(2 * np.pi * 200 * data.time)
    found = scan.compute(tone)
    assert abs(float(found.frequency[found.power.values[0].argmax()]) - 200) < scan.WIDTH


def test_the_stretch_holds_the_strongest_envelope(data, drawn):
    assert float(drawn.envelope[0].max()) == float(data.envelope[0].max())
    assert float(drawn.time[-1] - drawn.time[0]) == pytest.approx(scan.SHOWN, rel=1e-3)
    np.testing.assert_allclose(drawn.frequency.values[-1], 1.5 * float(data.resonant_frequency.max()), rtol=0.02)


def test_the_caption_tells_the_rms_of_each_mode(data, drawn):
    um = 1e6 * LENGTH * data.mode_displacement.values[0].std()
    assert f"rms {um:.3g} µm" in drawn.attrs["caption"]
    assert "nothing measured" in drawn.attrs["caption"]


def test_a_mode_has_one_colour_in_time_and_in_its_spectrum(drawn):
    axes = scan.draw(drawn).axes
    spectra = [line.get_color() for line in axes[-1].lines if line.get_label().startswith("mode")]
    assert len(set(spectra)) == 3
    for axis in axes:
        if axis.get_ylabel().startswith("mode"):
            colour = spectra[int(axis.get_ylabel().split()[1]) - 1]
            assert {line.get_color() for line in axis.lines} == {colour}


def test_it_can_be_drawn_of_a_short_scan_of_one_mode(data):
    short = data.isel(time=slice(0, 400), mode=slice(0, 1))
    figure = scan.draw(scan.compute(short))
    assert len(figure.axes) == 4
