"""Settings of the documentation site: Sphinx, MyST and furo, without network at build and reading.

`uv run --group docs sphinx-build -W docs docs/_build` builds it.
"""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "twolink"
author = "the twolink contributors"
copyright = "the twolink contributors"
release = version = version_of("twolink")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "extensions.generated",
    "extensions.mathml",
    "extensions.prose",
]
exclude_patterns = ["_build", "extensions", "generated/site"]
suppress_warnings = ["config.cache"]
nitpicky = False

myst_enable_extensions = ["dollarmath", "deflist", "attrs_block"]
myst_heading_anchors = 3
# A missing page or heading must be an error, not a download.
myst_all_links_external = False
math_numfig = False

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
default_role = "code"

html_theme = "furo"
html_title = f"twolink {release}"
html_math_renderer = "mathml"
html_static_path = ["_static"]
# Pages that play the films of the gallery.
html_extra_path = ["generated/site"]
html_css_files = ["twolink.css"]
html_js_files = ["accessible.js"]
html_copy_source = False
html_show_sphinx = False
# Highlighting with a contrast of at least 4.5 to 1.
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"
html_theme_options = {"source_edit_link": "", "navigation_with_keys": True}
