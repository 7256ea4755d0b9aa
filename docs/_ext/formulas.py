"""Formulas as MathML, which browsers draw by themselves: a page loads no script from the network."""

import re
from html import unescape
from xml.etree import ElementTree

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

# What LaTeX has as a formula of its own, and docutils only inside one.
ALIGNED = re.compile(r"\\(begin|end)\{(?:align|gather|equation)\*?\}")
ENTITY = re.compile("&(?!amp;|lt;|gt;|quot;)\\w+;")  # of HTML, which XML does not have
NAMESPACE = "{http://www.w3.org/1998/Math/MathML}"
ACCENTS = tuple("˙¨ˆ^¯‾˜~ˇ→⃗")

ElementTree.register_namespace("", NAMESPACE[1:-1])
LOGGER = logging.getLogger(__name__)


def visit(self, node: nodes.math) -> None:
    """A formula in a line of text."""
    self.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def visit_block(self, node: nodes.math_block) -> None:
    """A formula of its own, with its number where it has one."""
    self.body.append(self.starttag(node, "div", CLASS="math"))
    if node["number"]:
        self.body.append(f'<span class="eqno">({self.get_secnumber(node) or node["number"]})')
        self.add_permalink_ref(node, "Link to this equation")
        self.body.append("</span>")
    self.body.append(mathml(node, as_block=True) + "</div>\n")
    raise nodes.SkipNode


def mathml(node: nodes.Element, *, as_block: bool) -> str:
    """The formula of a node; one that cannot be read is a warning and stays as it was written."""
    try:
        return tidy(tex2mathml(ALIGNED.sub(r"\\\1{aligned}", node.astext()), as_block=as_block))
    except MathError as error:
        LOGGER.warning("formula %r: %s", node.astext(), error, location=node)
        return f"<code>{node.astext()}</code>"


def tidy(formula: str) -> str:
    """MathML in which an index stands beside a letter with an accent, not under it, and bars stand close."""
    root = ElementTree.fromstring(ENTITY.sub(lambda found: unescape(found[0]), formula))
    for parent in root.iter():
        if parent.tag == f"{NAMESPACE}mo" and parent.text in ("|", "‖"):
            parent.attrib |= {"lspace": "0", "rspace": "0"}
        for i, child in enumerate(parent):
            if child.tag == f"{NAMESPACE}munderover" and child[2].text in ACCENTS:
                base, index, accent = child
                accented = ElementTree.Element(f"{NAMESPACE}mover", accent="true")
                accented.extend([base, accent])
                parent[i] = ElementTree.Element(f"{NAMESPACE}msub")
                parent[i].extend([accented, index])
                parent[i].tail = child.tail
    return ElementTree.tostring(root, encoding="unicode")


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the renderer `mathml`."""
    app.add_html_math_renderer("mathml", (visit, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
