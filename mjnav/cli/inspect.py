"""`mjnav inspect LOG`: what a log holds and how its run went, also of a killed writer or a damaged file."""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

from mjnav.cli.terminal import print_drawn, print_table, shown
from mjnav.errors import DamagedLogError
from mjnav.printable import printable

if TYPE_CHECKING:
    from mjnav.report.inspection import Inspection
    from mjnav.report.worst_moments import WorstMoment

_RUN = ("scene", "controller", "seed", "engine")  # of the metadata, in one line
_VERSION = "version."
_MAX_LINES = 500  # of a section, and topics
_MAX_WIDTH = 60  # [characters] that a short name is padded to, because of a long one

Columns = Sequence[tuple[str, str, str]]  # key, head and form of the numbers of a row
_BELIEFS = (
    *(("ticks", "ticks", "d"), ("rmse_m", "RMSE [m]", ".3f"), ("nees", "NEES", ".2f"), ("coverage", "coverage", ".1%")),
    *(("divergences", "diverged", "d"), ("ess_min", "least ESS", ".1f"), ("ess_mean", "mean ESS", ".1f")),
    ("depleted_share", "depleted", ".1%"),
)
_TOPICS = (
    *(("messages", "messages", "d"), ("missing", "missing", "d"), ("hz", "Hz", ".2f")),
    *(("max_gap_s", "max gap [s]", ".3f"), ("max_gap_at_s", "at [s]", ".2f")),
    *(("bytes", "bytes", "d"), ("share", "share", ".1%")),
)


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="an MCAP file")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints what can be read; 0 for any readable beginning of a log. Raises DamagedLogError after printing."""
    from mjnav.log.encode.json_messages import dumps
    from mjnav.report.inspection import inspect

    found = inspect(arguments.log)
    if arguments.json:
        print(dumps(found.document()).decode())
    elif found.topics or found.run is not None or found.damage is None:
        _print(found)
    if found.damage is not None:
        sys.stdout.flush()
        raise DamagedLogError(found.damage["error"])
    return 0


def _print(found: "Inspection") -> None:
    print_drawn(lambda console: console.print(_headline(found), style="bold", soft_wrap=True))
    _show("", list(_origin(found)))
    for title, lines in (
        ("missing", [f"  {printable(sentence)}" for sentence in found.missing]),
        ("recovered from another log", list(_named(found.recovered or {}))),
        ("worst moments", list(_moments(found.moments))),
        ("figures", list(_figures(found.figures or {}))),
        ("timing", list(_timing(found.timing))),
        ("result", list(_named(_not_yet_said(found)))),
    ):
        _show(title, lines)
    if found.beliefs:
        _print_title("beliefs")
        _print_rows(("of", "by"), _BELIEFS, [(belief["body"], belief["by"]) for belief in found.beliefs], found.beliefs)
    print()
    names = [(name, topic["schema"]) for name, topic in found.topics.items()]
    _print_rows(("topic", "schema"), _TOPICS, names, found.topics.values())
    if len(found.topics) > _MAX_LINES:
        print(f"{len(found.topics) - _MAX_LINES} topics more, which --json has")


def _print_title(text: str) -> None:
    print()
    print_drawn(lambda console: console.print(text, style="bold"))


def _show(title: str, lines: Sequence[str]) -> None:
    """As many as somebody reads; a stranger's log may name a hundred thousand things."""
    if title and lines:
        _print_title(title)
    for line in lines[:_MAX_LINES]:
        print(line)
    if len(lines) > _MAX_LINES:
        print(f"  {len(lines) - _MAX_LINES} lines more, which --json has")


def _headline(found: "Inspection") -> str:
    """How the run ended and what state the file is in, in one line."""
    duration = found.duration_s
    length = "no messages" if duration is None else f"{duration:.1f} s of {'simulated ' * (found.run is not None)}time"
    state = "damaged" if found.damage is not None else "truncated" if found.truncated else ""
    ended = found.outcome or ("not a run of mjnav" if found.run is None else "the run did not end")
    return f"{printable(ended)}: {length}{f'; the file is {state}' if state else ''}"


def _origin(found: "Inspection") -> Iterator[str]:
    """Where the log comes from."""
    run = {key: printable(value) for key, value in (found.run or {}).items()}
    yield f"  {printable(found.path)}, {_size(found.bytes)}"
    if run:
        yield f"  {', '.join(f'{key} {run.pop(key)}' for key in _RUN if key in run)}"
        versions = [f"{key.removeprefix(_VERSION)} {run.pop(key)}" for key in list(run) if key.startswith(_VERSION)]
        if versions:
            yield f"  {', '.join(versions)}"
        for key, value in run.items():
            yield f"  {printable(key)} {value}".rstrip()
    if found.people:
        from mjnav.report.inspection import people_lines

        yield from (f"  people {printable(line)}" for line in people_lines(found.people))


def _moments(moments: Sequence["WorstMoment"]) -> Iterator[str]:
    for m in moments:
        yield f"  {m.time_s:8.2f} s  tick {m.tick:<6d}  {m.kind:12}  {printable(m.text)}"


def _timing(timing: Mapping[str, Any] | None) -> Iterator[str]:
    if timing is None:
        return
    yield f"  {'ms':10}  {'p50':>8}  {'p99':>8}  {'max':>8}"
    for name, quantiles in {**timing["compute_ms"], "lateness": timing["lateness_ms"]}.items():
        yield f"  {name:10}  " + "  ".join(f"{shown(value, '.3f'):>8}" for value in quantiles.values())
    yield from _named({key: timing[key] for key in ("deadline_misses", "real_time_factor", "work_factor")})


def _not_yet_said(found: "Inspection") -> dict[str, Any]:
    """What only the result says."""
    said = {*(found.figures or {}), *(found.timing or {}), *(found.run or {}), "schema"}
    return {key: value for key, value in (found.result or {}).items() if key not in said and value != {}}


def _print_rows(texts: Sequence[str], columns: Columns, rows: Iterable[tuple[str, ...]], values: Iterable[Any]) -> None:
    """A row for each of the values: its texts under the first heads, then its numbers."""
    numbers = ([shown(value[key], form) for key, _, form in columns] for value in values)
    lines = [(*map(printable, row), *line) for row, line in islice(zip(rows, numbers, strict=True), _MAX_LINES)]
    heads = (*texts, *(head for _, head, _ in columns))
    print_table(lines, heads, numbers=range(len(texts), len(heads)))


def _figures(figures: Mapping[str, Any]) -> Iterator[str]:
    """A line for each figure with its unit, group by group."""
    from mjnav.metrics.summary import FIGURES
    from mjnav.report.figure_text import by_group

    width = min(max(map(len, figures), default=0), _MAX_WIDTH)
    for group, names in by_group(figures).items():
        yield f"  {group}"
        for name in names:
            value = figures[name]
            unit = FIGURES[name].unit if name in FIGURES and value is not None else ""
            yield f"    {printable(name):{width}}  {_text(value)} {unit}".rstrip()


def _named(values: Mapping[str, Any]) -> Iterator[str]:
    """A line for each value."""
    width = min(max(map(len, values), default=0), _MAX_WIDTH)
    for key, value in values.items():
        yield f"  {printable(key):{width}}  {_text(value)}".rstrip()


def _text(value: object) -> str:
    """A figure for people: four digits, tables as `name value`."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return f"{len(value)}" if len(value) > 3 else "; ".join(map(_text, value)) or "none"
    if isinstance(value, Mapping):
        return ", ".join(f"{printable(key)} {_text(part)}" for key, part in value.items())
    return printable(value)


def _size(size: float) -> str:
    for unit in ("B", "kB", "MB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} GB"
