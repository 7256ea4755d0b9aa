"""Paths that users give. Those of output files are checked before the work, and they are written whole."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from mjnav.errors import InputError, InvalidValue, MjnavError


def path_text(key: str, given: object, allowed: str = "a path, without null characters") -> str:
    """The text of a path. Raises InvalidValue for what can be the name of no file."""
    try:
        text = os.fspath(given)  # type: ignore[arg-type]
        encoded = os.fsencode(text)
    except (TypeError, UnicodeEncodeError):
        raise InvalidValue(key, given, allowed) from None
    if isinstance(text, bytes) or b"\0" in encoded:
        raise InvalidValue(key, given, allowed)
    return text


def check_folder(path: str | os.PathLike, folder: Path) -> None:
    """Raises InputError where the folder in which `path` is to be made is missing or not writable."""
    if not os.path.isdir(folder):  # Path.is_dir raises for a name that is too long
        raise InputError(f"{path}: there is no folder {folder}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{path}: the folder {folder} is not writable")


def output_path(option: str, given: str | os.PathLike[str], *suffixes: str) -> Path:
    """The path of a file that can be written; an existing file will be replaced. Creates nothing.

    Raises InputError where the name ends in none of `suffixes`, and where the folder is missing or not writable.
    """
    path = Path(path_text(option, given))
    if path.suffix.lower() not in suffixes:
        raise InvalidValue(option, str(given), f"a file name that ends in {' or '.join(suffixes)}")
    if not os.path.exists(path):
        check_folder(path, path.absolute().parent)
    elif os.path.isdir(path):
        raise InputError(f"{path}: a folder")
    elif not os.access(path, os.W_OK):
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
    """The open file, which is there once it is whole. Raises MjnavError with the path where the disk refuses."""
    with replacement(path) as partial, open(partial, "wb") as file:
        yield file


@contextmanager
def replacement(path: Path) -> Iterator[Path]:
    """A temporary file beside `path`, which replaces it at the end; after an error it is removed.

    Raises MjnavError with the path where the disk refuses.
    """
    partial = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        raise MjnavError(f"{path}: {error.strerror or error}") from None
    finally:
        partial.unlink(missing_ok=True)
