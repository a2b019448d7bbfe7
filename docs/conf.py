"""The pages of docs/ as a site: `python -m sphinx -W docs build/docs`.

Neither the build nor a reader fetches anything. The pages are plain Markdown. The lists of links in index.md are the navigation.
"""

import sys
from pathlib import Path

import palpate

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "palpate"
copyright = "the palpate developers, MIT licence"
version = release = palpate.__version__
extensions = ["myst_parser", "site_parts"]
# The map of the source is for developers: CONTRIBUTING.md has the link.
exclude_patterns = ["extensions", "generator", "static", "examples", "try", "source.md"]
html_theme = "furo"
html_title = f"palpate {release}"
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_search_scorer = str(Path(__file__).parent / "static" / "scorer.js")
html_show_sphinx = False
html_copy_source = False
html_use_index = False
smartquotes = False
# A contrast of 7 to 1; the package comes with furo.
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"

myst_enable_extensions = ["dollarmath", "amsmath"]
myst_dmath_double_inline = True
myst_heading_anchors = 4
