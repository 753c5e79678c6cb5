"""Signals measured at the base: what their numbers mean, and what cannot be read."""

import wave

import numpy as np
import pytest
from refusals import refusal
from scipy.io import wavfile
from scipy.signal import lfilter

from vibrissa.errors import FormatError
from vibrissa.mechanics.sensor.base_signal import _stuck, read_base_signal
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
STIFFNESS = WHISKER.youngs_modulus * np.pi / 4 * (0.04 * 1.5e-3) ** 4
TIME = np.arange(200) / 2000
VOLTS = np.sin(2 * np.pi * 90 * TIME)


def written(path, header, *columns):
    lines = [",".join(header), *(",".join(f"{cell:.9g}" for cell in row) for row in zip(*columns, strict=True))]
    path.write_text("# recorded by hand\n" + "\n".join(lines) + "\n")
    return path


@pytest.fixture
def table(tmp_path):
    return written(tmp_path / "base.csv", ["time_ms", "bridge", "hall"], 1e3 * TIME, VOLTS, -2 * VOLTS + 1)


def test_a_calibrated_reading_becomes_a_moment(table):
    found = read_base_signal(table, kind="moment", unit="V", calibration=3e-8, column="bridge")
    np.testing.assert_allclose(found.base_moment, 3e-8 * VOLTS, atol=1e-15)
    np.testing.assert_allclose(found.time, TIME, atol=1e-12)
    assert found.base_moment.units == "N m"
    assert (found.attrs["unit"], found.attrs["calibration"], found.attrs["zero"]) == ("V", 3e-8, "of the file")


@pytest.mark.parametrize(
    ("kind", "unit", "name", "factor"),
    [
        ("moment", "uN m", "base_moment", 1e-6),
        ("moment", "uN m", "base_curvature", 1e-6 / STIFFNESS),
        ("curvature", "1/mm", "base_curvature", 1e3),
        ("curvature", "1/m", "base_moment", STIFFNESS),
        ("strain", "ustrain", "base_curvature", 1e-6 / 6e-5),  # ε = bC on the surface
        ("strain", "1", "base_moment", STIFFNESS / 6e-5),
        ("force", "mN", "transverse_force", 1e-3),
    ],
)
def test_units_of_each_kind(table, kind, unit, name, factor):
    found = read_base_signal(table, kind=kind, unit=unit, column="bridge", whisker=WHISKER)
    np.testing.assert_allclose(found[name], factor * VOLTS, rtol=1e-7, atol=1e-9 * factor)


def test_a_sensor_mounted_the_other_way_round_is_told_by_its_sign_and_its_zero_by_the_rest(tmp_path):
    resting = np.where(TIME < 0.02, 0.0, VOLTS)
    path = written(tmp_path / "hall.csv", ["hall"], 0.7 - 2 * resting)
    found = read_base_signal(path, kind="hall", unit="V", calibration=-5e-9, sampling_rate=2000, rest=(0, 0.015))
    np.testing.assert_allclose(found.base_moment, 1e-8 * resting, atol=1e-16)


@pytest.mark.parametrize(("dtype", "top"), [(np.int16, 2**15), (np.int32, 2**31), (np.uint8, 2**7)])
def test_integers_of_a_wave_file_count_in_full_scale(tmp_path, dtype, top):
    middle = top if dtype is np.uint8 else 0
    stored = np.round(0.5 * VOLTS * (top - 1) + middle).astype(dtype)
    wavfile.write(tmp_path / "base.wav", 2000, np.stack([np.full_like(stored, middle), stored], axis=1))
    found = read_base_signal(tmp_path / "base.wav", kind="hall", unit="full scale", calibration=2e-7, column="2")
    np.testing.assert_allclose(found.base_moment, 1e-7 * VOLTS, atol=2e-7 * 1.01 / top)
    assert found.attrs["clipped"] == 0


def test_floats_of_a_wave_file_are_what_they_are_and_clipping_is_counted(tmp_path):
    wavfile.write(tmp_path / "base.wav", 2000, VOLTS.astype(np.float32))
    found = read_base_signal(tmp_path / "base.wav", kind="moment", unit="uN m")
    np.testing.assert_allclose(found.base_moment, 1e-6 * VOLTS, atol=1e-13)
    wavfile.write(tmp_path / "base.wav", 2000, np.clip(4e4 * VOLTS, -(2**15), 2**15 - 1).astype(np.int16))
    clipped = read_base_signal(tmp_path / "base.wav", kind="hall", unit="full scale", calibration=1)
    assert clipped.attrs["clipped"] == np.count_nonzero(np.abs(4e4 * VOLTS) >= 2**15 - 1)


@pytest.mark.parametrize("end", ["base.wav", "base.csv"])
def test_floats_that_stay_at_their_largest_or_smallest_are_counted_as_clipped(tmp_path, end):
    cut = np.clip(VOLTS, -0.8, 0.9)
    cut[100] = 1.5  # a single largest one is a peak
    cut[[20, 21]] = -1.5  # and so are two
    if end == "base.csv":
        path = written(tmp_path / end, ["time", "bridge"], TIME, cut)
    else:
        wavfile.write(path := tmp_path / end, 2000, cut.astype(np.float32))
    assert read_base_signal(path, kind="moment", unit="uN m").attrs["clipped"] == 0
    cut[[20, 21, 100]] = 0
    if end == "base.csv":
        written(path, ["time", "bridge"], TIME, cut)
    else:
        wavfile.write(path, 2000, cut.astype(np.float32))
    held = np.count_nonzero(cut == 0.9) + np.count_nonzero(cut == -0.8)
    assert read_base_signal(path, kind="moment", unit="uN m").attrs["clipped"] == held > 30


@pytest.mark.parametrize(
    "values",
    [
        np.where(TIME < 0.05, 0, np.abs(VOLTS) + 0.01),  # before it is touched
        np.maximum(np.sin(2 * np.pi * 3 * TIME), 0) * np.abs(VOLTS),  # between touches
        np.round(100 * np.sin(2 * np.pi * 5 * TIME)),  # in whole steps of a converter
    ],
    ids=["rest", "touches", "steps"],
)
def test_rests_and_slow_turns_are_not_clipped(tmp_path, values):
    path = written(tmp_path / "base.csv", ["time", "bridge"], TIME, values)
    assert read_base_signal(path, kind="moment", unit="uN m").attrs["clipped"] == 0


def ringing(seed, rate=2000, seconds=10, damping=0.05, touched=None):
    """An oscillator of 100 Hz under white noise, or under noise only while it is touched, in units of its rms."""
    rng, turn = np.random.default_rng(seed), 2 * np.pi * 100 / rate
    kicks = rng.normal(size=int(seconds * rate))
    if touched is not None:
        kicks *= touched(np.arange(kicks.size) / rate)
    decay, at = np.exp(-damping * turn), turn * np.sqrt(1 - damping**2)
    moved = lfilter([1.0], [1.0, -2 * decay * np.cos(at), decay**2], kicks)
    return moved / moved.std()


def stuck(path, values, rate=2000):
    written(path, ["bridge"], values)
    return read_base_signal(path, kind="moment", unit="uN m", sampling_rate=rate).attrs["stuck"]


@pytest.mark.parametrize("quanta", [np.inf, 100, 20], ids=["floats", "11 bits", "8 bits"])
@pytest.mark.parametrize("lost", [False, True], ids=["held", "set to 0"])
@pytest.mark.parametrize("offset", [0, 25, -25], ids=["about 0", "above 0", "below 0"])
def test_samples_that_were_held_or_lost_are_counted(tmp_path, quanta, lost, offset):
    whole = ringing(1) + offset
    whole = whole if np.isinf(quanta) else np.round(quanta * whole)
    values, first = whole.copy(), 50 + 200 * np.arange(90)
    for at in first:  # 20 ms each
        values[at : at + 40] = 0.0 if lost else values[at - 1]
    assert stuck(tmp_path / "base.csv", whole) == 0
    counted = stuck(tmp_path / "base.csv", values)
    assert 0.5 * 90 * 40 < counted <= 90 * 40  # some begin or end by chance without a step
    values = whole.copy()
    for at in first[:3]:
        values[at : at + 40] = 0.0
    assert stuck(tmp_path / "base.csv", values) == 0  # three may be chance
    wavfile.write(tmp_path / "base.wav", 2000, np.clip(whole - whole.mean(), -1, 1).astype(np.float32))
    assert read_base_signal(tmp_path / "base.wav", kind="moment", unit="uN m").attrs["stuck"] == 0  # clipped


def passing(seed):
    start, stop = np.random.default_rng(seed).uniform((1, 6), (4, 9))
    return lambda t: (t > start) & (t < stop)


WHOLE = {  # records in which values repeat though nothing is held
    "at rest before and after": lambda seed, q: np.round(q * ringing(seed, touched=passing(seed))),
    "touch after touch": lambda seed, q: np.round(
        q * ringing(seed, touched=lambda t: np.sin(2 * np.pi * (0.5 + 0.05 * seed) * t) > 0)
    ),
    "sampled finely": lambda seed, q: np.round(q * ringing(seed, rate=20000, seconds=1)),
    "slow": lambda seed, q: np.round(q * (ringing(seed) / 10 + 3 * np.sin(np.arange(20000) / 100))),
    "noisy": lambda seed, q: np.round(q * ringing(seed) + 0.4 * np.random.default_rng(seed).normal(size=20000)),
    "stored five times": lambda seed, q: np.repeat(np.round(q * ringing(seed, seconds=2)), 5),
    "stored ten times": lambda seed, q: np.repeat(np.round(q * ringing(seed, seconds=2)), 10),
}


@pytest.mark.parametrize("kind", WHOLE)
@pytest.mark.parametrize("quanta", [0.7, 2, 8, 50, 500])
def test_coarse_steps_and_rests_are_not_taken_for_held_samples(kind, quanta):
    assert not [seed for seed in range(50) if _stuck(WHOLE[kind](seed, quanta), clipped=False)]


@pytest.mark.parametrize("values", [[1, 1], [1, 2], [1, 1, 2], [0] * 30, [0] * 30 + [1], [1] + [0] * 30])
def test_nothing_is_held_in_a_few_samples(tmp_path, values):
    assert stuck(tmp_path / "base.csv", np.array(values, float)) == 0


def test_clipping_of_24_bits_is_counted_at_both_ends(tmp_path):
    stored = np.round(0.5 * VOLTS * 2**23).astype("<i4")
    stored[:40], stored[40:50] = 2**23 - 1, -(2**23)
    with wave.open(str(tmp_path / "base.wav"), "wb") as file:
        file.setparams((1, 3, 2000, 0, "NONE", ""))
        file.writeframes(stored.view(np.uint8).reshape(-1, 4)[:, :3].tobytes())
    found = read_base_signal(tmp_path / "base.wav", kind="hall", unit="full scale", calibration=1)
    assert found.attrs["clipped"] == 50


def test_the_line_whose_time_is_uneven_is_named(tmp_path):
    time = np.arange(50) / 1000
    time[7] += 0.0004
    rows = "".join(f"{one:.6f},{k % 3}\n" for k, one in enumerate(time))
    (tmp_path / "s.csv").write_text("time,moment\n" + rows)
    with pytest.raises(FormatError, match="line 9 must be sampled evenly"):
        read_base_signal(tmp_path / "s.csv", kind="moment", unit="N m")


def test_times_rounded_to_more_than_the_interval_are_refused_with_a_remedy_that_serves(tmp_path):
    even = np.arange(4000) / 2000
    path = written(tmp_path / "s.csv", ["time", "moment"], np.round(even, 3), np.sin(even))
    with refusal("format", f"{path}, line 4") as caught:
        read_base_signal(path, kind="moment", unit="N m")
    assert caught.value.value == "the time of the one before: times are rounded to 0.001 s, at intervals of 0.0005 s"
    assert "sort" not in caught.value.remedy
    assert "`sampling_rate`" in caught.value.remedy
    path = written(tmp_path / "s.csv", ["moment"], np.sin(even))  # the remedy
    assert read_base_signal(path, kind="moment", unit="N m", sampling_rate=2000).time[-1] == even[-1]


def test_times_rounded_to_a_tenth_of_a_millisecond_are_those_of_their_mean_rate(tmp_path):
    even = np.arange(4097) / 2048
    path = written(tmp_path / "s.csv", ["time", "moment"], np.round(even, 4), np.sin(even))
    found = read_base_signal(path, kind="moment", unit="N m")
    np.testing.assert_allclose(found.time, even, atol=1e-4)
    np.testing.assert_allclose(np.diff(found.time), 1 / 2048, rtol=1e-4)


VOLT = {"kind": "moment", "unit": "V", "calibration": 1e-8, "column": "bridge"}


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"kind": "torque"}, ("unknown", "kind")),
        ({"calibration": None}, ("missing", "calibration")),
        ({"calibration": 0.0}, ("range", "calibration")),
        ({"unit": "mN m"}, ("conflict", "calibration")),
        ({"kind": "hall", "unit": "N m", "calibration": None}, ("missing", "calibration")),
        ({"kind": "strain"}, ("missing", "whisker")),
        ({"column": None}, ("missing", "column")),
        ({"column": "force"}, ("unknown", "column")),
        ({"sampling_rate": 2000.0}, ("missing", "base.csv")),
        ({"rest": (5.0, 6.0)}, ("too-few", "rest")),
    ],
)
def test_what_the_numbers_mean_must_be_told(table, change, rule):
    with refusal(*rule):
        read_base_signal(table, **(VOLT | change))


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("", ("too-few", "base.csv")),
        ("time,bridge\n0,1\n0.1,x\n0.2,1\n", ("format", "base.csv, line 3, bridge")),
        ("time,bridge\n0,1\n0.1\n0.2,1\n", ("shape", "base.csv, line 3")),
        ("time,bridge\n0,1\n0.1,1\n0.2,1\n0.3,2\n0.6,1\n", ("format", "base.csv, line 6")),
        ("time,bridge\n0,1\n-0.1,1\n-0.2,1\n", ("range", "base.csv")),
        ("bridge\n1\n2\n3\n", ("missing", "base.csv")),
    ],
)
def test_broken_tables_are_refused_by_their_line(tmp_path, text, rule):
    (tmp_path / "base.csv").write_text(text)
    with refusal(*rule):
        read_base_signal(tmp_path / "base.csv", **VOLT)


def test_broken_wave_files_are_refused(tmp_path):
    (tmp_path / "base.wav").write_bytes(b"RIFF and no more")
    wave = {"kind": "hall", "unit": "full scale", "calibration": 1.0}
    with refusal("format", "base.wav"):
        read_base_signal(tmp_path / "base.wav", **wave)
    with refusal("missing", "none.wav"):
        read_base_signal(tmp_path / "none.wav", **wave)
    wavfile.write(tmp_path / "base.wav", 2000, np.zeros((9, 2), np.int16))
    with refusal("missing", "column") as caught:
        read_base_signal(tmp_path / "base.wav", **wave)
    assert caught.value.remedy == "1 to 2"
    for change, fields in (
        ({"column": "3"}, ("unknown", "column", "'3'")),
        ({"column": "1", "unit": "V"}, ("unknown", "unit", "'V'")),
        ({"sampling_rate": 5.0}, ("conflict", "sampling_rate", "5.0")),
    ):
        with refusal(*fields):
            read_base_signal(tmp_path / "base.wav", **(wave | change))


def test_a_unit_other_than_that_of_the_header_is_refused(tmp_path):
    """A bridge read in mV, taken for V, would give a moment a thousand times too large."""
    path = written(tmp_path / "mv.csv", ["time_ms", "bridge_mV"], 1e3 * TIME, 1e3 * VOLTS)
    with refusal("conflict", "unit", "V"):
        read_base_signal(path, kind="moment", unit="V", calibration=3e-8)
    found = read_base_signal(path, kind="moment", unit="mV", calibration=3e-11)
    np.testing.assert_allclose(found.base_moment, 3e-8 * VOLTS, atol=1e-15)
