"""What a log holds and how its run went, as one dictionary: `mjnav inspect --json` prints it, a report shows it."""

import os
from collections.abc import Mapping
from typing import Any

from mjnav.errors import InputError
from mjnav.messages import Trajectory
from mjnav.metrics.summary import summarise
from mjnav.metrics.timing import compute_ms, quantiles
from mjnav.recording.reader import Log, open_log
from mjnav.scenarios.spec import Scenario


def inspect(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Reads a log once and says what it holds.

    Times are simulated, rates over a topic's own span. What is not known is None, and what is missing stands under
    `missing`, as sentences. `figures` are computed from the messages under the names of `mjnav run --json`, so that a
    run that did not end has them too. Raises InputError where the file is missing or not MCAP.
    """
    log = open_log(path)
    try:
        trajectory, scenario = log.trajectory(), log.scenario()
    except InputError:
        trajectory = scenario = None
    result = None if log.result is None else dict(log.result)
    total = sum(topic.bytes for topic in log.topics.values())
    return {
        "schema": 1,
        "complete": log.complete,
        "truncated": log.truncated,
        "duration_s": log.duration,
        "outcome": result and result.get("outcome"),
        "topics": {
            name: {
                "schema": topic.schema,
                "messages": topic.messages,
                "hz": topic.hz,
                "max_gap_s": None if topic.max_gap_ns is None else 1e-9 * topic.max_gap_ns,
                "max_gap_at_s": None,  # when it begins
                "missing": None,  # messages that must have been there; None where a tick may go without
                "bytes": topic.bytes,
                "share": topic.bytes / total if total else None,
            }
            for name, topic in sorted(log.topics.items())
        },
        "run": None if log.run is None else dict(log.run),
        "result": result,
        "path": str(log.path),
        "bytes": os.path.getsize(path),
        "damage": None,  # or {"error": text, "lost_bytes": n, "lost": [{"from": byte, "to": byte, "why": text}]}
        "missing": [],  # sentences
        "ticks": None,  # or {"whole": n, "missing": n, "ranges": [[first, last]]}
        "figures": _figures(log, trajectory, scenario),
        "timing": _timing(log, trajectory),
        "moments": [],  # the five worst: {"kind", "time_s", "tick", "value", "unit", "text"}
    }


def _figures(log: Log, trajectory: Trajectory | None, scenario: Scenario | None) -> dict[str, Any] | None:
    if trajectory is None or scenario is None:
        return None
    outcome = None if log.result is None else log.result.get("outcome")
    figures = summarise(trajectory, scenario, outcome=str(outcome))
    if outcome is None:
        figures |= {"outcome": None, "success": None}
    return {**figures, "ess_min": {"robot": None, "people": None}, "recoveries": None}


def _timing(log: Log, trajectory: Trajectory | None) -> dict[str, Any] | None:
    if trajectory is None:
        return None
    result: Mapping[str, Any] = log.result or {}
    return {
        "ticks": len(trajectory.timing),
        "compute_ms": compute_ms(trajectory.timing),
        "lateness_ms": quantiles(trajectory.timing[:, -1] * 1e-6),
        "deadline_misses": result.get("deadline_misses", trajectory.deadline_misses),
        "real_time_factor": result.get("real_time_factor"),  # against the wall clock; only the result knows it
        "work_factor": None,  # simulated time over the time that ticks took
    }
