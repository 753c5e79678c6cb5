"""Plain words: pages, help, messages and first lines of docstrings avoid phrases that readers have to read twice."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MADE = ("modules.md", "options.md")  # from docstrings and help, which are read here
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/*.md"), *ROOT.glob("docs/learn/*.md")]
PAGES = sorted(path for path in PAGES if path.name not in MADE)
SOURCES = sorted((ROOT / "src").rglob("*.py"))

REMEDIES = {  # phrase: what to write; "cannot tell", "tell … apart" and "stand-alone" are right English
    r"(?<!cannot )\b(?:tells?|told|telling)\b(?![^.;:]*\bapart\b)": "report, print, estimate or distinguish",
    r"\b(?:stands?|stood|standing)\b(?!-alone)": "is, or lies",
    r"\b(?:comes?|came|coming) out\b": "is, or results in",
    r"\bof (?:its|their) own accord\b": "automatically, or without being given",
    r"\bof (?:itself|themselves)\b": "by itself, or name the cause",
    r"\bwhat (?:is|was) (?:\w+ ){1,3}?(?:is|was)\b": "name the thing, then the verb",
    r"\b(?:for|to|by) who\b": "for those who",
    r"\bwho does what\b": "name the parts and their tasks",
    r"\bas much of\b": "the same",
    r"\bthat (?:is|are) none\b": "an unknown …, or not a …",
    r"\bhears? of\b": "receives, or is informed of",
    r"\bh[eo]ld against\b(?! the substrate)": "compare with",
    r"\banew\b": "again",
    r"\b(?:take|takes|took|taken|taking) for (?!granted)": "assumed to be, or mistaken for",
    r"\b(?:is|are|was|were) said\b": "is reported, or leave it out",
    r"\bmakes? what\b": "name what is made",
    r"\bcarr(?:y|ies|ied) on\b": "continue",
    r"\bhinges?\b": "threshold-linear fit, or drive above the threshold",
    r"\b(?:used to be|formerly|was rewritten|until now)\b": "leave history to the changelog",
}


def of_page(path):
    """Give the prose of a page, line by line with its number; blocks of code are blank."""
    text = path.read_text(encoding="utf-8")
    text = re.sub(r"^```.*?^```", lambda found: "\n" * found[0].count("\n"), text, flags=re.MULTILINE | re.DOTALL)
    prose = re.sub(r"^ {4}.*$|^\(.*\)=$", "", text, flags=re.MULTILINE)
    yield from enumerate(prose.splitlines(), start=1)


def of_source(path):
    """Give messages, help and first paragraphs of docstrings; of commands the whole docstring, which is their help."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    strings = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    bodies = [node.body for node in ast.walk(tree) if hasattr(node, "body") and isinstance(node.body, list)]
    docstrings = {id(body[0].value) for body in bodies if body and isinstance(body[0], ast.Expr)}
    for node in strings:
        first = id(node) in docstrings and "cli" not in path.parts
        yield node.lineno, node.value.partition("\n\n")[0] if first else node.value


def faults(texts):
    """Name the number and the phrase of each fault, with its remedy; what is in backticks is a name."""
    for number, text in texts:
        prose = " ".join(re.sub(r"`+[^`]*`+", "…", text).split())
        for phrase, remedy in REMEDIES.items():
            for found in re.finditer(phrase, prose, re.IGNORECASE):
                yield f"line {number}: “{prose[max(found.start() - 30, 0) : found.end() + 20]}”; write: {remedy}"


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_a_page_is_in_plain_words(path):
    assert list(faults(of_page(path))) == []


def test_messages_help_and_docstrings_are_in_plain_words():
    found = [f"{path.relative_to(ROOT)}, {fault}" for path in SOURCES for fault in faults(of_source(path))]
    assert found == []


@pytest.mark.parametrize(
    ("text", "phrase"),
    [
        ("what is found is told", "told"),
        ("the table stands beside the other", "stands"),
        ("one that is none", "that is none"),
        ("A Hinge", "Hinge"),
        ("what is left out is refused", "what is left out is"),
    ],
)
def test_a_phrase_to_avoid_is_found(text, phrase):
    assert any(phrase in fault for fault in faults([(1, text)]))


@pytest.mark.parametrize(
    "text", ["cannot tell envelope from phase", "`tell` is a name", "stand-alone", "taken for granted"]
)
def test_right_english_is_left_alone(text):
    assert list(faults([(1, text)])) == []


def test_prose_alone_is_read(tmp_path):
    (tmp_path / "page.md").write_text("(eq-hinge)=\nwords\n\n    told\n\n```\ntold\n```\ntold\n")
    (tmp_path / "module.py").write_text('"""Words.\n\nTold here."""\nRULE = "told"\n')
    assert [fault.partition(":")[0] for fault in faults(of_page(tmp_path / "page.md"))] == ["line 9"]
    assert [fault.partition(":")[0] for fault in faults(of_source(tmp_path / "module.py"))] == ["line 4"]
