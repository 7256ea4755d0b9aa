"""Repeats a run from the scenario in its log, and compares it with the log tick by tick.

The fields of a tick are compared in the order of cause and effect.
"""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from math import isnan
from pathlib import Path
from typing import Any, NamedTuple

from mjnav import settings
from mjnav.control.registry import Method, shipped
from mjnav.errors import InputError, UntrustedCode
from mjnav.log.encode.topics import EVENTS, PLAN, TIMING, topics
from mjnav.log.log_format import REPLAY
from mjnav.log.read.log import Log, decoder, open_log
from mjnav.loop.episode import Episode
from mjnav.loop.events import ABORTED, GIVEN
from mjnav.loop.prepare import check_functions, with_estimators
from mjnav.loop.provenance import FACTS, OWN_SOURCES, PARAMETERS, changes, run_info
from mjnav.loop.result import Result
from mjnav.loop.supervision import RunFault
from mjnav.messages import PHASES, TickRecord, WorldState
from mjnav.robot.controller import build_controller
from mjnav.robot.latency import replayed
from mjnav.scene.plugged import plugins_of
from mjnav.scene.spec import Scenario
from mjnav.settings.plugins import Given, name_of
from mjnav.world.scene import parts_hash

# ------------------------------------------------------------------------------ comparison of ticks


PARTS = ("truth", "reading", "estimate", "detections", "tracks", "decision", "command")  # of a tick: causes first

Documents = Mapping[str, Sequence[Any]]  # of one tick, by topic


@dataclass(frozen=True, slots=True)
class FieldDifference:
    """One value that is not the same; None where one side has none."""

    part: str  # truth, reading, estimate, detections, tracks, decision, command; run, result
    field: str  # "/robot/state pose.0"
    logged: Any
    again: Any

    @property
    def amount(self) -> float | None:
        """By how much two numbers differ."""
        values = (self.logged, self.again)
        if any(isinstance(value, bool) or not isinstance(value, int | float) for value in values):
            return None
        return abs(self.again - self.logged)


class LoggedTick(NamedTuple):
    """What a log holds of one tick, or of the state in which its run ended."""

    tick: int
    documents: Documents


class TickComparison:
    """Compares ticks with those in a log of the same scenario, to the last bit.

    Where `gaps` are expected, as in a log whose writer was killed, a missing topic is not compared.
    """

    def __init__(self, scenario: Scenario, *, gaps: bool = False):
        self._topics = [topic for topic in topics(scenario) if topic.compared]
        self._fields = [
            (p, topic.name, topic.compared[p]) for p in PARTS for topic in self._topics if p in topic.compared
        ]
        self._decoders = {topic.name: decoder(topic.schema) for topic in self._topics}
        self._gaps = gaps

    def logged(self, log: Log) -> Iterator[LoggedTick]:
        """What is compared of the ticks of a log, one by one."""
        messages = log.messages(*(topic.name for topic in self._topics))
        for tick, group in groupby(messages, key=lambda message: message.sequence):
            documents: dict[str, list[Any]] = {}
            for message in group:
                documents.setdefault(message.topic, []).append(self._document(message.topic, message.value))
            yield LoggedTick(tick, documents)

    def tick(self, logged: Documents, record: TickRecord) -> list[FieldDifference]:
        """What differs in one tick, causes first."""
        again: dict[str, list[Any]] = {}
        for topic in self._topics:
            found = again.setdefault(topic.name, [])
            if topic.encode_reading is not None:
                before = map(topic.encode_reading, record.readings_before)
                found += [self._decoded(topic.name, data) for data in before if data is not None]
            if topic.encode is not None and (data := topic.encode(record)) is not None:
                found.append(self._decoded(topic.name, data))
        return self._compare(logged, again)

    def final(self, logged: Documents, tick: int, state: WorldState) -> list[FieldDifference]:
        """What differs in the state in which the run ended."""
        encoded = {topic.name: topic.encode_final for topic in self._topics}
        return self._compare(
            logged, {name: [self._decoded(name, encode(tick, state))] for name, encode in encoded.items() if encode}
        )

    def _decoded(self, topic: str, data: bytes) -> Any:
        return self._document(topic, self._decoders[topic](data))

    def _document(self, topic: str, value: Any) -> Any:
        """A message's value; of a protobuf message, what is compared, with None for NaN, which is equal to nothing."""
        if isinstance(value, dict):
            return value
        return {
            key: _comparable(getattr(value, key)) for _, name, keys in self._fields if name == topic for key in keys
        }

    def _compare(self, logged: Documents, again: Documents) -> list[FieldDifference]:
        found: list[FieldDifference] = []
        if all(logged.get(topic, []) == documents for topic, documents in again.items()):
            return found
        for part, topic, keys in self._fields:
            before, after = logged.get(topic, ()), again.get(topic, ())
            if before == after or (not before and (self._gaps or topic == PLAN)):  # earlier logs have no plans
                continue
            for key in keys:
                found += differences(part, f"{topic} {key}", _values(before, key), _values(after, key))
        return found


def differences(part: str, name: str, logged: Any, again: Any) -> list[FieldDifference]:
    """The values of two documents that are not the same."""
    before, after = dict(_leaves(logged, name)), dict(_leaves(again, name))
    return [
        FieldDifference(part, field, before.get(field), after.get(field))
        for field in {**after, **before}
        if before.get(field) != after.get(field)
    ]


def _values(documents: Sequence[Any], key: str) -> Any:
    """The value of a key in the only document, or in each."""
    values = [document.get(key) for document in documents]
    return values[0] if len(values) == 1 else values


def _leaves(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Every single value in a document, with its path."""
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _leaves(part, f"{name}.{key}")
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for i, part in enumerate(value):
            known = isinstance(part, Mapping) and isinstance(part.get("name"), str)
            yield from _leaves(part, f"{name}.{part['name'] if known else i}")
    else:
        yield name, value


def _comparable(value: Any) -> Any:
    if isinstance(value, bool):
        return value
    return (None if isnan(value) else value) if isinstance(value, float) else list(map(_comparable, value))


# ------------------------------------------------------------------------------------------- replay


# What the metadata `mjnav/run` say of the run itself; the rest is about the machine and its programs.
_OF_THE_RUN = ("scene", "controller", PARAMETERS, "seed", "engine", "argv")
# Figures of the result that depend on the clock, on where the log is, or on what was asked for beside the run.
_OF_THE_CLOCK = ("compute_ms", "real_time_factor", "deadline_misses", "log", "profile", "detour")


@dataclass(frozen=True, slots=True)
class Replay:
    """How a run compares with its log when it is repeated."""

    path: Path
    ticks: int  # that were compared
    missing: int  # that the log lacks between them
    complete: bool  # it came to where the log says that its run ended
    outcome: str | None  # as the log has it
    state_hash: str | None  # as the log has it
    differences: tuple[FieldDifference, ...]  # of the first tick that has any, causes first
    tick: int | None  # that tick, and when it was [s]; the number of ticks where it is the end that differs
    time: float | None
    warnings: tuple[str, ...]  # what differs beside the scenario, in words: programs, sources, machine

    @property
    def identical(self) -> bool:
        """Nothing differs, to the last bit."""
        return not self.differences


def replay(
    log: Log | str | os.PathLike[str],
    *,
    trust: bool = False,
    controller: Any = None,
    localizer: Any = None,
    tracker: Any = None,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda time: None,
) -> Replay:
    """Runs the scenario of a log, open or by its path, again and compares every tick, up to the first that differs.

    The log is read as the run goes on, and a log that does not reach to the end of its run is compared as far as it
    goes. A controller that is none of mjnav's own, and any other plug-in, is code, which is imported and run only with
    `trust`; metrics are left out without it. `controller`, `localizer` and `tracker` (names, classes or objects)
    run in place of the log's, the controller with the log's parameters. `stop` and `progress` are as in `run`.
    Raises InputError where the log is missing, not mjnav's, or its scenario cannot be run here, DamagedLogError where a
    checksum fails.
    """
    check_functions(stop=stop, progress=progress)
    log = log if isinstance(log, Log) else open_log(log)
    if log.run is None:
        raise InputError(f"{log.path}: not a log of mjnav's")
    scenario, known = _scenario(log)
    left_out = bool(scenario.metrics) and not trust
    if left_out:
        scenario = replace(scenario, metrics=None)
    logged = scenario
    scenario = with_estimators(scenario, localizer, tracker)
    if controller is not None:
        scenario = replace(scenario, control=replace(scenario.control, method=name_of(controller)))
        with settings.below(file="controller"):
            build_controller(scenario)
    elif (method := shipped(scenario.control.method)) is not None:
        scenario = _with_defaults(scenario, log.path, log.run.get(PARAMETERS, "{}"), method)
    if not trust:
        _refuse_code(log.path, logged, scenario)
    follower = _Follower(log, scenario, known, renamed=controller is not None)
    if follower.empty and not log.complete:
        raise InputError(f"{log.path}: holds no tick that could be compared")
    episode = Episode(scenario, watch=follower.watch, stop=lambda: follower.done or stop(), progress=progress)
    info = run_info(scenario, scenario.seed, parts_hash())
    warnings = _warnings({**log.run, OWN_SOURCES: info[OWN_SOURCES]} if left_out else log.run, info)
    if left_out:
        warnings = (*warnings, "its own metrics, which are code, were left out")
    fault = None
    try:
        result = episode.run()
    except RunFault as error:
        if error.result is None:
            raise
        result, fault = error.result, str(error)
    if follower.error is not None:
        raise follower.error
    if not (follower.differences or stop()):
        follower.finish(result, fault)
    if follower.differences and any(message.value.name == GIVEN for message in log.messages(EVENTS)):
        warnings = ("its commands were given to Simulation.step; a replay asks the controller", *warnings)
    return Replay(
        path=log.path,
        ticks=follower.compared,
        missing=follower.missing,
        complete=follower.complete,
        outcome=log.result.get("outcome") if log.result else None,
        state_hash=log.result.get("state_hash") if log.result else None,
        differences=tuple(follower.differences),
        tick=follower.tick if follower.differences else None,
        time=follower.time if follower.differences else None,
        warnings=warnings,
    )


def _refuse_code(path: Path, logged: Scenario, scenario: Scenario) -> None:
    """Raises UntrustedCode where the scenario still has code that the log names and that is not mjnav's own."""
    method = logged.control.method
    if scenario.control.method is method and shipped(method) is None:
        raise UntrustedCode(f"{path}: its controller is {method!r}")
    given = {plugin.name for plugin in plugins_of(scenario).values() if isinstance(plugin.name, Given)}
    for key, plugin in plugins_of(scenario).items():
        if plugin.name not in given and plugins_of(logged).get(key) == plugin:
            other = {"localizer": "localizer=CLASS", "tracker": "tracker=CLASS"}.get(plugin.noun)
            raise UntrustedCode(f"{path}: its {plugin.noun} ({key}) is {plugin.name!r}", other=other)


class _Follower:
    """Reads a log in step with the run that repeats it. `known` ticks can be repeated; None for all.

    The result's controller is compared unless it was `renamed`.
    """

    def __init__(self, log: Log, scenario: Scenario, known: int | None, *, renamed: bool):
        gaps = log.truncated or log.recovered is not None
        self._comparison = TickComparison(scenario, gaps=gaps)
        self._logged = self._comparison.logged(log)
        self._next = next(self._logged, None)
        self._result = log.result
        self._total = None if log.result is None else log.result.get("ticks")  # of the run
        self._aborted = log.result is None or log.result.get("outcome") == ABORTED
        self._known = known
        self._ignored = (
            *_OF_THE_CLOCK,
            *(["controller"] if renamed else []),
            *([] if scenario.metrics else ["metrics"]),
        )
        self._ticks = self._contacts = 0  # that were run
        self.compared = self.missing = 0
        self.complete = False
        self.differences: list[FieldDifference] = []
        self.tick, self.time = 0, 0.0  # the last that was looked at
        self.error: Exception | None = None  # of the log; raised in a tick it would count as the run's
        self.empty = self._next is None or known == 0

    @property
    def done(self) -> bool:
        """There is nothing more to compare; a run that ended by itself must do so again."""
        if self.differences or self.error is not None or self._ticks == self._known:
            return True
        if self._total is None:
            return self._next is None
        return self._ticks >= self._total + (not self._aborted)

    def watch(self, record: TickRecord) -> None:
        """One tick of the run."""
        self._ticks += 1
        self._contacts += len(record.truth.contacts)
        self.tick, self.time = record.tick, record.truth.time
        if record.tick == self._total:
            self.differences = [FieldDifference("run", "end", self._ended, "goes on")]
        elif self._next is not None and self._next.tick == record.tick:
            try:
                self.differences = self._comparison.tick(self._next.documents, record)
                self._next = next(self._logged, None)
            except Exception as error:
                self.error = error
            self.compared += 1
        else:
            self.missing += 1

    def finish(self, result: Result, fault: str | None) -> None:
        """The end of the run, where no tick differed."""
        summary = result.summary
        self.tick, self.time = summary["ticks"], summary["time_s"]
        ended = fault or _ending(summary)
        if self._result is None:
            if self._next is not None and not self.done and not _is_last(self._next):
                self.differences = [FieldDifference("run", "end", "goes on", ended)]
            return
        if self._known is not None and self._known < self._result["ticks"]:
            return
        if self._aborted and fault is None and self._result["time_s"] != summary["time_s"]:
            return  # what ended it, a full disk perhaps, did so within a tick
        self.complete = True
        if (fault is not None and not self._aborted) or _ending(summary) != self._ended:
            self.differences = [FieldDifference("run", "end", self._ended, ended)]
            return
        if self._next is not None and self._next.tick == self._ticks and _is_last(self._next):
            self.differences = self._comparison.final(self._next.documents, self._ticks, _final(result, self._contacts))
        for key in summary:
            if key in self._result and key not in self._ignored:
                self.differences += differences("result", key, self._result[key], summary[key])

    @property
    def _ended(self) -> str | None:
        return None if self._result is None else _ending(self._result)


def _ending(result: Mapping[str, Any]) -> str:
    return f"{result.get('outcome')} after {result.get('ticks')} ticks"


def _is_last(logged: LoggedTick) -> bool:
    """Whether it is the state in which a run ended, which has no decision."""
    return "/decision" not in logged.documents


def _final(result: Result, contacts_before: int) -> WorldState:
    t = result.trajectory
    return WorldState(
        time=float(t.time[-1]),
        robot_pose=t.robot_pose[-1],
        robot_twist=t.robot_twist[-1],
        people_position=t.people_position[-1],
        people_velocity=t.people_velocity[-1],
        contacts=t.contacts[contacts_before:],
        people_radius=None if t.people_radius is None else t.people_radius[-1],
    )


def _scenario(log: Log) -> tuple[Scenario, int | None]:
    """The scenario that repeats the run, and for how many ticks; None where for all.

    A run whose latency was measured is repeated by its own times, which a log that was not ended holds tick by tick.
    """
    if REPLAY in log.attachments:
        return log.scenario(REPLAY), None
    scenario = log.scenario()
    control = scenario.control
    if control.latency is None or control.latency.model != "measured":
        return scenario, None
    trace: list[float] = []
    for message in log.messages(TIMING):
        if message.sequence != len(trace):
            break
        spent = sum(message.value[f"{phase}_ns"] for phase in PHASES[: PHASES.index("control") + 1])
        trace.append(1e-9 * spent)
    latency = replayed(control.latency, control.period, trace)
    return replace(scenario, control=replace(control, latency=latency)), len(trace)


def _with_defaults(scenario: Scenario, path: Path, parameters: str, method: Method) -> Scenario:
    """The scenario with all `parameters` that its run had, as JSON: the defaults may be others by now."""
    try:
        had = dict(json.loads(parameters))
    except (TypeError, ValueError):
        raise InputError(f"{path}: its controller's parameters are no JSON: {parameters!r}") from None
    known, control = settings.keys(method.controller_class.parameters_type), scenario.control
    had = {key: value for key, value in had.items() if key in known}
    return replace(scenario, control=replace(control, parameters=had | dict(control.parameters)))


def _warnings(logged: Mapping[str, str], now: Mapping[str, str]) -> tuple[str, ...]:
    """Changes of the controller, of the facts that decide the bits, then of the rest that both have."""
    others = [key for key in now if key not in (*_OF_THE_RUN, *FACTS)]
    return (*_changes(logged, now, ["controller"]), *changes(logged, now), *_changes(logged, now, others))


def _changes(logged: Mapping[str, str], now: Mapping[str, str], keys: Iterable[str]) -> Iterator[str]:
    for key in keys:
        if key in logged and logged[key] != now[key]:
            yield f"{key} was {logged[key] or 'unknown'}, is {now[key] or 'unknown'}"
