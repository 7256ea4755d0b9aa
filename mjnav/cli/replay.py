"""`mjnav replay LOG`: runs a log's scenario again, and says identical, or what differs first."""

import argparse
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from mjnav.cli.main import INTERRUPTED
from mjnav.cli.terminal import compile_notice, interruptible, progress, tell
from mjnav.printable import printable

if TYPE_CHECKING:
    from mjnav.loop.replay import Replay


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="a log of mjnav's")
    code = parser.add_mutually_exclusive_group()
    code.add_argument(
        "--trust", action="store_true", help="import and run a controller that the log names by its module"
    )
    code.add_argument("--controller", metavar="NAME", help="run this one in its place, with the log's parameters")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the comparison; 0 where nothing differs, 1 where something does."""
    from mjnav.log import open_log
    from mjnav.loop.replay import replay

    log = open_log(arguments.log)
    with compile_notice(), interruptible() as interrupted, progress("replay", log.duration or 0.0) as show:
        comparison = replay(
            log, trust=arguments.trust, controller=arguments.controller, stop=interrupted, progress=show
        )
    if interrupted():
        tell(
            f"interrupted after {comparison.ticks} ticks, {'all identical' if comparison.identical else 'which differ'}"
        )
        return INTERRUPTED
    print(json.dumps(summary(comparison)) if arguments.json else describe(comparison))
    return 0 if comparison.identical else 1


def summary(comparison: "Replay") -> dict[str, Any]:
    """The object that `--json` prints."""
    first = comparison.differences[0] if comparison.differences else None
    return {
        "schema": 1,
        "log": str(comparison.path),
        "warnings": list(comparison.warnings),  # before what they may explain
        "identical": comparison.identical,
        "ticks": comparison.ticks,
        "missing_ticks": comparison.missing,
        "complete": comparison.complete,
        "outcome": comparison.outcome,
        "state_hash": comparison.state_hash,
        "first_difference": first
        and {
            "tick": comparison.tick,
            "time_s": comparison.time,
            "part": first.part,
            "field": first.field,
            "log": first.logged,
            "replay": first.again,
            "amount": first.amount,
        },
        "differences": len(comparison.differences),
    }


def describe(comparison: "Replay") -> str:
    """The comparison, for people: first what is not as it was when the log was written, then what follows."""
    lines = [f"warning: {printable(text)}" for text in comparison.warnings]
    if comparison.identical and comparison.complete:
        lines += [f"identical: {comparison.ticks} ticks, state hash {comparison.state_hash}"]
    elif comparison.identical:
        lines += [f"identical as far as the log goes: {comparison.ticks} ticks; its run did not end in order"]
    else:
        lines += _differing(comparison)
    if comparison.missing:
        lines.append(f"  the log lacks {comparison.missing} ticks, which were not compared")
    return "\n".join(lines)


def _differing(comparison: "Replay") -> Iterator[str]:
    first, parts = comparison.differences[0], dict.fromkeys(difference.part for difference in comparison.differences)
    at_end = first.part in ("run", "result")
    place = (
        f"at the end, after {comparison.tick} ticks"
        if at_end
        else f"in tick {comparison.tick}, at {comparison.time:g} s"
    )
    apart = f", {first.amount:.3g} apart" if first.amount is not None else ""
    yield f"differs {place}: {len(comparison.differences)} values, {', '.join(parts)}"
    yield f"  {first.part:8}  {first.field}: {first.logged} in the log, {first.again} now{apart}"
