"""TOML and the files that a run file names: bounded reading, values with a file of their own, parsing and writing.

Only regular files up to a size limit are read. A text that is no TOML is reported in one line.
"""

import errno
import json
import os
import re
import stat
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date, time
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from mjnav.errors import InvalidValue

# ---------------------------------------------------------------------- files that a run file names


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


@contextmanager
def readable(what: str, key: str = "", found: object = None, *, file: str | None = None) -> Iterator[None]:
    """Raises InvalidValue where a file cannot be read, or is no text: `what` it should have been."""
    try:
        yield
    except (OSError, ValueError) as error:  # ValueError: a null character in the name, or not UTF-8
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidValue(key, found, f"{what} that can be read ({reason})", file=file) from None


def decoded(data: bytes, allowed: str = "text in UTF-8") -> str:
    """The text of a file's bytes. Raises InvalidValue with the line that is none."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, bad = data.count(b"\n", 0, error.start) + 1, data[error.start : error.end]
        raise InvalidValue(f"line {line}", bad, allowed) from None


def inline(document: dict[str, Any], folder: Path | None) -> None:
    """Replaces the path of a latency trace by its numbers, so that the scenario needs no file but its own.

    A relative path counts from `folder`, or else from the working folder; without a folder no path is allowed. Raises
    InvalidValue.
    """
    latency = document.get("control", {})
    latency = latency.get("latency") if isinstance(latency, dict) else None
    if isinstance(latency, dict) and isinstance(latency.get("trace"), str):
        latency["trace"] = _numbers(latency["trace"], folder)


def found(key: str, name: str, folder: Path | None, instead: str = "numbers") -> Path:
    """The path of a file that a run file in `folder` names: from there, or else from the working folder.

    Raises InvalidValue without a folder, where `instead` is allowed.
    """
    if folder is None:
        raise InvalidValue(key, name, f"{instead}; only a run file may name another file")
    beside = folder / name
    return beside if os.path.exists(beside) else Path(name)  # Path.exists raises for a name that is too long


def _numbers(name: str, folder: Path | None) -> list[float]:
    path = found(TRACE, name, folder)
    with readable("a text file of numbers", TRACE, name):
        text = read_regular(path, _MAX_BYTES).decode()
    values = []
    for number, line in enumerate(text.splitlines(), start=1):
        for word in re.split(r"[,;\s]+", line.partition("#")[0].strip()):
            try:
                values += [float(word)] if word else []
            except ValueError:
                raise InvalidValue(TRACE, word, f"numbers, one or more a line (line {number} of {path})") from None
    return values


# ----------------------------------------------------------------------------------- TOML to tables


MAX_PARTS = 100  # of a dotted key: tomllib needs time quadratic in them, minutes for 10^5
_TOKEN = re.compile(r"""[\w-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|[ \t]+|.""", re.DOTALL)


def parse(text: str, file: str) -> dict[str, Any]:
    """The tables of a TOML text; `file` is its name in messages. Raises InvalidValue."""
    if _most_parts(text) > MAX_PARTS:
        raise InvalidValue("", "a key of more parts", f"keys of at most {MAX_PARTS} parts", file=file)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, line, column = _place(str(error), text)
        lines = text.splitlines()
        found = lines[line - 1].strip() if line <= len(lines) else "the end"
        raise InvalidValue(f"line {line}, column {column}", found, f"TOML ({what})", file=file) from None
    except ValueError as error:  # a number of thousands of digits
        raise InvalidValue("", str(error), "TOML with whole numbers of at most 64 bits", file=file) from None
    except RecursionError:
        raise InvalidValue("", "tables and arrays too deep in one another", "TOML", file=file) from None


def _place(message: str, text: str) -> tuple[str, int, int]:
    """tomllib's complaint, and the line and column, which it gives in words only."""
    place = re.fullmatch(r"(.*) \(at line (\d+), column (\d+)\)", message, re.DOTALL)
    if place:
        return place[1], int(place[2]), int(place[3])
    last = text.rpartition("\n")[2]
    return message.removesuffix(" (at end of document)"), text.count("\n") + 1, len(last) + 1


def _most_parts(text: str) -> int:
    """The parts of the longest dotted key anywhere in a text; 0 where it has too few dots for a long one."""
    if text.count(".") < MAX_PARTS:
        return 0
    most = dots = 0
    for token in _TOKEN.finditer(text):
        first = token[0][0]
        if first == ".":
            dots += 1
            most = max(most, dots)
        elif not (first.isalnum() or first in "_-\"' \t"):
            dots = 0
    return most + 1


# ----------------------------------------------------------------------------------- tables to TOML


def toml_text(table: dict[str, Any]) -> str:
    """The TOML text of a table; TypeError for a value that TOML does not have."""
    return "\n".join(_table_lines(table, "")).strip() + "\n"


def _table_lines(table: dict[str, Any], path: str) -> Iterator[str]:
    """The lines of a table: first its own values, then the tables in it."""
    inner = {key: value for key, value in table.items() if isinstance(value, dict) or _is_array_of_tables(value)}
    yield from (f"{_key(key)} = {value_text(value)}" for key, value in table.items() if key not in inner)
    for key, value in inner.items():
        name = f"{path}.{_key(key)}" if path else _key(key)
        for header, item in [(f"[{name}]", value)] if isinstance(value, dict) else [(f"[[{name}]]", i) for i in value]:
            yield from ("", header, *_table_lines(item, name))


def _is_array_of_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def value_text(value: object) -> str:
    """The TOML text of a value; TypeError for one that TOML does not have."""
    match value:
        case str():
            return _string(value)
        case bool():
            return "true" if value else "false"
        case Integral():
            return str(int(value))
        case Real():
            return repr(float(value))
        case date() | time():  # a datetime is a date
            return value.isoformat()
        case list():
            return f"[{', '.join(map(value_text, value))}]"
        case dict():
            return "{" + ", ".join(f"{_key(key)} = {value_text(item)}" for key, item in value.items()) + "}"
    raise TypeError(f"TOML has no {type(value).__name__}")


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _string(key)


def _string(text: str) -> str:
    """A basic string. JSON's escapes are TOML's, but JSON leaves DEL as it is."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
