"""The guide: pages written by hand, and the reference of keys, methods and names made of the package itself.

pip install -e ".[docs]"
sphinx-build -W --keep-going docs docs/_build
"""

import sys
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

MATHJAX = find_spec("sphinx-mathjax-offline")
assert MATHJAX is not None, 'pip install -e ".[docs]"'
assert MATHJAX.submodule_search_locations is not None

project = "simrail"
author = "The simrail developers"
release = metadata.version("simrail")

extensions = ["generated", "myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "_figures", "method_equations"]

html_theme = "pydata_sphinx_theme"
html_title = "simrail"
html_context = {"default_mode": "auto"}  # else the theme calls it an error that nobody has chosen
html_show_sourcelink = False
html_css_files = ["guide.css"]
# Equations are set by one file that lies beside the pages: they need no network either.
html_static_path = [
    "_static",
    str(next(Path(place) for place in MATHJAX.submodule_search_locations) / "static/mathjax/tex-svg-full.js"),
]
mathjax_path = "tex-svg-full.js"
html_sidebars = {"*": []}  # pages that stand alone; those in folders list their neighbours
html_theme_options = {
    "show_prev_next": True,
    "header_links_before_dropdown": 6,
    "navigation_with_keys": True,
    "secondary_sidebar_items": ["page-toc"],
}

myst_enable_extensions = ["amsmath", "dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3

default_role = "literal"
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_validation_checks = set()
