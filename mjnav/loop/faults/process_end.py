"""How a process ended that could not report it, and where in its code it was."""

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
    """Dumps the stack to `descriptor` on a fatal signal and on DUMP, without the interpreter's lock."""
    faulthandler.enable(descriptor, all_threads=False)  # type: ignore[arg-type] - a descriptor, as documented
    faulthandler.register(DUMP, descriptor, all_threads=False)  # type: ignore[arg-type]


def dump_of(process: int, descriptor: int) -> str:
    """The stack that the process dumps when it is asked to; empty where it does not answer."""
    os.kill(process, DUMP)
    return read_dump(descriptor, _PATIENCE)


def read_dump(descriptor: int, patience: float = 0.0) -> str:
    """What has been dumped to `descriptor`."""
    text = b""
    while select.select([descriptor], [], [], _PAUSE if text else patience)[0]:
        if not (piece := os.read(descriptor, _MAX_DUMP)):
            break
        text += piece
    return text.decode(errors="replace")


def describe_end(exit_code: int, dump: str) -> str:
    """How a process ended, from its exit code or minus the signal that ended it, and where, if it dumped its stack."""
    named = {one.value: one.name for one in signal.Signals}
    what = (
        f"exit code {exit_code}, as os._exit does" if exit_code >= 0 else named.get(-exit_code, f"signal {-exit_code}")
    )
    where = location(dumped_frames(dump))
    return f"{what} ({where})" if where else what
