"""Write formulas as MathML, which browsers draw by themselves: no script, no font, no LaTeX.

A formula that cannot be converted is a warning that names the page and line, and so an error in `make docs`.
Browsers stretch brackets only with a font made for mathematics, which few machines have: the brackets of a
matrix are drawn as its borders instead (`formulas.css`), and others that would have to grow are refused;
those of a stated size grow to what they hold where a font lets them.
"""

import xml.etree.ElementTree as ET
from html import escape
from itertools import pairwise

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number
from sphinx.util.typing import ExtensionMetadata
from sphinx.writers.html5 import HTML5Translator

logger = logging.getLogger(__name__)
MATHML = "http://www.w3.org/1998/Math/MathML"
BRACKETED = [f"{{{MATHML}}}{name}" for name in ("mo", "mtable", "mo")]
VALUES = [f"{{{MATHML}}}{name}" for name in ("mi", "mn", "msub", "msup", "msubsup")]
ET.register_namespace("", MATHML)


def to_mathml(node: nodes.Element, display: str) -> str:
    """The formula of `node` as one `<math>` element; on failure its LaTeX source, and a warning."""
    latex = node.astext()
    try:
        root = ET.fromstring(convert(latex, display=display))
        # What it does not know, the converter passes on: a command as text, a stray & as markup.
        unknown = [part for part in root.itertext() if "\\" in part]
        if unknown:
            raise ValueError(f"unknown command {unknown[0]}")
        draw_brackets(root)
        give_room(root)
        return ET.tostring(root, encoding="unicode")
    except Exception as error:  # noqa: BLE001 - the converter raises many classes; each becomes a named warning
        logger.warning("formula not understood (%s): %s", error, latex, location=node)
        return f"<code>{escape(latex)}</code>"


def draw_brackets(root: ET.Element) -> None:
    """Make the brackets around matrices part of the matrix; refuse others that would have to stretch."""
    for parent in list(root.iter()):
        parts = list(parent)
        for opening, matrix, closing in zip(parts, parts[1:], parts[2:], strict=False):
            tags = [opening.tag, matrix.tag, closing.tag]
            if tags == BRACKETED and (opening.text, closing.text) == ("[", "]"):
                matrix.set("class", "matrix")
                parent.remove(opening)
                parent.remove(closing)
    for operator in root.iter(f"{{{MATHML}}}mo"):
        operator.attrib.pop("maxsize", None)
        if operator.get("fence") == "true" and operator.get("stretchy") == "true":
            raise ValueError(
                f"a bracket that browsers do not stretch: {operator.text}; write it without \\left"
            )


def give_room(root: ET.Element) -> None:
    """Take bars for brackets, not for operators; part the name of a function from its value."""
    for parent in list(root.iter()):
        bars = [part for part in parent if part.text == "|"]
        if len(bars) % 2:
            raise ValueError("a bar without its other one; write what is given with \\mid")
        for number, bar in enumerate(bars):
            bar.attrib |= {"form": ("prefix", "postfix")[number % 2], "lspace": "0", "rspace": "0"}
        for number, (name, value) in reversed(list(enumerate(pairwise(parent), 1))):
            if name.tag == f"{{{MATHML}}}mi" and len(name.text or "") > 1 and value.tag in VALUES:
                parent.insert(number, ET.Element(f"{{{MATHML}}}mspace", width="0.17em"))


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    translator.body.append(to_mathml(node, "inline"))
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula of its own, with its number if it has a label."""
    translator.body.append(translator.starttag(node, "div", CLASS="formula", tabindex="0"))
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
