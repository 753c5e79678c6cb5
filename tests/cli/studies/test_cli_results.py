"""The verbs of results: signal at the base, posture, sweeps of a table, figures of a folder; one line for bad input."""

import json

import numpy as np
import pytest

from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.netcdf import load, save
from vibrissa.quantities import dataset

CONE = ("--whisker.length", "0.04", "--whisker.cone-angle", "0.0015")
FREQUENCY, DAMPING = 90.0, 0.05


@pytest.fixture(scope="module")
def bridge(tmp_path_factory):
    """A robot's bridge: an oscillator kicked at random, 5 s at 2 kHz, in volts."""
    return written(kicked(FREQUENCY, np.random.default_rng(3)), tmp_path_factory.mktemp("bridge") / "bridge.csv")


def kicked(frequency, rng, rate=2000):
    decay, turn = np.exp(-DAMPING * 2 * np.pi * frequency / rate), 2 * np.pi * frequency / rate
    kick, x = rng.normal(size=10_000), np.zeros(10_000)
    for i in range(2, x.size):
        x[i] = 2 * decay * np.cos(turn) * x[i - 1] - decay**2 * x[i - 2] + kick[i]
    return x


def written(x, path):
    path.write_text("volts\n" + "\n".join(f"{value:.6g}" for value in x) + "\n")
    return path


@pytest.fixture(scope="module")
def profile(tmp_path_factory):
    """A whisker of known posture, turned in the image, with 5 µm of noise at every node."""
    arc, rng = np.arange(0, 0.68 * 0.04, 116e-6), np.random.default_rng(0)
    still = stationary_profile(Posture(contact=0.29, base_angle=1.2), 1 - arc / 0.04)
    z = (still.profile_x.values + 1j * still.profile_y.values) * 0.04 * np.exp(0.5j)
    y = -z.imag + 5e-6 * rng.standard_normal((200, arc.size))
    sd = np.full(y.shape, 5e-6)
    tracked = dataset(time=np.arange(200) / 2000, x=np.tile(z.real, (200, 1)), y=y, y_sd=sd, arc_length=arc)
    path = tmp_path_factory.mktemp("profile") / "profile.nc"
    save(tracked.expand_dims("whisker"), path)
    return path


BRIDGE = ("--kind", "moment", "--signal-unit", "V", "--calibration", "2e-7", "--sampling-rate", "2000")


def test_a_signal_at_the_base_tells_its_resonance(vibrissa, bridge, tmp_path):
    files = ("--out", tmp_path / "base.nc", "--picture", tmp_path / "base.png")
    code, out, err = vibrissa("sensor", bridge, *BRIDGE, "--guess", "85", *files, "--json")
    assert code == 0, err
    told = json.loads(out)
    assert told["resonant_frequency_white"][0] == pytest.approx(FREQUENCY, rel=0.02)
    assert told["damping_white"][0] == pytest.approx(DAMPING, rel=0.3)
    assert "nothing is predicted" in err
    assert load(tmp_path / "base.nc").base_moment_envelope.shape == (1, 10_000)
    assert (tmp_path / "base.png").stat().st_size > 10_000


def test_a_second_mode_with_white_forcing_has_no_interval_and_a_remark(vibrissa, tmp_path):
    rng = np.random.default_rng(4)
    two = sum(x / x.std() for x in (kicked(FREQUENCY, rng), kicked(300.0, rng)))
    files = ("--out", tmp_path / "base.nc", "--picture", tmp_path / "base.html")
    words = ("sensor", written(two, tmp_path / "two.csv"), *BRIDGE, "--guess", "90", "--guess", "300")
    code, out, err = vibrissa(*words, *files, "--json")
    assert code == 0, err
    found = json.loads(out)
    assert found["resonant_frequency_white"][0] == pytest.approx(FREQUENCY, rel=0.02)
    assert found["resonant_frequency_white_low"][0] < found["resonant_frequency_white_high"][0]
    assert found["resonant_frequency_white"][1] == pytest.approx(300, rel=0.1)
    assert [found["resonant_frequency_white_low"][1], found["damping_white_high"][1]] == [None, None]
    assert "mode 2 has no interval: with white forcing the flank of the modes below is fitted as its width" in err
    assert "a known texture, with whisker, posture and speed, helps" in err
    assert "nan" not in (tmp_path / "base.html").read_text("utf-8").split("Mode 1:")[1].split("</")[0]
    assert "[" not in vibrissa(*words)[1].split("\n")[-2]  # nor in the table


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        (BRIDGE, "must say about where its resonances lie"),
        ((*BRIDGE, "--guess", "1200"), "--guess must lie below 625 Hz at 2000 samples per second, got"),
        ((*BRIDGE, "--guess", "90", "--guess", "60"), "--guess must ascend from above 0 (Hz)"),
        ((*BRIDGE, "--guess", "90", "--rest", "4", "6"), "--rest must lie in the record, 0 to 4.9995 s, got"),
        ((*BRIDGE, "--guess", "90", "--contact", "0.3"), "both a place (--contact or --base-distance) and"),
        ((*BRIDGE, "--guess", "90", "--texture", "t.csv"), "must come with whisker, posture, scan_speed"),
        (
            ("--kind", "moment", "--signal-unit", "V", "--sampling-rate", "2000", "--guess", "90"),
            "calibration must be given",
        ),
        ((*BRIDGE, "--guess", "90", "--picture", "p.gif"), "--picture must end in .png"),
    ],
)
def test_a_signal_that_is_not_told_is_refused_in_one_line(vibrissa, bridge, words, rule):
    code, out, err = vibrissa("sensor", bridge, *words)
    assert (code, out) == (2, "")
    assert rule in err.replace("--calibration", "calibration")
    assert err.count("\n") == 1


def test_a_profile_tells_its_posture(vibrissa, profile):
    code, out, err = vibrissa("posture", profile, *CONE, "--json")
    assert code == 0, err
    told = json.loads(out)
    assert told["contact_low"] < 0.29 < told["contact_high"]
    assert told["base_angle_low"] < 1.2 < told["base_angle_high"]
    assert told["profile_r2"] > 0.99
    assert told["friction_se"] is None
    assert "friction: given, 0.4; --fit-friction fits it" in err
    assert "over a texture the" in err
    code, out, err = vibrissa("posture", profile, *CONE, "--json", "--excursion-sd", "1e-4")
    assert code == 0, err
    assert "over a texture" not in err
    wide = json.loads(out)
    assert wide["contact_se"] == pytest.approx(np.hypot(told["contact_se"], 0.003), rel=0.3)
    assert wide["base_angle_se"] == pytest.approx(np.hypot(told["base_angle_se"], 0.02), rel=0.4)


def test_a_profile_that_cannot_serve_is_refused(vibrissa, profile):
    other = profile.parent / "other.nc"
    save(dataset(image_row=np.arange(40)), other)
    code, _, err = vibrissa("posture", other, *CONE)
    assert (code, err) == (
        2,
        f"vibrissa: {other} must hold profiles; take what `vibrissa track` or `import-tracks` wrote\n",
    )
    for words, rule in (
        ((*CONE, "--which", "1"), "--which must name one of the 1 tracked whiskers"),
        ((*CONE, "--excursion-sd", "-1e-4"), "--excursion-sd must not be negative"),
        ((*CONE, "--substrate", "1,2", "--substrate", "3,4"), "does not state its pixel size"),
        ((), "whisker must be given"),
    ):
        code, _, err = vibrissa("posture", profile, *words)
        assert code == 2
        assert rule in err


def test_figures_are_drawn_of_a_folder_and_what_is_missing_is_said(vibrissa, profile, tmp_path):
    folder = profile.parent
    save(
        dataset(image_row=np.arange(40), image_column=np.arange(60), image=np.full((40, 60), 180, np.uint8)),
        folder / "still.nc",
    )
    for number, rule in (
        ("6", "no [laboratory] and no sweeps"),
        ("9", "no table of units"),
        ("12", "must be one of 1,"),
    ):
        code, _, err = vibrissa("figure", number, folder, "--out", tmp_path / "f.png")
        assert code == 2
        assert rule in err
    assert not (tmp_path / "f.png").exists()
    code, _, err = vibrissa("figure", "1", folder, "--out", tmp_path / "f.jpg")
    assert code == 2
    assert "--out must end in .png" in err
    assert vibrissa("figure", "1", tmp_path / "absent", "--out", tmp_path / "f.png")[0] == 2


def test_a_table_of_sweeps_is_refused_before_any_work(vibrissa, tmp_path):
    (tmp_path / "sweeps.csv").write_text("track,animal,whisker,texture,speed\nt.nc,r,C2,unknown,0.1\n")
    code, _, err = vibrissa("recordings", tmp_path / "sweeps.csv", "--out", tmp_path / "out")
    assert code == 2
    assert "has an unknown column, got 'speed'; did you mean scan_speed?" in err
    assert not (tmp_path / "out").exists()
