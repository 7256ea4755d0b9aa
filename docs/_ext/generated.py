"""The directive `generated`: reference pages written from the code when the site is built.

    ```{generated} commands
    ```

Its argument is a file of `docs/_ext/reference/`, whose `markdown()` gives the text.
"""

from importlib import import_module

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Generated(SphinxDirective):
    """Markdown that a function gives, in the place of the directive."""

    required_arguments = 1
    has_content = False

    def run(self) -> list[nodes.Node]:
        """The nodes of the text; the page is read again at every build, for the code is not its source file."""
        self.env.note_reread()
        text = import_module(f"reference.{self.arguments[0].replace('-', '_')}").markdown()
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the directive."""
    app.add_directive("generated", Generated)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
