"""The data folders of mjnav, and the scenes that are shipped in one of them."""

import tomllib
from pathlib import Path

from mjnav.errors import InputError

_PACKAGE = Path(__file__).resolve().parents[1]


def data_folder(name: str) -> Path:
    """The folder "models" or "runs": inside the package where it was installed, beside it in a source tree."""
    for parent in (_PACKAGE, _PACKAGE.parent):
        if (parent / name).is_dir():
            return parent / name
    raise InputError(f"the folder {name!r} is missing both from {_PACKAGE} and from beside it; install mjnav again")


def describe(folder: str = "") -> tuple[tuple[str, str], ...]:
    """Name and one-line description of every shipped scene, by name; or of the studies, where `folder` has them."""
    found = []
    for path in sorted((data_folder("runs") / folder).glob("*.toml"), key=lambda path: path.stem):
        try:
            document = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue  # `load` says what is wrong with it
        if folder or "robot" in document:  # other files beside the scenes are not listed
            found.append((path.stem, " ".join(str(document.get("description", "")).split())))
    return tuple(found)


def names() -> tuple[str, ...]:
    """The names of the shipped scenes."""
    return tuple(name for name, _ in describe())
