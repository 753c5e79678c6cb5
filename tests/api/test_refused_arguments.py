"""Arguments of the public functions that cannot be meant: one line with argument, rule and value."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.api.shared.arguments import as_kind
from vibrissa.quantities import dataset

WHISKER, POSTURE = vb.Whisker(length=0.04, cone_angle=1.5e-3), vb.Posture(contact=0.29, base_angle=1.2)
GAPS = vb.Gaps(position=[1e-3], width=[6e-4])
MOTION = np.sin(np.arange(2000) / 20) * 1e-4

WRONG = {
    "a length with a unit": (lambda: vb.Whisker(length="40mm", cone_angle=1e-3), "format", "Whisker.length"),
    "a contact with a unit": (lambda: vb.Posture(contact="11mm", base_angle=1.2), "format", "Posture.contact"),
    "an angle with a unit": (lambda: vb.Posture(contact=0.3, base_angle="70deg"), "format", "Posture.base_angle"),
    "a height with a unit": (lambda: vb.Posture.at_height("16mm", 1.2), "format", "Posture.base_distance"),
    "a height in millimetres": (lambda: vb.Posture.at_height(16.5, 1.2), "range", "Posture.base_distance"),
    "a curvature in words": (lambda: vb.Rod(intrinsic_curvature="a"), "format", "Rod.intrinsic_curvature"),
    "a point beyond the base": (lambda: vb.profile(WHISKER, POSTURE, s=[0.5, 1.5]), "range", "s"),
    "a point that is none": (lambda: vb.profile(WHISKER, POSTURE, s=[np.nan]), "range", "s"),
    "modes about nothing": (lambda: vb.modes(WHISKER, POSTURE, about="x"), "unknown", "about"),
    "a number of modes in words": (lambda: vb.modes(WHISKER, POSTURE, n_modes="3"), "format", "n_modes"),
    "a broken number of modes": (lambda: vb.modes(WHISKER, POSTURE, n_modes=2.5), "format", "n_modes"),
    "a seed below zero": (lambda: vb.random_grating(0.35, rng=-1), "format", "rng"),
    "another seed below zero": (lambda: vb.simulate_units(MOTION, 5, seed=-1), "range", "seed"),
    "half a trial": (lambda: vb.simulate_units(MOTION, 5, n_trials=2.5), "format", "n_trials"),
    "half a unit": (lambda: vb.simulate_units(MOTION, 2.5), "format", "units"),
    "an envelope with a unit": (lambda: vb.simulate_units(MOTION, mean_envelope="55um"), "format", "mean_envelope"),
    "a dataset as a table": (lambda: vb.save(vb.modes(WHISKER), "modes.csv"), "format", "modes.csv"),
    "a motion, not its samples": (
        lambda: vb.save(vb.scan(WHISKER, POSTURE, GAPS, speed=0.1, damping=0.11), "z.nc"),
        "format",
        "data",
    ),
    "a number for a whisker": (lambda: vb.atlas(3), "format", "name"),
    "times of an array": (
        lambda: vb.track(np.zeros((9, 60, 90), np.uint8), pixel_size=1e-4, frame_rate=500, drop_frames="nan"),
        "conflict",
        "drop_frames",
    ),
    "positions in words": (lambda: vb.HeightProfile(position="a", height="b"), "format", "position"),
    "a speed with a unit": (lambda: vb.scan(WHISKER, POSTURE, GAPS, speed="100mm/s"), "format", "speed"),
    "a sample of no name": (lambda: vb.sample_data("foo"), "missing", "name"),
    "a depth for each gap": (
        lambda: vb.Gaps(position=[0, 0.01], width=[1e-3, 1e-3], depth=[1e-5, 2e-5]),
        "format",
        "depth",
    ),
    "a gap of no width": (lambda: vb.Gaps(position=[0, 0.01], width=[1e-3, -1e-3]), "range", "texture"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_meant_is_refused_by_its_name(case):
    call, code, argument = WRONG[case]
    with refusal(code, argument):
        call()


def test_remedies_are_in_the_words_of_the_function(tmp_path):
    tilted = tmp_path / "tilted.csv"
    x = np.arange(2000) * 1e-6
    np.savetxt(tilted, np.column_stack([x, 0.1 * x]), delimiter=",", header="position_m,height_m", comments="")
    with refusal("format", "tilted.csv") as caught:
        vb.read_surface(tilted)
    assert "`levelling='line'`" in str(caught.value)
    assert np.ptp(vb.read_surface(tilted, levelling="line").height) < 1e-9


def test_remedies_say_what_is_meant(tmp_path):
    with refusal("format", "data") as caught:
        vb.save(vb.scan(WHISKER, POSTURE, GAPS, speed=0.1, damping=0.11), tmp_path / "z.nc")
    assert "`.sample(rate=…)`" in caught.value.remedy
    with refusal("format", "speed", "'100mm/s'") as caught:
        vb.scan(WHISKER, POSTURE, GAPS, speed="100mm/s")
    assert "0.1 for 100 mm/s" in caught.value.remedy
    (tmp_path / "bare.txt").write_text("0 0\n1 1\n2 0\n")
    with refusal("format", "x_unit", "'inch'") as caught:
        vb.read_surface(tmp_path / "bare.txt", x_unit="inch", z_unit="um")
    assert caught.value.rule == "must be one of m, mm, um, nm"


def test_a_surface_that_a_negative_friction_cannot_follow_names_the_friction():
    ground = vb.HeightProfile(position=[0, 5e-3, 5.001e-3, 1e-2], height=[0, 0, 50e-6, 50e-6])
    backwards = vb.Posture(contact=0.29, base_angle=1.2, friction=-0.4)
    with pytest.raises(vb.InputError) as caught:
        vb.scan(vb.atlas("C2"), backwards, ground, speed=0.1)
    assert "its friction is negative" in caught.value.remedy


def test_surfaces_are_equal_by_value():
    one, same = vb.random_grating(0.1, rng=1), vb.random_grating(0.1, rng=1)
    assert one == same
    assert hash(one) == hash(same)
    assert hash(vb.HeightProfile([0, 1e-3], [0.0, 1e-5])) == hash(vb.HeightProfile([0, 1e-3], [-0.0, 1e-5]))
    assert one != vb.random_grating(0.1, rng=2)
    assert one != vb.Gaps(one.position, one.width, depth=2 * one.depth)
    profile = vb.HeightProfile([0, 1e-3], [0, 1e-5])
    assert profile == vb.HeightProfile([0, 1e-3], [0, 1e-5])
    assert profile != vb.HeightProfile([0, 1e-3], [0, 2e-5])
    assert profile != one


@pytest.mark.parametrize("kind", [list, tuple, np.asarray])
def test_a_replay_takes_the_delay_of_each_whisker(kind):
    time = np.arange(24000) / 2000
    motion = xr.DataArray(2e-6 * np.sin(50 * time), {"time": time}, ("time",), attrs={"units": "m"})
    delays = np.arange(24) / 10
    found = vb.replay(motion, duration=5.0, rate=2000, delays=kind(delays))
    np.testing.assert_allclose(found.delay, delays, atol=1e-12)
    with refusal("shape", "delays"):
        vb.replay(motion, duration=5.0, rate=2000, delays="odd")


@pytest.mark.parametrize("kind", [np.array, np.float16, np.float32, xr.DataArray])
def test_numbers_of_any_class_are_taken(kind):
    width = float(kind(4e-4))
    same = vb.gap(WHISKER, POSTURE, width=width, n_modes=2)
    xr.testing.assert_identical(vb.gap(WHISKER, POSTURE, width=kind(4e-4), n_modes=np.uint8(2)), same)
    assert vb.Whisker(length=kind(0.04), cone_angle=1e-3).length == float(kind(0.04))


def test_the_unit_of_a_number_is_not_dropped():
    same = vb.gap(WHISKER, POSTURE, width=4e-4)
    xr.testing.assert_identical(vb.gap(WHISKER, POSTURE, width=xr.DataArray(0.4, attrs={"units": "mm"})), same)
    for wrong in (xr.DataArray(0.4, attrs={"units": "inch"}), 0.4 * pytest.importorskip("quantities").mm):
        with refusal("unknown", "width"):
            vb.gap(WHISKER, POSTURE, width=wrong)


def test_a_unit_of_any_quantity_is_taken():
    motion = vb.scan(WHISKER, POSTURE, GAPS, speed=0.1)
    xr.testing.assert_identical(motion.sample(rate=xr.DataArray(2e3, attrs={"units": "Hz"})), motion.sample(rate=2e3))
    guess = xr.DataArray([120.0, 340.0], dims="mode", attrs={"units": "Hz"})
    for held in (guess, list(guess)):
        assert as_kind("guess", held, "Sequence[float] | None") == (120.0, 340.0)
    with refusal("unknown", "rate", "fortnight"):
        motion.sample(rate=xr.DataArray(2e3, attrs={"units": "fortnight"}))


def spikes_within(window):
    return vb.read_spikes({"a": [0.1, 0.6]}, trials=[0, 1], window=window)


def coupled(**how):
    return vb.envelope_coupling({"a": [0.1]}, MOTION, **how)


NOT_TWO = {"three": (0, 1, 2), "one": (1,), "a number": 1.0, "pairs": [[0, 1], [1, 2]]}


@pytest.mark.parametrize("case", NOT_TWO)
def test_a_window_is_two_numbers(case):
    for call in (spikes_within, lambda window: coupled(window=window), lambda window: coupled(band=window)):
        with refusal("shape") as caught:
            call(NOT_TWO[case])
        assert caught.value.rule == "must be two numbers"


@pytest.mark.parametrize("call", [spikes_within, lambda window: coupled(window=window)])
def test_text_that_reads_as_numbers_is_no_window(call):
    for window in (("0", "1"), (0, "1"), np.array(["0", "1"])):
        with refusal("format", "window"):
            call(window)


def test_points_and_lists_have_their_length():
    for wrong in ((0.0, 0.0, 0.01), [0.01]):
        with refusal("shape", "pole"):
            vb.kinematics(straight(), pole=wrong)
    with refusal("shape", "face"):
        vb.kinematics(straight(), face=np.zeros((2, 3)))
    with refusal("shape", "delays", "0.01"):
        coupled(delays=0.01)


@pytest.mark.parametrize("value", [[5.0, 10.0], [5, 10]])
@pytest.mark.parametrize("held", [list, tuple, lambda array: array])
def test_nodes_in_millimetres_are_those_in_metres(held, value):
    motion = vb.scan(WHISKER, POSTURE, GAPS, speed=0.1)
    nodes = held(xr.DataArray(value, dims="node", attrs={"units": "mm"}))
    xr.testing.assert_identical(motion.sample(2e3, nodes=nodes), motion.sample(2e3, nodes=[5e-3, 10e-3]))


def test_numbers_of_python_and_whole_numbers_are_kept():
    for plain in ([1, 2], (1, 2.5), range(2)):
        assert as_kind("whiskers", plain, "Sequence[int] | None") is plain
    (first, second) = as_kind("whiskers", [np.int64(1), xr.DataArray(2)], "Sequence[int] | None")
    assert type(first) is type(second) is int


def straight(n_frames=8, n_nodes=6):
    shape = (n_frames, n_nodes)
    along = np.linspace(0.0, 0.02, n_nodes)
    return dataset(
        {"frame": "image", "pixel_size": 1e-4},
        time=np.arange(n_frames) / 500,
        arc_length=along,
        x=np.broadcast_to(along, shape),
        y=np.full(shape, 0.01),
    )


RAW = {
    "a variable saved": (lambda: vb.save(straight().x, "x.nc"), "format", "data"),
    "resonances for a motion": (lambda: vb.fit_resonances(modal(), [120.0, 340.0]), "format", "motion"),
    "a guess for one of two modes": (lambda: vb.fit_resonances(modal(), guess=[120.0]), "shape", "guess"),
    "a node with a unit": (lambda: vb.scan(WHISKER, POSTURE, GAPS, speed=0.1).sample(nodes="5mm"), "format", "nodes"),
    "gaps with a unit": (lambda: vb.Gaps(["1mm"], ["1mm"]), "format", "position"),
    "a face of one point": (lambda: vb.kinematics(straight(), face=np.zeros(2)), "shape", "face"),
    "a frame": (lambda: vb.plot_tracks(straight(), np.zeros((8, 9, 9)), frames=3), "shape", "frames"),
    "a unit by its number": (lambda: vb.plot_unit(UNITS, 2), "unknown", "name"),
    "a figure of nothing": (lambda: vb.figure("surface", None), "format", "results"),
}
UNITS = dataset(
    unit_name=["a", "b"],
    spike_time=[0.1],
    spike_trial=np.array([0]),
    spike_unit=np.array([0]),
    significant=np.array([True, False]),
)


def modal():
    return xr.Dataset(coords={"mode": [1, 2]})


@pytest.mark.parametrize("case", RAW)
def test_what_ended_in_an_error_of_another_package_is_refused_in_one_line(case):
    call, code, argument = RAW[case]
    with refusal(code, argument):
        call()


def test_a_window_may_have_its_unit():
    window = [0, 500] * pytest.importorskip("quantities").ms
    cut = vb.read_spikes({"a": [0.1, 0.6]}, trials=[0, 1], window=window)
    assert cut.spike_time.values.tolist() == [0.1]


def test_a_line_of_the_face_may_be_an_array():
    face = ((0.0, 0.0), (0.0, 0.01))
    found = vb.kinematics(straight(), face=np.array(face))
    xr.testing.assert_identical(found.whisker_angle, vb.kinematics(straight(), face=face).whisker_angle)
