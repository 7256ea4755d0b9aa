"""The pictures that scripts draw: every `docs/pictures/NAME.py FOLDER` is run before the pages are read.

A page shows them as `/_pictures/NAME-....png`.
"""

import shlex
import sys
from pathlib import Path

from making import digest, make
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)


def draw(app: Sphinx) -> None:
    """Runs every script whose pictures are missing or older than its sources. Raises ExtensionError where one fails."""
    folder = Path(app.srcdir) / "_pictures"
    folder.mkdir(exist_ok=True)
    for script in sorted((Path(app.srcdir) / "pictures").glob("*.py")):
        current = digest(script.read_text(encoding="utf-8"))
        stamp = folder / f"{script.stem}.drawn"
        if stamp.exists() and stamp.read_text() == current:
            continue
        LOGGER.info("drawing the pictures of %s", script.name)
        work = folder / script.stem
        try:
            make(f"{shlex.quote(sys.executable)} {shlex.quote(str(script))} .", work)
        except RuntimeError as error:
            raise ExtensionError(str(error)) from error
        for picture in work.iterdir():
            picture.replace(folder / picture.name)
        work.rmdir()
        stamp.write_text(current)


def setup(app: Sphinx) -> dict[str, bool]:
    """Draws before anything is read."""
    app.connect("builder-inited", draw)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
