"""Refusals of the package at the command line: arguments are options there, and stay arguments in Python."""

import re
from pathlib import Path

import pytest

import vibrissa
from vibrissa.cli import options_of
from vibrissa.cli.shared.words.glossary import GLOSSARY
from vibrissa.cli.shared.words.refusals import argument_for, as_typed, in_options, option_for
from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError
from vibrissa.mechanics.statics.profile import Posture

SOURCE = Path(vibrissa.__file__).parent


@pytest.mark.parametrize(
    ("verb", "name", "option"),
    [
        ("scan", "Posture.base_angle", "--base-angle"),
        ("scan", "Whisker.length", "--whisker.length"),
        ("scan", "Scan.speed", "--speed"),
        ("replay", "speed", "--max-speed"),
        ("scan", "level", "--levelling"),
        ("neural", "level", "--level"),
        ("pick", "seeds", "--seed-point"),
        ("modes", "number of modes", "--n-modes"),
        ("map", "Gratings.mean_period", "--mean-period"),
        ("modes", "n_trials", None),
        ("neural", "stimulus.csv.json", None),
        ("neural", "line 3, trials", None),
    ],
)
def test_an_argument_is_the_option_of_the_verb(verb, name, option):
    assert option_for(name, options_of(verb)) == option


@pytest.mark.parametrize("option", GLOSSARY)
def test_an_option_gives_the_argument_that_leads_back_to_it(option):
    assert option_for(argument_for(option), [option]) == option
    assert argument_for(option).isidentifier()


def test_a_negative_quantity_is_that_of_its_option(vibrissa):
    code, _, err = vibrissa("modes", "--contact", "0.3", "--whisker.cone-angle", "1.5mrad", "--whisker.length", "-60mm")
    assert (code, err) == (2, "vibrissa: --whisker.length must be positive and finite, got -60mm\n")


def test_a_refusal_names_what_was_typed():
    words = ["scan", "--speed", "100", "--base-angle=70"]
    taken = options_of("scan")
    fast = as_typed(RangeError("Scan.speed", "must be at most 10 m/s", 100.0, "give it in m/s"), taken, words)
    assert str(fast) == "--speed must be at most 10 m/s, got 100; write --speed 100mm/s, if that is meant"
    steep = as_typed(RangeError("Posture.base_angle", "must be below π/2", 70.0), taken, words)
    assert str(steep).endswith("got 70; write --base-angle 70deg, if that is meant")
    known = as_typed(
        RangeError("Scan.speed", "must be at most 10 m/s", 12.0, "give it in m/s: 0.012 for 12 mm/s"),
        taken,
        ["scan", "--speed", "12m/s"],
    )
    assert str(known) == "--speed must be at most 10 m/s, got 12m/s"
    two = as_typed(ConflictError("event, trial_table", "must not go with `period`"), options_of("neural"), [])
    assert str(two) == "--event, --trial-table must not go with --period"
    level = FormatError("a.csv", "must be level", None, "`level='line'` takes it away, `level='none'` keeps it")
    assert as_typed(level, taken, words).remedy == "--levelling line takes it away, --levelling none keeps it"
    other = MissingError("r.nc", "must hold the motion of a point", remedy="scan again with `nodes=[0.005]`")
    assert as_typed(other, options_of("replay"), []).remedy == "scan again with --node 0.005"


def test_what_no_option_gives_stays():
    assert in_options("set `attrs` or `workers=2`") == "set `attrs` or --workers 2"


def test_a_quantity_with_its_unit_is_not_mended():
    error = RangeError("Scan.speed", "must be at most 10 m/s", 100.0)
    assert as_typed(error, options_of("scan"), ["scan", "--speed", "100m/s"]).remedy == ""


def test_the_same_refusal_names_the_argument_in_python(vibrissa):
    with pytest.raises(RangeError, match=r"^Posture\.base_angle must lie"):
        Posture(contact=0.3, base_angle=70)
    assert vibrissa("profile", "--contact", "0.3", "--base-angle", "70")[2].startswith(
        "vibrissa: --base-angle must lie"
    )


def test_the_package_below_the_command_line_names_no_option():
    words = re.compile(r"[\"' (`]--[a-z][a-z-]+")
    ours = {name.removeprefix("--") for name in GLOSSARY}
    for path in SOURCE.rglob("*.py"):
        if {"cli", "warm.py", "snippets.py"} & set(path.relative_to(SOURCE).parts):  # they run or write commands
            continue
        text = path.read_text("utf-8")
        for found in words.finditer(text):
            line = text[: found.end()].rpartition("\n")[2] + text[found.end() :].partition("\n")[0]
            if "vibrissa " in line or "dask" in line or '"""' in line or "pip" in line:
                continue
            assert found[0].strip("\"' (`").removeprefix("--") not in ours, f"{path}: {line}"


def test_a_unit_is_suggested_only_where_the_number_is_of_its_size_and_the_unit_another():
    words = ["scan", "--base-angle", "1.7", "--guess", "1000"]
    steep = RangeError("Posture.base_angle", "must be below π/2", 1.7)
    assert "if that is meant" not in str(as_typed(steep, options_of("scan"), words))
    fast = RangeError("guess", "must lie below 312.5 Hz", 1000.0)
    assert "if that is meant" not in str(as_typed(fast, options_of("sensor"), words))
