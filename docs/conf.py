"""The site: `uv run sphinx-build -W docs docs/_build`, then open docs/_build/index.html."""

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "mjnav"
author = copyright = "mjnav contributors"
version = release = installed_version("mjnav")

extensions = ["myst_parser", "sphinx_copybutton", "drawn", "formulas", "generated", "links", "made_by"]
exclude_patterns = ["_build", "_pictures"]
nitpicky = True

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
html_math_renderer = "mathml"

html_theme = "furo"
html_title = "mjnav"
html_show_sphinx = False
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
copybutton_exclude = ".linenos, .gp, .go"  # the prompts and the output of a console

# Types in signatures are text: NumPy's and Python's own pages are not of this site.
nitpick_ignore_regex = [("py:.*", ".*")]
python_maximum_signature_line_length = 100
