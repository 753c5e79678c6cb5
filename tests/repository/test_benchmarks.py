"""Every script that a page names is there, and imports what exists and is declared in pyproject.toml."""

import ast
import importlib
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + sorted(ROOT.glob("docs/*.md"))
BENCHMARKS = sorted(ROOT.glob("benchmarks/**/*.py"))
SCRIPTS = [*BENCHMARKS, *sorted(ROOT.glob("docs/make_*.py"))]
# helpers that lie beside a script, or in the folders of tests that it adds to its path
BESIDE = {path.stem: path for folder in ("benchmarks", "docs", "tests") for path in ROOT.glob(f"{folder}/**/*.py")}
DISTRIBUTIONS = {"av": "av", "yaml": "pyyaml", "PIL": "pillow", "sklearn": "scikit-learn"}  # where they differ


def name_of(script):
    return str(script.relative_to(ROOT))


@pytest.mark.parametrize("path", [*PAGES, *SCRIPTS], ids=name_of)
def test_every_script_and_example_that_is_named_is_there(path):
    named = re.findall(
        r"(?<![\w/])(?:benchmarks|examples|docs)/[\w/-]+\.(?:py|toml|csv|sh|md)\b", path.read_text("utf-8")
    )
    assert [name for name in named if not (ROOT / name).is_file()] == []


def imports(script):
    """Give (module, names) of every import of a script, also of those in functions and in programs held as text."""
    text = script.read_text("utf-8")
    trees = [ast.parse(text)]
    constants = (node.value for node in ast.walk(trees[0]) if isinstance(node, ast.Constant))
    for value in constants:
        if isinstance(value, str) and re.search(r"^(?:import|from) \w", value, re.MULTILINE) and "\n" in value:
            lines = re.findall(r"^(?:import \S+|from \S+ import [\w, ]+)$", value, re.MULTILINE)
            trees.append(ast.parse("\n".join(lines)))
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.Import):
            yield from ((alias.name, ()) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module, tuple(alias.name for alias in node.names)


def declared(groups):
    """Names of the packages that pyproject.toml declares: of the package, its extras, and some groups."""
    table = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    project = table["project"]
    lists = [project["dependencies"], *project["optional-dependencies"].values()]
    lists += [table["dependency-groups"][group] for group in groups]
    words = [re.match(r"[\w.-]+", line)[0].lower() for one in lists for line in one if isinstance(line, str)]
    return set(words)


@pytest.mark.parametrize("script", SCRIPTS, ids=name_of)
def test_every_import_of_a_script_is_declared_and_every_name_of_the_package_exists(script):
    packages = declared(("bench", "peers"))
    for module, names in imports(script):
        first = module.partition(".")[0]
        if first == "vibrissa":
            found = importlib.import_module(module)
            for name in names:
                assert hasattr(found, name) or importlib.import_module(f"{module}.{name}"), f"{module}.{name}"
        elif first in BESIDE:
            tops = ast.parse(BESIDE[first].read_text("utf-8")).body
            defined = {name.id for top in tops for name in ast.walk(top) if isinstance(name, ast.Name)}
            defined |= {top.name for top in tops if isinstance(top, ast.FunctionDef | ast.ClassDef)}
            assert set(names) <= defined, f"{module}: {sorted(set(names) - defined)}"
        elif first not in sys.stdlib_module_names:
            assert DISTRIBUTIONS.get(first, first).lower() in packages, f"{first} is in no group of pyproject.toml"


def test_every_benchmark_says_how_to_run_it():
    for script in BENCHMARKS:
        text = script.read_text("utf-8")
        if 'if __name__ == "__main__"' in text:
            assert f"benchmarks/{script.relative_to(ROOT / 'benchmarks')}" in ast.get_docstring(ast.parse(text)), script
