"""Motions read and joined: by hand, without seams, and refused in one line."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.netcdf import save
from vibrissa.quantities import dataset
from vibrissa.stimulus.loop import joined, seam_steps
from vibrissa.stimulus.waveform import PointMotion, even_rate, motion_at, read_motion

RATE = 2000.0


def vibration(seed, duration=4.0, rate=RATE, offset=0.0):
    """Sum of sines within the band [m]: known at any rate."""
    rng = np.random.default_rng(seed)
    f, phase = rng.uniform(5, 80, 12), rng.uniform(0, 2 * np.pi, 12)
    t = np.arange(round(duration * rate) + 1) / rate
    return PointMotion(
        displacement=offset + 1e-5 * np.sin(2 * np.pi * np.outer(t, f) + phase).sum(1), sampling_rate=rate
    )


def write(path, time, displacement, head="time,displacement"):
    rows = "\n".join(f"{a},{b}" for a, b in zip(time, displacement, strict=True))
    path.write_text(f"# laser\n{head}\n{rows}\n")
    return path


# Joined


def test_joints_and_the_loops_end_step_no_more_than_the_motion_itself():
    motions = [vibration(seed, offset=1e-3 * seed) for seed in range(3)]
    loop, seams, _ = joined(motions, 10.0, RATE)
    step, bend = seam_steps(loop, seams, 0.05, RATE)
    assert seams.shape == (3,)
    assert max(step.max(), bend.max()) < 1.2
    hard = np.concatenate([one.displacement[: len(loop) // 3] for one in motions])
    assert seam_steps(hard, np.arange(3) / 3 * len(hard) / RATE, 0.05, RATE)[0].max() > 5


def test_outside_the_overlaps_the_loop_is_the_motion_itself():
    motion = vibration(0)
    loop, seams, begins = joined([motion], 3.5, RATE, fade=0.1)
    start = int((motion.duration - 3.6) / 2 * RATE + 0.5)
    assert begins == pytest.approx([start / RATE], abs=1e-9)
    inside = slice(200, 7000)
    difference = loop[inside] - motion.displacement[start:][inside]
    assert seams == [0]
    assert np.ptp(difference) < 1e-12


def test_the_end_of_a_single_motion_goes_over_into_its_own_start():
    def moved(t):
        return 5e-5 * np.sin(2 * np.pi * 20.13 * t + 1)  # large where the fade ends

    motion = PointMotion(displacement=moved(np.arange(22001) / RATE), sampling_rate=RATE)
    loop, _, (begin,) = joined([motion], 10.0, RATE, fade=0.05)
    t = np.arange(20000) / RATE
    sigma = np.sin(np.pi / 2 * np.minimum(t / 0.05, 1)) ** 2
    rising, falling = np.sin(np.pi / 2 * sigma), np.cos(np.pi / 2 * sigma)
    expected = rising * moved(begin + t) + falling * moved(begin + 10.0 + t)
    np.testing.assert_allclose(loop, expected - expected.mean(), atol=1e-7)  # ends are freed from the mean of 10.05 s
    assert seam_steps(loop, np.zeros(1), 0.05, RATE)[0].max() < np.sqrt(2)


def test_the_power_of_independent_motions_does_not_dip_in_the_overlap():
    # 400 pairs of motions of unit power: within the overlap the mean square stays 1 within 5 standard errors
    pairs = [[vibration(2 * k, 1.0), vibration(2 * k + 1, 1.0)] for k in range(400)]
    loops = np.array([joined(pair, 1.6, RATE, fade=0.1)[0] for pair in pairs])
    power = np.mean(loops**2, axis=0) / np.mean(loops**2)
    assert abs(power[1600:1800].mean() - 1) < 0.15
    assert abs(power[1650:1750].mean() - 1) < 0.15


@given(a=st.floats(0.1, 10))
@settings(max_examples=10, deadline=None)
def test_joining_is_linear_and_forgets_offsets(a):
    motions = [vibration(0), vibration(1)]
    scaled = [PointMotion(displacement=a * one.displacement + 1e-4, sampling_rate=RATE) for one in motions]
    np.testing.assert_allclose(joined(scaled, 6.0, RATE)[0], a * joined(motions, 6.0, RATE)[0], atol=1e-13)


def test_motions_of_different_rates_give_the_same_loop():
    fine, coarse = ([vibration(s, rate=rate) for s in range(2)] for rate in (8000.0, 2000.0))
    a, b = joined(fine, 6.0, RATE)[0], joined(coarse, 6.0, RATE)[0]
    assert np.abs(a - b).max() < 1e-3 * np.abs(a).max()


def test_what_a_finer_motion_holds_above_the_band_does_not_fold_into_it():
    rate, t = 8000.0, np.arange(0, 4.0001, 1 / 8000)
    high = PointMotion(displacement=1e-5 * np.sin(2 * np.pi * 1950 * t), sampling_rate=rate)  # would fold to 50 Hz
    loop = joined([high], 3.5, RATE)[0]
    power = np.abs(np.fft.rfft(loop)) / len(loop)
    assert power[: round(100 * 3.5)].max() < 1e-9


def test_a_short_motion_gives_what_it_has_and_the_others_the_rest():
    short, long = vibration(0, 1.0), vibration(1, 6.0)
    loop, seams, begins = joined([short, long], 6.0, RATE)
    np.testing.assert_allclose(seams, [0, 0.95], atol=1e-3)
    for motion, seam, begin in zip((short, long), seams, begins, strict=True):  # what is said is what is replayed
        inside = np.arange(round(seam * RATE) + 150, round(seam * RATE) + 1500)
        source = inside - round(seam * RATE) + round(begin * RATE)
        assert np.ptp(loop[inside] - motion.displacement[source]) < 1e-9
    assert len(loop) == 12000


@pytest.mark.parametrize(
    ("durations", "duration", "fade", "words"),
    [
        ([4.0], 4.0, 0.05, ("format", "inputs")),
        ([4.0, 4.0], 10.0, 0.05, ("format", "inputs")),
        ([4.0, 0.08], 4.0, 0.05, ("format", "inputs")),
        ([4.0], 3.0, 0.0, ("range", "fade")),
        ([4.0], 3.0, 2.0, ("range", "fade")),
        ([4.0], -1.0, 0.05, ("range", "duration")),
        ([4.0], 3.00001, 0.05, ("too-few", "duration")),
        ([4.0], 3e6, 0.05, ("range", "command")),
    ],
)
def test_motions_that_cannot_fill_the_loop_are_refused(durations, duration, fade, words):
    with refusal(*words):
        joined([vibration(0, one) for one in durations], duration, RATE, fade=fade)


# Read


def prediction(arc, moved, rate=RATE):
    time = np.arange(len(moved)) / rate
    return dataset(time=time, node=np.arange(len(arc)), arc_length=np.array(arc), displacement=moved)


def test_a_node_at_the_distance_is_taken_as_it_is_and_between_nodes_shares_are(tmp_path):
    moved = 1e-5 * np.random.default_rng(0).normal(size=(50, 2))
    save(prediction([4.5e-3, 6e-3], moved), tmp_path / "p.nc")
    np.testing.assert_array_equal(read_motion(tmp_path / "p.nc", distance=6e-3).displacement, moved[:, 1])
    between = read_motion(tmp_path / "p.nc", distance=5e-3)
    np.testing.assert_allclose(between.displacement, moved @ [2 / 3, 1 / 3])
    assert between.sampling_rate == pytest.approx(RATE)
    assert np.isnan(between.resonance)


def test_the_first_resonance_comes_along():
    data = prediction([5e-3], np.zeros((9, 1))).merge(dataset(mode=[1, 2], resonant_frequency=[88.0, 240.0]))
    assert motion_at(data, 5e-3).resonance == 88.0


@pytest.mark.parametrize("bend", [-8.0, 8.0])
def test_tracked_centrelines_move_along_their_normal_to_the_concave_side(bend):
    arc = np.linspace(0, 0.02, 41)
    motion = 2e-5 * np.sin(2 * np.pi * 30 * np.arange(400) / RATE)
    motion -= motion.mean()
    angle = 0.3 + bend * arc
    x = np.cumsum(np.cos(angle)) * arc[1] - np.outer(motion, np.sin(angle))
    y = np.cumsum(np.sin(angle)) * arc[1] + np.outer(motion, np.cos(angle))
    tracks = {"x": x[None], "y": y[None], "arc_length": arc[None]}
    data = dataset(lead=("whisker",), whisker=[0], time=np.arange(400) / RATE, node=np.arange(41), **tracks)
    found = motion_at(data, 5.1e-3).displacement
    np.testing.assert_allclose(found, np.sign(bend) * motion, atol=2e-8)
    with refusal("unknown", "dataset: whisker"):
        motion_at(data, 5e-3, which=1)


def test_text_is_read_in_the_units_of_its_header(tmp_path):
    t, u = np.arange(20) / RATE, 1e-5 * np.sin(np.arange(20))
    plain = read_motion(write(tmp_path / "a.csv", t, u))
    scaled = read_motion(write(tmp_path / "b.csv", t * 1e3, u * 1e6, "time_ms,displacement_um"))
    np.testing.assert_allclose(plain.displacement, u, rtol=1e-15)
    np.testing.assert_allclose(scaled.displacement, u, rtol=1e-12)
    assert scaled.sampling_rate == pytest.approx(RATE)


def test_dimensions_that_are_not_understood_are_refused():
    data = prediction([5e-3], np.zeros((9, 1)))
    np.testing.assert_array_equal(motion_at(data.transpose(), 5e-3).displacement, np.zeros(9))
    with refusal("shape", "dataset", value="trial as well"):
        motion_at(data.expand_dims(trial=2), 5e-3)


def refusals(tmp_path):
    t, u = np.arange(20) / RATE, 1e-5 * np.sin(np.arange(20))
    uneven, lost, hole = t.copy(), np.delete(t, 5), u.copy()
    uneven[7] += 0.1 / RATE
    hole[3] = np.nan
    yield write(tmp_path / "mm.csv", t, u * 1e6), ("range", "mm.csv: displacement", "10 m"), "is it in millimetres"
    yield write(tmp_path / "nan.csv", t, hole), ("format", "nan.csv, line 6, displacement", "'nan'"), ""
    yield (
        write(tmp_path / "uneven.csv", uneven, u),
        ("range", "uneven.csv: time", "sample 7 at 0.00355 s, 0.1 of an interval out of step"),
        "",
    )
    found = "sample 5 at 0.003 s, 0.001 s after the one before, others 0.0005 s"
    yield write(tmp_path / "lost.csv", lost, u[1:]), ("range", "lost.csv: time", found), "interpolate where"
    yield write(tmp_path / "back.csv", -t, u), ("range", "back.csv: time", "-0 s to -0.0095 s"), ""
    yield write(tmp_path / "few.csv", t[:3], u[:3]), ("too-few", "few.csv: time", "3"), ""
    yield write(tmp_path / "none.csv", [], []), ("too-few", "none.csv: time", "0"), ""
    yield write(tmp_path / "head.csv", t, u, "t,u"), ("unknown", "head.csv, line 2", "'t'"), ""
    yield write(tmp_path / "word.csv", ["a"], [1]), ("format", "word.csv, line 3, time", "'a'"), ""
    yield write(tmp_path / "inf.csv", [np.nan, *t], [0, *u]), ("format", "inf.csv, line 3, time", "'nan'"), ""
    yield write(tmp_path / "x.txt", t, u), ("format", "x.txt", "'.txt'"), ""
    yield tmp_path / "absent.csv", ("missing", "absent.csv"), ""
    save(prediction([0.01], np.zeros((9, 1))), tmp_path / "far.nc")
    yield tmp_path / "far.nc", ("missing", "far.nc", "0.01 m"), "predict with `nodes=[0.005]`"
    save(prediction([0.001, 0.01], np.zeros((9, 2))), tmp_path / "wide.nc")
    yield tmp_path / "wide.nc", ("missing", "wide.nc", "0.001 m"), "predict with `nodes=[0.005]`"
    save(dataset(time=t, excursion=u), tmp_path / "bare.nc")
    yield tmp_path / "bare.nc", ("missing", "variable 'arc_length'"), ""
    save(dataset(time=t, mode=[1], mode_displacement=u[None]), tmp_path / "scan.nc")
    yield tmp_path / "scan.nc", ("missing", "scan.nc", "modes alone"), "scan again with `nodes=[0.005]`"


def test_bad_input_is_refused_in_one_line(tmp_path):
    for path, fields, remedy in refusals(tmp_path):
        with refusal(*fields) as found:
            read_motion(path)
        assert found.value.remedy.startswith(remedy)


@pytest.mark.parametrize("distance", [0.0, -1.0, np.nan])
def test_a_distance_that_is_not_positive_is_refused(distance, tmp_path):
    with refusal("range", "distance"):
        read_motion(tmp_path / "x.csv", distance=distance)


def test_times_rounded_in_a_file_are_even_enough():
    assert even_rate(np.round(np.arange(1000) / 3000, 6), "x") == pytest.approx(3000, rel=1e-5)
