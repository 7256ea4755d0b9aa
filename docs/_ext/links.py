"""Says at the end of a build how many links leave the site; a build without a network cannot follow them."""

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)


def count(app: Sphinx, error: Exception | None) -> None:
    """Prints the number of different addresses outside the site."""
    if error is not None or app.builder.format != "html":
        return
    found = [
        node["refuri"]
        for name in app.env.found_docs
        for node in app.env.get_doctree(name).findall(nodes.reference)
        if node.get("refuri", "").startswith(("http:", "https:"))
    ]
    LOGGER.info(
        "%d pages; %d links to %d addresses elsewhere, not followed",
        len(app.env.found_docs),
        len(found),
        len(set(found)),
    )


def setup(app: Sphinx) -> dict[str, bool]:
    """Counts when the build has finished."""
    app.connect("build-finished", count)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
