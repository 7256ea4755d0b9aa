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
from mjnav.scene.crowd_import import RADII, Imported, choose_window, import_crowd, scene_tables, scene_text
from mjnav.scene.load import loads
from mjnav.scene.overrides import Override, apply, overrides_of
from mjnav.scene.people import MAX_WALKING_SPEED

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
    parser.add_argument("kind", choices=("crowd",), help="what the file holds: recorded tracks of people")
    parser.add_argument("file", metavar="FILE", help="a recording: rows of frame, id, x, y, or obsmat")
    parser.add_argument("-o", "--output", metavar="FILE.toml", help="write a run file with a part of it, a new file")
    parser.add_argument(
        "--frame-rate",
        type=float,
        metavar="HZ",
        help="what the column of frames counts a second: 25 in most files of ETH and UCY, 1 where it counts seconds",
    )
    parser.add_argument(
        "--window", nargs=2, type=float, metavar=("FROM", "TO"), help="the part for the run file [s]; found by default"
    )
    parser.add_argument("--people", type=int, metavar="N", help="find a part with this number of people, not the most")
    parser.add_argument(
        "--duration",
        type=float,
        default=LENGTH,
        metavar="S",
        help=f"of the parts that are listed and found [s]; {LENGTH:g} by default",
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
    _check_options(arguments, writes=output is not None)
    table = _crowd_table(arguments)
    try:
        found = import_crowd(arguments.file, table, arguments.duration)
        if not arguments.json:
            _print(found)
        wrote = None if output is None else _write(arguments, found, table, output)
    except InvalidValue as error:
        raise _of_option(error) from None
    if arguments.json:
        print(json.dumps(_document(found, wrote), allow_nan=False))
    elif wrote is not None:
        print()
        print_lines(list(_written_lines(wrote)))
    return 0


def _check_options(arguments: argparse.Namespace, *, writes: bool) -> None:
    for option in ("window", "people", "react"):
        given = getattr(arguments, option) not in (None, False)
        check_needs(f"--{option}", "-o FILE.toml", given=given, met=writes)
    check_needs("--people", "no --window", given=arguments.people is not None, met=arguments.window is None)
    if arguments.people is not None:
        check_whole("--people", arguments.people, 1)
    if not 1.0 <= arguments.duration <= MAX_LENGTH:
        raise InvalidValue("--duration", arguments.duration, f"a number from 1 to {MAX_LENGTH:g} s")


def _crowd_table(arguments: argparse.Namespace) -> dict[str, Any]:
    """The keys of [crowd] that the options and --set give."""
    crop = arguments.crop
    options = {
        "frame_rate": arguments.frame_rate,
        "window": arguments.window,
        "crop": None if crop is None else [crop[:2], crop[2:]],
        "people": "react" if arguments.react else None,
    }
    document = {"crowd": {key: value for key, value in options.items() if value is not None}}
    for override in _overrides(arguments, of_crowd=True):
        apply(document, override, {})
    if "frame_rate" not in document["crowd"]:
        allowed = "what the column of frames counts a second: 25 in most files of ETH and UCY, whose frames go in steps"
        raise InvalidValue("--frame-rate", None, f"{allowed} of 10 that are 0.4 s apart; 1 where it counts seconds")
    return document["crowd"]


def _overrides(arguments: argparse.Namespace, *, of_crowd: bool) -> list[Override]:
    given = overrides_of(arguments.overrides)
    return [override for override in given if override.key.startswith("crowd.") == of_crowd]


def _of_option(error: InvalidValue) -> InvalidValue:
    """The error of a key of [crowd] in the words of the command line; that of a file as it is."""
    if error.file is not None:
        return error
    option = _OPTIONS.get(error.key.partition(".")[0], f"--set: crowd.{error.key}")
    return InvalidValue(option, error.found, error.allowed, nearest=error.nearest)


def _write(arguments: argparse.Namespace, found: Imported, table: dict[str, Any], output: Path) -> dict[str, Any]:
    """Writes the run file once it is known to load; what was written, as --json has it."""
    window = found.crowd.window or choose_window(found.tracks.tracks, arguments.duration, arguments.people)
    tables = scene_tables(found, window, printable(output.stem), output.absolute().parent)
    tables["crowd"] = {**table, **tables["crowd"]}
    for override in _overrides(arguments, of_crowd=False):
        apply(tables, override, {})
    text = scene_text(tables)
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
        "frame_step": recording.usual_step,
        "frame_rate_hz": found.crowd.frame_rate,
        "frame_rate_basis": "given",
        "frame_rate_sure": True,
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
        "pairs": survey.pairs,
        "closest_m": survey.closest,
        "overlapping_pairs": {f"{r:g}": n for r, n in zip(RADII, survey.overlapping, strict=True)},
        "windows": [asdict(window) for window in survey.windows],
        "wrote": wrote,
    }


def _print(found: Imported) -> None:
    print(printable(found.crowd.file))
    print_lines([f"  {name:13}{text}" for name, text in _facts(found)])
    windows = found.survey.windows
    print()
    rows = [
        (f"{w.start:g} to {w.end:g} s", str(w.people), str(w.most_at_once), _metres(w.closest_at_start))
        for w in windows[:_MAX_WINDOWS]
    ]
    print_table(rows, ("window", "people", "most at once", "closest at start"), numbers=(1, 2, 3))
    if len(windows) > _MAX_WINDOWS:
        print(f"{len(windows) - _MAX_WINDOWS} windows more, which --json has")


def _facts(found: Imported) -> Iterator[tuple[str, str]]:
    recording, tracks, survey = found.recording, found.tracks, found.survey
    speeds, step, rate = survey.speeds, recording.usual_step, found.crowd.frame_rate
    (x0, y0), (x1, y1) = survey.area
    yield "columns", f"{' '.join(recording.columns)}; {recording.num_skipped} lines of comments or headers"
    people = f"{len(recording.frame)} of {len(recording.labels)} people"
    yield "rows", f"{people}; {recording.num_repeated} repeated, left out"
    yield "frames", f"{recording.frame.min():g} to {recording.frame.max():g}, usually in steps of {step:g}"
    yield "duration", f"{survey.duration:.1f} s at {rate:g} frames a second; a step is {step / rate:.3g} s"
    yield "area", f"x {x0:.2f} to {x1:.2f} m, y {y0:.2f} to {y1:.2f} m"
    walking = "nobody walks" if speeds.median_walking is None else f"{speeds.median_walking:.2f} m/s median of who walk"
    yield "speed", f"{walking}, {speeds.highest:.2f} highest; {100.0 * speeds.standing:.0f} % of the steps are standing"
    yield "tracks", f"{survey.people}; a person is there for {survey.mean_time_there:.1f} s on average"
    yield "at once", f"{survey.most_at_once} people at most"
    yield "gaps", f"{tracks.num_gaps} that cut a track, {tracks.num_bridged} shorter ones bridged"
    yield "jumps", f"{tracks.num_jumps} that cut a track, faster than {MAX_WALKING_SPEED:g} m/s"
    yield "single rows", f"{tracks.num_single}, left out"
    counts = ", ".join(f"{n} with radius {r:g}" for r, n in zip(RADII, survey.overlapping, strict=True))
    yield "overlaps", f"of {survey.pairs} pairs at a moment: {counts}; closest {_metres(survey.closest)}"


def _metres(value: float | None) -> str:
    return "none" if value is None else f"{value:.2f} m"


def _written_lines(wrote: dict[str, Any]) -> Iterator[str]:
    (x, y, _), (to_x, to_y) = wrote["robot"]["start"], wrote["robot"]["goal"]
    first, last = wrote["window_s"]
    yield f"{wrote['file']}: {first:g} to {last:g} s, {wrote['people']} people ({wrote['behaviour']})"
    yield f"  robot        from ({x:g}, {y:g}) to ({to_x:g}, {to_y:g})"
