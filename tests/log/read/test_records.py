"""Intact records come out as they were written; of damaged ones it is told where they stood and what is wrong."""

import struct
import zlib
from collections import Counter

import lz4.frame
import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    DataEnd,
    Footer,
    Header,
    Message,
    Metadata,
    Schema,
)
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

from mjnav.log.read.records import LIMIT, BadRecord, Budget, LostBytes, read_records, unpacked
from tests.log.mutated_logs import damaged


def written(record) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


# ----------------------------------------------------------------------------------------- one record

CONTENT = b"".join(
    written(record)
    for record in (
        Schema(id=1, data=b"{}", encoding="jsonschema", name="mjnav.Command"),
        Channel(id=2, topic="/command", message_encoding="json", metadata={"a": "b"}, schema_id=1),
        Message(channel_id=2, log_time=5, data=b'{"v": 1}', publish_time=6, sequence=7),
        Message(channel_id=2, log_time=8, data=b"", publish_time=9, sequence=10),
    )
)
PACK = {b"": bytes, b"lz4": lz4.frame.compress, b"zstd": zstandard.compress}


def chunk(content=CONTENT, compression=b"", *, packed=None, size=None, checksum=None, length=None) -> bytes:
    packed = content if packed is None else packed
    size = len(content) if size is None else size
    checksum = zlib.crc32(content) if checksum is None else checksum
    head = struct.pack("<QQQII", 0, 0, size, checksum, len(compression)) + compression
    body = head + struct.pack("<Q", len(packed) if length is None else length) + packed
    return struct.pack("<BQ", Opcode.CHUNK, len(body)) + body


def records_of(raw: bytes) -> list:
    return list(unpacked(raw, Budget(len(raw))))


@pytest.mark.parametrize("compression", PACK)
def test_a_sound_chunk_gives_what_was_written(compression):
    raw = chunk(compression=compression, packed=PACK[compression](CONTENT))
    schema, channel, message, empty = records_of(raw)
    assert (schema.name, channel.topic, channel.metadata) == ("mjnav.Command", "/command", {"a": "b"})
    assert message == Message(channel_id=2, log_time=5, data=b'{"v": 1}', publish_time=6, sequence=7)
    assert (empty.data, empty.sequence) == (b"", 10)
    assert records_of(chunk(b"", compression, packed=PACK[compression](b""))) == []


PACKED = lz4.frame.compress(CONTENT)
BAD = {
    "another size": (chunk(size=5), "a chunk of 5 bytes that holds more"),
    "more decompressed": (chunk(compression=b"lz4", packed=PACKED, size=len(CONTENT) + 1), "that holds"),
    "far too large": (chunk(size=LIMIT + 1), f"more than the {LIMIT} that are read"),
    "more than its file may hold": (chunk(compression=b"lz4", packed=PACKED, size=10**8), "more than allowed"),
    "another checksum": (chunk(checksum=1), "does not match its checksum"),
    "not LZ4": (chunk(compression=b"lz4", packed=b"x" * 200), "cannot be decompressed"),
    "unknown compression": (chunk(compression=b"rar"), "compression 'rar' is unknown"),
    "a record cut short": (chunk(CONTENT[:-1]), "longer than it says"),
    "a message too short": (chunk(b"\x05" + struct.pack("<Q", 21) + bytes(21)), "longer than it says"),
}


@pytest.mark.parametrize(("raw", "what"), BAD.values(), ids=BAD)
def test_a_chunk_that_contradicts_itself_is_refused(raw, what):
    with pytest.raises(BadRecord, match=what):
        records_of(raw)


# ---------------------------------------------------------------------------------------- whole files


def key(message: Message) -> tuple:
    return message.channel_id, message.sequence, message.log_time, message.publish_time, message.data


def places(content: bytes, opcode: int) -> list[tuple[int, int]]:
    """Where each record of a kind starts and ends in an undamaged file."""
    found, start = [], len(MCAP0_MAGIC)
    while start < len(content) - len(MCAP0_MAGIC):
        kind, length = struct.unpack_from("<BQ", content, start)
        if kind == opcode:
            found.append((start, start + 9 + length))
        start += 9 + length
    return found


def read(folder, content: bytes) -> list:
    (folder / "read.mcap").write_bytes(content)
    return list(read_records(folder / "read.mcap"))


def messages(records) -> list[tuple]:
    return [key(record) for record in records if isinstance(record, Message)]


def lost(records) -> list[LostBytes]:
    return [record for record in records if isinstance(record, LostBytes)]


def flipped(content: bytes, place: int, bit: int = 0) -> bytes:
    changed = bytearray(content)
    changed[place] ^= 1 << bit
    return bytes(changed)


def in_chunks(content: bytes) -> list[list[tuple]]:
    """The messages of each chunk of an undamaged file."""
    return [messages(records_of(content[start:end])) for start, end in places(content, Opcode.CHUNK)]


def test_an_intact_file_gives_all_records_that_the_library_gives(whole):
    records = list(read_records(whole))
    with open(whole, "rb") as file:
        expected = list(StreamReader(file, validate_crcs=True).records)
    kinds = (Header, Message, Attachment, Metadata, DataEnd)
    for kind in kinds:
        assert [r for r in records if isinstance(r, kind)] == [r for r in expected if isinstance(r, kind)]
    assert lost(records) == []
    assert isinstance(records[-1], Footer)


def test_a_damaged_chunk_is_skipped_and_told(whole):
    content, chunks = whole.read_bytes(), in_chunks(whole.read_bytes())
    for number, (start, end) in enumerate(places(content, Opcode.CHUNK)):
        for place in (start + 30, start + 60, (start + end) // 2, end - 1):
            records = read(whole.parent, flipped(content, place))
            assert messages(records) == [message for i, part in enumerate(chunks) if i != number for message in part]
            assert [(part.start, part.end) for part in lost(records)] == [(start, end)]
            assert isinstance(records[-1], Footer)
            topics = {record.id for record in records if isinstance(record, Channel)}
            assert topics >= {message[0] for message in messages(records)}


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_after_any_damage_a_chunk_is_whole_or_missing_and_the_damage_told(whole, data):
    content = whole.read_bytes()
    changed = data.draw(damaged(content))
    if not changed.startswith(MCAP0_MAGIC):
        return
    records = read(whole.parent, changed)
    kept, expected = Counter(messages(records)), []
    for part in in_chunks(content):
        found = {message in kept for message in part}
        assert len(found) == 1
        expected += part if found == {True} else []
    assert messages(records) == expected
    assert lost(records) or not content.startswith(changed) or changed.endswith(content[-20:])
    edges = [edge for part in lost(records) for edge in (part.start, part.end)]
    assert edges == sorted(edges)
    assert all(0 <= edge <= len(changed) for edge in edges)


def test_where_a_damaged_length_leads_nowhere_all_that_follows_is_lost(whole):
    content = whole.read_bytes()
    start, _ = places(content, Opcode.CHUNK)[2]
    first, second, *_ = in_chunks(content)
    for changed in (flipped(content, start + 6), content[:start] + bytes(9) + content[start + 9 :]):
        records = read(whole.parent, changed)
        assert messages(records) == first + second
        (part,) = lost(records)
        assert (part.start, part.end, part.is_damage) == (start, len(content), True)
