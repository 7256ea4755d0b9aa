"""Output files: their paths are checked before the work, and they are written whole."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from mjnav.errors import InputError, InvalidValue


def output_path(option: str, given: str | os.PathLike[str], *suffixes: str) -> Path:
    """The path of a file that can be written; an existing file will be replaced. Creates nothing.

    Raises InputError where the name ends in none of `suffixes`, and where the folder is missing or not writable.
    """
    path = Path(given)
    if path.suffix.lower() not in suffixes:
        raise InvalidValue(option, str(given), f"a file name that ends in {' or '.join(suffixes)}")
    folder = path.absolute().parent
    if not folder.is_dir():
        raise InputError(f"{path}: there is no folder {folder}")
    if path.is_dir():
        raise InputError(f"{path}: a folder")
    if not os.access(path if path.exists() else folder, os.W_OK):
        raise InputError(f"{path}: not writable")
    return path


def new_path(option: str, given: str | os.PathLike[str], *suffixes: str) -> Path:
    """As `output_path`, of a file that does not exist yet."""
    path = output_path(option, given, *suffixes)
    if os.path.lexists(path):
        raise InputError(f"{path}: exists already; choose another name")
    return path


@contextmanager
def written(path: Path) -> Iterator[IO[bytes]]:
    """The open file. Raises InputError with the path where the disk refuses."""
    try:
        with open(path, "wb") as file:
            yield file
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None


@contextmanager
def replacement(path: Path) -> Iterator[Path]:
    """A temporary file beside `path`, which replaces it at the end; after an error it is removed.

    Raises InputError with the path where the disk refuses.
    """
    partial = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    finally:
        partial.unlink(missing_ok=True)
