"""Input that looks sound and is not: refused in one line, or remarked."""

import json
import wave

import numpy as np
import pytest

from vibrissa.cli import app, options_of
from vibrissa.cli.shared.display.output import named

POSTURE = ("--contact", "0.29", "--base-angle", "1.2", "--whisker.length", "40mm", "--whisker.cone-angle", "1.5mrad")
VERBS = [name for name in app if not name.startswith("-")]
NAMED = [verb for verb in VERBS if {"--out", "--spikes-out"} & options_of(verb)]


@pytest.mark.parametrize("verb", NAMED)
def test_every_verb_refuses_a_result_without_a_name(verb):
    arguments = app[verb].assemble_argument_collection()
    out = [one for one in arguments if {"--out", "--spikes-out"} & set(one.names)]
    assert out
    assert all(one.parameter.converter is named for one in out)


@pytest.mark.parametrize("verb", [verb for verb in VERBS if "--seed" in options_of(verb)])
def test_every_verb_refuses_a_negative_seed(verb):
    (seed,) = (one for one in app[verb].assemble_argument_collection() if "--seed" in one.names)
    (check,) = seed.parameter.validator
    check(int, 0)
    with pytest.raises(ValueError, match=r"^--seed must be 0 or a positive whole number, got -1$"):
        check(int, -1)


@pytest.mark.parametrize("out", ["/", "", "//"])
@pytest.mark.parametrize("verb", [("run",), ("modes", *POSTURE[:2], *POSTURE[4:])])
def test_a_result_needs_a_name(vibrissa, verb, out):
    code, printed, err = vibrissa(*verb, "--out", out)
    assert (code, printed) == (2, "")
    assert err == f"vibrissa: --out must name a file or a folder, got {out!r}; for example ./out\n"


@pytest.mark.parametrize(("key", "part"), [("seed", "film"), ("spike_seed", "cortex")])
def test_a_negative_seed_of_a_study_is_named(vibrissa, tmp_path, key, part):
    (tmp_path / "s.toml").write_text(f'name = "a"\n[{part}]\n{key} = -1\n')
    code, _, err = vibrissa("run", tmp_path / "s.toml", "--dry-run")
    assert code == 2
    assert f"{key} must be 0 or a positive whole number, got -1" in err


@pytest.mark.parametrize(
    ("friction", "remark"),
    [("-0.2", "the surface then moves towards the base"), ("3", "no dry surface is known to reach"), ("1.5", None)],
)
def test_unusual_friction_is_remarked(vibrissa, friction, remark):
    code, _, err = vibrissa("profile", *POSTURE, "--friction", friction)
    assert code == 0
    assert (remark in err) if remark else (err == "")


@pytest.mark.parametrize("count", [0, 41, 10**6])
@pytest.mark.parametrize("verb", ["scan", "gap"])
def test_modes_are_one_to_forty(vibrissa, tmp_path, verb, count):
    (tmp_path / "t.csv").write_text("position_mm,width_mm\n1,0.5\n")
    given = [tmp_path / "t.csv", "--speed", "0.1"] if verb == "scan" else ["--gap-width", "0.6mm"]
    code, _, err = vibrissa(verb, *given, *POSTURE, "--n-modes", count)
    assert code == 2
    assert "--n-modes must be" in err


@pytest.mark.parametrize("fill", [(), ("--fill",)])
@pytest.mark.parametrize("kind", [".npy", ".csv", ".txt"])
def test_infinite_heights_are_refused_where_they_are(vibrissa, tmp_path, kind, fill):
    x, z = np.linspace(0, 10, 50), np.sin(np.arange(50.0))
    z[6] = np.inf
    path, units = tmp_path / f"s{kind}", ["--x-unit", "mm", "--z-unit", "um"]
    if kind == ".npy":
        np.save(path, np.c_[x, z])
    else:
        header = "position_mm,height_um" if kind == ".csv" else ""
        np.savetxt(path, np.c_[x, z], delimiter=",", header=header, comments="")
    code, _, err = vibrissa("scan", path, *POSTURE, "--speed", "0.1", *fill, *([] if kind == ".csv" else units))
    assert code == 2
    assert err.count("\n") == 1
    assert "inf" in err
    assert "point 7" in err or "line 8" in err or "line 7" in err


def test_two_guesses_give_one_line_once(vibrissa, tmp_path):
    rate, f, rng = 2000.0, 60.0, np.random.default_rng(0)
    t, turn = np.arange(8000) / rate, 2 * np.pi * f / rate
    x, kicks = np.zeros(t.size), rng.normal(size=t.size)
    for i in range(2, t.size):  # an oscillator of damping 0.05 under white noise
        x[i] = kicks[i] + 2 * np.exp(-0.05 * turn) * np.cos(turn) * x[i - 1] - np.exp(-0.1 * turn) * x[i - 2]
    np.savetxt(tmp_path / "s.csv", np.c_[t, x], delimiter=",", header="time,moment", comments="")
    asked = ["--kind", "moment", "--signal-unit", "V", "--calibration", 1]
    code, out, err = vibrissa("sensor", tmp_path / "s.csv", *asked, "--guess", 2 * f / 3, "--guess", f, "--json")
    assert code == 0
    found = json.loads(out)["resonant_frequency_white"]
    assert found[0] is None
    assert found[1] == pytest.approx(f, rel=0.03)
    assert "no line of its own was found for mode 1 (about 40 Hz)" in err


def test_a_wav_of_too_few_samples_is_one_line(vibrissa, tmp_path):
    for count in (0, 1, 2, 30):
        with wave.open(str(tmp_path / "s.wav"), "wb") as file:
            file.setnchannels(1)
            file.setsampwidth(2)
            file.setframerate(2000)
            file.writeframes(np.arange(count, dtype="<i2").tobytes())
        asked = ["--kind", "moment", "--signal-unit", "full scale", "--calibration", 1, "--guess", 60]
        code, out, err = vibrissa("sensor", tmp_path / "s.wav", *asked)
        assert (code, out) == (2, "")
        assert err.count("\n") == 1
