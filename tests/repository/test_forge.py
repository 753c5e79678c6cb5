"""What the forge, the archive and conda read says the same as pyproject.toml, and names what is there."""

import json
import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

import vibrissa

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
TEMPLATES = [path for path in sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml")) if path.stem != "config"]
CONDA = {"matplotlib-base": "matplotlib"}  # its name of a package: that of the index


def read(path):
    return yaml.safe_load(path.read_text())


def steps(workflow):
    return [step for job in workflow["jobs"].values() for step in job["steps"]]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_workflows_run_what_is_there_with_the_least_rights(path):
    workflow = read(path)
    assert {"name", True, "permissions", "jobs"} <= workflow.keys()  # YAML reads the key on as true
    assert workflow["permissions"]["contents"] == "read"
    for step in steps(workflow):
        assert step.keys() & {"uses", "run"}
        assert re.fullmatch(r"[\w/-]+@(v\d+|release/v\d+)", step.get("uses", "a@v1"))
        for name in re.findall(r"\.ci/\w+|[\w-]+\.lock|run\.py", step.get("run", "")):
            assert (ROOT / name).is_file(), name
    for job in workflow["jobs"].values():
        assert "needs" not in job or job["needs"] in workflow["jobs"]


def test_the_oldest_python_and_three_systems_are_tested():
    jobs = read(ROOT / ".github/workflows/tests.yml")["jobs"]
    matrix = jobs["fast"]["strategy"]["matrix"]
    (oldest,) = re.findall(r"[\d.]+", PROJECT["requires-python"])
    assert oldest == matrix["python"][0]
    assert all(SpecifierSet(PROJECT["requires-python"]).contains(version) for version in matrix["python"])
    assert {"ubuntu-latest", "macos-latest"} == set(matrix["os"])
    assert jobs["windows"]["continue-on-error"] is True


def test_a_release_is_of_the_version_of_its_tag_and_keeps_no_password():
    text = (ROOT / ".github/workflows/release.yml").read_text()
    assert "GITHUB_REF_NAME#v" in text
    assert "secrets." not in text
    assert read(ROOT / ".github/workflows/release.yml")["jobs"]["publish"]["permissions"] == {"id-token": "write"}


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.stem)
def test_templates_of_issues_ask_each_thing_once(path):
    template = read(path)
    assert {"name", "description", "body"} <= template.keys()
    names = [one["id"] for one in template["body"]]
    assert len(set(names)) == len(names)
    assert all(one["attributes"]["label"] for one in template["body"])


def test_the_recipe_asks_for_what_the_project_asks_for():
    recipe = read(ROOT / "recipe/recipe.yaml")
    python, *run = recipe["requirements"]["run"]
    assert python == f"python {PROJECT['requires-python']}"
    found = {CONDA.get(name, name): SpecifierSet(bound) for name, bound in (one.split(" ", 1) for one in run)}
    assert found == {one.name: one.specifier for one in map(Requirement, PROJECT["dependencies"])}
    (command,) = PROJECT["scripts"].items()
    assert recipe["build"]["python"]["entry_points"] == [" = ".join(command)]
    assert recipe["context"]["version"] == vibrissa.__version__
    assert recipe["about"]["license"] == PROJECT["license"]
    assert recipe["about"]["summary"] == PROJECT["description"]


def test_the_archive_is_given_what_the_citation_says():
    archive, citation = json.loads((ROOT / ".zenodo.json").read_text()), read(ROOT / "CITATION.cff")
    assert archive["title"] == citation["title"]
    assert archive["license"] == citation["license"].lower()
    assert archive["keywords"] == citation["keywords"] == PROJECT["keywords"]
    assert [one["name"] for one in archive["creators"]] == [one["name"] for one in citation["authors"]]
    dois = [one["doi"] for one in citation["references"]]
    assert [one["identifier"] for one in archive["related_identifiers"]] == dois
