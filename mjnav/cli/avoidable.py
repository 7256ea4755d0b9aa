"""`mjnav avoidable LOG...`: which collisions and time-outs a robot that knew all true paths would have avoided."""

import argparse
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from mjnav.cli.terminal import answer, compile_notice, print_table, progress, tell
from mjnav.errors import MjnavError
from mjnav.printable import printable

Document = Mapping[str, Any]
RUN_HEADS: Mapping[str, str] = MappingProxyType(  # key of a run's document -> head of its column
    {
        "method": "method",
        "scene": "scene",
        "seed": "seed",
        "outcome": "outcome",
        "name": "touched",
        "time_s": "at [s]",
        "who_moved": "who moved",
        "avoidable_2s_before": "avoidable 2 s before",
        "avoidable_1s_before": "1 s before",
        "timeout_avoidable": "avoidable time-out",
        "last_chance_s_before": "last chance [s before]",
        "stalled_s": "at rest [s]",
        "stalled_way_free_s": "way free [s]",
    }
)
METHOD_HEADS: Mapping[str, str] = MappingProxyType(
    {
        "method": "method",
        "runs": "runs",
        "robot_at_fault": "its fault, of its collisions",
        "avoidable_2s_before": "avoidable 2 s before",
        "avoidable_1s_before": "1 s before",
        "timeout_avoidable": "avoidable time-outs",
        "mean_stalled_s": "at rest [s]",
        "mean_stalled_way_free_s": "way free [s]",
    }
)


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument(
        "logs",
        metavar="LOG",
        nargs="+",
        help="logs, folders of logs, or studies (a name, or a folder with results), of which the kept logs count",
    )
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints a line a run, and of several runs a table of the methods.

    Raises the first error of a log that cannot be read, after the others are printed.
    """
    from mjnav.study.avoidable import by_method, judge, sources

    named = [sources(given) for given in arguments.logs]
    meant = {source.path: source for logs, _ in named for source in logs}  # each log once
    runs: list[Document] = []
    errors: list[MjnavError] = []
    with compile_notice(), progress("avoidable", len(meant), "logs") as show:
        for done, source in enumerate(meant.values()):
            try:
                runs.append(judge(source))
            except MjnavError as error:
                errors.append(error)
            show(done + 1)
    if errors and not runs:
        raise errors[0]
    methods = by_method(runs)
    notes = [note for _, note in named if note is not None]
    answer(arguments, {"logs": runs, "methods": methods, "notes": notes}, lambda: _print(runs, methods, notes))
    for error in errors[1:]:
        tell(str(error))
    if errors:
        raise errors[0]
    return 0


def _print(runs: Sequence[Document], methods: Mapping[str, Document], notes: Sequence[str]) -> None:
    _print_table([{**run, **(run["collision"] or {})} for run in runs], RUN_HEADS)
    if len(runs) > 1:
        print()
        _print_table([{"method": name, **shares} for name, shares in methods.items()], METHOD_HEADS)
        print("shares with 95 % intervals; times are means a run")
    for note in notes:
        print(note)


def _print_table(documents: Sequence[Document], heads: Mapping[str, str]) -> None:
    print_table([[_cell(document.get(key)) for key in heads] for document in documents], list(heads.values()))


def _cell(value: object) -> str:
    """A value of a document in words; a share as `3 of 4, 75 % [30, 95]`."""
    match value:
        case None | {"of": 0}:
            return "-"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.1f}"
        case {"count": int(count), "of": int(total), "interval": (float(low), float(high))}:
            return f"{count} of {total}, {100 * count / total:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"
    return printable(str(value))
