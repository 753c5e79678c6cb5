"""Sphinx: the pages of this folder, the package's own docstrings, and what is made from both while building."""

import gc
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

from vibrissa import __version__

project = "vibrissa"
author = "The vibrissa developers"
release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
]
templates_path = ["_templates"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
nb_execution_timeout = 120
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_merge_streams = True
copybutton_prompt_text = "$ "
myst_heading_anchors = 3
autosummary_generate = True
shutil.rmtree(Path(__file__).parent / "_build" / "api", ignore_errors=True)  # it may hold modules that are gone
gc.set_threshold(100_000, 50, 100)  # a page points both ways: the collector would walk all of it again and again
autodoc_use_type_comments = False  # there are none, and looking for them parses every function
autodoc_typehints = "none"  # the docstrings say shape and unit, which types cannot
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_param = napoleon_use_rtype = False  # a type is said in words: no link is made of "row" or "x"
# beside the HTML lie the pages of autosummary, in _build/api, which are read
exclude_patterns = ["_build/html", "_build/jupyter_execute", "_build/.jupyter_cache", "_templates"]
suppress_warnings = [
    "myst-nb.lexer",  # of notebooks that are not run
    "ref.citation",  # a reference may be listed before a docstring cites it
    "ref.python",  # a name that two modules have, as attributes
]

html_theme = "pydata_sphinx_theme"
html_show_sourcelink = False
html_theme_options = {"navbar_center": [], "show_prev_next": False}
html_math_renderer = "mathml"  # every browser draws it; MathJax would come from elsewhere

ENTRY = re.compile(r"@\w+\{(?P<key>\w+),(?P<fields>.*?)^\}", re.DOTALL | re.MULTILINE)
FIELD = re.compile(r"^ *(\w+) *= \{(.*)\},$", re.MULTILINE)
ACCENTED = re.compile(  # what tex2mathml makes of an accent with a subscript: it puts the subscript under the letter
    r"<munderover>\s*(<mi>[^<]*</mi>)\s*(<m(?:i|row)>.*?</m(?:i|row)>)\s*(<mo[^>]*>[¨˙ˆ¯]</mo>)\s*</munderover>",
    re.DOTALL,
)
EQUATION = re.compile(r"Eqs?\.\s+\((\d+)\)\s+of\s+\[Boubenec2014\]_")
PICTURES = os.environ.get("VIBRISSA_GALLERY") != "0"  # without them and the sidebar the build takes a third as long
nb_execution_mode = "cache" if PICTURES else "off"  # outputs of notebooks that have not changed are kept
if PICTURES:  # the lists of names come from elsewhere
    intersphinx_mapping = {
        "numpy": ("https://numpy.org/doc/stable/", None),
        "xarray": ("https://docs.xarray.dev/en/stable/", None),
    }
    intersphinx_timeout = 3
html_sidebars = {"**": ["globaltoc.html"] if PICTURES else []}  # all pages under their captions, beside each of them


def citation(entry):
    """Print one entry of references.bib as the target of the docstrings' [Key]_."""
    of = dict(FIELD.findall(entry["fields"]))
    authors = of["author"].replace(" and ", "; ")
    pages = of["pages"].replace("--", "–")
    work = f"{of['journal']} {of['volume']}" if "journal" in of else of["booktitle"]
    where = f"{work}, {pages} ({of['year']})"
    return f".. [{entry['key']}] {authors}. {of['title']}. {where}. doi: {of['doi']}\n"


def complete(app, docname, source):
    """Fill the page of references from references.bib; leave out the gallery's pictures where none are made."""
    if docname == "references":
        bib = Path(app.srcdir, "references.bib").read_text(encoding="utf-8")
        source[0] += "\n" + "\n".join(citation(entry) for entry in ENTRY.finditer(bib))
    if docname == "gallery" and not PICTURES:
        source[0] = re.sub(r"^!\[.*", "*(left out of this build)*", source[0], flags=re.MULTILINE)


def lead_to_theory(app, what, name, obj, options, lines):
    """Let a docstring that has an equation of the paper lead to where the page of theory derives or corrects it."""
    numbers = sorted(map(int, set(EQUATION.findall("\n".join(lines)))))
    if numbers:
        lines += ["", ".. seealso:: Theory: " + ", ".join(f":ref:`Eq. {n} <eq-{n}>`" for n in numbers)]


def bars(app, what, name, obj, options, lines):
    """Keep |x| for what it is, a modulus; reStructuredText would take it for a substitution."""
    for i, line in enumerate(lines):
        if "|" in line and not line.lstrip().startswith(">>>"):
            parts = re.split(r"(``.*?``)", line)
            lines[i] = "".join(part if part.startswith("``") else part.replace("|", r"\|") for part in parts)


def skip_fields(app, what, name, obj, skip, options):
    """Leave out the fields of named tuples, which the docstring of the class describes, and what matplotlib adds."""
    written = str(getattr(obj, "__doc__", "")).startswith("Alias for field number")
    return True if written or hasattr(obj, "_autogenerated_signature") else None


def make_gallery(app):
    """Make the figures, in a process of its own: it starts others."""
    if PICTURES:
        make = Path(app.srcdir, "make_gallery.py")
        subprocess.run([sys.executable, make, Path(app.srcdir, "_build/gallery")], check=True)


def mathml(*, block):
    """Give what writes a formula as MathML."""

    def visit(self, node):
        formula = tex2mathml(node.astext(), as_block=block)
        formula = formula.replace('display="block"', 'display="block" style="margin: 0.8em 0"')
        self.body.append(ACCENTED.sub(r'<msub><mover accent="true">\1\3</mover>\2</msub>', formula))
        raise SkipNode

    return visit


def setup(app):
    """Hook all of it in."""
    app.add_html_math_renderer("mathml", (mathml(block=False), None), (mathml(block=True), None))
    app.connect("builder-inited", make_gallery)
    app.connect("source-read", complete)
    app.connect("autodoc-process-docstring", bars)
    app.connect("autodoc-process-docstring", lead_to_theory)
    app.connect("autodoc-skip-member", skip_fields)
