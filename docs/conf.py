"""The guide: pages written by hand, and the reference of keys, methods and names made of the package itself.

pip install -e ".[docs]"
sphinx-build -W --keep-going docs docs/_build
"""

import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "simrail"
author = "The simrail developers"
release = metadata.version("simrail")

extensions = ["generated", "myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build"]

html_theme = "pydata_sphinx_theme"
html_title = "simrail"
html_show_sourcelink = False
html_sidebars = {"*": []}  # pages that stand alone; those in folders list their neighbours
html_theme_options = {
    "show_prev_next": True,
    "navigation_with_keys": True,
    "secondary_sidebar_items": ["page-toc"],
}

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3

autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_validation_checks = set()
