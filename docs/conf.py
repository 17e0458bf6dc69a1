"""Settings of the documentation site. `make docs` builds it; `tools/site` writes the pages that come from the code."""

from importlib.metadata import version as version_of

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

project = "armlab"
author = "the authors of armlab"
version = release = version_of("armlab")

extensions = ["myst_nb", "sphinx_copybutton", "sphinxcontrib.bibtex", "sphinxcontrib.mermaid"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_dmath_allow_space = False
myst_dmath_allow_digits = False
myst_fence_as_directive = ["mermaid"]
myst_heading_anchors = 3
nb_execution_mode = "force"  # what the file keeps is for readers of the repository, and may be stale
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # s a cell
nb_output_stderr = "warn"  # which ends the build
bibtex_bibfiles = ["references.bib"]

html_theme = "pydata_sphinx_theme"
html_title = "armlab"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "navigation_with_keys": False,
    "show_nav_level": 1,
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "secondary_sidebar_items": ["page-toc"],
}
copybutton_exclude = ".linenos, .gp, .go"


def _show_math(translator: nodes.NodeVisitor, node: nodes.Element) -> None:
    """MathML, which browsers draw without scripts and fonts from other places."""
    if isinstance(node, nodes.math_block):
        written = f'<div class="equation-block">{convert(node.astext(), display="block")}</div>'
    else:
        written = convert(node.astext(), display="inline")
    translator.body.append(written)
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Registers the renderer of equations."""
    app.add_html_math_renderer("mathml", (_show_math, None), (_show_math, None))
