"""The log: one MCAP file a run, written while it goes and readable however it ended.

The only folder that imports mcap and protobuf, which takes as long as everything else that `mjnav list` needs: so the
names below are imported when they are first asked for.
"""

from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjnav.log.log_format import check_path
    from mjnav.log.read.log import Log, TopicSummary, open_log
    from mjnav.log.read.trajectory import TrajectoryBuilder
    from mjnav.log.write.writer import Recorder

__all__ = ["Log", "Recorder", "TopicSummary", "TrajectoryBuilder", "check_path", "open_log"]

_PLACES = MappingProxyType(
    {
        "Log": "read.log",
        "Recorder": "write.writer",
        "TopicSummary": "read.log",
        "TrajectoryBuilder": "read.trajectory",
        "check_path": "log_format",
        "open_log": "read.log",
    }
)


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'mjnav.log' has no attribute {name!r}")
    return getattr(import_module(f"mjnav.log.{_PLACES[name]}"), name)
