"""What a log holds and how its run went: `mjnav inspect` prints it, a page shows it.

`judged_beliefs` says how good each belief of the run was, body by body.

`shown_people` describes the people of the scene: how they walk, and how they take the robot.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import isfinite, sqrt
from typing import Any

import numpy as np

from mjnav.errors import InputError
from mjnav.log.read.log import Log, TopicSummary, open_log
from mjnav.log.read.ticks import EVERY_TICK, LoggedRun
from mjnav.messages import PHASES, Array, Trajectory
from mjnav.metrics import consistency
from mjnav.metrics.safety import sees_robot
from mjnav.metrics.summary import summarise
from mjnav.metrics.timing import compute_ms, quantiles
from mjnav.report.worst_moments import WorstMoment, worst_moments
from mjnav.scene.people import REGULAR, Person
from mjnav.scene.spec import BEHAVIOURS, Scenario

# -------------------------------------------------------------------------------------------- beliefs


Document = dict[str, Any]  # as `mjnav inspect --json` has it


def judged_beliefs(trajectory: Trajectory, scenario: Scenario) -> list[Document]:
    """The robot's, then each person's: where tracks carry no name, of the tracks that figures take for the person's.

    Figures that are undefined or infinite are None.
    """
    robot, people = scenario.estimation.robot, scenario.estimation.obstacles
    errors, nees = consistency.track_error(trajectory), consistency.people_nees(trajectory)
    particles = np.full(len(trajectory.status), float(people.particles))
    by = _by(people.source, people.filter, people.tracker)
    return [
        _judged(
            *("robot", _by(robot.source, robot.filter, robot.localizer), consistency.of_robot(trajectory)),
            *(consistency.robot_error(trajectory), trajectory.robot_ess),
            consistency.robot_particles(trajectory, scenario),
        ),
        *(
            _judged(
                *(f"person{i}", by, consistency.consistency(nees[:, i], 4, trajectory.time)),
                *(errors[:, i], trajectory.people_ess[:, i], particles),
            )
            for i in range(errors.shape[1])
        ),
    ]


def _by(source: str, kind: str, own: object) -> str:
    if own is not None:
        return str(getattr(own, "name", own))
    return source if source == "direct" else f"{source}, {kind}"


def _judged(
    body: str, by: str, judged: consistency.Consistency, error: Array, ess: Array, particles: Array
) -> Document:
    squared = consistency.mean((error[:, :2] ** 2).sum(axis=1))
    finite = judged.nees is not None and isfinite(judged.nees)
    figures = {**asdict(judged), "nees": judged.nees if finite else None}
    return {
        "body": body,  # "robot", "person0"
        "by": by,  # what it goes by, and the filter: "pose, particle"
        "ticks": figures.pop("ticks"),  # with a belief
        "rmse_m": None if squared is None else sqrt(squared),
        **figures,
        "ess_min": consistency.least(ess),
        "ess_mean": consistency.mean(ess),
        "depleted_share": consistency.depleted_share(ess, particles),
    }


# --------------------------------------------------------------------------------------------- people


@dataclass(frozen=True, slots=True)
class ShownPerson:
    """How a person walks, takes the robot, and when they come and go."""

    behaviour: str  # its name in run files
    temperament: str
    sees_robot: bool  # and takes account of it
    enters_s: float
    leaves_s: float | None

    @property
    def words(self) -> str:
        """Behaviour, temperament where it is not the regular one, and sight, such as "orca, scared, sees the robot"."""
        parts = [self.behaviour, *([self.temperament] if self.temperament != REGULAR else [])]
        return ", ".join([*parts, "sees the robot" if self.sees_robot else "takes no account of the robot"])


def shown_people(scenario: Scenario) -> list[ShownPerson]:
    """The people of a scene, in order."""
    return [
        ShownPerson(_behaviour(person), person.temperament or REGULAR, sees, person.enters or 0.0, person.leaves)
        for person, sees in zip(scenario.people, sees_robot(scenario), strict=True)
    ]


def _behaviour(person: Person) -> str:
    own = type(person.behaviour)
    return next((name for name, kind in BEHAVIOURS.items() if kind is own), getattr(person.behaviour, "name", ""))


def people_lines(people: Sequence[ShownPerson]) -> Iterator[str]:
    """A line for all people who are alike, such as "0, 3, 4: orca, scared, sees the robot"."""
    for words in dict.fromkeys(person.words for person in people):
        yield f"{', '.join(str(i) for i, person in enumerate(people) if person.words == words)}: {words}"


# ----------------------------------------------------------------------------------------- inspection


NUM_SHOWN = 10  # ranges of bytes and of ticks that sentences name
NUM_RANGES = 1000  # that are listed


@dataclass(frozen=True, slots=True)
class Inspection:
    """A log in whatever state. Times are simulated, and what is not known is None."""

    complete: bool
    truncated: bool
    duration_s: float | None
    outcome: str | None
    topics: dict[str, Document]
    run: dict[str, Any] | None  # the log's metadata of the same names
    result: dict[str, Any] | None
    recovered: dict[str, Any] | None  # what `mjnav recover` said of the log that this one was made from
    path: str
    bytes: int
    damage: Document | None  # of a file that is not only cut off
    missing: list[str]  # sentences
    ticks: Document | None
    people: list[ShownPerson] | None  # of the scene
    figures: dict[str, Any] | None  # from the messages, named as by `mjnav run --json`; also of a run that did not end
    beliefs: list[Document] | None  # by body
    timing: Document | None
    moments: list[WorstMoment]  # the most severe first

    def document(self) -> dict[str, Any]:
        """What `mjnav inspect --json` prints."""
        found = {"schema": 1, **asdict(self)}
        for moment in found["moments"]:
            del moment["severity"]
        return found


def inspect(source: str | os.PathLike[str] | Log) -> Inspection:
    """What a log of whatever state, open or by its path, holds. Raises InputError where it is missing or not MCAP."""
    log = source if isinstance(source, Log) else open_log(source, allow_damage=True)
    run, not_json = log.whole_ticks()
    scenario, refused = _scenario(log, run)
    ticks = None if run is None else _ticks(run, _result_ticks(log))
    with np.errstate(all="ignore"):  # what a damaged log says may be any number
        return Inspection(
            complete=log.complete,
            truncated=log.truncated,
            duration_s=log.duration,
            outcome=_outcome(log),
            topics=_topics(log),
            run=None if log.run is None else dict(log.run),
            result=None if log.result is None else dict(log.result),
            recovered=None if log.recovered is None else dict(log.recovered),
            path=str(log.path),
            bytes=log.size,
            damage=_damage(log),
            missing=list(_missing(log, not_json, ticks, refused)),
            ticks=ticks,
            people=None if scenario is None else shown_people(scenario),
            figures=None if run is None or scenario is None else _figures(log, run, scenario),
            beliefs=None if run is None or scenario is None else judged_beliefs(run.trajectory, scenario),
            timing=None if run is None else _timing(log, run, scenario),
            moments=[] if run is None or scenario is None else worst_moments(run, scenario),
        )


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


def _topics(log: Log) -> dict[str, Document]:
    """The messages of each topic; rates and gaps are within the topic's own span."""
    ours = log.run is not None
    start = 0 if ours else log.start_ns
    total = sum(topic.bytes for topic in log.topics.values())
    return {
        name: {
            "schema": topic.schema,
            "messages": topic.messages,
            "hz": topic.hz,
            "max_gap_s": None if topic.max_gap_ns is None else 1e-9 * topic.max_gap_ns,
            "max_gap_at_s": None if (at := topic.max_gap_at_ns) is None or start is None else 1e-9 * (at - start),
            "missing": _missing_messages(topic, _result_ticks(log) or 0) if ours and name in EVERY_TICK else None,
            "bytes": topic.bytes,
            "share": topic.bytes / total if total else None,  # of the log's bytes before compression
        }
        for name, topic in sorted(log.topics.items())
    }


def _missing_messages(topic: TopicSummary, ticks: int) -> int:
    """Ticks without a message, of a topic that has one in every tick."""
    if topic.first_sequence is None or topic.last_sequence is None:
        return ticks
    return topic.first_sequence + topic.skipped + max(0, ticks - 1 - topic.last_sequence)


def _ticks(run: LoggedRun, expected: int | None) -> Document:
    """How many can be counted on: a tick is whole if figures can be computed from it."""
    ends = [-1, *run.ticks.tolist(), expected or 0]
    ranges = [(a + 1, b - 1) for a, b in pairwise(ends) if b > a + 1]
    missing = sum(last - first + 1 for first, last in ranges)
    return {"whole": len(run.trajectory.status), "missing": missing, "ranges": ranges[:NUM_RANGES]}


def _damage(log: Log) -> Document | None:
    if log.error is None:
        return None
    lost = [{"from": p.start, "to": p.end, "why": p.why} for p in log.lost[:NUM_RANGES]]
    return {"error": str(log.error), "lost_bytes": sum(part.end - part.start for part in log.lost), "lost": lost}


def _missing(log: Log, not_json: Mapping[str, int], ticks: Document | None, refused: str) -> Iterator[str]:
    if log.truncated:
        yield "no footer: the writer was killed, or the file was not copied whole"
    if log.run is None:
        yield "no mjnav/run: another program wrote this, or its beginning is lost"
    elif log.result is None:
        yield "no mjnav/result: the run did not end"
    for part in log.lost[:NUM_SHOWN]:
        yield f"bytes {part.start} to {part.end}: {part.why}"
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
    if refused:
        yield f"figures: {refused}"


def _figures(log: Log, run: LoggedRun, scenario: Scenario) -> dict[str, Any]:
    outcome = _outcome(log)
    figures = summarise(run.trajectory, scenario, outcome=outcome or "")
    if outcome is None:
        figures |= {"outcome": None, "success": None, "spl": None}
    return {**figures, **_recorded(log)}


def _recorded(log: Log) -> dict[str, Any]:
    """Figures as the run recorded them: to compute them would run the log's code, or the people without the robot."""
    found: dict[str, Any] = {}
    for key in ("metrics", "detour"):
        values = (log.result or {}).get(key)
        if isinstance(values, Mapping) and any(map(_is_number, values.values())):
            found[key] = {str(name): value if _is_number(value) else None for name, value in values.items()}
    return found


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and np.isfinite(value)


def _timing(log: Log, run: LoggedRun, scenario: Scenario | None) -> Document:
    """How long ticks took: p50, p99 and max, by phase."""
    result = log.result or {}
    busy = 1e-9 * float(run.timing[:, 1 : 1 + len(PHASES)].sum())
    simulated = None if scenario is None else len(run.timing) * scenario.control.period
    return {
        "ticks": len(run.timing),
        "compute_ms": compute_ms(run.timing),
        "lateness_ms": quantiles(run.timing[:, -1] * 1e-6),
        # The end of the last tick may also miss its deadline, which no tick's timing says.
        "deadline_misses": result.get("deadline_misses", run.deadline_misses),
        "real_time_factor": result.get("real_time_factor"),  # by the clock, which only the result has
        "work_factor": simulated / busy if simulated is not None and busy > 0.0 else None,  # by the time of ticks
    }
