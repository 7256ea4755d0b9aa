"""Recorded errors in a file: a column of CSV that a run file names in place of numbers.

    [noise.pose.x]
    distribution = "empirical"
    samples = { file = "pose.csv", column = "x" }

Loading the run file puts the numbers in place of the file, so a log has them and a replay needs no file. Of more than
10 000 these are quantiles at even distances.
"""

import csv
import os
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

from mjnav.errors import InvalidValue, unknown_name
from mjnav.noise import CHANNELS
from mjnav.noise.distributions import thinned
from mjnav.scene import toml as files
from mjnav.settings import Settled, below, settled

_MAX_BYTES = 50_000_000


@dataclass(frozen=True, slots=True)
class SamplesFile(Settled):
    """What stands in place of numbers."""

    file: Annotated[str, "a CSV file, from the run file's folder or else the working folder"]
    column: Annotated[str | None, "of the errors, where the file has several"] = None


def read_column(path: str | os.PathLike[str], column: str | None) -> tuple[str, list[float]]:
    """A column's name and its numbers; without a name the only one. Raises InvalidValue with the file and its line."""
    name = os.fspath(path)
    with files.readable("a CSV file", file=name):
        text = files.read_regular(name, _MAX_BYTES).decode("utf-8-sig")
    try:
        first, *rows = csv.reader(text.splitlines()) if text.strip() else [[]]
    except csv.Error as error:
        raise InvalidValue("", None, f"CSV ({error})", file=name) from None
    head = [cell.strip() for cell in first]
    if column is None:
        if len(head) != 1:
            allowed = f"one of {', '.join(head)}" if head else "a column with its name on top"
            raise InvalidValue("column", None, allowed, file=name)
        column = head[0]
    if column not in head:
        error = unknown_name("column", column, head)
        raise error.within(file=name)
    if head.count(column) > 1 or _number(column) is not None:
        raise InvalidValue("line 1", column, "the column's name, which no other has and which is no number", file=name)
    place, values = head.index(column), []
    for number, row in enumerate(rows, start=2):
        cell = row[place].strip() if place < len(row) else ""
        if not row or not cell:
            continue
        value = _number(cell)
        if value is None or not isfinite(value):
            raise InvalidValue(f"line {number}", cell, f"a finite number in column {column}", file=name)
        values.append(value)
    return column, values


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def put_samples(document: dict[str, Any], folder: Path | None) -> None:
    """Puts numbers in place of every `samples = { file, column }` of [noise]; as `toml.inline` does with a trace."""
    noise = document.get("noise")
    for channel in CHANNELS:
        table: Any = noise
        for part in channel.split("."):
            table = table.get(part) if isinstance(table, dict) else None
        given = table.get("samples") if isinstance(table, dict) else None
        if not isinstance(given, dict):
            continue
        with below("noise", *channel.split("."), "samples"):
            samples = settled(SamplesFile, given)
            path = files.found("file", samples.file, folder)
            try:
                table["samples"] = thinned(read_column(path, samples.column)[1])
            except InvalidValue as error:
                inner = InvalidValue(error.key, error.found, error.allowed, nearest=error.nearest)
                raise InvalidValue("", samples.file, f"a column of errors that can be read ({inner})") from None
