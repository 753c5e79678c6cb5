"""Quantities with units at the command line: what they mean, and one line with the right form for what is none."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibrissa.cli.shared.words.axes import axis_of, values_of
from vibrissa.cli.shared.words.glossary import GLOSSARY
from vibrissa.cli.shared.words.units import DIMENSIONS, in_si, written
from vibrissa.netcdf import load
from vibrissa.tables.quantity import number
from vibrissa.whisker import Whisker

pytest.importorskip("pint")
POSTURE = ("--contact", "0.29", "--base-angle", "70deg")
CONE = ("--whisker.length", "40mm", "--whisker.cone-angle", "1.5mrad")
MEANT = {  # by hand
    ("--base-angle", "angle"): {
        "70deg": math.radians(70),
        "70 deg": math.radians(70),
        "1.2rad": 1.2,
        "90°": math.pi / 2,
    },
    ("--pixel-size", "length"): dict.fromkeys(
        ["95um", "95µm", "95μm", "95e-3mm", "95000nm", "9.5e-5", "0.0095cm"], 95e-6
    ),
    ("--speed", "speed"): {"100mm/s": 0.1, "10 cm/s": 0.1, "6m/min": 0.1},
    ("--frame-rate", "rate"): {"2kHz": 2000.0, "2000/s": 2000.0, "2/ms": 2000.0},
    ("--bin-width", "duration"): {"10ms": 0.01, "500us": 5e-4, "1min": 60.0},
    ("--whisker.youngs-modulus", "pressure"): {"3.74GPa": 3.74e9, "3.74kN/mm^2": 3.74e9},
    ("--whisker.density", "density"): {"1.14g/cm^3": 1140.0, "1140kg/m³": 1140.0},
    ("--max-acceleration", "acceleration"): {"10m/s^2": 10.0, "1cm/ms²": 1e4},
    ("--gain", "voltage"): {"0.195uV": 0.195e-6},
    ("--slope", "slope"): {"0.25/s/um": 2.5e5, "0.25Hz/um": 2.5e5},
}
TYPED = [(option, kind, text, value) for (option, kind), texts in MEANT.items() for text, value in texts.items()]


@pytest.mark.parametrize(("option", "kind", "text", "value"), TYPED)
def test_a_quantity_is_its_number_of_si_units(option, kind, text, value):
    assert in_si(text, option, kind) == pytest.approx(value, rel=1e-15)


@given(st.integers(1, 999_999), st.integers(0, 6))
def test_a_length_in_micrometres_is_the_float_that_si_would_be(digits, places):
    text = f"{digits / 10**places:.{places}f}"
    assert in_si(f"{text}um", "--part", "length") == float(f"{text}e-6")


@pytest.mark.parametrize("option", [name for name, one in GLOSSARY.items() if one.kind in DIMENSIONS])
def test_the_example_of_every_quantity_can_be_read(option):
    for word in GLOSSARY[option].example.replace(":", " ").split():
        assert in_si(word, option, GLOSSARY[option].kind) is not None
    assert written(option).startswith(f"{option} ")
    assert number(written(option).split(" ")[1]) is None


def test_an_axis_takes_units_and_lengths_over_the_whiskers():
    cone = Whisker(length=0.04, cone_angle=1.5e-3)
    angles = axis_of("45deg:80deg:7", "--base-angle", "angle").values
    np.testing.assert_allclose(np.degrees(angles), np.linspace(45, 80, 7), rtol=1e-14)
    assert axis_of("200mm/s,0.1", "--speed", "speed").values == [0.1, 0.2]
    lengths = axis_of("8mm:16mm:3", "--contact", "over length")
    np.testing.assert_allclose(values_of(lengths, "--contact", cone), [0.2, 0.3, 0.4], rtol=1e-14)
    assert values_of(axis_of("0.2,0.3", "--contact", "over length"), "--contact") == [0.2, 0.3]


def test_a_length_is_the_share_of_the_cones(vibrissa):
    plain = vibrissa("profile", "--contact", "0.29", "--base-angle", "1.2", *CONE, "--json")[1]
    assert vibrissa("profile", "--contact", "11.6mm", "--base-angle", "1.2", *CONE, "--json")[1] == plain
    gaps = [vibrissa("gap", *POSTURE, "--gap-width", width, *CONE, "--json")[1] for width in ("0.6mm", "0.015")]
    assert json.loads(gaps[0])["held_excursion"] == pytest.approx(json.loads(gaps[1])["held_excursion"], rel=1e-9)
    words = ("gap", *POSTURE, "--gap-width", "0.6mm", *CONE, "--json", "--whisker.tip")
    tips = [vibrissa(*words, tip)[1] for tip in ("2mm", "0.05")]
    assert tips[0] == tips[1] != gaps[0]


def test_a_map_is_the_same_in_other_units(vibrissa, tmp_path):
    (tmp_path / "gap.csv").write_text("position,width\n0.002,0.0006\n")
    words = ("map", "--texture", tmp_path / "gap.csv", "--speed", "100mm/s", *CONE, "--scheduler", "synchronous")
    for name, at in (("a", ("0.2:0.4:2", "1.0,1.2")), ("b", ("8mm:16mm:2", "1.0rad,1.2"))):
        assert vibrissa(*words, "--contact", at[0], "--base-angle", at[1], "--out", tmp_path / f"{name}.nc")[0] == 0
    a, b = (load(tmp_path / f"{name}.nc") for name in "ab")
    np.testing.assert_allclose(b.contact, a.contact, rtol=1e-14)
    np.testing.assert_allclose(b.to_array(), a.to_array(), rtol=1e-9)


P, W = "--contact 0.29 --base-angle 70deg", "--whisker.length 40mm --whisker.cone-angle 1.5mrad"
SCAN = f"scan gap.csv {P} {W} --speed"
TRACK = "track movie.avi --pixel-size"
MODES = "modes --contact 0.3 --whisker.length"
DRAWN = f"map --speed 100mm/s --contact 0.3 --base-angle 1 {W} --seeds 1 --grating-length"
BITS = "information --spikes s.csv --trials 9 --window"
MISTAKES = {
    "degrees": ("profile --contact 0.29 --base-angle 70", "write --base-angle 70deg,"),
    "degrees of a map": (
        f"map --texture gap.csv --speed 0.1 {W} --contact 0.3 --base-angle 45:80:7",
        "write --base-angle 45deg:80deg:7,",
    ),
    "angle as length": ("profile --contact 0.29 --base-angle 70mm", "write --base-angle 70deg,"),
    "angle by another name": ("profile --contact 0.29 --base-angle 70dgr", "write --base-angle 70deg,"),
    "speed in mm/s": (f"{SCAN} 100", "got 100; write --speed 100mm/s,"),
    "speed as length": (f"{SCAN} 100mm", "write --speed 100mm/s,"),
    "speed without a stroke": (f"{SCAN} 100mms", "write --speed 100mm/s,"),
    "a decimal comma": (f"{SCAN} 0,1", "write --speed 100mm/s,"),
    "a decimal comma with a unit": (f"{SCAN} 0,1m/s", "write --speed 0.1m/s,"),
    "pixels in mm": (f"{TRACK} 0.1", "write --pixel-size 0.1mm,"),
    "a contact beyond the base": (f"modes --contact 0.95 {W}", "(over L), got 0.95\n"),
    "pixels in µm": (f"{TRACK} 95", "write --pixel-size 95um,"),
    "pixels in pixels": (f"{TRACK} 10px", "write --pixel-size 10um,"),
    "frame rate in kHz": (f"{TRACK} 95um --frame-rate 2", "write --frame-rate 2kHz\n"),
    "frame rate in mm": (f"{TRACK} 95um --frame-rate 500mm", "write --frame-rate 2kHz, or the number in Hz\n"),
    "frame rate as fps": (f"{TRACK} 95um --frame-rate 500fps", "or the number in Hz\n"),
    "length in mm": (f"{MODES} 40 --whisker.cone-angle 1.5e-3", "write --whisker.length 40mm,"),
    "cone angle in mrad": (f"{MODES} 40mm --whisker.cone-angle 1.5", "write --whisker.cone-angle 1.5mrad,"),
    "modulus in GPa": (
        f"modes --contact 0.3 {W} --whisker.youngs-modulus 3.74",
        "write --whisker.youngs-modulus 3.74GPa\n",
    ),
    "density in g/cm³": (f"modes --contact 0.3 {W} --whisker.density 1.14", "write --whisker.density 1.14g/cm^3\n"),
    "contact in mm": ("profile --contact 11.6 --base-angle 70deg", "write --contact 11.6mm,"),
    "contact in m": (
        "scan gap.csv --contact 0.0116 --base-angle 1 --speed 0.1 --atlas C2",
        "L: 0.32698 for 0.0116 m\n",
    ),
    "contact of no whisker": ("profile --contact 11.6mm --base-angle 70deg", "write --contact 0.29\n"),
    "contact as an angle": (
        "profile --contact 12deg --base-angle 1",
        "write --contact 0.29, over L, or --contact 12mm\n",
    ),
    "gap width in mm": (f"gap {P} {W} --gap-width 0.6", "write --gap-width 0.6mm,"),
    "gap depth in µm": (f"gap {P} {W} --gap-width 0.6mm --gap-depth 35", "write --gap-depth 35um\n"),
    "node in mm": (f"{SCAN} 0.1 --node 5", "write --node 5mm\n"),
    "part in mm": (f"{SCAN} 0.1 --part 60:90", "write --part 60mm\n"),
    "part of one end": (f"{SCAN} 0.1 --part 60mm", "for example --part 60mm:90mm\n"),
    "sampling in kHz": (f"{SCAN} 0.1 --sampling-rate 5", "write --sampling-rate 5kHz\n"),
    "bins in ms": (f"{BITS} 1 10 --bin-width 10", "write --bin-width 10ms\n"),
    "window in metres": (f"{BITS} 1m 10s", "write --window 1s,"),
    "threshold that is a mass": (
        "trials-needed --stimulus s.csv --threshold 42kg --slope 2.5e5 --baseline 5",
        "write --threshold 42um, or the number in m\n",
    ),
    "mean period in mm": (f"{DRAWN} 20mm --mean-period 0.6", "write --mean-period 0.6mm\n"),
    "grating in mm": (f"{DRAWN} 20", "write --grating-length 20mm\n"),
    "lengths and shares": (
        f"map --texture gap.csv --speed 0.1 {W} --contact 0.2:16mm:5 --base-angle 1",
        "--contact must be lengths, or shares of L, not both",
    ),
    "diameters as a surface": (
        f"scan diameters.csv {P} {W} --speed 0.1",
        "must be a surface, got a table of diameters",
    ),
    "an old option": (f"scan gap.csv {P} --scan-speed 0.1", "--scan-speed of scan is now --speed"),
    "an old verb": ("whisk a b", "the verb whisk is now whisking"),
    "an option by another name": ("profile --contact 0.3 --base_angel 1", "--base-angle"),
    "a common word": (f"scan gap.csv {P} {W} --velocity 0.1", "scan has no option --velocity; did you mean --speed?"),
    "frames per second": (f"{TRACK} 95um --fps 500", "track has no option --fps; did you mean --frame-rate?"),
    "a verb by another name": ("profil", '"profile"'),
    "no kind": ("sensor gap.csv", "--kind must be given, with its value; for example --kind moment; see --help\n"),
    "half a window": (
        f"{BITS} 1",
        "must be given, with its 2 values. Only got 1; for example --window 1s 10s; see --help\n",
    ),
    "an option of another verb": ("modes --contact 0.3 --seed-point 1,2", "--seed-point"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_plausible_mistake_ends_in_one_line_that_shows_the_right_form(vibrissa, tmp_path, monkeypatch, case):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gap.csv").write_text("position,width\n0.001,0.0006\n")
    (tmp_path / "diameters.csv").write_text("distance_mm,diameter_um\n0,120\n4,108\n")
    words, right = MISTAKES[case]
    code, out, err = vibrissa(*words.split())
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert right in err
    assert {path.name for path in tmp_path.iterdir()} == {"diameters.csv", "gap.csv"}


def test_bare_numbers_import_no_units():
    words = "'profile --contact 0.3 --base-angle 1.2'.split()"
    code = f"import sys; from vibrissa.cli import app; app.parse_args({words}); print('pint' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "False\n"
