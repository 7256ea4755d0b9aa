"""The topics of a log, with their schemas."""

from mjnav.log.encode.topics import topics
from mjnav.loop.prepare import load_scenario

from .markdown import escape


def markdown() -> str:
    """A table of the topics, in the order in which a tick writes them."""
    rows = [f"| `{t.name}` | `{t.schema.name}` | {escape(t.text)} |" for t in topics(load_scenario("crossing1"))]
    return "\n".join(["| topic | schema | holds |", "|---|---|---|", *rows])
