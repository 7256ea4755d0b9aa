"""A log of whatever state and size: what it holds, what is missing, and the run as arrays."""

import json
import os
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from mcap.records import Message

from mjnav.errors import DamagedLogError
from mjnav.recording.read.reader import Log, surveyed
from mjnav.recording.read.stream import CutOff, read_records
from mjnav.recording.read.survey import Survey
from mjnav.recording.read.ticks import TICK, TIMING, LoggedRun, TickAssembler
from mjnav.recording.recover.salvage import Lost, Salvaged, Unchecked, salvage

_WANTED = frozenset((*TICK, TIMING))


@dataclass(frozen=True, slots=True)
class Scan:
    """What is in a log, and what is not."""

    log: Log
    size: int  # [bytes] of the file
    run: LoggedRun | None  # across gaps; None where no tick is whole
    lost: tuple[Lost, ...]  # bytes that are no intact record
    error: DamagedLogError | None  # None where nothing but the end is missing
    unreadable: Mapping[str, int]  # by topic: documents that are not JSON
    unregistered: int  # messages of which nothing says the topic


def scan_log(path: str | os.PathLike[str]) -> Scan:
    """Reads a log once; twice where it is damaged, for all that is intact before and behind the damage.

    Memory is bounded by the largest chunk and a row of arrays a tick. Raises InputError where the file is missing or
    not MCAP.
    """
    path = Path(path)
    error = None
    try:
        scan, cut_off = _scan(path, read_records(path))
        if cut_off is None:
            return scan
    except DamagedLogError as damaged:
        error = DamagedLogError(str(damaged))  # a new one: that one's traceback holds the chunk it was about
    scan, _ = _scan(path, salvage(path))
    holes = [lost for lost in scan.lost if lost.end < scan.size]
    if error is None and holes:
        size = sum(lost.end - lost.start for lost in holes)
        error = DamagedLogError(f"{path}: damaged from byte {holes[0].start} on: {size} bytes are no record")
    return replace(scan, log=replace(scan.log, damaged=error is not None), error=error)


def _scan(path: Path, found: Iterable[Salvaged | CutOff]) -> tuple[Scan, CutOff | None]:
    survey, ticks = Survey(), TickAssembler(across_gaps=True)
    lost: list[Lost] = []
    unreadable: Counter[str] = Counter()
    cut_off = None
    for record in found:
        if isinstance(record, Lost):
            lost.append(record)
        elif isinstance(record, CutOff):
            cut_off = record
        elif not isinstance(record, Unchecked):
            survey.add(record)
            if isinstance(record, Message) and (channel := survey.channels.get(record.channel_id)) is not None:
                topic = channel.topic
                if topic in _WANTED and channel.message_encoding == "json":
                    try:
                        ticks.add(topic, record.sequence, json.loads(record.data))
                    except (ValueError, RecursionError):
                        unreadable[topic] += 1
    log = surveyed(path, survey)
    return Scan(log, path.stat().st_size, ticks.finish(), tuple(lost), None, unreadable, survey.unregistered), cut_off
