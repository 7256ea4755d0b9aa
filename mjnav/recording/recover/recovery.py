"""What a damaged log gives back and what it does not, counted while it is read."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    DataEnd,
    Footer,
    McapRecord,
    Message,
    Metadata,
    MetadataIndex,
    Statistics,
)

from mjnav.recording.read.records import LostBytes

MAX_RANGES = 200  # of lost bytes that are listed


def unknown_topic(channel: int) -> str:
    """The topic of messages of which no record says the topic."""
    return f"/unknown/{channel}"


@dataclass(frozen=True, slots=True)
class LostRange:
    """Bytes from `start` to before `end` that are no intact record, and how many messages they held at least."""

    start: int
    end: int
    why: str
    messages: int


@dataclass(frozen=True, slots=True)
class Recovery:
    """What was kept of a log and what was lost, by the keys of `--json` and of the metadata `mjnav/recovered`."""

    how: str  # `intact`; `mended` where one changed bit was all; else `recovered`
    changed_bit: int | None  # of a mended log; bit 0 is the lowest of byte 0
    has_end: bool
    messages: int
    messages_lost: int
    messages_lost_is_exact: bool  # the file itself still says how many it held; else at least so many were lost
    unknown_topics: list[str]
    topics: dict[str, int]  # messages kept, and lost
    topics_lost: dict[str, int]
    attachments: list[str]
    attachments_lost: list[str]
    metadata: list[str]
    metadata_lost: list[str]
    unchecked: dict[str, int]  # kept although neither a checksum of their own nor that of all data fits
    bytes_lost: int
    num_ranges: int
    ranges: list[LostRange]  # the first MAX_RANGES


def count_intact(found: Iterable[tuple[McapRecord | LostBytes, bool]], changed_bit: int | None = None) -> Recovery:
    """Counts what `intact_records` gives of a log, read with `changed_bit` inverted."""
    topics: dict[int, str] = {}
    kept: Counter[int] = Counter()
    expected: Mapping[int, int] | None = None
    unchecked: Counter[str] = Counter()
    names = {kind: Counter[str]() for kind in (Attachment, AttachmentIndex, Metadata, MetadataIndex)}
    ranges: list[LostBytes] = []
    seen: set[type] = set()
    for record, checked in found:
        seen.add(type(record))
        what = type(record).__name__.lower()
        if isinstance(record, Message):
            kept[record.channel_id] += 1
        elif isinstance(record, LostBytes):
            ranges.append(record)
            continue
        elif isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Statistics):
            expected = record.channel_message_counts
        elif isinstance(record, Attachment | AttachmentIndex | Metadata | MetadataIndex):
            names[type(record)][record.name] += 1
            what += f" {record.name}"
        if not checked:
            unchecked[what] += 1
    verified, has_end = DataEnd in seen, Footer in seen
    intact = verified and has_end and not ranges
    if expected is not None:
        lost = Counter(expected)
        lost.subtract(kept)
    else:
        lost = sum((Counter(gap.messages) for gap in ranges), Counter())
    return Recovery(
        how="recovered" if not intact else "intact" if changed_bit is None else "mended",
        changed_bit=changed_bit if intact else None,
        has_end=has_end,
        messages=kept.total(),
        messages_lost=(+lost).total(),
        messages_lost_is_exact=expected is not None,
        unknown_topics=[unknown_topic(channel) for channel in sorted(kept.keys() - topics)],
        topics=_by_topic({**dict.fromkeys(topics, 0), **kept}, topics),
        topics_lost=_by_topic(+lost, topics),
        attachments=sorted(names[Attachment].elements()),
        attachments_lost=sorted((names[AttachmentIndex] - names[Attachment]).elements()),
        metadata=sorted(names[Metadata].elements()),
        metadata_lost=sorted((names[MetadataIndex] - names[Metadata]).elements()),
        unchecked={} if verified else dict(unchecked),
        bytes_lost=sum(gap.end - gap.start for gap in ranges),
        num_ranges=len(ranges),
        ranges=[LostRange(gap.start, gap.end, gap.why, sum(gap.messages.values())) for gap in ranges[:MAX_RANGES]],
    )


def _by_topic(counts: Mapping[int, int], topics: Mapping[int, str]) -> dict[str, int]:
    """Numbers of messages by channel, as numbers by topic."""
    total: Counter[str] = Counter()
    for channel, count in counts.items():
        total[topics.get(channel, unknown_topic(channel))] += count
    return dict(sorted(total.items()))
