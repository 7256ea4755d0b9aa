"""What a whole run attaches to its simulation."""

from collections.abc import Callable
from dataclasses import dataclass

from mjnav.loop.pacer import Stopwatch
from mjnav.messages import TickRecord
from mjnav.recording.live import LiveServer


@dataclass(frozen=True, slots=True)
class Attached:
    """A watcher, live clients, a thread for the log, a stopwatch of its own.

    `watch` sees every tick before the world moves on, and the clients of `live` get what a log gets. `cones` also
    computes the samples that are logged when no log is written; a log that is `threaded` is written on a thread.
    """

    watch: Callable[[TickRecord], None] = lambda record: None
    live: LiveServer | None = None
    cones: bool = False
    threaded: bool = False
    stopwatch: Stopwatch | None = None
