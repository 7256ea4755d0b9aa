"""Records that contradict themselves are refused, each with what is wrong."""

import struct
import zlib

import lz4.frame
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Message, Schema

from mjnav.recording.read.records import LIMIT, BadRecord, chunk_records, parse_record


def written(record) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


CONTENT = b"".join(
    written(record)
    for record in (
        Schema(id=1, data=b"{}", encoding="jsonschema", name="mjnav.Command"),
        Channel(id=2, topic="/command", message_encoding="json", metadata={"a": "b"}, schema_id=1),
        Message(channel_id=2, log_time=5, data=b'{"v": 1}', publish_time=6, sequence=7),
        Message(channel_id=2, log_time=8, data=b"", publish_time=9, sequence=10),
    )
)


def chunk(content=CONTENT, compression=b"", *, packed=None, size=None, checksum=None, length=None) -> bytes:
    packed = content if packed is None else packed
    size = len(content) if size is None else size
    checksum = zlib.crc32(content) if checksum is None else checksum
    head = struct.pack("<QQQII", 0, 0, size, checksum, len(compression)) + compression
    return head + struct.pack("<Q", len(packed) if length is None else length) + packed


@pytest.mark.parametrize(
    ("compression", "pack"), [(b"", bytes), (b"lz4", lz4.frame.compress), (b"zstd", zstandard.compress)]
)
def test_a_sound_chunk_gives_what_was_written(compression, pack):
    schema, channel, message, empty = chunk_records(chunk(compression=compression, packed=pack(CONTENT)))
    assert (schema.name, channel.topic, channel.metadata) == ("mjnav.Command", "/command", {"a": "b"})
    assert message == Message(channel_id=2, log_time=5, data=b'{"v": 1}', publish_time=6, sequence=7)
    assert (empty.data, empty.sequence) == (b"", 10)


def test_a_chunk_without_a_checksum_or_content_is_sound():
    assert len(list(chunk_records(chunk(checksum=0)))) == 4
    for compression, pack in ((b"", bytes), (b"lz4", lz4.frame.compress), (b"zstd", zstandard.compress)):
        assert list(chunk_records(chunk(b"", compression, packed=pack(b"")))) == []


def test_records_that_do_not_belong_in_a_chunk_are_ignored():
    assert list(chunk_records(chunk(b"\xc8" + struct.pack("<Q", 3) + b"abc"))) == []


PACKED = lz4.frame.compress(CONTENT)
BAD = {
    "no beginning": (b"abc", "a chunk without its beginning"),
    "another length": (chunk(length=5), "a chunk of 5 bytes, of which it holds"),
    "another size": (chunk(size=5), "a chunk of .* bytes that claims 5"),
    "more decompressed": (chunk(compression=b"lz4", packed=PACKED, size=len(CONTENT) + 1), "bytes that claims"),
    "less decompressed": (chunk(compression=b"lz4", packed=PACKED, size=len(CONTENT) - 1), "does not match its check"),
    "zstd of another size": (
        chunk(compression=b"zstd", packed=zstandard.compress(CONTENT), size=9),
        "cannot hold the 9",
    ),
    "far too large": (chunk(size=LIMIT + 1), f"more than the {LIMIT} that are read"),
    "larger than LZ4 can": (chunk(compression=b"lz4", packed=PACKED, size=10**7), "cannot hold the 10000000 bytes"),
    "another checksum": (chunk(checksum=1), "does not match its checksum"),
    "not LZ4": (chunk(compression=b"lz4", packed=b"x" * 200), "cannot be decompressed"),
    "not Zstandard": (chunk(compression=b"zstd", packed=b"x" * 200), "cannot be decompressed"),
    "LZ4 cut short": (chunk(compression=b"lz4", packed=PACKED[:-20], checksum=0), "that claims"),
    "unknown compression": (chunk(compression=b"\xffrar"), "compression '.rar' is unknown"),
    "a record cut short": (chunk(CONTENT[:-1]), "a record of 22 bytes, of which it holds 21"),
    "a header cut short": (chunk(CONTENT + b"\x05\x01"), "ends within a record"),
    "a record without end": (chunk(b"\x05" + struct.pack("<Q", 2**60)), "a record of 1152921504606846976 bytes"),
    "zeros": (chunk(bytes(100)), "opcode 0"),
    "a message too short": (chunk(b"\x05" + struct.pack("<Q", 21) + bytes(21)), "a message of 21 bytes"),
    "a schema too short": (chunk(b"\x03" + struct.pack("<Q", 3) + bytes(3)), "a record that makes no sense .schema"),
    "a topic that is no text": (chunk(CONTENT.replace(b"/command", b"/comm\xff\xfe\xfd")), "no sense .channel"),
}


@pytest.mark.parametrize(("body", "what"), BAD.values(), ids=BAD)
def test_a_chunk_that_contradicts_itself_is_refused(body, what):
    with pytest.raises(BadRecord, match=what):
        list(chunk_records(body))


def test_an_attachments_checksum_is_verified_where_there_is_one():
    body = written(Attachment(1, 2, "a", "text/plain", b"content"))[9:]
    assert parse_record(Opcode.ATTACHMENT, body).data == b"content"
    with pytest.raises(BadRecord, match="an attachment that does not match its checksum"):
        parse_record(Opcode.ATTACHMENT, body.replace(b"content", b"contemt"))
    assert parse_record(Opcode.ATTACHMENT, body[:-4] + bytes(4)).name == "a"


@pytest.mark.parametrize("size", [0, 5, 40])
def test_an_attachment_cut_short_is_refused(size):
    body = written(Attachment(1, 2, "a", "text/plain", b"content"))[9:]
    with pytest.raises(BadRecord, match="attachment"):
        parse_record(Opcode.ATTACHMENT, body[:size])


def test_indices_and_unknown_opcodes_give_no_record():
    assert [parse_record(opcode, b"") for opcode in (Opcode.CHUNK_INDEX, Opcode.STATISTICS, 77, 200)] == [None] * 4
