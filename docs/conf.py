"""The documentation as one site: `sphinx-build -E -W -n -c docs . out/docs`, which is `make docs`.

The checkout itself is the source folder, so that a link from any Markdown file to any other is the same on the site as
in the repository, and is checked. Nothing is fetched: equations are MathML (`extensions/mathml.py`), the theme's fonts
are the system's. Links to other sites are checked by hand with `-b linkcheck`, since CI does not depend on them.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "extensions")]

project = "deskew"
author = "the authors of deskew"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "fields",
    "mathml",
    "navigation",
    "public_names",
]

include_patterns = ["*.md", "docs/*.md", "docs/adr/*.md", "docs/api/*.md", "reports/*.md", "reports/*/*.md"]
exclude_patterns = [".*", "out", "outputs", "multirun", "build", "dist", "tests", "deskew", "data_synth", "experiments"]
root_doc = "docs/README"

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
html_math_renderer = "mathml"
suppress_warnings = ["myst.header"]  # a report's page may begin at any level

# Types, shapes and units stand in the docstrings; annotations would say less and take more room.
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
default_role = "code"
nitpicky = True

html_theme = "furo"
html_title = "deskew"
html_copy_source = False
html_show_copyright = False
html_show_sourcelink = False
html_static_path = ["static"]
html_extra_path = ["extra"]  # index.html, which leads to the index of the documentation
html_css_files = ["site.css"]
