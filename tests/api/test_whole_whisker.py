"""The whole whisker in Python: ``model`` of :func:`vibrissa.gap` and :func:`vibrissa.scan`."""

import numpy as np
import pytest
from refusals import refusal

import vibrissa as vb

WHISKER = vb.Whisker(length=0.04, cone_angle=1.5e-3, tip=0.28)
POSTURE = vb.Posture(contact=0.29, base_angle=1.2)
SURFACE = vb.periodic_grating(6e-3, period=0.6e-3)


def test_a_gap_has_the_same_names_by_name_and_by_settings():
    first = vb.gap(WHISKER, POSTURE, width=0.4e-3, model="rod")
    lifted = vb.gap(WHISKER, POSTURE, width=0.4e-3, model=vb.Rod(curvature=15.0))
    assert first.largest_mode_displacement.shape == (3,)
    assert set(first) == set(lifted)
    assert not np.array_equal(first.largest_mode_displacement, lifted.largest_mode_displacement)


def test_a_rod_by_name_and_by_its_defaults_is_one_rod():
    first, second = (vb.gap(WHISKER, POSTURE, width=0.4e-3, model=model) for model in ("rod", vb.Rod()))
    assert np.array_equal(first.largest_mode_displacement, second.largest_mode_displacement)
    assert "not modelled" not in first.axial_force.attrs["long_name"]


def test_a_gap_is_bridged_from_its_near_edge_to_the_end_of_the_free_end():
    long = vb.Whisker(length=0.04, cone_angle=1.5e-3, tip=0.2)
    data = vb.gap(long, POSTURE, width=0.6e-3, model="rod")
    bridged = data.time.values[data.contact_state.values == 3]
    both = data.time.values[(data.last_contact - data.first_contact).values > 0.55e-3]
    assert bridged.size >= 0.9 * both.size > 10
    assert bridged.min() == pytest.approx(both.min(), abs=2e-4)


def test_a_whisker_in_the_air_is_outside_the_model():
    data = vb.gap(WHISKER, POSTURE, width=0.4e-3, model=vb.Rod(curvature=60.0))
    assert data.attrs["verdict"].startswith("outside the model: the whisker is off the ground in 100 % of the time")


def test_a_scan_by_the_rod_is_a_motion():
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="rod")
    data = motion.sample(2000, nodes=[5e-3])
    assert data.attrs["verdict"].startswith("usable: whole whisker, which bridges")
    assert motion.verdict.startswith("usable: whole whisker, which bridges")
    assert motion.remarks(2000) == [f"The prediction is {data.attrs['verdict']}."]
    assert "whole whisker" in repr(motion)
    np.testing.assert_allclose(np.diff(data.time), 1 / 2000)
    assert data.time[0] == 0
    figure = motion.plot()
    assert len(figure.axes) == 5


def test_a_whisker_with_its_free_end_moves_far_less_than_the_single_contact_says():
    rod, modes = (vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model=model).sample(2000) for model in ("rod", "modes"))
    assert float(rod.mode_sd[0]) < 0.3 * float(modes.mode_sd[0])


def test_a_height_profile_is_scanned_too():
    x = np.linspace(0, 5e-3, 501)
    relief = vb.HeightProfile(position=x, height=5e-6 * (1 - np.cos(2 * np.pi * x / 1e-3)))
    data = vb.scan(WHISKER, POSTURE, relief, speed=0.1, model="rod").sample(2000)
    assert data.attrs["verdict"].startswith("usable")
    assert float(data.mode_sd[0]) > 1e-6


def test_units_listen_to_the_rod():
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="rod")
    assert vb.simulate_units(motion, 2, n_trials=2).sizes["unit"] == 2


def test_what_has_no_meaning_is_refused():
    with refusal("unknown", "model", "'beam'"):
        vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="beam")
    with refusal("range", "Rod.curvature"):
        vb.Rod(curvature=float("nan"))
    for form in ({"response": "linear"}, {"jump": "ramp-limit"}, {"modes": "curved"}):
        with refusal("conflict", next(iter(form))):
            vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="rod", **form)
    with refusal("range", "width"):
        vb.gap(WHISKER, POSTURE, width=0.0143, model="rod")
    path = vb.PosturePath(time=np.array([0.0, 1.0]), contact=np.array([0.29, 0.28]), base_angle=np.array([1.2, 1.2]))
    with refusal("conflict", "model"):
        vb.scan(WHISKER, path, SURFACE, speed=0.1, model="rod")
    with pytest.raises(vb.InputError, match="rate"):
        vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="rod").sample(-1)
