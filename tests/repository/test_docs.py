"""The pages hold: commands are such as the program takes, equations lead to their functions and back, all is there."""

import ast
import csv
import html
import importlib
import importlib.util
import itertools
import os
import pkgutil
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from fontTools.ttLib import TTFont

import vibrissa
from vibrissa.cli import app

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]
ROLE = re.compile(r"\{(?:py:)?(?:func|meth|class|attr|mod|data)\}`~?([\w.]+)`")


# Commands


def commands(path):
    """Give the commands of vibrissa in the indented blocks of a page; not those abridged by an ellipsis."""
    text = path.read_text(encoding="utf-8").replace("\\\n", " ")
    for line in re.findall(r"^ {4}(?:vibrissa|python3 run\.py) (.+)$", text, re.MULTILINE):
        words = shlex.split(line, comments=True)
        if words and words[0] not in ("test", "lock") and "…" not in words:
            yield words


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_every_command_of_a_page_is_one_that_the_program_takes(path, monkeypatch):
    monkeypatch.setattr(
        "vibrissa.cli.shared.display.output.refuse_out", lambda out: None
    )  # commands before make the folders
    for words in commands(path):
        app.parse_args(words, print_error=False, exit_on_error=False)


def test_a_command_that_is_none_is_found_out(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("    vibrissa modes --contact 0.3 \\\n        --colour red\n")
    (words,) = commands(page)
    assert words == ["modes", "--contact", "0.3", "--colour", "red"]
    with pytest.raises(Exception, match="colour"):
        app.parse_args(words, print_error=False, exit_on_error=False)


def test_every_file_that_a_command_takes_from_examples_is_there():
    for path in PAGES:
        for word in (word for words in commands(path) for word in words if word.startswith("examples/")):
            assert (ROOT / word).exists(), f"{path.name}: {word}"


MADE = ("--out", "--picture", "--preview", "--spikes-out")


def git(*words, given=None):
    """Give what git says of this folder, line by line."""
    done = subprocess.run(["git", *words], cwd=ROOT, input=given, capture_output=True, text=True)
    if done.returncode > 1:
        pytest.skip("not a clone: git does not know this folder")
    return done.stdout.splitlines()


def test_whatever_a_command_of_a_page_makes_is_ignored_by_git_and_nothing_that_is_shipped():
    shipped = git("ls-files")
    typed = [words for path in PAGES for words in commands(path)]
    made = {after for words in typed for word, after in itertools.pairwise(words) if word in MADE} - set(shipped)
    assert {"scan.nc", "command.wav", "sheet.png", "built", "laboratory", "study.schema.json"} <= made
    assert set(git("check-ignore", "--stdin", given="\n".join(made))) == made
    assert git("ls-files", "--cached", "--ignored", "--exclude-standard") == []
    new = {"docs/new.png", "docs/howto-new.md", "examples/new.csv", "examples/new.toml", "benchmarks/new.py"}
    assert git("check-ignore", "--stdin", given="\n".join(new)) == []


# Theory


def sections():
    """Give the sections of the page of theory by their targets."""
    parts = re.split(r"^\((eq-[\w-]+)\)=$", (DOCS / "theory.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def citing():
    """Give every equation number of the paper with the full name of what cites it."""
    for path in sorted((ROOT / "src").rglob("*.py")):
        module = ".".join(path.relative_to(ROOT / "src").with_suffix("").parts).removesuffix(".__init__")
        yield from cited_in(ast.parse(path.read_text(encoding="utf-8")), module)


def cited_in(node, name):
    """Give the equations that a module, class or function cites, and those within it."""
    text = " ".join((ast.get_docstring(node) or "").split())
    for numbers in re.findall(r"Eqs?\. ((?:\(\d+\)(?:, | and )?)+) of \[Boubenec2014\]_", text):
        yield from ((int(number), name) for number in re.findall(r"\d+", numbers))
    for child in node.body:
        if isinstance(child, ast.ClassDef | ast.FunctionDef):
            yield from cited_in(child, f"{name}.{child.name}")


def test_every_equation_that_the_code_cites_stands_on_the_page_of_theory_with_its_function():
    found, page = dict.fromkeys(range(1, 20), 0), sections()
    for number, name in citing():
        assert name in ROLE.findall(page[f"eq-{number}"]), f"Eq. {number}: {name}"
        found[number] += 1
    assert set(found.values()) == {1}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_every_function_that_a_page_names_exists(path):
    for name in ROLE.findall(path.read_text(encoding="utf-8")):
        assert resolved(name) is not None, name


def resolved(name):
    """Import what a dotted name says."""
    words = name.split(".")
    for split in range(len(words), 0, -1):
        try:
            found = importlib.import_module(".".join(words[:split]))
        except ModuleNotFoundError:
            continue
        for word in words[split:]:
            found = getattr(found, word)
        return found
    return None


def test_every_formula_has_a_function():
    without = [target for target, text in sections().items() if not ROLE.search(text)]
    assert not without


# Tables


def test_every_table_for_download_is_whole_and_on_a_page():
    pages = "".join(path.read_text(encoding="utf-8") for path in PAGES)
    named = set(re.findall(r"[<(](validation/[\w-]+\.csv)[>)]", pages))
    assert {str(path.relative_to(DOCS)) for path in DOCS.glob("validation/*")} == named
    for name in named:
        head, *rows = csv.reader((DOCS / name).read_text(encoding="utf-8").splitlines())
        assert len(set(head)) == len(head) > 1, name
        assert all(head), name
        assert rows, name
        assert {len(row) for row in rows} == {len(head)}, name


# The whole


def test_picture_of_the_rooms_is_that_of_the_contract():
    spec = importlib.util.spec_from_file_location("make_layers", DOCS / "make_layers.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert (DOCS / "layers.svg").read_text(encoding="utf-8") == made.picture(), "python docs/make_layers.py"


def modules():
    """Name every public module of the package."""
    found = pkgutil.walk_packages(vibrissa.__path__, "vibrissa.")
    return [name for _, name, _ in found if not any(word.startswith("_") for word in name.split("."))]


def test_list_of_modules_is_of_these_modules(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    made = importlib.import_module("make_modules").page()
    assert (DOCS / "modules.md").read_text(encoding="utf-8") == made, "python docs/make_modules.py"


def test_pages_build_without_a_warning_and_every_public_module_is_on_them(tmp_path):
    needed = ("sphinx", "myst_nb", "sphinx_design", "pydata_sphinx_theme")
    if not all(importlib.util.find_spec(name) for name in needed):
        pytest.skip("the group docs is not installed: pip install --group docs")
    command = [sys.executable, "-c", "from sphinx.cmd.build import main; import sys; sys.exit(main(sys.argv[1:]))"]
    command += ["-q", "-W", "--keep-going", "-b", "html", str(DOCS), str(tmp_path)]
    done = subprocess.run(command, env=os.environ | {"VIBRISSA_GALLERY": "0"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    api = tmp_path / "_build/api"
    assert [name for name in modules() if not (api / f"{name}.html").exists()] == []
    assert "theory.html#eq-17" in (api / "vibrissa.signals.envelope.html").read_text(encoding="utf-8")
    theory = (tmp_path / "theory.html").read_text("utf-8")
    assert not re.search(r'(?:src|href)="https?://[^"]*\.(?:js|css)"', theory)
    formulas = re.findall(r"<math.*?</math>", theory, re.DOTALL)
    text = html.unescape(re.sub(r"<[^>]*>", "", "".join(formulas)))
    drawn = set(re.sub(r"[\s\u2061]", "", text))  # U+2061 is invisible
    assert set(map(ord, drawn)) <= set(TTFont(tmp_path / "_static" / "math.woff").getBestCmap())
