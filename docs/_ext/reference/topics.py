"""The topics of a log, with their schemas."""

from mjnav.log.encode.topics import topics
from mjnav.log.log_format import TOPICS
from mjnav.loop.prepare import load_scenario

from .markdown import escape


def markdown() -> str:
    """A table of the topics, in the order in which a tick writes them."""
    schemas = {topic.name: topic.schema.name for topic in topics(load_scenario("crossing1"))}
    rows = [f"| `{name}` | `{schemas.get(name, '')}` | {escape(text)} |" for name, text in TOPICS.items()]
    return "\n".join(["| topic | schema | holds |", "|---|---|---|", *rows])
