"""Samples too few to follow the contact: found, and the rate that is named is enough."""

import numpy as np
import pytest

import vibrissa as vb
from vibrissa.api.remarks import Remark
from vibrissa.mechanics.scan.undersampling import contact_lines, contact_rate, surface_remarks
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker

WHISKER, POSTURE, SPEED = Whisker(length=0.04, cone_angle=1.5e-3), Posture(contact=0.29, base_angle=1.2), 0.1
PERIOD, RATE = 1e-5, 20_000.0


def sinusoid() -> vb.HeightProfile:
    """One whose crests the contact holds, each for one period."""
    x = np.arange(0, 1e-3, PERIOD / 40)
    return vb.HeightProfile(position=x, height=1e-8 * np.sin(2 * np.pi * x / PERIOD))


def measured_sd(motion: vb.Motion, rate: float) -> float:
    """Standard deviation of the excursion well inside the surface [m]."""
    t = np.arange(0.002, 0.008, 1 / rate)
    return float(motion.prediction.excursion(t).std()) * WHISKER.length


# held for a period and let go, the excursion is a sawtooth; over gaps it is one for half of the time, else 0
SURFACES = {
    "sinusoid": (sinusoid, PERIOD / np.sqrt(12)),
    "gaps": (lambda: vb.periodic_grating(1e-3, period=PERIOD), PERIOD / 2 * np.sqrt(1 / 6 - 1 / 16)),
}


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.filterwarnings("ignore::vibrissa.api.remarks.Remark")
def test_the_rate_that_is_named_gives_the_excursion_of_the_closed_form(name):
    made, expected = SURFACES[name]
    motion = vb.scan(WHISKER, POSTURE, made(), speed=SPEED)
    needed = contact_rate(motion.prediction, RATE)
    assert needed > RATE
    assert abs(measured_sd(motion, RATE) / expected - 1) > 0.1
    # one of n samples of each period falls on either side of the jump
    assert measured_sd(motion, needed) == pytest.approx(expected, rel=SPEED / PERIOD / needed * 2)


def test_it_is_said_with_the_number():
    motion = vb.scan(WHISKER, POSTURE, vb.periodic_grating(1e-3, period=PERIOD), speed=SPEED)
    with pytest.warns(Remark, match=r"20000 samples per second do not follow the contact.*; \d+ would do\."):
        motion.sample(RATE)


def test_the_vibration_does_not_depend_on_the_rate():
    motion = vb.scan(WHISKER, POSTURE, vb.periodic_grating(2e-3, period=PERIOD), speed=SPEED)
    coarse, fine = (motion.prediction.mode_displacement(np.arange(0, 0.02, 1 / rate)) for rate in (RATE, 16 * RATE))
    np.testing.assert_allclose(fine[:, ::16], coarse, atol=1e-9 * np.abs(coarse).max())


@pytest.mark.parametrize("speed", [0.02, 0.1, 0.5])
def test_textures_that_are_sampled_well_are_not_remarked(speed):
    motion = vb.scan(WHISKER, POSTURE, vb.random_grating(0.05, rng=1), speed=speed)
    assert contact_lines(motion.prediction, RATE) == []


def test_the_surface_under_a_whole_whisker_is_judged_by_its_finest_part():
    fine, coarse = vb.periodic_grating(1e-3, period=PERIOD), vb.periodic_grating(1e-2, period=1e-3)
    (line,) = surface_remarks(fine, SPEED, RATE)
    assert line.startswith("20000 samples per second do not follow the surface at 0.1 m/s")
    enough = float(line.split("; ")[1].split()[0])
    assert enough * PERIOD / SPEED >= 4  # samples of a period, twice what Nyquist asks for
    assert surface_remarks(fine, SPEED, enough) == []
    assert surface_remarks(coarse, SPEED, RATE) == []
    assert surface_remarks(vb.HeightProfile.from_gaps(fine), SPEED, RATE)[0][:40] == line[:40]


@pytest.mark.parametrize("seed", range(4))
def test_the_rate_that_is_named_for_a_rough_surface_is_enough(seed):
    """A self-affine surface is alike at every scale; each rate once named the next."""
    rough = vb.self_affine(length=5e-3, hurst=0.1, rms=5e-6, longest=1e-3, shortest=1e-6, spacing=2.5e-7, rng=seed)
    [line] = surface_remarks(rough, 0.1, 20e3)
    named = float(line.rpartition("; ")[2].split()[0])
    assert surface_remarks(rough, 0.1, named) == []


def test_no_rate_is_named_where_none_of_those_looked_at_is_enough():
    fine = vb.periodic_grating(1e-3, period=PERIOD)
    least = float(surface_remarks(fine, SPEED, RATE)[0].split("; ")[1].split()[0])
    far = least / 64  # at 64 times that rate the samples are those that are looked at
    [line] = surface_remarks(fine, SPEED, far)
    assert line.endswith(f"not even {16 * far:g} would do")
