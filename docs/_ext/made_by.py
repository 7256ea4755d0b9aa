"""The directive `made-by`: a picture or film, and the commands that make it, which are run when the site is built.

    ```{made-by} hall.png
    :alt: The robot in the hall
    mjnav run hall --seed 3 --log hall.mcap
    mjnav render hall.mcap --at 18 -o hall.png
    ```

With `:hide:` only the picture is shown. The same commands are run once a build, and again when they or mjnav's
sources have changed.
"""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

LOGGER = logging.getLogger(__name__)
FILMS = (".mp4", ".webm")
SOURCES = Path(__file__).parents[2]


class MadeBy(SphinxDirective):
    """The commands as a block of code, and under it what they make."""

    required_arguments = 1
    has_content = True
    option_spec = {"alt": directives.unchanged_required, "hide": directives.flag}  # noqa: RUF012 - as docutils has it

    def run(self) -> list[nodes.Node]:
        """Runs the commands where their result is missing."""
        self.env.note_reread()
        commands, name = "\n".join(self.content), self.arguments[0]
        folder = Path(self.env.app.outdir) / "_made" / _digest(commands)
        if not (folder / name).exists():
            _make(commands, folder)
        if not (folder / name).exists():
            raise self.error(f"the commands did not make {name}")
        shown: list[nodes.Node] = []
        if "hide" not in self.options:
            shown.append(nodes.literal_block(commands, commands, language="bash"))
        up = "../" * self.env.docname.count("/")
        shown.append(_figure(f"{up}_made/{folder.name}/{name}", self.options.get("alt", "")))
        return shown


def _figure(address: str, alt: str) -> nodes.Node:
    alt = alt.replace('"', "&quot;")
    if address.endswith(FILMS):
        html = f'<video class="made" src="{address}" title="{alt}" controls loop muted playsinline></video>'
    else:
        html = f'<a href="{address}"><img class="made" src="{address}" alt="{alt}" loading="lazy"></a>'
    return nodes.raw("", f"{html}\n", format="html")


def _make(commands: str, folder: Path) -> None:
    """Runs the commands in a folder, which appears whole or not at all. Raises RuntimeError where one fails."""
    work = folder.with_suffix(".part")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-e", "-c", commands], cwd=work, env={**os.environ, "PATH": path}, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode} of\n{commands}\n{done.stdout}{done.stderr}")
    for log in work.rglob("*.mcap"):
        log.unlink()  # large, and not shown
    work.rename(folder)


def _digest(commands: str) -> str:
    """Of the commands and of everything that may change what they make."""
    digest = hashlib.sha256(commands.encode())
    for folder in ("mjnav", "models", "runs"):
        for file in sorted((SOURCES / folder).rglob("*")):
            if file.suffix in (".py", ".toml", ".xml", ".js", ".css", ".html") and "out" not in file.parts:
                digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


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
