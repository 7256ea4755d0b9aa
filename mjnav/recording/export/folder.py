"""The folder that an export fills: there is all of it or nothing."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from mjnav.errors import InputError, MjnavError


def check_new_folder(path: str | os.PathLike[str]) -> Path:
    """The path of a folder that could be made, or that is there and empty; creates nothing.

    Raises InputError where there is anything else, or the folder around it is missing or not writable.
    """
    given, path = path, Path(os.path.abspath(path))
    if path.is_symlink() or (path.exists() and not (path.is_dir() and not any(path.iterdir()))):
        raise InputError(f"{given}: exists already, and an export never replaces anything; choose another name")
    if not path.parent.is_dir():
        raise InputError(f"{given}: there is no folder {path.parent}")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise InputError(f"{given}: the folder {path.parent} is not writable")
    return path


@contextmanager
def new_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path at which to make and fill a folder, which moves to `path` at the end.

    After an exception nothing of it is left. What the disk refuses becomes an error for people.
    """
    target = check_new_folder(path)
    try:
        with TemporaryDirectory(prefix=f".{target.name}-", dir=target.parent) as beside:
            folder = Path(beside, target.name)
            yield folder
            folder.rename(target)
    except OSError as error:
        raise MjnavError(f"{path}: writing failed: {error.strerror or error}") from error
