"""Reading files that users name: bounded, regular files only; and values of a run file that have their own file."""

import errno
import os
import re
import stat
from pathlib import Path
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.plugins.importing import is_file

_MAX_BYTES = 10_000_000
TRACE = "control.latency.trace"


def read_regular(path: str | os.PathLike[str], limit: int) -> bytes:
    """A file's bytes. Raises OSError where it cannot be read, is no regular file, or holds more than `limit` bytes."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)  # a pipe is opened without waiting
    with open(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "not a regular file")
        content = file.read(limit + 1)
    if len(content) > limit:
        raise OSError(errno.EFBIG, f"more than {limit} bytes")
    return content


def place_plugins(document: dict[str, Any], folder: Path) -> None:
    """Makes the paths in a run file's plug-ins, "file.py:Class", those from the working folder, in place.

    As for a trace, they count from `folder`, or else from the working folder.
    """
    control = document.get("control")
    if isinstance(control, dict) and isinstance(control.get("method"), str):
        control["method"] = _placed(control["method"], folder)


def _placed(name: str, folder: Path) -> str:
    file, colon, own = name.rpartition(":")
    if not (colon and is_file(file)) or os.path.isabs(file) or not os.path.isfile(folder / file):
        return name
    return f"{folder / file}:{own}"


def inline(document: dict[str, Any], folder: Path | None) -> None:
    """Replaces the path of a latency trace by its numbers, so that the scenario needs no file but its own.

    A relative path counts from `folder`, or else from the working folder; without a folder no path is allowed. Raises
    InvalidValue.
    """
    latency = document.get("control", {})
    latency = latency.get("latency") if isinstance(latency, dict) else None
    if isinstance(latency, dict) and isinstance(latency.get("trace"), str):
        if folder is None:
            raise InvalidValue(TRACE, latency["trace"], "numbers; only a run file may name another file")
        latency["trace"] = _numbers(latency["trace"], folder)


def _numbers(name: str, folder: Path) -> list[float]:
    beside = folder / name
    path = beside if beside.exists() else Path(name)
    try:
        text = read_regular(path, _MAX_BYTES).decode()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidValue(TRACE, name, f"a text file of numbers that can be read ({reason})") from None
    values = []
    for number, line in enumerate(text.splitlines(), start=1):
        for word in re.split(r"[,;\s]+", line.partition("#")[0].strip()):
            try:
                values += [float(word)] if word else []
            except ValueError:
                raise InvalidValue(TRACE, word, f"numbers, one or more a line (line {number} of {path})") from None
    return values
