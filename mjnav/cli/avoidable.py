"""`mjnav avoidable LOG...`: which collisions and time-outs a robot that knew all true paths would have avoided."""

import argparse
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mjnav.cli.terminal.progress import compile_notice, progress, tell
from mjnav.cli.terminal.tables import print_table
from mjnav.errors import MjnavError
from mjnav.printable import printable

if TYPE_CHECKING:
    from mjnav.study.avoidable import JudgedLog, MethodShares, Share

AVOIDABLE = ("avoidable 2 s before", "1 s before")  # as `oracle.avoidable.LEADS`
RUN_HEADS = ("method", "scene", "seed", "outcome", "touched", "who moved", *AVOIDABLE, "avoidable time-out")
RUN_TIMES = ("last chance [s before]", "at rest [s]", "way free [s]")
METHOD_HEADS = ("method", "runs", "collisions", "its fault", *AVOIDABLE, "avoidable time-outs")
METHOD_TIMES = RUN_TIMES[1:]


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
    meant = {source.path: source for found, _ in named for source in found}  # each log once
    judged: list[JudgedLog] = []
    errors: list[MjnavError] = []
    with compile_notice(), progress("avoidable", len(meant), "logs") as show:
        for done, source in enumerate(meant.values()):
            try:
                judged.append(judge(source))
            except MjnavError as error:
                errors.append(error)
            show(done + 1)
    if errors and not judged:
        raise errors[0]
    methods, notes = by_method(judged), [str(kept) for _, kept in named if kept is not None]
    if arguments.json:
        print(json.dumps(_document(judged, methods, notes)))
    else:
        _print(judged, methods, notes)
    for error in errors[1:]:
        tell(str(error))
    if errors:
        raise errors[0]
    return 0


def _print(judged: Sequence["JudgedLog"], methods: Mapping[str, "MethodShares"], notes: Sequence[str]) -> None:
    numbers = range(len(RUN_HEADS), len(RUN_HEADS) + len(RUN_TIMES))
    print_table([_run(one) for one in judged], (*RUN_HEADS, *RUN_TIMES), numbers=numbers)
    if len(judged) > 1:
        print()
        rows = [_method(name, shares) for name, shares in methods.items()]
        numbers = (1, 2, 3, len(METHOD_HEADS), len(METHOD_HEADS) + 1)
        print_table(rows, (*METHOD_HEADS, *METHOD_TIMES), numbers=numbers)
        print("shares with 95 % intervals; times are means a run")
    for note in notes:
        print(note)


def _run(one: "JudgedLog") -> tuple[str, ...]:
    collision, rest = one.judgement.collision, one.judgement.rest
    if collision is None:
        hit, chance = ("-",) * 4, None
    else:
        touched = f"{collision.contact.name} at {collision.contact.time:.1f} s"
        who = "-" if collision.touch is None else str(collision.touch)
        hit, chance = (touched, who, *map(_verdict, collision.avoidable)), collision.last_chance
    seed = "-" if one.seed is None else str(one.seed)
    return (
        *(printable(text) for text in (one.method, one.scene, seed, one.outcome or "-", *hit[:2])),
        *hit[2:],
        _verdict(one.judgement.timeout),
        "-" if chance is None else f"{chance:.1f}",
        f"{rest.total:.1f}",
        f"{rest.free:.1f}",
    )


def _verdict(avoidable: bool | None) -> str:
    return "-" if avoidable is None else "yes" if avoidable else "no"


def _method(name: str, shares: "MethodShares") -> tuple[str, ...]:
    return (
        printable(name),
        str(shares.runs),
        str(shares.at_fault.of),
        str(shares.at_fault.count),
        *map(_share, (*shares.avoidable, shares.timeouts)),
        f"{shares.rest:.1f}",
        f"{shares.rest_free:.1f}",
    )


def _share(share: "Share") -> str:
    """`3 of 4, 75 % [30, 95]`."""
    if share.interval is None:
        return "-"
    low, high = share.interval
    return f"{share.count} of {share.of}, {100 * share.count / share.of:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def _document(
    judged: Sequence["JudgedLog"], methods: Mapping[str, "MethodShares"], notes: Sequence[str]
) -> dict[str, Any]:
    return {
        "schema": 1,
        "logs": [_run_document(one) for one in judged],
        "methods": {name: _method_document(shares) for name, shares in methods.items()},
        "notes": list(notes),
    }


def _run_document(one: "JudgedLog") -> dict[str, Any]:
    from mjnav.metrics.oracle.avoidable import LEADS

    collision, rest = one.judgement.collision, one.judgement.rest
    hit = None
    if collision is not None:
        touch = collision.touch
        hit = {
            "time_s": collision.contact.time,
            "kind": collision.contact.kind,
            "name": collision.contact.name,
            "robot_moved": None if touch is None else touch.moving,
            "robot_at_fault": None if touch is None else touch.at_fault,
            **{_key(lead): found for lead, found in zip(LEADS, collision.avoidable, strict=True)},
            "last_chance_s_before": collision.last_chance,
        }
    return {
        "log": str(one.path),
        "scene": one.scene,
        "method": one.method,
        "seed": one.seed,
        "outcome": one.outcome,
        "collision": hit,
        "timeout_avoidable": one.judgement.timeout,
        "stalled_s": rest.total,
        "stalled_way_free_s": rest.free,
    }


def _method_document(shares: "MethodShares") -> dict[str, Any]:
    from mjnav.metrics.oracle.avoidable import LEADS

    def share(found: "Share") -> dict[str, Any]:
        return {"count": found.count, "of": found.of, "interval": found.interval}

    return {
        "runs": shares.runs,
        "robot_at_fault": share(shares.at_fault),
        **{_key(lead): share(found) for lead, found in zip(LEADS, shares.avoidable, strict=True)},
        "timeout_avoidable": share(shares.timeouts),
        "mean_stalled_s": shares.rest,
        "mean_stalled_way_free_s": shares.rest_free,
    }


def _key(lead: float) -> str:
    return f"avoidable_{lead:g}s_before"
