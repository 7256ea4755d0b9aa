"""The directive `made-by`: a picture or film, and the commands that make it, which are run when the site is built.

    ```{made-by} hall.png
    :alt: The robot in the hall
    mjnav run hall --seed 3 --log hall.mcap
    mjnav render hall.mcap --at 7 -o hall.png
    ```

With `:hide:` only the picture is shown.
"""

import shutil
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import directives
from making import digest, make
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

FILMS = (".mp4", ".webm")


class MadeBy(SphinxDirective):
    """The commands as a block of code, and under it what they make."""

    required_arguments = 1
    has_content = True
    option_spec = {"alt": directives.unchanged_required, "hide": directives.flag}  # noqa: RUF012 - as docutils has it

    def run(self) -> list[nodes.Node]:
        """Runs the commands where their result is missing. Raises a docutils error where they fail."""
        self.env.note_reread()  # the sources that decide what is made are not the page's
        commands, name = "\n".join(self.content), self.arguments[0]
        folder = Path(self.env.app.outdir) / "_made" / digest(commands)
        if not folder.exists():
            try:
                make(commands, folder)
            except RuntimeError as error:
                raise self.error(str(error)) from error
        if not (folder / name).exists():
            raise self.error(f"the commands did not make {name}")
        shown: list[nodes.Node] = []
        if "hide" not in self.options:
            shown.append(nodes.literal_block(commands, commands, language="bash"))
        up = "../" * self.env.docname.count("/")
        return [*shown, _figure(f"{up}_made/{folder.name}/{name}", self.options.get("alt", ""))]


def _figure(address: str, alt: str) -> nodes.Node:
    alt = alt.replace('"', "&quot;")
    if address.endswith(FILMS):
        html = f'<video class="made" src="{address}" title="{alt}" controls loop muted playsinline></video>'
    else:
        html = f'<a href="{address}"><img class="made" src="{address}" alt="{alt}" loading="lazy"></a>'
    return nodes.raw("", f"{html}\n", format="html")


def remove_old(app: Sphinx, error: Exception | None) -> None:
    """Removes what no page shows any more."""
    made = Path(app.outdir) / "_made"
    if error is None and app.builder.format == "html" and made.is_dir():
        pages = "".join(file.read_text(encoding="utf-8") for file in Path(app.outdir).rglob("*.html"))
        for folder in made.iterdir():
            if folder.name not in pages:
                shutil.rmtree(folder)


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the directive."""
    app.add_directive("made-by", MadeBy)
    app.connect("build-finished", remove_old)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
