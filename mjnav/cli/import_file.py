"""`mjnav import KIND FILE`: what a recording of people, a map or a world holds, and a run file with it."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mjnav.cli import options
from mjnav.cli.terminal import print_table, tell
from mjnav.errors import InputError, InvalidValue
from mjnav.output_files import new_path, written
from mjnav.printable import printable
from mjnav.scene.crowd_import import Imported, choose_window, import_crowd, scene_tables
from mjnav.scene.floor_import import MAPS, WORLDS, floor_tables
from mjnav.scene.load import loads
from mjnav.scene.map_file import FREE, OCCUPIED, UNKNOWN, read_map
from mjnav.scene.overrides import apply, overrides_of
from mjnav.scene.spec import Scenario
from mjnav.scene.toml import toml_text

LENGTH, MAX_LENGTH = 30.0, 1e6  # [s] of a window


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.epilog = "All of [crowd] is set by --set: crowd.window=[3.0, 9.0], crowd.people=react; see mjnav keys crowd."
    parser.add_argument(
        "kind",
        choices=("crowd", "map", "world"),
        help="what the file holds: recorded tracks of people, a map of ROS map_server, a world of Gazebo",
    )
    parser.add_argument(
        "file", metavar="FILE", help="a recording (rows of frame, id, x, y, or obsmat), a map's .yaml, or a .world"
    )
    wrote = parser.add_mutually_exclusive_group()
    wrote.add_argument("-o", "--output", metavar="FILE.toml", help="write a run file with it, a new file")
    wrote.add_argument(
        "--suite",
        metavar="FILE.toml",
        help="write suites for `mjnav bench`, and beside them a run file of every whole part with people",
    )
    options.start_and_goal(parser)
    parser.add_argument(
        "--frame-rate",
        type=float,
        metavar="HZ",
        help="what the column of frames counts a second: 25 in most files of ETH and UCY, 1 where it counts seconds",
    )
    parser.add_argument(
        "--people",
        type=options.number(int, 1, 1_000_000),
        metavar="N",
        help="find a part with this number of people, not the most",
    )
    parser.add_argument(
        "--duration",
        type=options.number(float, 1.0, MAX_LENGTH, "s"),
        metavar="S",
        help=f"of the parts that are listed and found [s]; {LENGTH:g} by default",
    )
    options.overrides(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints what the file holds and writes the run files."""
    for option in ("frame_rate", "people", "duration", "suite"):
        given = getattr(arguments, option) is not None
        options.check_needs(
            f"--{option.replace('_', '-')}", "`import crowd`", given=given, met=arguments.kind == "crowd"
        )
    output = None if arguments.output is None else new_path("--output", arguments.output, ".toml")
    of_scene = [override.key for override in overrides_of(arguments.overrides) if not override.key.startswith("crowd.")]
    options.check_needs("--set", "-o FILE.toml", given=bool(of_scene), met=bool(output or arguments.suite))
    document = {"schema": 1, **(_crowd if arguments.kind == "crowd" else _floor)(arguments, output)}
    if arguments.json:
        print(json.dumps(document, allow_nan=False))
    else:
        _print(document)
    return 0


def _crowd(arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
    """What a recording holds, and what was written, as --json has it."""
    arguments.duration = LENGTH if arguments.duration is None else arguments.duration
    suite = None if arguments.suite is None else new_path("--suite", arguments.suite, ".toml")
    options.check_needs("--people", "-o FILE.toml", given=arguments.people is not None, met=output is not None)
    table = _crowd_table(arguments)
    try:
        imported = import_crowd(arguments.file, table, arguments.duration)
        document = _holds_crowd(imported)
        if output is not None:
            document["wrote"] = _write(arguments, imported, output)
        if suite is not None:
            document["wrote"] = _write_suite(arguments, imported, suite)
    except InvalidValue as error:
        if error.file is not None or error.key in ("frame_rate", "duration"):
            raise
        raise error.within("crowd", file="--set") from None
    return document


def _crowd_table(arguments: argparse.Namespace) -> dict[str, Any]:
    """The keys of [crowd] that --frame-rate and --set give."""
    document: dict[str, Any] = {"crowd": {}}
    if arguments.frame_rate is not None:
        document["crowd"]["frame_rate"] = arguments.frame_rate
    for override in overrides_of(arguments.overrides):
        if override.key.startswith("crowd."):
            apply(document, override, {})
    if "frame_rate" not in document["crowd"]:
        allowed = "what the column of frames counts a second: 25 in most files of ETH and UCY, whose frames go in steps"
        raise InvalidValue("--frame-rate", None, f"{allowed} of 10 that are 0.4 s apart; 1 where it counts seconds")
    return document["crowd"]


def _write(arguments: argparse.Namespace, imported: Imported, output: Path) -> dict[str, Any]:
    """Writes the run file of a window; what was written, as --json has it."""
    window = imported.crowd.window or choose_window(imported.tracks.tracks, arguments.duration, arguments.people)
    text, scenario = _scene(arguments, scene_tables(imported, window, output), output)
    _write_text(output, text)
    return {
        "file": str(output),
        "window_s": list(window),
        "people": len(scenario.people),
        "behaviour": imported.crowd.people,
        "robot": {"start": list(scenario.robot.start), "goal": list(scenario.robot.route[-1])},
    }


def _write_suite(arguments: argparse.Namespace, imported: Imported, output: Path) -> dict[str, Any]:
    """Writes a run file of every whole window, once all are known to load, and the suite of them."""
    if {"window", "people"} & set(imported.table):
        raise InputError("--suite has every window, with people who are replayed and who react: set neither")
    length, texts = arguments.duration, {}
    for window in imported.survey.windows:
        if window.people and window.end - window.start > 0.99 * length:
            file = new_path("--suite", output.with_name(f"{output.stem}-{window.start:g}.toml"), ".toml")
            texts[file] = _scene(arguments, scene_tables(imported, (window.start, window.end), file), file)[0]
    if not texts:
        raise InvalidValue("duration", length, f"at most the recording's {imported.survey.duration:g} s")
    about = f"{printable(Path(imported.crowd.file).name)}: {len(texts)} windows of {length:g} s"
    suites = [
        {
            "name": f"{printable(output.stem)} {people}",
            "version": 1,
            "description": about,
            "scenes": [file.name for file in texts],
            "seeds": [0],
            "set": {"crowd.people": people},
        }
        for people in ("replay", "react")
    ]
    tables = {"schema": 1, "set": {"physics.engine": "kinematic"}, "suites": suites}
    for file, text in (*texts.items(), (output, _made(arguments, tables))):
        _write_text(file, text)
    return {"file": str(output), "windows": len(texts)}


def _scene(arguments: argparse.Namespace, tables: dict[str, Any], output: Path) -> tuple[str, Scenario]:
    """The text of a run file with what --set gives, and what it loads as."""
    for override in overrides_of(arguments.overrides):
        if arguments.kind != "crowd" or not override.key.startswith("crowd."):
            apply(tables, override, {})
    text = _made(arguments, tables)
    return text, loads(text, file=str(output), folder=output.absolute().parent)


def _made(arguments: argparse.Namespace, tables: dict[str, Any]) -> str:
    return f"# Made by `mjnav import {arguments.kind}`.\n{toml_text(tables)}"


def _write_text(path: Path, text: str) -> None:
    with written(path) as file:
        file.write(text.encode())


def _holds_crowd(imported: Imported) -> dict[str, Any]:
    """What a recording holds, as --json has it."""
    recording, tracks, survey = imported.recording, imported.tracks, imported.survey
    return {
        "file": imported.crowd.file,
        "columns": list(recording.columns),
        "rows": len(recording.frame),
        "people": len(recording.labels),
        "skipped_lines": recording.num_skipped,
        "repeated_rows": recording.num_repeated,
        "frames": [float(recording.frame.min()), float(recording.frame.max())],
        "frame_step": recording.usual_step,
        "frame_rate_hz": imported.crowd.frame_rate,
        "tracks": survey.people,
        "gaps": tracks.num_gaps,
        "bridged_gaps": tracks.num_bridged,
        "jumps": tracks.num_jumps,
        "single_rows": tracks.num_single,
        "duration_s": survey.duration,
        "area_m": [list(corner) for corner in survey.area],
        "speed_m_s": asdict(survey.speeds),
        "mean_time_there_s": survey.mean_time_there,
        "most_at_once": survey.most_at_once,
        "closest_m": survey.closest,
        "windows": [asdict(window) for window in survey.windows],
        "wrote": None,
    }


def _print(document: dict[str, Any]) -> None:
    """The same for people: a line for each figure, the windows as a table."""
    for key, value in document.items():
        if key not in ("schema", "windows", "wrote"):
            print(f"  {key:17}  {_text(value)}")
    if windows := document.get("windows"):
        print()
        rows = [
            (
                f"{w['start']:g} to {w['end']:g} s",
                *(_text(w[key]) for key in ("people", "most_at_once", "closest_at_start")),
            )
            for w in windows
        ]
        print_table(rows, ("window", "people", "most at once", "closest at start [m]"), numbers=(1, 2, 3))
    if wrote := document.get("wrote"):
        print()
        print("\n".join(f"{name:10}  {_text(value)}" for name, value in wrote.items()))


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_text(part)}" for key, part in value.items())
    if isinstance(value, list | tuple):
        return " ".join(map(_text, value)) or "-"
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else printable(value)


# ----------------------------------------------------------------------------------- a map or a world


_MAX_TOLD = 10  # things left out that are told one by one


def _floor(arguments: argparse.Namespace, output: Path | None) -> dict[str, Any]:
    """What a map or a world holds, and what was written, as --json has it."""
    suffixes = MAPS if arguments.kind == "map" else WORLDS
    if not arguments.file.endswith(suffixes):
        raise InvalidValue("FILE", arguments.file, f"a {arguments.kind}, a file that ends in {' or '.join(suffixes)}")
    given = {override.key for override in overrides_of(arguments.overrides)}
    if output is not None and not {"robot.start", "robot.goal"} <= given:
        raise InputError("-o needs --start X,Y,HEADING and --goal X,Y")
    tables, left_out = floor_tables(arguments.file, (output or Path("x.toml")).absolute().parent)
    document = _holds(arguments, tables, left_out)
    tell_left_out(left_out)
    if output is not None:
        text, scenario = _scene(arguments, {**tables, "name": printable(output.stem)}, output)
        _write_text(output, text)
        document["wrote"] = {"file": str(output), "pillars": len(scenario.pillars), "walls": len(scenario.walls)}
    return document


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
        return {**counts, "left_out": left_out}
    grid = read_map(arguments.file)
    states = (("occupied", OCCUPIED), ("free", FREE), ("unknown", UNKNOWN))
    shares = {name: float(np.mean(grid.cells == state)) for name, state in states}
    info = grid.info
    return {
        "cells": list(grid.cells.shape[::-1]),
        "resolution_m": info.resolution,
        "origin": list(info.origin),
        "mode": info.mode,
        **{f"{name}_share": share for name, share in shares.items()},
    }
