"""Write formulas as MathML, which browsers draw by themselves: no script, no font, no LaTeX.

A formula that cannot be converted is a warning that names the page and line, and so an error in `make docs`.
"""

import xml.etree.ElementTree as ET
from html import escape

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number
from sphinx.util.typing import ExtensionMetadata
from sphinx.writers.html5 import HTML5Translator

logger = logging.getLogger(__name__)


def to_mathml(node: nodes.Element, display: str) -> str:
    """The formula of `node` as one `<math>` element; on failure its LaTeX source, and a warning."""
    latex = node.astext()
    try:
        mathml = convert(latex, display=display)
        # What it does not know, the converter passes on: a command as text, a stray & as markup.
        unknown = [part for part in ET.fromstring(mathml).itertext() if "\\" in part]
        if unknown:
            raise ValueError(f"unknown command {unknown[0]}")
        return mathml
    except Exception as error:  # noqa: BLE001 - the converter raises many classes; each becomes a named warning
        logger.warning("formula not understood (%s): %s", error, latex, location=node)
        return f"<code>{escape(latex)}</code>"


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    translator.body.append(to_mathml(node, "inline"))
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula of its own, with its number if it has a label."""
    translator.body.append(translator.starttag(node, "div", CLASS="formula"))
    if node["number"]:
        number = get_node_equation_number(translator, node)
        translator.body.append(f'<span class="eqno">({number})')
        translator.add_permalink_ref(node, "Link to this equation")
        translator.body.append("</span>")
    translator.body.append(to_mathml(node, "block"))
    translator.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> ExtensionMetadata:
    """Register the renderer under the name that `html_math_renderer` selects."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
