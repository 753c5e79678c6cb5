"""Sphinx: the pages of this folder, and the package's own docstrings."""

import re
from pathlib import Path

from vibrissa import __version__

project = "vibrissa"
author = "The vibrissa developers"
release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
autosummary_generate = True
autodoc_typehints = "none"  # the docstrings say shape and unit, which types cannot
napoleon_google_docstring = False
exclude_patterns = ["_build/html"]  # the pages of autosummary lie beside it, in _build/api
suppress_warnings = ["ref.citation"]  # a reference may be listed before a docstring cites it

html_theme = "pydata_sphinx_theme"
html_show_sourcelink = False

ENTRY = re.compile(r"@\w+\{(?P<key>\w+),(?P<fields>.*?)^\}", re.DOTALL | re.MULTILINE)
FIELD = re.compile(r"^ *(\w+) *= \{(.*)\},$", re.MULTILINE)


def citation(entry):
    """Print one entry of references.bib as the target of the docstrings' [Key]_."""
    of = dict(FIELD.findall(entry["fields"]))
    authors = of["author"].replace(" and ", "; ")
    pages = of["pages"].replace("--", "–")
    where = f"{of['journal']} {of['volume']}, {pages} ({of['year']})"
    return f".. [{entry['key']}] {authors}. {of['title']}. {where}. doi: {of['doi']}\n"


def list_references(app, docname, source):
    """Fill the page of references from references.bib, the one place they are kept in."""
    if docname == "references":
        bib = Path(app.srcdir, "references.bib").read_text(encoding="utf-8")
        source[0] += "\n" + "\n".join(citation(entry) for entry in ENTRY.finditer(bib))


def setup(app):
    """Hook the list of references in."""
    app.connect("source-read", list_references)
