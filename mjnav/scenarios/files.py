"""Reading files that users name: bounded, regular files only; and values of a run file that have their own file."""

import errno
import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.plugins.importing import placed

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
    """Makes the paths in a run file's plug-ins, "file.py:Class", absolute, in place.

    As for a trace, they count from `folder`, or else from the working folder.
    """
    metrics = document.get("metrics")
    if isinstance(metrics, list):
        document["metrics"] = [placed(one, folder) if isinstance(one, str) else one for one in metrics]
    for table, key in _named(document):
        if isinstance(table.get(key), str):
            table[key] = placed(table[key], folder)
        elif isinstance(table.get(key), dict) and isinstance(table[key].get("name"), str):
            table[key]["name"] = placed(table[key]["name"], folder)


def _named(document: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Every table that may name a plug-in, and the key under which it does."""
    estimation = _table(document, "estimation")
    yield _table(document, "control"), "method"
    yield _table(estimation, "robot"), "localizer"
    yield _table(estimation, "obstacles"), "tracker"
    yield _table(document, "prediction"), "model"
    for array, key in (("people", "behaviour"), ("metrics", "name")):
        items = document.get(array)
        yield from ((item, key) for item in (items if isinstance(items, list) else ()) if isinstance(item, dict))
    waiting = [_table(document, "noise")]
    while waiting:
        noise = waiting.pop()
        yield noise, "distribution"
        waiting += [inner for inner in noise.values() if isinstance(inner, dict)]


def _table(document: dict[str, Any], key: str) -> dict[str, Any]:
    found = document.get(key)
    return found if isinstance(found, dict) else {}


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


def found(name: str, folder: Path) -> Path:
    """The path of a file that a run file in `folder` names: from there, or else from the working folder."""
    beside = folder / name
    return beside if os.path.exists(beside) else Path(name)  # Path.exists raises for a name that is too long


def _numbers(name: str, folder: Path) -> list[float]:
    path = found(name, folder)
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
