"""The whole whisker in Python: ``model`` of :func:`vibrissa.gap` and :func:`vibrissa.scan`."""

import numpy as np
import pytest
from refusals import refusal

import vibrissa as vb
from vibrissa.mechanics.whisking.base_path import BasePath

WHISKER = vb.Whisker(length=0.04, cone_angle=1.5e-3, tip=0.28)
POSTURE = vb.Posture(contact=0.29, base_angle=1.2)
SURFACE = vb.periodic_grating(6e-3, period=0.6e-3)


def test_a_gap_has_the_same_names_by_name_and_by_settings():
    first = vb.gap(WHISKER, POSTURE, width=0.4e-3, model="rod")
    lifted = vb.gap(WHISKER, POSTURE, width=0.4e-3, model=vb.Rod(intrinsic_curvature=15.0))
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
    data = vb.gap(WHISKER, POSTURE, width=0.4e-3, model=vb.Rod(intrinsic_curvature=60.0))
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


def test_a_rod_whose_base_moves_is_a_motion_in_the_air_or_on_the_ground():
    time = np.linspace(0, 0.05, 26)
    lifted = vb.BasePath(time=time, base_angle=np.full(26, 1.2), base_distance=0.9 + 0.05 * np.sin(100 * time))
    held = vb.PosturePath(time=time, base_angle=np.full(26, 1.2), contact=np.full(26, 0.29))
    in_air, pressed = (vb.scan(WHISKER, path, SURFACE, speed=0.1, model="rod") for path in (lifted, held))
    data = in_air.sample(2000)
    assert data.attrs["begins"] == "in the air"
    assert float(data.detached_share) == 1
    assert "in the air 100 % of the time" in in_air.verdict
    assert "base moves" in repr(pressed)
    assert float(pressed.sample(2000).detached_share) < 0.2
    with refusal("conflict", "nodes"):
        pressed.sample(2000, nodes=[5e-3])


def test_the_free_end_is_what_the_rod_finds():
    long = vb.Whisker(length=0.04, cone_angle=1.5e-3, tip=0.2)
    straight, lifted = (
        vb.gap(long, POSTURE, width=0.4e-3, model=vb.Rod(intrinsic_curvature=curvature)).free_end_length
        for curvature in (0.0, 15.0)
    )
    assert 3e-3 < float(straight) < 3.6e-3  # that of the cone is 3.6 mm
    assert 0.5 < float(lifted) / float(straight) < 0.8  # it touches nearer to the tip
    assert np.isnan(vb.gap(WHISKER, POSTURE, width=0.4e-3, model=vb.Rod(intrinsic_curvature=60.0)).free_end_length)


def test_a_tip_that_may_be_in_metres_is_remarked_on():
    short = vb.Whisker(length=0.04, cone_angle=1.5e-3, tip=0.0114)
    judged = vb.gap(short, POSTURE, width=0.4e-3, model="rod").attrs["verdict"]
    assert judged.startswith(
        "caution: the rod ends at 0.03 L, short of the tip at 0.0114 L (if 11.4 mm were meant: 0.285)"
    )


def test_a_thin_tip_of_the_atlas_needs_no_caution():
    """Its 0.0218 of L, read as metres, would be 0.6 of the whisker: nobody meant that."""
    judged = vb.gap(vb.atlas("C2"), POSTURE, width=0.4e-3, model="rod").attrs["verdict"]
    assert judged.startswith("usable")


def test_units_listen_to_the_rod():
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="rod")
    assert vb.simulate_units(motion, 2, n_trials=2).sizes["unit"] == 2


def test_what_has_no_meaning_is_refused():
    with refusal("unknown", "model", "'beam'"):
        vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="beam")
    with refusal("range", "Rod.intrinsic_curvature"):
        vb.Rod(intrinsic_curvature=float("nan"))
    for form in ({"response": "linear"}, {"jump": "ramp-limit"}, {"modes": "curved"}):
        with refusal("conflict", next(iter(form))):
            vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="rod", **form)
    with refusal("range", "width"):
        vb.gap(WHISKER, POSTURE, width=0.0143, model="rod")
    path = vb.PosturePath(time=np.array([0.0, 1.0]), contact=np.array([0.29, 0.28]), base_angle=np.array([1.2, 1.2]))
    with refusal("conflict", "model"):
        vb.scan(WHISKER, BasePath.of(path), SURFACE, speed=0.1)
    with pytest.raises(vb.InputError, match="rate"):
        vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1, model="rod").sample(-1)


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
def test_over_a_rough_surface_the_free_end_is_that_beyond_the_contact_nearest_to_the_base(phase):
    long, x = vb.Whisker(length=0.08, cone_angle=2e-3, tip=0.2), np.linspace(0, 0.01, 1001)
    sine = vb.HeightProfile(position=x, height=20e-6 * np.sin(2 * np.pi * x / 1e-3 + phase))
    posture = vb.Posture(contact=0.29, base_angle=0.8)
    free_end = float(vb.scan(long, posture, sine, speed=0.1, model="rod").sample(2000).free_end_length)
    assert free_end == pytest.approx(0.09 * 0.08, abs=1e-3)  # within a period of the surface


def test_one_node_may_be_a_number():
    motion = vb.scan(WHISKER, POSTURE, SURFACE, speed=0.1)
    one, many = motion.sample(2000, nodes=5e-3), motion.sample(2000, nodes=[5e-3])
    np.testing.assert_array_equal(one.displacement, many.displacement)
