"""How Sphinx lays out the book; book/build.py calls it."""

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

project = "Dollop"
author = "the Dollop developers"
copyright = "2026, the Dollop developers"
html_title = "Dollop"

extensions = ["myst_nb", "sphinx_copybutton"]
myst_enable_extensions = ["dollarmath"]
nb_execution_mode = "off"  # book/build.py has executed them
nb_output_stderr = "remove"
nb_ipywidgets_js = {}  # stills stand in for widgets, so nothing has to come from a network
exclude_patterns = [".doctrees"]

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["book.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "navigation_with_keys": True,
    "light_css_variables": {"color-brand-primary": "#0072B2", "color-brand-content": "#0072B2"},
    "dark_css_variables": {"color-brand-primary": "#56B4E9", "color-brand-content": "#56B4E9"},
}
html_math_renderer = "mathml"


def inline_formula(translator, node):
    """A formula within a line."""
    translator.body.append(tex2mathml(node.astext()))
    raise SkipNode


def block_formula(translator, node):
    """A formula on a line of its own."""
    translator.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise SkipNode


def setup(app):
    """Browsers draw MathML on their own: no script, no network."""
    app.add_html_math_renderer("mathml", (inline_formula, None), (block_formula, None))
