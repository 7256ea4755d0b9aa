"""A log as a folder that other programs read, in one of FORMATS: all of the folder or nothing of it.

A format is a module with `TOPICS`, the topics of the log that it knows, and `write`, which fills a folder from their
messages and gives the number of poses, rows or messages in each file or topic.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType, ModuleType

from mjnav.errors import InputError, missing_extra, unknown_name
from mjnav.log.log_format import appearing, check_folder
from mjnav.log.read.log import Log, LogMessage
from mjnav.log.read.tables import not_ours


@dataclass(frozen=True, slots=True)
class Format:
    """The module that writes a format, what it counts, and whether it takes --topic."""

    module: str
    counts: str
    by_topic: bool = False


FORMATS: Mapping[str, Format] = MappingProxyType(
    {
        "tum": Format("mjnav.log.export.tum", "poses"),
        "csv": Format("mjnav.log.export.csv_tables", "rows", by_topic=True),
        "parquet": Format("mjnav.log.export.parquet", "rows", by_topic=True),
        "rosbag2": Format("mjnav.log.export.rosbag2", "messages"),
    }
)
# package that a format imports -> what it is called in registries, and the extra that brings it
_OPTIONAL = MappingProxyType({"rosbags": ("rosbags", "ros2"), "pyarrow": ("pyarrow", "pandas")})


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

    Gives the number of poses, rows or messages by file or topic. `progress` is told the simulated time so far [s]; what
    it raises ends the export. After any exception nothing of the folder is left. Raises InputError where mjnav did not
    write the log or it holds no messages, and as `check_format` and `check_new_folder` do; DamagedLogError where a
    message is not one of mjnav's; MjnavError where the folder cannot be written.
    """
    chosen = tuple(dict.fromkeys(topics))
    check_format(form, chosen)
    target = check_new_folder(path)
    log.check_ours()
    if log.duration is None:
        raise InputError(f"{log.path}: holds no messages to export")
    for topic, why in log.unreadable.items():
        if topic in chosen:
            raise InputError(f"{log.path}: {topic}: {why}")
    module = _load(form)
    chosen = tuple(topic for topic in chosen or module.TOPICS if topic not in log.unreadable)
    with appearing(target) as folder, not_ours(log.path):
        return module.write(log, chosen, _reported(log.messages(*chosen), progress), folder)


def _load(name: str) -> ModuleType:
    if name not in FORMATS:
        raise unknown_name("--format", name, FORMATS)
    try:
        return import_module(FORMATS[name].module)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in _OPTIONAL:
            raise
        raise missing_extra(*_OPTIONAL[package]) from None


def _reported(messages: Iterator[LogMessage], progress: Callable[[float], None]) -> Iterator[LogMessage]:
    first = None
    for message in messages:
        first = message.time_ns if first is None else first
        progress(1e-9 * (message.time_ns - first))
        yield message


def check_new_folder(path: str | os.PathLike[str]) -> Path:
    """The path of a folder that could be made, or that is there and empty; creates nothing.

    Raises InputError where there is anything else, or the folder around it is missing or not writable.
    """
    given, path = path, Path(os.path.abspath(path))
    if path.is_symlink() or (path.exists() and not (path.is_dir() and not any(path.iterdir()))):
        raise InputError(f"{given}: exists already, and an export never replaces anything; choose another name")
    check_folder(given, path.parent)
    return path
