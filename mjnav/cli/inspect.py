"""`mjnav inspect LOG`: what a log holds and how its run went, also where its writer was killed."""

import argparse
import json
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mjnav.recording import Log, open_log

if TYPE_CHECKING:
    from rich.table import Table

_FIRST_FIGURES = ("success", "time_s", "collisions", "min_clearance_m", "path_length_m", "control_cost")
_PIPE_WIDTH = 200  # [characters] where no terminal says how wide it is


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="an MCAP file")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the summary; 0 for any readable beginning of a log."""
    log = open_log(arguments.log)
    if arguments.json:
        print(json.dumps(summary(log)))
    else:
        _print(log)
    return 0


def summary(log: Log) -> dict[str, Any]:
    """The object that `--json` prints; times are simulated, rates are over a topic's own span."""
    return {
        "schema": 1,
        "complete": log.complete,
        "truncated": log.truncated,
        "duration_s": log.duration,
        "outcome": _outcome(log),
        "topics": {
            name: {
                "schema": topic.schema,
                "messages": topic.messages,
                "hz": topic.hz,
                "max_gap_s": None if topic.max_gap_ns is None else 1e-9 * topic.max_gap_ns,
                "bytes": topic.bytes,
            }
            for name, topic in sorted(log.topics.items())
        },
        "run": None if log.run is None else dict(log.run),
        "result": None if log.result is None else dict(log.result),
    }


def _outcome(log: Log) -> str | None:
    return None if log.result is None else log.result.get("outcome")


def _headline(log: Log) -> str:
    """How the run ended, in one line."""
    duration = "no messages" if log.duration is None else f"{log.duration:.1f} s of simulated time"
    end = "; the file has no end: its writer was killed" if log.truncated else ""
    if log.run is None:
        return f"not a run of mjnav: {duration}{end}"
    return f"{_outcome(log) or 'the run did not end'}: {duration}{end}"


def _print(log: Log) -> None:
    from rich.console import Console

    on_terminal = sys.stdout is not None and sys.stdout.isatty()
    console = Console(width=None if on_terminal else _PIPE_WIDTH, highlight=False, markup=False, emoji=False)
    with console.capture() as captured:  # rich itself would end the process where the reader has gone
        console.print(_headline(log), style="bold")
        for title, values in (("result", _ordered(log.result or {})), ("run", log.run or {})):
            if values:
                width = max(map(len, values))
                console.print(f"\n{title}", style="bold")
                for key, value in values.items():
                    console.print(f"  {key:{width}}  {_text(value)}", soft_wrap=True)
        console.print()
        console.print(_topics(log))
    print(captured.get(), end="")


def _topics(log: Log) -> "Table":
    from rich.table import Table

    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column("topic", overflow="fold")
    table.add_column("schema", overflow="fold")
    for column in ("messages", "Hz", "max gap [s]", "kB"):
        table.add_column(column, justify="right", no_wrap=True)
    for name, topic in sorted(log.topics.items()):
        table.add_row(
            name,
            topic.schema,
            str(topic.messages),
            "-" if topic.hz is None else f"{topic.hz:.2f}",
            "-" if topic.max_gap_ns is None else f"{1e-9 * topic.max_gap_ns:.3f}",
            f"{1e-3 * topic.bytes:.1f}",
        )
    return table


def _ordered(values: Mapping[str, Any]) -> dict[str, Any]:
    """What is asked first comes first."""
    first = [key for key in _FIRST_FIGURES if key in values]
    return {key: values[key] for key in [*first, *(key for key in values if key not in first)]}


def _text(value: object) -> str:
    """A figure for people: four digits, tables as `name value`."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_text(part)}" for key, part in value.items())
    return str(value)
