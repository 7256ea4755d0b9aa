"""What a log holds and how its run went, as one dictionary: `mjnav inspect --json` prints it, a report shows it."""

import os
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from mjnav.errors import InputError
from mjnav.messages import PHASES, Array
from mjnav.metrics.summary import summarise
from mjnav.metrics.timing import compute_ms, quantiles
from mjnav.recording.read.log import Log, TopicSummary, open_log
from mjnav.recording.read.ticks import EVERY_TICK, LoggedRun
from mjnav.report.moments import worst_moments
from mjnav.scenarios.spec import Scenario

NUM_SHOWN = 10  # ranges of bytes and of ticks that sentences name
NUM_RANGES = 1000  # that are listed


def inspect(log: Log | str | os.PathLike[str]) -> dict[str, Any]:
    """Reads a log of whatever state, open or by its path, and says what it holds.

    Times are simulated, rates are over a topic's own span, and what is not known is None.

    * `damage` is None or {error, lost_bytes, lost: [{from, to, why}]}, `missing` says in sentences what is not there.
    * `topics`: max_gap_at_s is when the largest gap begins; `missing` counts the messages that a topic of which every
      tick has one lacks, and is None for any other; `share` is of the bytes before compression.
    * `ticks` is None or {whole, missing, ranges: [[first, last]]}; a tick is whole if figures can be computed from it.
    * `figures` are computed from the messages under the names of `mjnav run --json`, so that a run that did not end has
      them too, with the least effective sample sizes and the number of recoveries.
    * `timing` has `mjnav run`'s compute_ms, lateness_ms likewise; work_factor is simulated time over the time that
      ticks took, and real_time_factor, against the clock, only the result's.
    * `recovered` is what `mjnav recover` said of the log that this one was made from.
    * `moments` are the worst: {kind, time_s, tick, value, unit, text}, the most severe first.

    Raises InputError where the file is missing or not MCAP.
    """
    log = log if isinstance(log, Log) else open_log(log, allow_damage=True)
    run, not_json = log.whole_ticks()
    scenario, refused = _scenario(log, run)
    total = sum(topic.bytes for topic in log.topics.values())
    ticks = None if run is None else _ticks(run, _result_ticks(log))
    with np.errstate(all="ignore"):  # what a damaged log says may be any number
        return {
            "schema": 1,
            "complete": log.complete,
            "truncated": log.truncated,
            "duration_s": log.duration,
            "outcome": _outcome(log),
            "topics": {name: _topic(name, topic, log, total) for name, topic in sorted(log.topics.items())},
            "run": None if log.run is None else dict(log.run),
            "result": None if log.result is None else dict(log.result),
            "recovered": None if log.recovered is None else dict(log.recovered),
            "path": str(log.path),
            "bytes": log.size,
            "damage": _damage(log),
            "missing": list(_missing(log, not_json, ticks, refused)),
            "ticks": ticks,
            "figures": None if run is None or scenario is None else _figures(log, run, scenario),
            "timing": None if run is None else _timing(log, run, scenario),
            "moments": [] if run is None or scenario is None else _moments(run, scenario),
        }


def _scenario(log: Log, run: LoggedRun | None) -> tuple[Scenario | None, str]:
    """The log's scenario, if its people are those of the messages; or else why not."""
    if run is None:
        return None, ""
    try:
        scenario = log.scenario()
    except InputError as error:
        return None, str(error)
    in_messages = run.trajectory.people_position.shape[1]
    if len(scenario.people) != in_messages:
        return None, f"its scenario has {len(scenario.people)} people, its messages {in_messages}"
    return scenario, ""


def _outcome(log: Log) -> str | None:
    outcome = (log.result or {}).get("outcome")
    return None if outcome is None else str(outcome)


def _result_ticks(log: Log) -> int | None:
    """How many ticks the run had, if it says so."""
    ticks = (log.result or {}).get("ticks")
    return ticks if isinstance(ticks, int) else None


def _topic(name: str, topic: TopicSummary, log: Log, total: int) -> dict[str, Any]:
    start = 0 if log.run is not None else log.start_ns
    gap_at = topic.max_gap_at_ns
    return {
        "schema": topic.schema,
        "messages": topic.messages,
        "hz": topic.hz,
        "max_gap_s": None if topic.max_gap_ns is None else 1e-9 * topic.max_gap_ns,
        "max_gap_at_s": None if gap_at is None or start is None else 1e-9 * (gap_at - start),
        "missing": _missing_messages(topic, log) if name in EVERY_TICK and log.run is not None else None,
        "bytes": topic.bytes,
        "share": topic.bytes / total if total else None,
    }


def _missing_messages(topic: TopicSummary, log: Log) -> int:
    """Ticks without a message among those that the topic must have told of."""
    ticks = _result_ticks(log)
    if topic.first_sequence is None or topic.last_sequence is None:
        return ticks or 0
    return topic.first_sequence + topic.skipped + max(0, (ticks or 0) - 1 - topic.last_sequence)


def _ticks(run: LoggedRun, expected: int | None) -> dict[str, Any]:
    ends = [-1, *run.ticks.tolist(), expected or 0]
    ranges = [[a + 1, b - 1] for a, b in pairwise(ends) if b > a + 1]
    missing = sum(last - first + 1 for first, last in ranges)
    return {"whole": len(run.trajectory.status), "missing": missing, "ranges": ranges[:NUM_RANGES]}


def _damage(log: Log) -> dict[str, Any] | None:
    if log.error is None:
        return None
    lost = [{"from": part.start, "to": part.end, "why": part.why} for part in log.lost]
    return {
        "error": str(log.error),
        "lost_bytes": sum(part["to"] - part["from"] for part in lost),
        "lost": lost[:NUM_RANGES],
    }


def _missing(log: Log, not_json: Mapping[str, int], ticks: Mapping[str, Any] | None, refused: str) -> Iterator[str]:
    if log.truncated:
        yield "no footer: the writer was killed, or the file was not copied whole"
    if log.run is None:
        yield "no mjnav/run: another program wrote this, or its beginning is lost"
    elif log.result is None:
        yield "no mjnav/result: the run did not end"
    for part in log.lost[:NUM_SHOWN]:
        messages = sum(part.messages.values())
        held = f", at least {messages} messages" if messages else ""
        yield f"bytes {part.start} to {part.end}: {part.why}{held}"
    if len(log.lost) > NUM_SHOWN:
        yield f"bytes in {len(log.lost) - NUM_SHOWN} more places"
    if ticks is not None and ticks["missing"]:
        named = ", ".join(f"{a}" if a == b else f"{a} to {b}" for a, b in ticks["ranges"][:NUM_SHOWN])
        more = ", and more" if len(ticks["ranges"]) > NUM_SHOWN else ""
        yield f"{ticks['missing']} ticks: {named}{more}"
    if log.unregistered:
        yield f"the topic of {log.unregistered} messages"
    for topic, count in not_json.items() if log.run is not None else ():
        yield f"{count} messages of {topic} that are not JSON"
    for topic, why in log.unreadable.items():
        yield f"{topic}: {why}"
    if refused:
        yield f"figures: {refused}"


def _figures(log: Log, run: LoggedRun, scenario: Scenario) -> dict[str, Any]:
    outcome = _outcome(log)
    figures = summarise(run.trajectory, scenario, outcome=outcome or "")
    if outcome is None:
        figures |= {"outcome": None, "success": None}
    ess = {"robot": _least(run.robot_ess), "people": _least(run.people_ess)}
    return {**figures, "ess_min": ess, "recoveries": run.recoveries}


def _least(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(finite.min()) if finite.size else None


def _timing(log: Log, run: LoggedRun, scenario: Scenario | None) -> dict[str, Any]:
    result = log.result or {}
    busy = 1e-9 * float(run.timing[:, 1 : 1 + len(PHASES)].sum())
    simulated = None if scenario is None else len(run.timing) * scenario.control.period
    return {
        "ticks": len(run.timing),
        "compute_ms": compute_ms(run.timing),
        "lateness_ms": quantiles(run.timing[:, -1] * 1e-6),
        # The end of the last tick may miss its deadline, too, which no tick's timing tells.
        "deadline_misses": result.get("deadline_misses", run.deadline_misses),
        "real_time_factor": result.get("real_time_factor"),
        "work_factor": simulated / busy if simulated is not None and busy > 0.0 else None,
    }


def _moments(run: LoggedRun, scenario: Scenario) -> list[dict[str, Any]]:
    return [
        {"kind": m.kind, "time_s": m.time, "tick": m.tick, "value": m.value, "unit": m.unit, "text": m.text}
        for m in worst_moments(run, scenario)
    ]
