"""One message of a log, and what is known of a topic once all of its messages were counted."""

from dataclasses import dataclass
from typing import Any, NamedTuple


class LogMessage(NamedTuple):
    """One decoded message: JSON as a dict, protobuf as its message object, anything else as bytes."""

    topic: str
    time_ns: int
    sequence: int  # the tick
    value: Any


@dataclass(slots=True)
class TopicSummary:
    """What one topic holds. Times are simulated nanoseconds; sequence numbers are ticks where mjnav wrote the log."""

    schema: str
    messages: int = 0
    first_ns: int | None = None
    last_ns: int | None = None
    max_gap_ns: int | None = None  # the longest time between two successive messages
    max_gap_at_ns: int | None = None  # when it began
    first_sequence: int | None = None
    last_sequence: int | None = None
    skipped: int = 0  # sequence numbers between those of successive messages
    bytes: int = 0  # of the messages, before compression

    @property
    def hz(self) -> float | None:
        """Messages a second over the topic's own span; None where they span no time."""
        if self.first_ns is None or self.last_ns is None or self.last_ns <= self.first_ns:
            return None
        return (self.messages - 1) / (1e-9 * (self.last_ns - self.first_ns))

    def add(self, time_ns: int, sequence: int, size: int) -> None:
        """Counts one more message."""
        self.messages += 1
        self.bytes += size
        if self.last_ns is None or self.last_sequence is None:
            self.first_ns, self.first_sequence = time_ns, sequence
        else:
            gap = time_ns - self.last_ns
            if self.max_gap_ns is None or gap > self.max_gap_ns:
                self.max_gap_ns, self.max_gap_at_ns = max(0, gap), self.last_ns
            if sequence > self.last_sequence + 1:
                self.skipped += sequence - self.last_sequence - 1
        self.last_ns, self.last_sequence = time_ns, sequence

    def shift(self, epoch: int) -> None:
        """Counts times from `epoch` [ns] on."""
        if self.first_ns is not None and self.last_ns is not None:
            self.first_ns, self.last_ns = self.first_ns - epoch, self.last_ns - epoch
        if self.max_gap_at_ns is not None:
            self.max_gap_at_ns -= epoch
