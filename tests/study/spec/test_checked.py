"""A study file with a mistake is answered in one line that names the place, the rule and the way out."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from vibrissa.errors import InputError
from vibrissa.neural.simulated.virtual import PhaseUnit, ThresholdLinearUnit
from vibrissa.study.spec.checked import keys_of, parts_of
from vibrissa.study.spec.settings import Study, read_study, validated_study

MOVIE = "[movie]\npath = 'a.avi'\npixel_size = 1e-4\n"
BASE = "[[base_signal]]\npath = 'a.csv'\nkind = 'moment'\nunit = 'V'\nguess = [90.0]\n"
OVER = (
    "[whisker]\nlength = 0.04\ncone_angle = 1.5e-3\n[posture]\ncontact = 0.29\nbase_angle = 1.2\n"
    "[scan]\nspeed = 0.1\ndamping = 0.11\n"
)
SURFACE = OVER + "[texture]\nlength = 0.1\n"


def read(text):
    return validated_study(tomllib.loads('name = "x"\n' + text), "s.toml", Path())


def told(text, code, place, value=None):
    with refusal(code, f"s.toml: {place}", value) as caught:
        read(text)
    return caught.value


@pytest.mark.parametrize(
    ("text", "place", "remedy"),
    [
        (MOVIE + "serch = 4\n", "[movie]: key 'serch'", "did you mean search?"),
        (MOVIE + "[movie.whisking.fan]\npivt = [1, 2]\n", "[movie.whisking.fan]: key 'pivt'", "did you mean pivot?"),
        ("[film.camera]\nnois = 3\n", "[film.camera]: key 'nois'", "did you mean noise?"),
        ("[film]\nframe_rate = 500\n", "[film]: key 'frame_rate'", "it belongs in [film.camera]"),
        ("[recording]\nthreshold = 1e-5\n", "[recording]: key 'threshold'", "it belongs in [recording.unit]"),
        ("[laboratory.nuisance]\nwandr = 1\n", "[laboratory.nuisance]: key 'wandr'", "did you mean wander?"),
        (BASE + "[base_signal.whisker]\nlenght = 1\n", "[base_signal.whisker]: key 'lenght'", "did you mean length?"),
        (
            BASE + "[base_signal.whisker]\ncontact = 1\n",
            "[base_signal.whisker]: key 'contact'",
            "it belongs in [base_signal.posture]",
        ),
        ("[posture]\nspeed = 0.1\n", "[posture]: key 'speed'", "it belongs in [scan]"),
        ("[laboratory]\ncolour = 'red'\n", "[laboratory]: key 'colour'", "it knows animals, whiskers"),
        (OVER + "[texture]\nfile = 'a.csv'\nseed = 3\n", "[texture]: key 'seed'", "it knows file, line"),
        (OVER + "[texture]\nlength = 0.1\nfill = true\n", "[texture]: key 'fill'", "it knows length"),
    ],
)
def test_a_wrong_key_is_answered_with_the_right_one_or_its_place(text, place, remedy):
    assert told(text, "unknown", place).remedy.startswith(remedy)


@pytest.mark.parametrize(
    ("text", "place", "found"),
    [
        (OVER.replace("0.29", "'0.29'"), "posture.contact", "must be a number, not '0.29'"),
        (OVER.replace("0.1\n", "true\n"), "scan.speed", "must be a number, not True"),
        (MOVIE.replace("1e-4", "'1e-4'"), "movie.pixel_size", "must be a number, not '1e-4'"),
        (MOVIE + "search = 4.5\n", "movie.search", "must be a whole number, not 4.5"),
        (MOVIE + "base = 'up'\n", "movie.base", "must be 'left', 'right', 'top' or 'bottom', not 'up'"),
        (MOVIE + "lamp = 3\n", "movie.lamp", "must be a list, in [ ] or must be 'find', not 3"),
        (MOVIE + "lamp = [1, 2, 3]\n", "movie.lamp.3", "must be given"),
        (MOVIE + "seeds = [[1, 'a']]\n", "movie.seeds.0.1", "must be a number, not 'a'"),
        ("[laboratory]\nspeeds = [0.1, 'fast']\n", "laboratory.speeds.1", "must be a number, not 'fast'"),
        ("[laboratory]\ncrop = 1\n", "laboratory.crop", "must be true or false, not 1"),
        (BASE.replace("'V'", "5"), "base_signal.0.unit", "must be text, in quotes, not 5"),
        ("[movie]\npath = 'a.avi'\n", "movie.pixel_size", "must be given"),
        ("sweeps = 3\n", "sweeps", "must be text, in quotes, not 3"),
    ],
)
def test_a_value_of_the_wrong_kind_is_told_in_the_files_own_words(text, place, found):
    assert told(text, "format", place).rule == (found if found == "must be given" else f"is not valid ({found})")


@pytest.mark.parametrize(
    ("text", "place", "value", "rule", "remedy"),
    [
        ("texture = 'a.csv'\n", "texture", "'a.csv'", "must be a table", "written [texture]"),
        (
            "[base_signal]\npath = 'a.csv'\n",
            "base_signal",
            "{'path': 'a.csv'}",
            "must be a list of tables",
            "written [[base_signal]]",
        ),
        ("base_signal = [3]\n", "base_signal", "[3]", "must be a list of tables", "written [[base_signal]]"),
        ("[film]\nn_frames = 10\ncamera = 3\n", "[film]: camera", "3", "must be a table", "written [film.camera]"),
    ],
)
def test_a_part_that_is_no_table_is_told_how_it_is_written(text, place, value, rule, remedy):
    error = told(text, "format", place, value)
    assert (error.rule, error.remedy) == (rule, remedy)


def test_a_surface_needs_a_whisker_a_posture_and_a_scan_and_no_movie():
    assert read(OVER + "[texture]\nfile = 'a.csv'\n").only_surface
    assert not read(OVER + "[texture]\nlength = 0.1\n[film]\nn_frames = 10\n").only_surface
    alone = told("[texture]\nlength = 0.1\n", "format", "study")
    assert "[texture] must come with [whisker], [posture], [scan]" in alone.rule
    without = OVER[: OVER.index("[posture]")] + OVER[OVER.index("[scan]") :] + "[texture]\nlength = 0.1\n"
    assert "[texture] must come with [posture]; they make the vibration" in told(without, "format", "study").rule
    assert "or a [texture] with [whisker], [posture] and [scan]" in told("", "format", "study").rule
    assert read(BASE + OVER + "[texture]\nlength = 0.1\n").only_surface


def test_marks_of_a_movie_have_a_frame_a_place_and_a_name():
    movie = {"path": "m.mkv", "pixel_size": 1e-4, "tracking": "link"}
    read = validated_study({"name": "x", "movie": {**movie, "marks": [[0, 120, 87.5, "C2"]]}}, "study", Path()).movie
    assert read.marks == ((0, 120.0, 87.5, "C2"),)
    assert read.base is None
    with refusal("format"):
        validated_study({"name": "x", "movie": {**movie, "marks": [[0, 1, 2]]}}, "study", Path())


def test_whole_numbers_serve_as_numbers():
    assert read(MOVIE + "threshold = 4\n").movie.threshold == 4.0


@dataclass(frozen=True)
class Inner:
    depth: int = 1


@dataclass(frozen=True)
class Outer:
    one: Inner
    maybe: Inner | None = None
    many: tuple[Inner, ...] = ()
    maybe_many: tuple[Inner, ...] | None = None
    numbers: tuple[float, ...] = ()
    folder: Path = Path()


def test_parts_are_found_however_they_are_held():
    found = {name: parts_of(Outer.__dataclass_fields__[name].type) for name in keys_of(Outer)}
    assert found == {
        "one": ([Inner], False),
        "maybe": ([Inner], False),
        "many": ([Inner], True),
        "maybe_many": ([Inner], True),
        "numbers": ([], True),
    }
    assert "folder" not in keys_of(Study)


def test_a_unit_of_another_model_has_the_keys_of_that_model():
    unit = read(SURFACE + "[recording.unit]\nmodel = 'carrier-phase'\ndepth = 0.5\n").recording.unit
    assert unit == PhaseUnit(depth=0.5)
    assert read(SURFACE + "[recording.unit]\nbaseline = 1.0\n").recording.unit == ThresholdLinearUnit(baseline=1.0)


@pytest.mark.parametrize(
    ("unit", "quantity", "remedy"),
    [
        ("model = 'carier-phase'\ndepth = 0.5", "[recording.unit]: model", "did you mean carrier-phase?"),
        ("model = 'carrier-phase'\ndepht = 0.5", "[recording.unit]: key 'depht'", "did you mean depth?"),
        ("depth = 0.5", "[recording.unit]: key 'depth'", "it knows model, threshold, slope, baseline, latency"),
    ],
)
def test_a_wrong_key_or_model_of_a_unit_is_judged_by_the_model_that_is_meant(unit, quantity, remedy):
    with refusal("unknown") as caught:
        read(SURFACE + f"[recording.unit]\n{unit}\n")
    assert caught.value.quantity.endswith(quantity)
    assert caught.value.remedy == remedy


def test_a_number_of_thousands_of_digits_is_one_line_and_a_mark_of_byte_order_is_none(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("n_modes = " + "9" * 5000)
    with pytest.raises(InputError, match=r"study\.toml must be TOML"):
        read_study(path)
    path.write_bytes('name = "Schnurrhaar, 40 µm"'.encode("latin-1"))
    with pytest.raises(InputError, match=r"study\.toml must be text in UTF-8; save it as UTF-8"):
        read_study(path)
    path.write_bytes(b"\xef\xbb\xbf[whisker]\nlength = 0.04\ncone_angle = 1.5e-3\nage = 3\n")
    with pytest.raises(InputError, match="age"):
        read_study(path)


WITH_UNITS = """
name = "units"
[whisker]
length = "40 mm"
cone_angle = "1.5 mrad"
[posture]
contact = 0.29
base_angle = "70deg"
[scan]
speed = "100 mm/s"
damping = 0.1
[film]
n_frames = 100
[film.camera]
frame_rate = "2 kHz"
pixel_size = "95um"
[texture]
length = "35 cm"
[[neural]]
spikes = "spikes.csv"
stimulus = "stimulus.csv"
bin_width = "5 ms"
spontaneous = ["-500 ms", 0.0]
delay = ["20ms"]
"""


def test_quantities_may_have_their_unit():
    """Every key whose docstring states a unit takes one, alone, in a list and in a list of parts."""
    study = validated_study(tomllib.loads(WITH_UNITS), "study.toml", Path())
    assert (study.whisker.length, study.whisker.cone_angle, study.scan.speed) == (0.04, 1.5e-3, 0.1)
    assert study.posture.base_angle == pytest.approx(np.deg2rad(70), rel=1e-15)
    assert (study.film.camera.frame_rate, study.film.camera.pixel_size, study.texture.length) == (2000.0, 95e-6, 0.35)
    [neural] = study.neural
    assert (neural.bin_width, neural.spontaneous, neural.delay) == (5e-3, (-0.5, 0.0), (0.02,))


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        ('"95um"', '"95 Hz"', "must be a number [m], or have a unit like it"),
        ('"95um"', '"95"', "must be a number"),
        ('"95um"', '"a few"', "must be a number"),
        ("contact = 0.29", 'contact = "11 mm"', "must be a number"),
        ('["20ms"]', '["20 mm"]', "must be a number [s], or have a unit like it"),
    ],
)
def test_what_is_no_quantity_of_the_kind_is_refused(old, new, rule):
    with refusal("format") as caught:
        validated_study(tomllib.loads(WITH_UNITS.replace(old, new)), "study.toml", Path())
    assert rule in str(caught.value)
