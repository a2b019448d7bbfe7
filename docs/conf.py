"""The pages of docs/ as a site: `python -m sphinx -W docs build/docs`. Nothing is fetched, here or by a reader."""

import sys
from enum import Enum
from pathlib import Path
from typing import Any

import palpate

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "palpate"
copyright = "the palpate developers, MIT licence"
version = release = palpate.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "site_parts",
    "cpp_reference",
]
exclude_patterns = ["extensions", "templates", "static"]
templates_path = ["templates"]
html_theme = "furo"
html_title = f"palpate {release}"
html_math_renderer = "mathml"
html_static_path, html_css_files = ["static"], ["site.css"]
html_search_scorer = str(Path(__file__).parent / "static" / "scorer.js")
html_show_sphinx = html_copy_source = False
# A contrast of 7 to 1; the package comes with furo.
pygments_style, pygments_dark_style = "a11y-high-contrast-light", "a11y-high-contrast-dark"

myst_enable_extensions = ["dollarmath", "amsmath"]
myst_dmath_double_inline = True
myst_heading_anchors = 3

autosummary_generate_overwrite = True
# cusum and Cusum: one file where names of files know no case.
autosummary_filename_map = {"palpate.design.Cusum": "palpate.design.Cusum-class"}
default_role = "py:obj"  # names in docstrings become links where they are known
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints = "none"  # the docstrings say more
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_param = False
# "low, high : float" is one entry of two names
napoleon_custom_sections = [("Attributes", "params_style")]
# Types are in words: shapes, units, ranges.
nitpick_ignore_regex = [("py:.*", ".*"), ("cpp:.*", ".*")]
# the namespace, on each page of a header
suppress_warnings = ["ref.python", "duplicate_declaration.cpp"]


def setup(app: Any) -> None:
    """Connect what autodoc and napoleon need to show the docstrings as they are written."""
    written: dict[str, list[str]] = {}

    def keep(_app: Any, what: str, name: str, _value: Any, _options: Any, lines: list[str]) -> None:
        if what == "property":
            written[name] = list(lines)

    def restore(
        _app: Any, _what: str, name: str, _value: Any, _options: Any, lines: list[str]
    ) -> None:
        lines[:] = written.pop(name, lines)

    def skip(
        _app: Any, _what: str, name: str, value: Any, _skip: bool, _options: Any
    ) -> bool | None:
        if isinstance(value, Enum) and not name.startswith("_"):
            return False
        return True if type(value).__name__ == "_tuplegetter" else None

    def level(_app: Any, _page: str, _template: str, context: dict[str, Any], _tree: Any) -> None:
        context["furo_navigation_tree"] = context["furo_navigation_tree"].replace(
            'role="heading"', 'role="heading" aria-level="2"'
        )

    # Sphinx gives the captions of the navigation the role of a heading, without a level.
    app.connect("html-page-context", level, priority=900)
    # Napoleon would take the text before a property's first colon for its type.
    app.connect("autodoc-process-docstring", keep, priority=400)
    app.connect("autodoc-process-docstring", restore, priority=600)
    # Members of an enumeration are shown; the fields of a named tuple stand in its docstring already.
    app.connect("autodoc-skip-member", skip)
