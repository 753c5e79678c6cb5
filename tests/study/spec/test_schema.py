"""The schema of study files takes what the program takes, refuses what it refuses, and tells what each key means."""

import json
import tomllib
import typing
from pathlib import Path

import pytest
from refusals import refusal

import vibrissa
from vibrissa.study.spec.checked import keys_of, parts_of
from vibrissa.study.spec.described import described
from vibrissa.study.spec.schema import study_schema
from vibrissa.study.spec.settings import Study, read_study
from vibrissa.texture.surface import random_grating

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.toml"))
BUILT_IN = [Path(vibrissa.__file__).parent / "data" / name for name in ("experiment.toml", "paper.toml")]
SCHEMA = study_schema()


@pytest.fixture(scope="module")
def validator():
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    return jsonschema.Draft7Validator(SCHEMA)


@pytest.mark.parametrize("path", [*EXAMPLES, *BUILT_IN], ids=lambda path: path.name)
def test_every_study_that_is_given_along_is_valid(path, validator):
    validator.validate(tomllib.loads(path.read_text(encoding="utf-8")))
    read_study(path)


@pytest.mark.parametrize(
    ("old", "new", "where", "code", "quantity"),
    [
        ("base_angle = 1.2", "base_angel = 1.2", "posture", "unknown", "[posture]: key 'base_angel'"),
        ("[film.camera]", "[film.kamera]", "film", "unknown", "[film]: key 'kamera'"),
        ("n_frames = 3500", "n_frames = 3500.5", "film.n_frames", "format", "film.n_frames"),
        ("contact = 0.29", 'contact = "0.29"', "posture.contact", "format", "posture.contact"),
        ('jump = "continuous"', 'jump = "springy"', "scan.jump", "format", "scan.jump"),
        ("length = 0.35 ", "lengthy = 0.35 ", "texture", "unknown", "[texture]: key 'lengthy'"),
        ("threshold = 8e-6", "threshold = true", "recording.unit", "format", "recording.unit.threshold"),
        ("[film]\nn_frames = 3500", "[film]", "film", "format", "film.n_frames"),
        ('name = "Built-in', 'folder = "."\nname = "Built-in', "", "unknown", "key 'folder'"),
    ],
)
def test_what_the_program_refuses_the_schema_refuses_in_the_same_place(
    old, new, where, code, quantity, validator, tmp_path
):
    text = next(path for path in BUILT_IN if path.name == "experiment.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "study.toml").write_text(text.replace(old, new), encoding="utf-8")
    with refusal(code, f"study.toml: {quantity}"):
        read_study(tmp_path / "study.toml")
    places = {".".join(map(str, e.absolute_path)) for e in validator.iter_errors(tomllib.loads(text.replace(old, new)))}
    assert where in places


def kinds(cls, found):
    found[cls.__name__] = cls
    for hint in typing.get_type_hints(cls).values():
        for kind in parts_of(hint)[0]:
            kinds(kind, found)
    return found


def test_every_key_of_every_part_is_there_told_and_closed():
    parts = kinds(Study, {})
    tables = SCHEMA["definitions"] | {"Study": SCHEMA}
    assert set(tables) == set(parts)
    for name, table in tables.items():
        assert list(table["properties"]) == keys_of(parts[name])
        assert table["additionalProperties"] is False
        for key, value in table["properties"].items():
            assert len(value["description"]) > 1, f"{name}.{key}"
            assert not {":func:", "``", "Attributes"} & set(value["description"].split()), f"{name}.{key}"
    text = json.dumps(SCHEMA)  # a key may be called null, no value is
    assert ": null" not in text
    assert '"type": "null"' not in text
    assert "folder" not in SCHEMA["properties"]


def test_descriptions_carry_units_and_follow_references():
    tell = {name: table["properties"] for name, table in SCHEMA["definitions"].items()}
    assert "[m]" in tell["Whisker"]["length"]["description"]
    assert "[rad]" in tell["Posture"]["base_angle"]["description"]
    assert "[Hz]" in tell["Camera"]["frame_rate"]["description"]
    assert "mN m" in tell["BaseSignal"]["unit"]["description"]  # what the function says that its docstring names
    assert tell["Film"]["subframes"]["default"] == 3
    assert described(random_grating)["depth"] == "Depth of the gaps [m]."


def test_an_editor_takes_a_quantity_with_its_unit_and_no_other_text(validator):
    study = {"name": "x", "whisker": {"length": "40 mm", "cone_angle": 1.5e-3}}
    validator.validate(study)
    study["whisker"]["length"] = "long"
    assert [list(error.absolute_path) for error in validator.iter_errors(study)] == [["whisker", "length"]]
