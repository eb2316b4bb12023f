"""Sphinx configuration; `make docs` builds the pages."""

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

_HERE = Path(__file__).parent
_PROJECT = tomllib.loads((_HERE.parent / "pyproject.toml").read_text())["project"]
sys.path.insert(0, str(_HERE))  # for extensions/

project = _PROJECT["name"]
release = version = _PROJECT["version"]
author = copyright = "the continuair authors"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "extensions.mathml",
]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "gallery/*.ipynb", "gallery/*.py", "gallery/*.zip"]

add_module_names = False
default_role = "py:obj"
napoleon_google_docstring = False
autodoc_typehints = "none"  # docstrings give the types
# Shapes, such as (runs, 3), name dimensions as properties of several classes are called.
suppress_warnings = ["ref.python"]
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True

sphinx_gallery_conf = {
    "examples_dirs": str(_HERE.parent / "examples" / "gallery"),
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "notebook_extensions": set(),
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
}

html_theme = "furo"
html_title = f"{project} {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
# Summaries are fetched, which browsers refuse to pages that are opened as files.
html_show_search_summary = False


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-docstring", keep_bars)


def keep_bars(*arguments: Any) -> None:
    """Escape the bars of absolute values, such as |κ|, which would name substitutions."""
    lines = arguments[-1]
    lines[:] = [
        re.sub(r"(?<![\w`|\\])\|([^|\s`][^|`]*)\|(?![\w`|])", r"\\|\1\\|", x) for x in lines
    ]
