"""`mjnav import crowd FILE`: what a recording of people holds, and a run file with a part of it."""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mjnav.cli.options import scene_options
from mjnav.cli.options.common import check_needs, check_whole
from mjnav.cli.terminal.tables import print_lines, print_table
from mjnav.errors import InvalidValue
from mjnav.output_files import new_path, written
from mjnav.printable import printable
from mjnav.scenarios.crowd.importing import (
    GIVEN,
    RADII,
    Imported,
    choose_window,
    import_crowd,
    scene_tables,
    scene_text,
)
from mjnav.scenarios.load import loads
from mjnav.scenarios.overrides import Override, apply, overrides_of
from mjnav.scenarios.people import MAX_WALKING_SPEED

KINDS = ("crowd",)
LENGTH, MAX_LENGTH = 30.0, 1e6  # [s] of a window
_MAX_WINDOWS = 60  # in text
_OPTIONS = {
    "frame_rate": "--frame-rate",
    "window": "--window",
    "crop": "--crop",
    "people": "--react",
    "duration": "--duration",
}


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("kind", choices=KINDS, help="what the file holds: recorded tracks of people")
    parser.add_argument("file", metavar="FILE", help="a recording: rows of frame, id, x, y, or obsmat")
    parser.add_argument("-o", "--output", metavar="FILE.toml", help="write a run file with a part of it, a new file")
    parser.add_argument(
        "--frame-rate", type=float, metavar="HZ", help="what the column of frames counts a second; guessed by default"
    )
    parser.add_argument(
        "--window", nargs=2, type=float, metavar=("FROM", "TO"), help="the part for the run file [s]; found by default"
    )
    parser.add_argument("--people", type=int, metavar="N", help="find a part with this number of people, not the most")
    parser.add_argument(
        "--duration", type=float, metavar="S", help=f"of the parts that are listed and found [s]; {LENGTH:g} by default"
    )
    parser.add_argument(
        "--crop", nargs=4, type=float, metavar=("X0", "Y0", "X1", "Y1"), help="leave out who is outside [m]"
    )
    parser.add_argument("--react", action="store_true", help="people who react in the run file, not a replay")
    scene_options.overrides(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints what the file holds and writes the run file."""
    output = None if arguments.output is None else new_path("--output", arguments.output, ".toml")
    _check_options(arguments, output)
    length = LENGTH if arguments.duration is None else arguments.duration
    table = _crowd_table(arguments)
    try:
        found = import_crowd(arguments.file, table, length)
    except InvalidValue as error:
        raise _of_option(error) from None
    if not arguments.json:
        _print(found)
    wrote = None if output is None else _write(arguments, found, table, output, length)
    if arguments.json:
        print(json.dumps(_document(found, wrote), allow_nan=False))
    elif wrote is not None:
        print()
        print_lines(list(_written_lines(wrote)))
    return 0


def _check_options(arguments: argparse.Namespace, output: Path | None) -> None:
    writes = "-o FILE.toml"
    check_needs("--window", writes, given=arguments.window is not None, met=output is not None)
    check_needs("--people", writes, given=arguments.people is not None, met=output is not None)
    check_needs("--react", writes, given=arguments.react, met=output is not None)
    check_needs("--people", "no --window", given=arguments.people is not None, met=arguments.window is None)
    if arguments.people is not None:
        check_whole("--people", arguments.people, 1)
    if arguments.duration is not None and not 1.0 <= arguments.duration <= MAX_LENGTH:
        raise InvalidValue("--duration", arguments.duration, f"a number from 1 to {MAX_LENGTH:g} s")


def _crowd_table(arguments: argparse.Namespace) -> dict[str, Any]:
    """The keys of [crowd] that the options and --set give."""
    table: dict[str, Any] = {}
    if arguments.frame_rate is not None:
        table["frame_rate"] = arguments.frame_rate
    if arguments.window is not None:
        table["window"] = arguments.window
    if arguments.crop is not None:
        table["crop"] = [arguments.crop[:2], arguments.crop[2:]]
    if arguments.react:
        table["people"] = "react"
    document = {"crowd": table}
    for override in _overrides(arguments, of_crowd=True):
        apply(document, override, {})
    return document["crowd"]


def _overrides(arguments: argparse.Namespace, *, of_crowd: bool) -> list[Override]:
    return [one for one in overrides_of(arguments.overrides) if one.key.startswith("crowd.") == of_crowd]


def _of_option(error: InvalidValue) -> InvalidValue:
    """The error of a key of [crowd] in the words of the command line; any other as it is."""
    if error.file is not None:
        return error
    first = error.key.partition(".")[0]
    if first in _OPTIONS:
        return InvalidValue(_OPTIONS[first], error.found, error.allowed, nearest=error.nearest)
    return InvalidValue(f"--set: crowd.{error.key}", error.found, error.allowed, nearest=error.nearest)


def _write(
    arguments: argparse.Namespace, found: Imported, table: dict[str, Any], output: Path, length: float
) -> dict[str, Any]:
    """Writes the run file once it is known to load; what was written, as --json has it."""
    if not found.rate.sure:
        allowed = f"a frame rate; the guess of {found.rate.frame_rate:g} Hz ({found.rate.basis}) is not sure"
        raise InvalidValue("--frame-rate", None, allowed)
    window = found.crowd.window or choose_window(found.tracks.tracks, length, arguments.people)
    try:
        tables = scene_tables(found, window, printable(output.stem), output.absolute().parent)
    except InvalidValue as error:
        raise _of_option(error) from None
    tables["crowd"] = {**table, **tables["crowd"]}
    for override in _overrides(arguments, of_crowd=False):
        apply(tables, override, {})
    text = scene_text(tables, found)
    scenario = loads(text, file=str(output), folder=output.absolute().parent)
    with written(output) as file:
        file.write(text.encode())
    return {
        "file": str(output),
        "window_s": list(window),
        "people": len(scenario.people),
        "behaviour": found.crowd.people,
        "robot": {"start": list(scenario.robot.start), "goal": list(scenario.robot.route[-1])},
    }


def _document(found: Imported, wrote: dict[str, Any] | None) -> dict[str, Any]:
    recording, tracks, survey = found.recording, found.tracks, found.survey
    return {
        "schema": 1,
        "columns": list(recording.columns),
        "rows": len(recording.frame),
        "people": len(recording.labels),
        "skipped_lines": recording.num_skipped,
        "repeated_rows": recording.num_repeated,
        "frames": [float(recording.frame.min()), float(recording.frame.max())],
        "frame_step": found.step,
        "frame_rate_hz": found.rate.frame_rate,
        "frame_rate_basis": found.rate.basis,
        "frame_rate_sure": found.rate.sure,
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
        "pairs": survey.overlaps.pairs,
        "closest_m": survey.overlaps.closest,
        "overlapping_pairs": {f"{r:g}": n for r, n in zip(RADII, survey.overlaps.overlapping, strict=True)},
        "windows": [asdict(window) for window in survey.windows],
        "wrote": wrote,
    }


def _print(found: Imported) -> None:
    print(printable(found.crowd.file))
    print_lines([f"  {name:13}{text}" for name, text in _facts(found)])
    windows = found.survey.windows
    print()
    rows = [
        (f"{one.start:g} to {one.end:g} s", str(one.people), str(one.most_at_once), _metres(one.closest_at_start))
        for one in windows[:_MAX_WINDOWS]
    ]
    print_table(rows, ("window", "people", "most at once", "closest at start"), numbers=(1, 2, 3))
    if len(windows) > _MAX_WINDOWS:
        print(f"{len(windows) - _MAX_WINDOWS} windows more, which --json has")


def _facts(found: Imported) -> Iterator[tuple[str, str]]:
    recording, tracks, survey = found.recording, found.tracks, found.survey
    speeds, overlaps = survey.speeds, survey.overlaps
    (x0, y0), (x1, y1) = survey.area
    yield "columns", f"{' '.join(recording.columns)}; {recording.num_skipped} lines of comments or headers"
    yield (
        "rows",
        f"{len(recording.frame)} of {len(recording.labels)} people; {recording.num_repeated} repeated, left out",
    )
    yield "frames", f"{recording.frame.min():g} to {recording.frame.max():g}, usually in steps of {found.step:g}"
    how = "" if found.rate.basis == GIVEN else "probably, " if found.rate.sure else "a guess, give --frame-rate: "
    yield "frame rate", f"{found.rate.frame_rate:g} Hz ({how}{found.rate.basis})"
    yield "duration", f"{survey.duration:.1f} s; a step is {found.step / found.rate.frame_rate:.3g} s"
    yield "area", f"x {x0:.2f} to {x1:.2f} m, y {y0:.2f} to {y1:.2f} m"
    walking = "nobody walks" if speeds.median_walking is None else f"{speeds.median_walking:.2f} m/s median of who walk"
    yield "speed", f"{walking}, {speeds.highest:.2f} highest; {100.0 * speeds.standing:.0f} % of the steps are standing"
    yield "tracks", f"{survey.people}; a person is there for {survey.mean_time_there:.1f} s on average"
    yield "at once", f"{survey.most_at_once} people at most"
    yield "gaps", f"{tracks.num_gaps} that cut a track, {tracks.num_bridged} shorter ones bridged"
    yield "jumps", f"{tracks.num_jumps} that cut a track, faster than {MAX_WALKING_SPEED:g} m/s"
    yield "single rows", f"{tracks.num_single}, left out"
    counts = ", ".join(f"{n} with radius {r:g}" for r, n in zip(RADII, overlaps.overlapping, strict=True))
    yield "overlaps", f"of {overlaps.pairs} pairs at a moment: {counts}; closest {_metres(overlaps.closest)}"


def _metres(value: float | None) -> str:
    return "none" if value is None else f"{value:.2f} m"


def _written_lines(wrote: dict[str, Any]) -> Iterator[str]:
    (x, y, _), (to_x, to_y) = wrote["robot"]["start"], wrote["robot"]["goal"]
    first, last = wrote["window_s"]
    yield f"{wrote['file']}: {first:g} to {last:g} s, {wrote['people']} people ({wrote['behaviour']})"
    yield f"  robot        from ({x:g}, {y:g}) to ({to_x:g}, {to_y:g})"
