"""Tables fit the terminal, and no digit of them is lost."""

import re
from pathlib import Path

import numpy as np
import pytest

from vibrissa.cli.shared.display.tables import folded, table_lines
from vibrissa.cli.studies.run import report_end
from vibrissa.quantities import dataset

EXAMPLES = Path(__file__).parents[3] / "examples"
HERE = ("--contact", "0.29", "--base-angle", "1.2")
CONE = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3")
SPIKES = ("--spikes", "spikes.csv", "--stimulus", "spikes-stimulus.csv", "--trials", "20")
VERBS = {
    "modes": ("modes", "--contact", "0.29", "--atlas", "C2"),
    "curved modes": ("modes", "--contact", "0.3", "--about", "profile", "--base-angle", "1.2"),
    "profile": ("profile", *HERE, "--atlas", "C2"),
    "gap": ("gap", *HERE, "--gap-width", "0.015"),
    "scan": ("scan", "grating.csv", *HERE, "--speed", "0.1", "--atlas", "C2"),
    "atlas": ("atlas",),
    "atlas of resonances": ("atlas", "--resonances"),
    "map": (
        "map",
        "--texture",
        "gap.csv",
        "--contact",
        "0.2,0.3",
        "--base-angle",
        "1",
        "--speed",
        "0.1",
        *CONE,
    ),
    "sensor": (
        "sensor",
        "robot.csv",
        "--kind",
        "moment",
        "--signal-unit",
        "V",
        "--calibration",
        "2e-7",
        "--guess",
        "123",
    ),
    "neural": ("neural", *SPIKES),
    "trials-needed": (
        "trials-needed",
        "--stimulus",
        "spikes-stimulus.csv",
        "--threshold",
        "42e-6",
        "--slope",
        "2.5e5",
        "--baseline",
        "5",
        "--threshold-within",
        "1e-5",
    ),
    "study": ("study", "robot.toml"),
    "dry run": ("run", "--dry-run"),
    "run": ("run", "robot.toml", "--out", "{tmp}/robot"),
}


@pytest.mark.parametrize("words", VERBS.values(), ids=VERBS)
def test_what_a_verb_prints_fits_80_columns(vibrissa, words, tmp_path, monkeypatch):
    monkeypatch.chdir(EXAMPLES)
    monkeypatch.setenv("COLUMNS", "80")
    code, out, err = vibrissa(*(word.format(tmp=tmp_path) for word in words))
    assert code == 0, err
    assert [line for line in out.splitlines() if len(line) > 80] == []
    assert out.strip()


def test_without_a_terminal_the_width_is_80(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    data = dataset(lead=("mode",), mode=np.arange(1, 3), **{name: np.ones(2) for name in WIDE})
    assert 60 < max(map(len, table_lines(data, ["mode", *WIDE]))) <= 80


WIDE = ("kappa", "resonant_frequency", "coupling", "linearity", "mechanism", "mode_sd")


def test_a_wide_table_continues_with_its_first_column_and_every_digit(monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    values = {name: np.array([1.23456e-5, -9.87654e8]) * (k + 1) for k, name in enumerate(WIDE)}
    lines = table_lines(dataset(lead=("mode",), mode=np.arange(1, 3), **values), ["mode", *WIDE])
    assert max(map(len, lines)) <= 60
    assert all(lines)
    heads = [line.split() for line in lines if line.split()[0] == "mode"]
    assert len(heads) > 1
    assert [name for head in heads for name in head[1:]] == list(WIDE)
    text = " ".join(lines).split()
    assert all(f"{value:.6g}" in text for column in values.values() for value in column)


def test_a_table_is_in_the_units_of_the_field_and_intervals_share_one(monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    columns = {
        "threshold": np.array([42e-6, 0.5e-6]),
        "threshold_low": np.array([0.0, np.nan]),
        "slope": np.array([2.5e5, 1e5]),
        "latency": np.array([0.0125, 0.001]),
        "peak_speed": np.array([0.1, 0.02]),
    }
    data = dataset(lead=("unit",), **columns, base_angle=np.pi / 3, static_moment=2e-7, length=0.04)
    lines = table_lines(data, ["base_angle", "static_moment", "length", *columns])
    assert [line.split(": ")[1] for line in lines[:3]] == ["60 [°]", "200 [nN m]", "40 [mm]"]
    head = re.split(r"  +", lines[3])
    assert [word.partition("[")[2].rstrip("]") for word in head[1:]] == ["µm", "µm", "1/(s µm)", "ms", "mm/s"]
    assert lines[4].split() == ["0", "42", "0", "0.25", "12.5", "100"]
    assert lines[5].split() == ["1", "0.5", "–", "0.1", "1", "20"]


def test_what_is_zero_or_unknown_has_a_unit_too():
    data = dataset(base_angle=0.0, length=np.nan, contact=0.3)
    assert [line.rpartition(": ")[2] for line in table_lines(data, ["base_angle", "length", "contact"])] == [
        "0 [°]",
        "– [m]",
        "0.3",
    ]


def test_words_are_wrapped_and_none_is_lost():
    key, words = ["unit", "a", "b"], ["reason", "the threshold lies below the range of the envelope", ""]
    lines = folded(key, [["rate", "1.25", "2.5"], words], 40)
    assert max(map(len, lines)) <= 40
    assert re.findall(r"\w+", " ".join(lines[1:]))[0] == "a"
    assert all(word in " ".join(lines).split() for word in words[1].split())


@pytest.mark.parametrize(("count", "shown"), [(3, True), (12, False)])
def test_few_sweeps_have_a_line_each_and_many_do_not(count, shown, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    numbers = ("scan_speed", "contact", "base_angle", "first_resonance", "first_damping", "first_correlation")
    columns = {name: np.full(count, 0.123456) for name in numbers} | {"accepted": np.ones(count, bool)}
    words = {name: np.full(count, "beta") for name in ("animal", "whisker_name", "rejected")}
    found = dataset(lead=("sweep",), sweep=np.arange(count), **columns, **words)
    report_end(found.assign_attrs(headlines='["done", "numbers"]', not_analysed="[]"), Path("out"), False)
    out, err = capsys.readouterr()
    lines = out.splitlines()
    assert lines[0] == "numbers"
    assert len(lines) == 1 + shown * (1 + 1 + count)
    assert max(map(len, lines)) <= 80
    assert err.splitlines() == [
        "vibrissa: done",
        "vibrissa: the report is out/report.html; --json prints its whole table",
    ]
