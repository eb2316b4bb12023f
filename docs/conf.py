"""Sphinx configuration; `make docs` builds the pages."""

import sys
import tomllib
from pathlib import Path

_HERE = Path(__file__).parent
_PROJECT = tomllib.loads((_HERE.parent / "pyproject.toml").read_text())["project"]
sys.path.insert(0, str(_HERE))  # for extensions/

project = _PROJECT["name"]
release = version = _PROJECT["version"]
author = copyright = "the continuair authors"

extensions = ["myst_parser", "sphinx.ext.autodoc", "extensions.mathml", "extensions.prose"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "soak.md"]

add_module_names = False
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"{project} {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
# Summaries are fetched, which browsers refuse to pages that are opened as files.
html_show_search_summary = False
