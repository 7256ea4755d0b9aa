"""A log for other programs: TUM trajectories, CSV tables, a ROS 2 bag. Each is a folder of its own.

A format is a module with `TOPICS`, the topics of the log that it knows, and `write`, which fills a folder from their
messages and says how much of what it wrote.
"""

import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from types import MappingProxyType, ModuleType

from mjnav.errors import DamagedLogError, InputError, MjnavError, missing_extra, unknown_name
from mjnav.recording.export.folder import check_new_folder, new_folder
from mjnav.recording.read.log import Log, LogMessage
from mjnav.recording.read.ticks import NOT_OURS

__all__ = ["FORMATS", "check_format", "check_new_folder", "export"]

# format -> (module, what it counts)
FORMATS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "tum": ("mjnav.recording.export.tum", "poses"),
        "csv": ("mjnav.recording.export.csv_tables", "rows"),
        "rosbag2": ("mjnav.recording.export.rosbag2", "messages"),
    }
)


# What a stranger's message leads to.
_NOT_OURS = (*NOT_OURS, struct.error)


def check_format(name: str, topics: Iterable[str] = ()) -> None:
    """Raises InputError where there is no such format, what it needs is not installed, or it knows none of a topic."""
    known = _load(name).TOPICS
    for topic in topics:
        if topic not in known:
            raise unknown_name("--topic", topic, known)


def export(
    log: Log,
    form: str,
    path: Path,
    *,
    topics: Iterable[str] = (),
    progress: Callable[[float], None] = lambda time: None,
) -> dict[str, int]:
    """Writes a log, or some of its topics, as the new folder `path`.

    Gives the number of poses, rows or messages by the name of what holds them. `progress` is told the simulated time
    so far [s]; what it raises ends the export, and then, as after any error, nothing is left of it. Raises InputError
    where the log was not written by mjnav or holds no messages, and as `check_format` and `check_new_folder` do,
    DamagedLogError where a message is not one of mjnav's.
    """
    chosen = tuple(dict.fromkeys(topics))
    check_format(form, chosen)
    if log.run is None:
        raise InputError(f"{log.path}: not a run of mjnav, and no other log can be exported")
    if log.duration is None:
        raise InputError(f"{log.path}: holds no messages to export")
    module = _load(form)
    chosen = chosen or tuple(module.TOPICS)
    try:
        with new_folder(path) as folder:
            return module.write(log, chosen, _told(log.messages(*chosen), progress), folder)
    except MjnavError:
        raise
    except _NOT_OURS as error:
        raise DamagedLogError(f"{log.path}: holds a message that is not one of mjnav's ({error!r})") from error


def _load(name: str) -> ModuleType:
    if name not in FORMATS:
        raise unknown_name("--format", name, FORMATS)
    try:
        return import_module(FORMATS[name][0])
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "rosbags":
            raise
        raise missing_extra("rosbags", "ros2") from None


def _told(messages: Iterator[LogMessage], progress: Callable[[float], None]) -> Iterator[LogMessage]:
    first = None
    for message in messages:
        first = message.time_ns if first is None else first
        progress(1e-9 * (message.time_ns - first))
        yield message
