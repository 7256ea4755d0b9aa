"""The log: one MCAP file a run, written while it goes and readable however it ended.

The only folder that imports mcap and protobuf, which takes as long as everything else that `mjnav list` needs: so the
names below are imported when they are first asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjnav.log.read.log import Log, open_log
    from mjnav.log.write.writer import Recorder

__all__ = ["Log", "Recorder", "open_log"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'mjnav.log' has no attribute {name!r}")
    return getattr(import_module(f"mjnav.log.{'write.writer' if name == 'Recorder' else 'read.log'}"), name)
