"""The site: Sphinx reads the repository's own pages where they lie, and those that `made` writes from the program.

The source folder is the repository, so that a link works in the repository as on the site.
"""

import os
import sys
from pathlib import Path

FOLDER = Path(__file__).parent
ROOT = FOLDER.parents[1]
sys.path[:0] = [str(ROOT), str(FOLDER), str(ROOT / "tests/support")]
# the kernels of the notebooks import from the same folders
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])

import made  # noqa: E402
from docutils import nodes  # noqa: E402

import patchfem  # noqa: E402

project = "patchfem"
author = "The patchfem founders"
copyright = "The patchfem founders, MIT licence"
version = release = patchfem.__version__
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "equations",
]
napoleon_google_docstring = False
root_doc = "studies/site/index"
include_patterns = [
    "README.md",
    "patchfem/*.md",
    "patchfem/scene/*.md",
    "patchfem/scene/guide/*.md",
    "studies/*.md",
    "studies/*/README.md",
    "studies/report/*.md",
    "studies/notebooks/*.ipynb",
    "studies/site/**.md",
    "tests/README.md",
]
exclude_patterns = [".venv", ".git", "out", "dist", "studies/site/README.md", "**/.*"]
myst_enable_extensions = ["dollarmath", "deflist", "html_image"]
myst_heading_anchors = 4
nb_execution_mode = "cache"
nb_execution_cache_path = str(ROOT / "out/site.cache")
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "none"
html_theme = "pydata_sphinx_theme"
html_math_renderer = "mathml"
html_title = "patchfem"
html_show_sourcelink = False
html_copy_source = False
html_static_path = []
html_search_scorer = str(FOLDER / "scorer.js")
html_theme_options = {
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "navigation_depth": 3,
    "footer_start": ["copyright"],
    "footer_end": [],
    "logo": {"text": "patchfem"},
}
# without this value the theme reports an invalid mode on the first page of a visit
html_context = {"default_mode": "auto"}
# a page of the repository may begin without a first-level heading
suppress_warnings = ["myst.header"]


def setup(app) -> None:
    """Write the generated pages before any page is read, and a first page for browsers at the end."""
    app.connect("builder-inited", lambda app: made.write(FOLDER / "made"))
    app.connect("doctree-read", _name_pictures)
    app.connect("build-finished", _front)


def _name_pictures(app, doctree) -> None:
    """Give pictures that code cells draw the heading above them as alternative text instead of their file name."""
    for image in doctree.findall(nodes.image):
        above = image
        while above.parent and not isinstance(above, nodes.section):
            above = above.parent
        image.setdefault(
            "alt", f"Picture drawn by the code above: {above.next_node(nodes.title).astext()}"
        )


def _front(app, fault) -> None:
    if fault is None and app.builder.name == "html":
        (Path(app.outdir) / "index.html").write_text(
            '<!doctype html><meta http-equiv="refresh" content="0; url=studies/site/index.html">'
            '<a href="studies/site/index.html">patchfem</a>',
            "utf-8",
        )
