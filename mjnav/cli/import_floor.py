"""`mjnav import map|world FILE`: what a map or a world holds, and a run file with it."""

import argparse
import json
from collections.abc import Iterable
from typing import Any

import numpy as np

from mjnav.cli.terminal.progress import tell
from mjnav.cli.terminal.tables import print_lines
from mjnav.errors import InputError, InvalidValue
from mjnav.output_files import new_path, written
from mjnav.printable import printable
from mjnav.scene.floor_import import MAPS, WORLDS, floor_tables
from mjnav.scene.load import loads
from mjnav.scene.map_file import FREE, OCCUPIED, UNKNOWN, read_map
from mjnav.scene.overrides import apply, overrides_of
from mjnav.scene.toml import toml_text

_MAX_TOLD = 10  # things left out that are told one by one


def execute(arguments: argparse.Namespace) -> int:
    """Prints what the file holds and writes the run file."""
    output = None if arguments.output is None else new_path("--output", arguments.output, ".toml")
    suffixes = MAPS if arguments.kind == "map" else WORLDS
    if not arguments.file.endswith(suffixes):
        raise InvalidValue("FILE", arguments.file, f"a {arguments.kind}, a file that ends in {' or '.join(suffixes)}")
    given = list(overrides_of(arguments.overrides))
    if output is not None and not {"robot.start", "robot.goal"} <= {override.key for override in given}:
        raise InputError("-o needs --start X,Y,HEADING and --goal X,Y")
    folder = (output or new_path("--output", "x.toml", ".toml")).absolute().parent
    tables, left_out = floor_tables(arguments.file, folder)
    document = _holds(arguments, tables, left_out)
    tell_left_out(left_out)
    if output is not None:
        tables["name"] = printable(output.stem)
        for override in given:
            apply(tables, override, {})
        text = f"# Made by `mjnav import {arguments.kind}`.\n{toml_text(tables)}"
        scenario = loads(text, file=str(output), folder=folder)
        with written(output) as file:
            file.write(text.encode())
        document["wrote"] = {"file": str(output), "pillars": len(scenario.pillars), "walls": len(scenario.walls)}
    if arguments.json:
        print(json.dumps(document, allow_nan=False))
    else:
        print_lines([f"  {key:12}  {_text(value)}" for key, value in document.items() if key != "schema"])
    return 0


def tell_left_out(left_out: list[str]) -> None:
    """What of a world stands nowhere, on standard error."""
    for text in left_out[:_MAX_TOLD]:
        tell(f"left out: {printable(text)}")
    if len(left_out) > _MAX_TOLD:
        tell(f"left out: {len(left_out) - _MAX_TOLD} more; `mjnav import world FILE --json` names them")


def _holds(arguments: argparse.Namespace, tables: dict[str, Any], left_out: list[str]) -> dict[str, Any]:
    """What the file holds, as --json has it."""
    if arguments.kind == "world":
        counts = {key: len(tables.get(key, ())) for key in ("pillars", "walls")}
        return {"schema": 1, **counts, "left_out": left_out}
    grid = read_map(arguments.file)
    states = (("occupied", OCCUPIED), ("free", FREE), ("unknown", UNKNOWN))
    shares = {name: float(np.mean(grid.cells == state)) for name, state in states}
    info = grid.info
    return {
        "schema": 1,
        "cells": list(grid.cells.shape[::-1]),
        "resolution_m": info.resolution,
        "origin": list(info.origin),
        "mode": info.mode,
        **{f"{name}_share": share for name, share in shares.items()},
    }


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {part}" for key, part in value.items())
    if isinstance(value, Iterable) and not isinstance(value, str):
        return " ".join(map(_text, value)) or "-"
    return f"{value:.4g}" if isinstance(value, float) else printable(value)
