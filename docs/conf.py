"""Settings of sphinx for the documentation site; docs/build_site.py lays out the sources and calls it."""

from __future__ import annotations

import re
from importlib.metadata import version as version_of
from typing import Any

project = "Curved-crease workbench"
author = "The bar-and-hinge workbench authors"
release = version_of("curved-crease-workbench")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
myst_heading_anchors = 3
myst_links_external_new_tab = False
exclude_patterns = ["examples/*.py"]
suppress_warnings = ["misc.highlighting_failure"]  # scenes are TOML with our own comments

html_theme = "furo"
html_title = "Curved-crease workbench"
html_static_path = ["viewer"]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0b4f86", "color-brand-content": "#0b4f86"}
}

default_role = "py:obj"  # `names` in docstrings link to what they name, where that is public
# the tree of pages on every page has pages, not names: an eighth of the time went into it
toc_object_entries = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_default_options = {"exclude-members": "__init__, __weakref__"}
python_use_unqualified_type_names = True
napoleon_google_docstring, napoleon_numpy_docstring = True, False
napoleon_use_ivar = True


def _plain(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain text with `names`: what would be markup of reStructuredText in them is not."""
    for index, line in enumerate(lines):
        parts = re.split(r"(``?[^`]*``?)", line)
        lines[index] = "".join(
            part if part.startswith("`") else re.sub(r"(?<!\\)([|*])|(?<=\w)(_)(?!\w)", r"\\\1\2", part)
            for part in parts
        )


def setup(app: Any) -> None:
    # before napoleon, which makes markup of its own
    app.connect("autodoc-process-docstring", _plain, priority=100)
