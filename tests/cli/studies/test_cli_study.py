"""The verb `study`, and the dry run: what is told, where, with which exit code; nothing is written."""

import json
import tomllib
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[3] / "examples"


def test_the_schema_is_given_on_the_screen_and_as_a_file(vibrissa, tmp_path):
    code, out, _ = vibrissa("study", "--schema")
    assert code == 0
    assert json.loads(out)["additionalProperties"] is False
    code, screen, err = vibrissa("study", "--schema", "--out", tmp_path / "study.schema.json")
    assert (code, screen) == (0, "")
    assert "study.schema.json" in err
    assert (tmp_path / "study.schema.json").read_text(encoding="utf-8") == out


def test_the_example_is_a_study_that_the_check_takes(vibrissa, tmp_path):
    code, _, _ = vibrissa("study", "--example", "--out", tmp_path / "mine.toml")
    assert code == 0
    assert "film" in tomllib.loads((tmp_path / "mine.toml").read_text(encoding="utf-8"))
    code, out, _ = vibrissa("study", tmp_path / "mine.toml")
    assert code == 0
    there, _, other = out.partition("it could also have")
    assert "[film]" in there
    assert "[[base_signal]]" in other
    code, out, _ = vibrissa("study", tmp_path / "mine.toml", "--json")
    told = json.loads(out)
    parts = dict(zip(told["part"], told["part_given"], strict=True))
    assert (parts["film"], parts["base_signal"]) == (True, False)


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        ((), "study must be one of: a study file, --schema, --example"),
        (("--schema", "--example"), "study must be one of: a study file, --schema, --example"),
        (("none.toml",), "none.toml must be an existing study file"),
        (("--schema", "--out", "schema.toml"), "--out must end in .json"),
        (("--schema", "--out", "nowhere/s.json"), "nowhere must be an existing folder"),
    ],
)
def test_what_cannot_be_done_is_told_in_one_line(vibrissa, words, rule, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = vibrissa("study", *words)
    assert (code, out) == (2, "")
    assert rule in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_dry_run_tells_the_plan_and_makes_nothing(vibrissa, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = vibrissa("run", EXAMPLES / "surface.toml", "--dry-run", "--workers", "3")
    assert (code, err) == (0, "")
    for said in ("nothing is done yet", "ridges.csv", "filming", "on 3 cores", "Figure 3: tracking", "left out"):
        assert said in out
    code, out, _ = vibrissa("run", "--dry-run", "--json")
    told = json.loads(out)
    assert "filming" in told["work"]
    assert told["wall_time"] > 0
    assert list(tmp_path.iterdir()) == []


def test_a_dry_run_without_its_inputs_is_refused_after_the_plan(vibrissa, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (EXAMPLES / "surface.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    code, out, err = vibrissa("run", "mine.toml", "--dry-run")
    assert code == 2
    assert "ridges.csv  must be an existing file" in out
    assert err == "vibrissa: ridges.csv must be an existing file\n"
    (tmp_path / "mine.toml").write_text(text.replace("base_angle", "base_angel"), encoding="utf-8")
    code, out, err = vibrissa("run", "mine.toml", "--dry-run")
    assert (code, out) == (2, "")
    assert err == "vibrissa: mine.toml: [posture]: key 'base_angel' is unknown; did you mean base_angle?\n"
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]
