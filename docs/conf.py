"""How the documentation is built: MyST pages, the furo theme, formulas as MathML, nothing from elsewhere."""

import sys
import tomllib
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "docs" / "_extensions"))

project = "handeye"
author = "the handeye contributors"
project_copyright = "the handeye contributors"
version = release = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]

extensions = ["myst_parser", "mathml_formulas", "generated_reference"]
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "_extensions"]
nitpicky = True

html_theme = "furo"
html_title = "handeye"
html_static_path = ["_static"]
html_css_files = ["formulas.css"]
html_math_renderer = "mathml"
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}


def mended(app: Sphinx, name: str, template: str, context: dict[str, Any], *rest: object) -> None:
    """Say of captions, headings to a screen reader, of which level they are; let keys reach what scrolls."""
    del app, name, template, rest
    plain = '<p class="caption" role="heading">'
    for part in ("furo_navigation_tree", "body"):
        if text := context.get(part):
            text = text.replace(plain, plain[:-1] + ' aria-level="2">')
            text = text.replace("<pre>", '<pre tabindex="0">')
            text = text.replace('<div class="table-wrapper', '<div tabindex="0" class="table-wrapper')
            context[part] = text


def setup(app: Sphinx) -> None:
    """Come after the theme, which makes the side bar."""
    app.connect("html-page-context", mended, priority=900)
