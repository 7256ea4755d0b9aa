"""Compares the ticks of a run with those of its log, field by field in the order of cause and effect."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import isnan
from types import MappingProxyType
from typing import Any, NamedTuple

from mjnav.messages import TickRecord, WorldState
from mjnav.recording.encode.topics import PLAN, topics
from mjnav.recording.read.log import LogMessage, decoder
from mjnav.scenarios.spec import Scenario

SCAN = "/scan"
# part of a tick, its topic, the keys of that topic's documents: causes before effects
_FIELDS = (
    ("truth", "/robot/state", ("time", "pose", "twist")),
    ("truth", "/people/truth", ("people",)),
    ("truth", "/contacts", ("contacts",)),
    ("reading", "/odometry", ("time", "interval", "v", "omega", "gyro", "pose")),
    ("reading", "/people/estimate", ("detections",)),
    ("reading", SCAN, ("ranges",)),
    ("estimate", "/robot/state", ("estimate",)),
    ("detections", "/detections", ("detections",)),
    ("tracks", "/people/estimate", ("people",)),
    ("decision", "/decision", ("nominal", "cost", "wish", "caution", "v", "omega", "status")),
    ("decision", PLAN, ("step", "path", "fan", "fan_cost", "violation", "feasible")),
    ("command", "/command", ("v", "omega")),
)
# Topics whose messages are no documents, and what is compared of them.
_ARRAYS = MappingProxyType({topic: keys for _, topic, keys in _FIELDS if topic in (SCAN, PLAN)})
COMPARED = tuple(dict.fromkeys(topic for _, topic, _ in _FIELDS))

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


def logged_ticks(messages: Iterable[LogMessage]) -> Iterator[LoggedTick]:
    """The messages of the topics in COMPARED, tick by tick as they come."""
    for tick, group in groupby(messages, key=lambda message: message.sequence):
        documents: dict[str, list[Any]] = {}
        for message in group:
            documents.setdefault(message.topic, []).append(_document(message.topic, message.value))
        yield LoggedTick(tick, documents)


class TickComparison:
    """Compares ticks with those in a log of the same scenario, to the last bit.

    Where `gaps` are expected, as in a log whose writer was killed, a missing topic is not compared.
    """

    def __init__(self, scenario: Scenario, *, gaps: bool = False):
        self._topics = [topic for topic in topics(scenario) if topic.name in COMPARED]
        self._decoders = {topic.name: decoder(topic.schema) for topic in self._topics}
        self._gaps = gaps

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
        return _document(topic, self._decoders[topic](data))

    def _compare(self, logged: Documents, again: Documents) -> list[FieldDifference]:
        found: list[FieldDifference] = []
        if all(logged.get(topic, []) == documents for topic, documents in again.items()):
            return found
        for part, topic, keys in _FIELDS:
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


def _document(topic: str, value: Any) -> Any:
    """A message's value; of a protobuf message, what is compared, with None for NaN, which is equal to nothing."""
    if topic not in _ARRAYS:
        return value
    return {key: _comparable(getattr(value, key)) for key in _ARRAYS[topic]}


def _comparable(value: Any) -> Any:
    if isinstance(value, bool):
        return value
    return (None if isnan(value) else value) if isinstance(value, float) else list(map(_comparable, value))
