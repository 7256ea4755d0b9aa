"""How a process ended that did not say so itself, and where it was then."""

import faulthandler
import os
import select
import signal

from mjnav.loop.faults.heartbeat import DUMP, dumped_frames
from mjnav.loop.faults.location import location

_MAX_DUMP = 1 << 16  # [bytes]; faulthandler writes at most 100 frames
_PATIENCE = 0.5  # [s] until a dump begins
_PAUSE = 0.1  # [s] between two pieces of it: it is written in many


def dump_to(descriptor: int) -> None:
    """Where this process is goes there when it dies of a fault, and when DUMP comes. Needs no interpreter's lock."""
    faulthandler.enable(descriptor, all_threads=False)  # type: ignore[arg-type] - a descriptor, as documented
    faulthandler.register(DUMP, descriptor, all_threads=False)  # type: ignore[arg-type]


def dump_of(process: int, descriptor: int) -> str:
    """What the process writes there when it is asked where it is; empty where it can not answer."""
    os.kill(process, DUMP)
    return read_dump(descriptor, _PATIENCE)


def read_dump(descriptor: int, patience: float = 0.0) -> str:
    """What was dumped there."""
    text = b""
    while select.select([descriptor], [], [], _PAUSE if text else patience)[0]:
        if not (piece := os.read(descriptor, _MAX_DUMP)):
            break
        text += piece
    return text.decode(errors="replace")


def describe_end(exit_code: int, dump: str) -> str:
    """How a process ended: its exit code, or minus the signal that ended it; and where, if it dumped that."""
    named = {one.value: one.name for one in signal.Signals}
    what = (
        f"exit code {exit_code}, as os._exit does" if exit_code >= 0 else named.get(-exit_code, f"signal {-exit_code}")
    )
    where = location(dumped_frames(dump))
    return f"{what} ({where})" if where else what
