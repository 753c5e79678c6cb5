"""Sphinx: the pages of this folder, the package's own docstrings, and what is made from both while building."""

import gc
import hashlib
import os
import re
import shutil
import subprocess
import sys
import zlib
from pathlib import Path

from docutils.nodes import SkipNode, Text
from docutils.utils.math.latex2mathml import tex2mathml
from pybtex.plugin import register_plugin
from pybtex.style.formatting.unsrt import Style as UnsrtStyle
from pybtex.style.labels import BaseLabelStyle
from sphinx.addnodes import toctree
from sphinx.errors import ExtensionError
from sphinx.pycode.parser import Parser
from sphinx.util.logging import getLogger

from vibrissa import __version__

sys.path.insert(0, str(Path(__file__).parent))  # of the directive ``pictured``

project = "vibrissa"
author = "The vibrissa developers"
release = __version__


class AuthorYear(BaseLabelStyle):
    """Label a work by its authors and its year, as the text names it."""

    def format_labels(self, entries):
        """Give the label of each work."""
        for entry in entries:
            names = [" ".join(person.last_names) for person in entry.persons["author"]]
            shown = names[0] if len(names) == 1 else " and ".join(names) if len(names) == 2 else f"{names[0]} et al."
            yield f"{shown} {entry.fields['year']}"


class References(UnsrtStyle):
    """The list of references, by author."""

    default_sorting_style = "author_year_title"
    default_label_style = AuthorYear


register_plugin("pybtex.style.formatting", "author_year_labels", References)

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinxcontrib.bibtex",
    "pictured",
]
templates_path = ["_templates"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
nb_execution_timeout = 120
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_merge_streams = True
copybutton_prompt_text = "$ "
bibtex_bibfiles = ["references.bib"]
bibtex_reference_style = "author_year"
bibtex_default_style = "author_year_labels"
myst_heading_anchors = 3
autosummary_generate = True
shutil.rmtree(Path(__file__).parent / "_build" / "api", ignore_errors=True)  # it may hold modules that are gone
gc.set_threshold(100_000, 50, 100)  # a page points both ways: the collector would walk all of it again and again
Parser.parse_definition = lambda self: None  # where each function ends: unused here, and two fifths of the time
autodoc_use_type_comments = False  # there are none, and looking for them parses every function
autodoc_typehints = "none"  # the docstrings say shape and unit, which types cannot
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_param = napoleon_use_rtype = False  # a type is said in words: no link is made of "row" or "x"
# beside the HTML lie the pages of autosummary, in _build/api, which are read
exclude_patterns = ["_build/html", "_build/jupyter_execute", "_build/notebooks-*", "_templates"]
nitpicky = True  # a name that leads nowhere is a warning; words of shapes and units, which have no dot, are no names
nitpick_ignore_regex = [("py:class", r"[^.]*")]
suppress_warnings = [
    "myst-nb.lexer",  # of notebooks that are not run
    "ref.python",  # a name that two modules have, as attributes
]

html_theme = "pydata_sphinx_theme"
html_title = f"vibrissa {release}"
html_show_sourcelink = False
html_theme_options = {"navbar_center": [], "show_prev_next": True}
html_math_renderer = "mathml"  # every browser draws it, with the font beside it; MathJax would come from elsewhere
html_static_path = ["_static"]
html_css_files = ["style.css"]
html_js_files = ["enlarge.js"]

ACCENTED = re.compile(  # what tex2mathml makes of an accent with a subscript: it puts the subscript under the letter
    r"<munderover>\s*(<mi>[^<]*</mi>)\s*(<m(?:i|row)>.*?</m(?:i|row)>)\s*(<mo[^>]*>[¨˙ˆ¯]</mo>)\s*</munderover>",
    re.DOTALL,
)
EQUATION = re.compile(r"Eqs?\.\s+\((\d+)\)\s+of\s+\[Boubenec2014\]_")
UPPER = re.compile(  # the upper limit of an integral, which browsers put on its slanted sign
    r"(<msubsup>\s*<mo>∫</mo>\s*(?:<m[ino]>[^<]*</m[ino]>|<mrow>.*?</mrow>)\s*)"
    r"(<m[ino]>[^<]*</m[ino]>|<mrow>.*?</mrow>)(\s*</msubsup>)",
    re.DOTALL,
)
FUNCTION = re.compile(r"<m[io][^>]*>(?:sin|cos|det)</m[io]>(?!\s*<mo[^>]*>\()")  # of what no bracket separates it from
PICTURES = os.environ.get("VIBRISSA_GALLERY") != "0"  # without them, notebooks are not run either
HERE = Path(__file__).parent
GALLERY, MADE_BY, LEARN = HERE / "_build" / "gallery", "made-by.txt", "learn/"


def fingerprint():
    """Give the hash of the package: figures and outputs of notebooks are kept by it."""
    found = hashlib.sha256()
    for path in sorted(
        [HERE / "make_gallery.py", *HERE.parent.glob("src/**/*.py"), *HERE.parent.glob("src/**/*.mplstyle")]
    ):
        found.update(path.read_bytes())
    return found.hexdigest()


nb_execution_mode = "cache" if PICTURES else "off"
nb_execution_cache_path = str(HERE / "_build" / f"notebooks-{fingerprint()[:12]}")
OTHERS = {  # what the pages name of other packages, which links without a network too
    "xarray": ("https://docs.xarray.dev/en/stable/", ("Dataset", "DataArray", "open_dataset", "open_zarr")),
    "pandas": ("https://pandas.pydata.org/docs/", ("DataFrame",)),
}


def known(package, names):
    """Write the list of a package's names that is taken where its own cannot be reached."""
    lines = "".join(
        f"{package}.{name} py:{'class' if name[0].isupper() else 'function'} 1 GENERATED/{package}.{name}.html#$ -\n"
        for name in names
    ).replace("GENERATED", "generated" if package == "xarray" else "reference/api")
    head = f"# Sphinx inventory version 2\n# Project: {package}\n# Version: \n# compressed using zlib.\n"
    path = Path(__file__).parent / "_build" / f"{package}.inv"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(head.encode() + zlib.compress(lines.encode()))
    return str(path)


intersphinx_mapping = {
    package: (address, (None, known(package, names)) if PICTURES else known(package, names))
    for package, (address, names) in OTHERS.items()
}
intersphinx_timeout = 3
html_sidebars = {"**": ["contents.html"]}


def cite(app, what, name, obj, options, lines):
    """Let the docstrings' [Key]_ lead to the page of references."""
    lines[:] = [re.sub(r"\[([A-Z]\w+\d{4}\w?)\]_", r":cite:t:`\1`", line) for line in lines]


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


def contents(app, pagename, templatename, context, doctree):
    """Give the sidebar all pages under their captions, once; Sphinx's own would search the whole tree for each page."""
    if not hasattr(app, "contents"):
        titles, trees = app.env.titles, app.env.get_doctree("index").findall(toctree)
        app.contents = [
            (tree["caption"], [(page, titles[page].astext()) for page in tree["includefiles"]]) for tree in trees
        ]
    context["contents"] = app.contents


def begin_gallery(app):
    """Begin to make the figures of this package, if they are not there, while the pages without them are read."""
    made_by = GALLERY / MADE_BY
    app.gallery = app.notebooks = None
    if PICTURES:
        app.notebooks = subprocess.Popen(
            [sys.executable, HERE / "run_notebooks.py", nb_execution_cache_path, str(nb_execution_timeout)]
        )
    if PICTURES and not (made_by.exists() and made_by.read_text() == fingerprint()):
        getLogger(__name__).info(
            "figures of the gallery: two minutes, or less if ``python3 run.py`` was run, beside pages and notebooks"
        )
        shutil.rmtree(GALLERY, ignore_errors=True)
        app.gallery = subprocess.Popen([sys.executable, HERE / "make_gallery.py", GALLERY])


def pages_of_figures_last(app, env, docnames):
    """Read notebooks after other pages, and those that show figures of the gallery last."""
    gallery = {name: "_build/gallery/" in Path(env.doc2path(name)).read_text(encoding="utf-8") for name in docnames}
    docnames.sort(key=lambda name: (gallery[name], name.startswith(LEARN)))


def end_notebooks(app, docname, source):
    """Wait for the outputs of all notebooks before the first one is read."""
    if docname.startswith(LEARN) and app.notebooks is not None:
        if app.notebooks.wait():
            raise ExtensionError("docs/run_notebooks.py failed: see above")
        app.notebooks = None


def end_gallery(app):
    """Wait for the figures."""
    if app.gallery is not None:
        if app.gallery.wait():
            raise ExtensionError("docs/make_gallery.py failed: see above")
        (GALLERY / MADE_BY).write_text(fingerprint())
        app.gallery = None


def stop_gallery(app, exception):
    """End what makes figures and outputs if the build has failed."""
    for work in filter(None, (app.gallery, app.notebooks)):
        work.terminate()


def shorten_remarks(app, doctree):
    """Leave out of what notebooks print where in a file a remark was issued."""
    for block in doctree.findall(lambda node: node.tagname == "literal_block" and "Remark: " in node.astext()):
        text = re.sub(r"^\S+:\d+: (Remark: .*)\n(?:[ ]+.*\n?)?", r"\1\n", block.astext(), flags=re.MULTILINE)
        block.rawsource, block.children = text, []
        block += Text(text)


def mathml(*, block):
    """Give what writes a formula as MathML."""

    def visit(self, node):
        formula = tex2mathml(node.astext(), as_block=block)
        formula = formula.replace("<mo>'</mo>", '<mo lspace="0" rspace="0.04em">′</mo>')
        formula = FUNCTION.sub(r'\g<0><mspace width="0.1667em"></mspace>', formula)
        formula = UPPER.sub(r'\1<mrow><mspace width="0.7em"></mspace>\2</mrow>\3', formula)
        formula = formula.replace('display="block"', 'display="block" style="margin: 0.8em 0"')
        self.body.append(ACCENTED.sub(r'<msub><mover accent="true">\1\3</mover>\2</msub>', formula))
        raise SkipNode

    return visit


def setup(app):
    """Hook all of it in."""
    app.add_html_math_renderer("mathml", (mathml(block=False), None), (mathml(block=True), None))
    app.connect("builder-inited", begin_gallery)
    app.connect("env-before-read-docs", pages_of_figures_last)
    app.add_event("figures-wanted")
    app.connect("figures-wanted", end_gallery)
    app.connect("source-read", end_notebooks)
    app.connect("build-finished", stop_gallery)
    app.connect("html-page-context", contents)
    app.connect("doctree-read", shorten_remarks)
    app.connect("autodoc-process-docstring", bars)
    app.connect("autodoc-process-docstring", lead_to_theory)
    app.connect("autodoc-process-docstring", cite)
    app.connect("autodoc-skip-member", skip_fields)
