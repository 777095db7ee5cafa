"""How Sphinx lays out the book; book/build.py calls it.

The API pages come from the docstrings by extensions that are part of Sphinx: autodoc reads them,
napoleon understands their numpydoc sections. (autosummary could write the pages, but it takes the
module dollop.laps for the function.)
"""

import os
import re
import sys
from importlib.util import find_spec
from pydoc import locate

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.addnodes import pending_xref
from sphinx.util.logging import getLogger
from sphinx.util.nodes import make_refnode

project = "Dollop"
author = "the Dollop developers"
copyright = "2026, the Dollop developers"
html_title = "Dollop"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]
myst_enable_extensions = ["dollarmath", "html_image"]
myst_heading_anchors = 3  # as GitHub has them
nb_execution_mode = "off"  # book/build.py has executed them
nb_output_stderr = "remove"
nb_code_prompt_show = nb_code_prompt_hide = "Solution"  # what exercises hide
nb_ipywidgets_js = {}  # stills stand in for widgets, so nothing has to come from a network
exclude_patterns = [".doctrees"]

default_role = "py:obj"  # single backticks in docstrings become links where they can
add_module_names = False
toc_object_entries_show_parents = "hide"
autodoc_member_order = "bysource"
autodoc_mock_imports = [name for name in ("pybullet",) if find_spec(name) is None]
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["book.css"]
html_js_files = ["book.js", ("buttons.js", {"data-repository": os.environ.get("GITHUB_REPOSITORY", "")})]
html_show_sourcelink = False
html_copy_source = False
html_domain_indices = False  # the first page of the API has the modules, in the order of the paper
html_theme_options = {
    "navigation_with_keys": True,
    "light_css_variables": {"color-brand-primary": "#0072B2", "color-brand-content": "#0072B2"},
    "dark_css_variables": {"color-brand-primary": "#56B4E9", "color-brand-content": "#56B4E9"},
}
html_math_renderer = "mathml"

LOG = getLogger(__name__)
SHORT = {"function", "class", "exception", "data"}
MEMBERS = {"method", "classmethod", "staticmethod", "property", "attribute"}


def inline_formula(translator, node):
    """A formula within a line."""
    translator.body.append(tex2mathml(node.astext()))
    raise SkipNode


def block_formula(translator, node):
    """A formula on a line of its own."""
    translator.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise SkipNode


def plain_text_first(app, what, name, thing, options, lines):
    """Docstrings are written to be read as they are: |x| is a length there, `.law` an attribute."""
    for n, line in enumerate(lines):
        prose = line if line[:1] in ("", " ", ">", "=") else line.replace("|", r"\|")
        lines[n] = re.sub(r"(?<!`)`(\.\w[\w.()]*)`(?!`)", r"``\1``", prose)
    if what in ("property", "attribute", "data"):
        lines[:0] = ["..", ""]  # a comment, or napoleon takes what stands before a colon for a type


def formulas_as_they_stand(app, what, name, thing, options, lines):
    """Keep the lines and signs of a formula: an indented block after a paragraph is literal."""
    for n in range(len(lines) - 2, 0, -1):
        before = next(filter(None, reversed(lines[:n])), " ")
        if lines[n] == "" and lines[n + 1].startswith("    ") and before[0] not in " .":
            lines[n:n] = ["", "::"]


def told_elsewhere(app, what, name, thing, skip, options):
    """Leave out what a package only hands on, and the fields of a NamedTuple: all have entries."""
    if type(thing).__name__ == "_tuplegetter":
        return True
    if what != "module" or not hasattr(thing, "__qualname__"):
        return None
    return True if thing.__module__ != app.env.current_document.autodoc_module else None


def by_what_the_module_sees(app, doctree):
    """Give a name its full one where its module, or one beside it, has it: two wings may have a `Way` each."""
    for node in doctree.findall(pending_xref):
        module, target = node.get("py:module"), node.get("reftarget", "")
        if node.get("refdomain") == "py" and module and target.replace(".", "").isidentifier():
            node["reftarget"] = full_name(target, module) or target


def full_name(target, module):
    """Where a public name that a module uses is defined; None if that is not plain."""
    if "." in target:
        things = [locate(target)] if target.startswith("dollop.") else []
    else:
        beside = [name for name in sorted(sys.modules) if name.rpartition(".")[0] == module.rpartition(".")[0]]
        things = [getattr(sys.modules[name], target, None) for name in (module, *beside) if name in sys.modules]
    for thing in things:
        home = getattr(thing, "__module__", None)
        name = getattr(thing, "__qualname__", "")
        if callable(thing) and name in getattr(sys.modules.get(home), "__all__", ()):
            return f"{home}.{name}"
    return None


def by_short_name(app, env, node, contnode):
    """Link a short name (`observe`, `LDS.fit`) to its entry, if only one object is called so.

    What begins with the package's name has an entry, or the build fails; `dollop.lab.Pioneer` has
    it in the module that the wing's door leads to.
    """
    if node.get("refdomain") != "py":
        return None
    objects = env.domains.python_domain.objects
    if not CALLED:
        CALLED.update(by_endings(objects))
    parts = node["reftarget"].removeprefix("dollop.").split(".")
    endings = (".".join(parts[n:]) for n in range(len(parts)))
    found = next((CALLED[ending] for ending in endings if ending in CALLED), [])
    if len(found) == 1:
        to = objects[found[0]]
        return make_refnode(app.builder, node["refdoc"], to.docname, to.node_id, contnode, found[0])
    if node["reftarget"].startswith("dollop."):
        LOG.warning("no entry for %s", node["reftarget"], location=node)
    return None


CALLED = {}
"""Full names by what they end in, once all pages are read."""


def by_endings(objects):
    """Full names of the objects, by every ending; what belongs to a class only with its class."""
    called = {}
    for name, to in objects.items():
        parts = name.split(".")
        first = 1 if to.objtype in SHORT else 2
        if to.objtype in SHORT | MEMBERS:
            for length in range(first, len(parts)):
                called.setdefault(".".join(parts[-length:]), []).append(name)
    return called


def setup(app):
    """Browsers draw MathML on their own: no script, no network."""
    app.add_html_math_renderer("mathml", (inline_formula, None), (block_formula, None))
    for prepare in (plain_text_first, formulas_as_they_stand):
        app.connect("autodoc-process-docstring", prepare, priority=400)  # before napoleon
    app.connect("autodoc-skip-member", told_elsewhere)
    app.connect("doctree-read", by_what_the_module_sees)
    app.connect("missing-reference", by_short_name)
