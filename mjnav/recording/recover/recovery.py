"""What a damaged log gives back and what it does not, counted while it is read."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    DataEnd,
    Footer,
    Header,
    Message,
    Metadata,
    MetadataIndex,
    Statistics,
)

from mjnav.recording.recover.salvage import Lost, Salvaged, Unchecked

MAX_RANGES = 200  # of lost bytes that a document lists


def unknown_topic(channel: int) -> str:
    """The topic of messages of which nothing tells any more what they are."""
    return f"/unknown/{channel}"


class Recovery:
    """Takes what `salvage` gives, in its order."""

    def __init__(self, size: int, changed_bit: int | None = None):
        self.size = size  # [bytes] of the log
        self.changed_bit = changed_bit  # the one that was read as the other; bit 0 is the lowest of byte 0
        self.profile = ""
        self.has_end = False
        self.ranges: list[Lost] = []
        self.attachments: Counter[str] = Counter()
        self.metadata: Counter[str] = Counter()
        self._verified = False  # the checksum of all data fits, if there is one
        self._topics: dict[int, str] = {}
        self._kept: Counter[int] = Counter()
        self._expected: Mapping[int, int] | None = None
        self._attachments_expected: Counter[str] = Counter()
        self._metadata_expected: Counter[str] = Counter()
        self._unchecked: Counter[str] = Counter()
        self._next_is_unchecked = False

    def add(self, item: Salvaged) -> None:
        """The next item."""
        if isinstance(item, Unchecked):
            self._next_is_unchecked = True
            return
        what = type(item).__name__.lower()
        if isinstance(item, Message):
            self._kept[item.channel_id] += 1
        elif isinstance(item, Lost):
            self.ranges.append(item)
        elif isinstance(item, Channel):
            self._topics[item.id] = item.topic
        elif isinstance(item, Attachment):
            self.attachments[item.name] += 1
            what += f" {item.name}"
        elif isinstance(item, Metadata):
            self.metadata[item.name] += 1
            what += f" {item.name}"
        elif isinstance(item, AttachmentIndex):
            self._attachments_expected[item.name] += 1
        elif isinstance(item, MetadataIndex):
            self._metadata_expected[item.name] += 1
        elif isinstance(item, Statistics):
            self._expected = item.channel_message_counts
        elif isinstance(item, Header):
            self.profile = item.profile
        elif isinstance(item, DataEnd):
            self._verified = True
        elif isinstance(item, Footer):
            self.has_end = True
        if self._next_is_unchecked:
            self._unchecked[what] += 1
            self._next_is_unchecked = False

    @property
    def intact(self) -> bool:
        """Nothing in the file, read with that bit as the other, is damaged."""
        return self.has_end and self._verified and not self.ranges

    @property
    def how(self) -> str:
        """`intact`, `mended` where one changed bit was all, else `recovered`."""
        if not self.intact:
            return "recovered"
        return "intact" if self.changed_bit is None else "mended"

    @property
    def holds_nothing(self) -> bool:
        """There is nothing to recover."""
        return not (self.intact or self._kept or self.attachments or self.metadata)

    @property
    def messages(self) -> dict[str, int]:
        """Messages kept, by topic."""
        return self._by_topic({**dict.fromkeys(self._topics, 0), **self._kept})

    @property
    def lost_is_exact(self) -> bool:
        """Whether the file itself still says how many messages it held; else at least so many were lost."""
        return self._expected is not None

    @property
    def messages_lost(self) -> dict[str, int]:
        """Messages lost, by topic."""
        if self._expected is not None:
            lost = Counter(self._expected)
            lost.subtract(self._kept)
        else:
            lost = Counter()
            for gap in self.ranges:
                lost.update(gap.messages)
        return self._by_topic(+lost)

    @property
    def unchecked(self) -> dict[str, int]:
        """What is kept although no checksum speaks for it, neither its own nor that of all data."""
        return {} if self._verified else dict(self._unchecked)

    def _by_topic(self, counts: Mapping[int, int]) -> dict[str, int]:
        total: Counter[str] = Counter()
        for channel, count in counts.items():
            total[self._topics.get(channel, unknown_topic(channel))] += count
        return dict(sorted(total.items()))

    def document(self) -> dict[str, Any]:
        """All of it, by the names that `--json` and the metadata of a recovered log give it."""
        messages, lost = self.messages, self.messages_lost
        return {
            "how": self.how,
            "changed_bit": self.changed_bit if self.how == "mended" else None,
            "has_end": self.has_end,
            "messages": sum(messages.values()),
            "messages_lost": sum(lost.values()),
            "messages_lost_is_exact": self.lost_is_exact,
            "unknown_topics": [unknown_topic(channel) for channel in sorted(self._kept.keys() - self._topics)],
            "topics": messages,
            "topics_lost": lost,
            "attachments": sorted(self.attachments.elements()),
            "attachments_lost": sorted((self._attachments_expected - self.attachments).elements()),
            "metadata": sorted(self.metadata.elements()),
            "metadata_lost": sorted((self._metadata_expected - self.metadata).elements()),
            "unchecked": self.unchecked,
            "bytes_lost": sum(gap.end - gap.start for gap in self.ranges),
            "num_ranges": len(self.ranges),
            "ranges": [
                {"start": gap.start, "end": gap.end, "why": gap.why, "messages": sum(gap.messages.values())}
                for gap in self.ranges[:MAX_RANGES]
            ],
        }
