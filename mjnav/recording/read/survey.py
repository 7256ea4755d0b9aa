"""What a log holds, summed up record by record: metadata, attachments, and figures of every topic."""

from dataclasses import dataclass

import mcap.records as records

from mjnav.recording.read.stream import CutOff


@dataclass(slots=True)
class TopicSummary:
    """What one topic holds. Times are simulated nanoseconds; sequence numbers are ticks where mjnav wrote the log."""

    schema: str
    encoding: str = ""
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
        if self.last_ns is None or self.first_ns is None or self.last_sequence is None:
            self.first_ns, self.first_sequence = time_ns, sequence
        else:
            gap = time_ns - self.last_ns
            if self.max_gap_ns is None or gap > self.max_gap_ns:
                self.max_gap_ns, self.max_gap_at_ns = max(0, gap), self.last_ns
            if sequence > self.last_sequence + 1:
                self.skipped += sequence - self.last_sequence - 1
        self.last_ns, self.last_sequence = time_ns, sequence


class Survey:
    """Takes the records of one log in their order."""

    def __init__(self):
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.topics: dict[str, TopicSummary] = {}
        self.channels: dict[int, records.Channel] = {}
        self.has_end = False
        self.unregistered = 0  # messages on a channel that no record speaks of
        self._schemas: dict[int, str] = {0: ""}
        self._topic_of: dict[int, TopicSummary] = {}

    def add(self, record: records.McapRecord | CutOff) -> None:
        """The next record."""
        if isinstance(record, records.Message):
            topic = self._topic_of.get(record.channel_id)
            if topic is None:
                self.unregistered += 1
            else:
                topic.add(record.log_time, record.sequence, len(record.data))
        elif isinstance(record, records.Schema):
            self._schemas[record.id] = record.name
        elif isinstance(record, records.Channel):
            self.channels[record.id] = record
            summary = TopicSummary(self._schemas.get(record.schema_id, ""), record.message_encoding)
            self._topic_of[record.id] = self.topics.setdefault(record.topic, summary)
        elif isinstance(record, records.Metadata):
            self.metadata[record.name] = record.metadata
        elif isinstance(record, records.Attachment):
            self.attachments[record.name] = record.data
        elif isinstance(record, records.Footer):
            self.has_end = True
