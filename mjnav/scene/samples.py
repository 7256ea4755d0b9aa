"""Recorded errors in a file: a column of CSV that a run file names in place of numbers.

    [noise.pose.x]
    distribution = "empirical"
    samples = { file = "pose.csv", column = "x" }

Loading the run file puts the numbers in place of the file, so a log has them and a replay needs no file.
"""

import csv
import os
from math import isfinite
from pathlib import Path
from typing import Any

from mjnav.errors import InvalidValue, unknown_name
from mjnav.noise import CHANNELS
from mjnav.scene import toml as files

_MAX_BYTES = 50_000_000


def read_column(path: str | os.PathLike[str], column: str | None) -> tuple[str, list[float]]:
    """A column's name and its numbers; without a name the only one. Raises InvalidValue with the file and its line."""
    name = os.fspath(path)
    with files.readable("a CSV file", file=name):
        text = files.read_regular(name, _MAX_BYTES).decode("utf-8-sig")
    rows = csv.reader(line for line in text.splitlines())
    head = [cell.strip() for cell in next(rows, [])]
    if column is None:
        if len(head) != 1:
            raise InvalidValue("column", None, f"one of {', '.join(head)}", file=name)
        column = head[0]
    if column not in head:
        error = unknown_name("column", column, head)
        raise error.within(file=name)
    place, values = head.index(column), []
    for number, row in enumerate(rows, start=2):
        cell = row[place].strip() if place < len(row) else ""
        if not row or not cell:
            continue
        try:
            value = float(cell)
        except ValueError:
            value = float("nan")
        if not isfinite(value):
            raise InvalidValue(f"line {number}", cell, f"a finite number in column {column}", file=name)
        values.append(value)
    return column, values


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
        where = f"noise.{channel}.samples"
        for key in given:
            if key not in ("file", "column"):
                raise unknown_name(where, key, ("file", "column"))
        file, column = given.get("file"), given.get("column")
        if not isinstance(file, str):
            raise InvalidValue(f"{where}.file", file, "the path of a CSV file, from the run file's folder")
        if folder is None:
            raise InvalidValue(f"{where}.file", file, "numbers; only a run file may name another file")
        if not (column is None or isinstance(column, str)):
            raise InvalidValue(f"{where}.column", column, "a column's name")
        try:
            table["samples"] = read_column(files.found(file, folder), column)[1]
        except InvalidValue as error:
            inner = InvalidValue(error.key, error.found, error.allowed, nearest=error.nearest)
            raise InvalidValue(where, file, f"a column of errors that can be read ({inner})") from None
