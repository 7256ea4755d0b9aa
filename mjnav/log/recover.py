"""Makes a whole log of a damaged one: all that is intact, and what was lost as the metadata `mjnav/recovered`."""

import json
import os
import shutil
import struct
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any

from mcap import records

from mjnav.errors import DamagedLogError
from mjnav.log.log_format import RECOVERED, appearing, check_path, mcap_writer
from mjnav.log.read.records import LostBytes, open_file, read_records

MAX_RANGES = 200  # of lost bytes that are listed
NAMED = (records.Attachment, records.AttachmentIndex, records.Metadata, records.MetadataIndex)
OnByte = Callable[[int], None]


Recovery = dict[str, Any]  # what was kept and what was lost, as `--json` and the metadata `mjnav/recovered` have it


def recover(
    log: str | os.PathLike[str], out: str | os.PathLike[str], *, on_byte: OnByte = lambda place: None
) -> Recovery:
    """Writes all that is intact in `log` to the new file `out`, and says what that is.

    A log that is not damaged is copied byte for byte. Of any other a new file is made of the same schemas, channels,
    messages, attachments and metadata, in the same order, with the metadata `mjnav/recovered`: the file's name and the
    keys of the Recovery. `out` appears when it is whole. `on_byte` is told how far in `log` the reading is.

    Raises InputError where `log` cannot be read or is no MCAP file, and where `out` exists or cannot be written;
    DamagedLogError where there is nothing to recover; MjnavError where the disk is full.
    """
    check_path(out)
    log = Path(log)
    recovery = _counted(read_records(log, on_byte))
    intact = recovery["how"] == "intact"
    if not (intact or recovery["messages"] or recovery["attachments"] or recovery["metadata"]):
        raise DamagedLogError(f"{log}: damaged: nothing in it can be recovered")
    with appearing(Path(out)) as path:
        with open(path, "xb") as file, open_file(log) as source:
            if not intact:
                try:
                    _write(log, recovery, file, on_byte)
                except struct.error as error:
                    raise DamagedLogError(f"{log}: damaged: it names more topics than a log can have") from error
            else:
                shutil.copyfileobj(source, file)
            file.flush()
            os.fsync(file.fileno())
        check_path(out)  # once more: the file may have been made meanwhile
    return recovery


def _counted(read: Iterable[records.McapRecord | LostBytes]) -> Recovery:
    """What the records of a file amount to."""
    topics: dict[int, str] = {}
    kept: Counter[int] = Counter()
    expected: Mapping[int, int] | None = None
    names = {kind: Counter[str]() for kind in NAMED}
    ranges: list[LostBytes] = []
    has_end = False
    for record in read:
        if isinstance(record, records.Message):
            kept[record.channel_id] += 1
        elif isinstance(record, LostBytes):
            ranges.append(record)
        elif isinstance(record, records.Channel):
            topics[record.id] = record.topic
        elif isinstance(record, records.Statistics):
            expected = record.channel_message_counts
        elif isinstance(record, records.Footer):
            has_end = True
        elif isinstance(record, NAMED):
            names[type(record)][record.name] += 1
    lost = Counter(expected or {})
    lost.subtract(kept)
    intact = has_end and not ranges
    return {
        "how": "intact" if intact else "recovered",
        "has_end": has_end,
        "messages": kept.total(),
        "messages_lost": (+lost).total(),
        "messages_lost_is_exact": expected is not None,  # the file itself still says how many it held
        "unknown_topics": [unknown_topic(channel) for channel in sorted(kept.keys() - topics)],
        "topics": _by_topic({**dict.fromkeys(topics, 0), **kept}, topics),
        "topics_lost": _by_topic(+lost, topics),
        "attachments": sorted(names[records.Attachment].elements()),
        "attachments_lost": sorted((names[records.AttachmentIndex] - names[records.Attachment]).elements()),
        "metadata": sorted(names[records.Metadata].elements()),
        "metadata_lost": sorted((names[records.MetadataIndex] - names[records.Metadata]).elements()),
        # They have no checksum of their own, and that of all data does not fit.
        "unchecked": {} if intact else {f"metadata {name}": count for name, count in names[records.Metadata].items()},
        "bytes_lost": sum(part.end - part.start for part in ranges),
        "num_ranges": len(ranges),
        "ranges": [asdict(part) for part in ranges[:MAX_RANGES]],
    }


def unknown_topic(channel: int) -> str:
    """The topic of messages of which no record says the topic."""
    return f"/unknown/{channel}"


def _by_topic(counts: Mapping[int, int], topics: Mapping[int, str]) -> dict[str, int]:
    """Numbers of messages by channel, as numbers by topic."""
    total: Counter[str] = Counter()
    for channel, count in counts.items():
        total[topics.get(channel, unknown_topic(channel))] += count
    return dict(sorted(total.items()))


def _write(log: Path, recovery: Recovery, file: IO[bytes], on_byte: OnByte) -> None:
    """A new file, whose numbers of schemas and channels may be others."""
    writer = mcap_writer(file)
    headers = (record for record in read_records(log) if isinstance(record, records.Header))
    header = next(headers, records.Header("", ""))
    writer.start(profile=header.profile, library="mjnav recover")
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    for record in read_records(log, on_byte):
        if isinstance(record, records.Message):
            if record.channel_id not in channels:
                channels[record.channel_id] = writer.register_channel(unknown_topic(record.channel_id), "", 0)
            channel = channels[record.channel_id]
            writer.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)
        elif isinstance(record, records.Schema) and record.id not in schemas:
            schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
        elif isinstance(record, records.Channel) and record.id not in channels:
            schema = schemas.get(record.schema_id, 0)  # 0: without a schema, as the format has it
            channels[record.id] = writer.register_channel(
                record.topic, record.message_encoding, schema, record.metadata
            )
        elif isinstance(record, records.Attachment):
            writer.flush()  # so that it comes behind the messages before it
            writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)
        elif isinstance(record, records.Metadata):
            writer.flush()
            writer.add_metadata(record.name, record.metadata)
    writer.flush()
    described = {"file": log.name, "size": log.stat().st_size, **recovery}
    writer.add_metadata(
        RECOVERED, {key: value if isinstance(value, str) else json.dumps(value) for key, value in described.items()}
    )
    writer.finish()
