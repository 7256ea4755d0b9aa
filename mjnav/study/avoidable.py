"""Asks the oracle of each log of a study or folder whether its outcome was avoidable, and counts the answers by method.

`sources` finds the logs that a file, a folder of logs or a study stands for: of a study, those that its sweep kept.

`judge` asks the oracle about one log; `by_method` puts the methods beside one another.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mjnav.errors import InputError, InvalidValue
from mjnav.log.read.log import open_log
from mjnav.metrics.intervals import wilson
from mjnav.metrics.oracle import Collision, judged
from mjnav.study.cells import DEFAULT_SETTING
from mjnav.study.keep import kept_log
from mjnav.study.results import find_results
from mjnav.study.store import Store

Document = Mapping[str, Any]  # as --json prints it
_COLUMNS = ("scene", "setting", "method", "seed", "success", "error", "log")


@dataclass(frozen=True, slots=True)
class Source:
    """A log, and the name that its study gives the method; None of a log without a study."""

    path: Path
    method: str | None = None


def sources(given: str) -> tuple[Sequence[Source], str | None]:
    """The logs that `given` names, and of a study a line on how many it kept.

    A file is a log; a folder with logs stands for these; anything else is a study as `mjnav compare` takes it. Raises
    InputError where there is no log.
    """
    path = Path(given)
    if path.suffix == ".mcap" or (os.path.isfile(path) and path.suffix != ".toml"):
        return (Source(path),), None
    if os.path.isdir(path) and (logs := sorted(path.glob("*.mcap"))):
        return tuple(map(Source, logs)), None
    if os.path.isdir(path) and not any(path.glob("*.parquet")):
        raise InputError(f"{path}: a folder without logs (*.mcap) and without results of a sweep")
    try:
        return _of_study(find_results(given)[0])
    except InvalidValue as error:
        if error.key != "study":
            raise
        raise InvalidValue(
            "LOG", given, f"a log, a folder of logs, or {error.allowed}", nearest=error.nearest
        ) from None


def _of_study(store: Store) -> tuple[Sequence[Source], str]:
    logs, failures, lacking = [], 0, 0
    rows = store.rows(_COLUMNS).to_pylist()
    for row in sorted(rows, key=lambda row: [row[name] for name in ("method", "setting", "scene", "seed")]):
        log = kept_log(store.folder, row["log"])
        failed = row["error"] is None and not row["success"]
        failures += failed
        lacking += failed and log is None
        if log is not None:
            setting = "" if row["setting"] == DEFAULT_SETTING else f", {row['setting']}"
            logs.append(Source(log, f"{row['method']}{setting}"))
    keep = "mjnav sweep STUDY --keep-logs failures keeps those of episodes that fail"
    if not logs:
        raise InputError(f"{store.folder}: kept no logs; {keep}")
    note = f"{store.folder}: logs of {len(logs)} of {len(rows)} episodes"
    if lacking:
        note = f"{note}; {lacking} of {failures} failures have none: {keep}"
    elif len(logs) < len(rows):
        note = f"{note}, every failure among them: shares are the study's, times at rest those of these runs alone"
    return logs, note


def judge(source: Source) -> Document:
    """What the oracle says of a log. Raises what `open_log` and `Log.trajectory` raise."""
    log = open_log(source.path)
    log.check_ours()
    scenario, trajectory, result = log.scenario(), log.trajectory(), log.result or {}
    outcome, ticks = result.get("outcome"), result.get("ticks", 0)
    if len(trajectory.decision) < ticks:
        whole = f"{len(trajectory.decision)} of {ticks} ticks are whole from its start on"
        raise InputError(f"{source.path}: {whole}: how its run ended cannot be judged")
    judgement = judged(trajectory, scenario, outcome=outcome)
    return {
        "log": str(source.path),
        "scene": scenario.name,
        "method": source.method or (log.run or {}).get("controller", scenario.control.method),
        "seed": scenario.seed,
        "outcome": outcome,  # None of a run that did not end
        "collision": judgement.collision and _verdict(judgement.collision),
        "timeout_avoidable": judgement.timeout,
        "stalled_s": judgement.stalled,
        "stalled_way_free_s": judgement.free,
    }


def _verdict(collision: Collision) -> Document:
    """Of the first contact of a run."""
    contact, touch, (two_seconds, one_second) = collision.contact, collision.touch, collision.avoidable
    return {
        "time_s": contact.time,
        "kind": contact.kind,
        "name": contact.name,
        "who_moved": None if touch is None else str(touch),  # in words; this and the next two are None of a thing
        "robot_moved": None if touch is None else touch.moving,
        "robot_at_fault": None if touch is None else touch.at_fault,
        "avoidable_2s_before": two_seconds,
        "avoidable_1s_before": one_second,
        "last_chance_s_before": collision.last_chance,  # None without one
    }


def by_method(runs: Iterable[Document]) -> dict[str, Document]:
    """The shares of each method over all scenes, in the order in which the methods come."""
    groups: dict[str, list[Document]] = {}
    for run in runs:
        groups.setdefault(run["method"], []).append(run)
    return {method: _shares(of_method) for method, of_method in groups.items()}


def _shares(runs: Sequence[Document]) -> Document:
    collisions = [run["collision"] for run in runs if run["collision"] is not None]
    time_outs = [run for run in runs if run["timeout_avoidable"] is not None]
    return {
        "runs": len(runs),
        "robot_at_fault": _share(collisions, "robot_at_fault"),  # collisions with a person, of all collisions
        "avoidable_2s_before": _share(collisions, "avoidable_2s_before"),
        "avoidable_1s_before": _share(collisions, "avoidable_1s_before"),
        "timeout_avoidable": _share(time_outs, "timeout_avoidable"),
        "mean_stalled_s": sum(run["stalled_s"] for run in runs) / len(runs),
        "mean_stalled_way_free_s": sum(run["stalled_way_free_s"] for run in runs) / len(runs),
    }


def _share(documents: Sequence[Document], key: str) -> Document:
    """How many of how many, with Wilson's interval, 95 %; None of nothing."""
    count = sum(bool(document[key]) for document in documents)
    return {"count": count, "of": len(documents), "interval": wilson(count, len(documents))}
