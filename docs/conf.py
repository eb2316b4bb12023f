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

extensions = ["myst_parser", "extensions.mathml"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "soak.md"]

html_theme = "furo"
html_title = f"{project} {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
# Summaries are fetched, which browsers refuse to pages that are opened as files.
html_show_search_summary = False
