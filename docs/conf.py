"""How the site is built; ``make docs`` does it, with warnings as errors and without a network."""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import generated  # noqa: E402

generated.write(HERE / "_generated")

project = "nlpweld"
author = "The nlpweld authors"
version = release = version_of("nlpweld")
extensions = ["myst_parser", "mathml"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "_generated"]
html_theme = "furo"
html_title = "nlpweld"
html_math_renderer = "mathml"
html_copy_source = False
html_show_copyright = False
