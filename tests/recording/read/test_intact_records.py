import struct
import tracemalloc
from collections import Counter
from dataclasses import dataclass
from io import BytesIO

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Header, Message, Metadata, Schema, Statistics
from mcap.stream_reader import breakup_chunk
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from mjnav.recording.read.intact_records import intact_records
from mjnav.recording.read.records import LostBytes
from tests.recording.mutated_logs import damaged

NUM_ATTACHMENTS, NUM_METADATA = 3, 2


@dataclass(frozen=True)
class Piece:
    """One record of an undamaged file; the messages in it if it is a chunk."""

    opcode: int
    start: int
    end: int
    messages: tuple[tuple, ...]


def key(message: Message) -> tuple:
    return message.channel_id, message.sequence, message.log_time, message.publish_time, message.data


def pieces_of(content: bytes) -> list[Piece]:
    pieces, at = [], len(MCAP0_MAGIC)
    while at < len(content) - len(MCAP0_MAGIC):
        opcode, length = struct.unpack_from("<BQ", content, at)
        end = at + 9 + length
        messages: tuple = ()
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(ReadDataStream(BytesIO(content[at + 9 : end])))
            messages = tuple(key(record) for record in breakup_chunk(chunk) if isinstance(record, Message))
        pieces.append(Piece(opcode, at, end, messages))
        at = end
    return pieces


def of_kind(pieces, opcode) -> list[Piece]:
    return [piece for piece in pieces if piece.opcode == opcode]


def everything_in(pieces) -> list[tuple]:
    return [message for piece in pieces for message in piece.messages]


@pytest.fixture(scope="module")
def pieces(whole):
    pieces = pieces_of(whole.read_bytes())
    assert len(of_kind(pieces, Opcode.CHUNK)) >= 4
    return pieces


def records_in(path) -> list:
    return [record for record, _ in intact_records(path)]


def intact_in(folder, content: bytes) -> list:
    path = folder / "damaged.mcap"
    path.write_bytes(content)
    return records_in(path)


def messages_of(items) -> list[tuple]:
    return [key(item) for item in items if isinstance(item, Message)]


def kinds_of(items) -> Counter:
    return Counter(type(item) for item in items)


def flipped(content: bytes, place: int, bit: int) -> bytes:
    changed = bytearray(content)
    changed[place] ^= 1 << bit
    return bytes(changed)


def written(path, *, attachment: bytes | None = None, num_chunks: int = 2, **options) -> bytes:
    """A small log of the library's own; two messages a chunk."""
    with open(path, "wb") as file:
        writer = Writer(file, **{"compression": CompressionType.LZ4, "enable_data_crcs": True, **options})
        writer.start()
        schema = writer.register_schema("text", "", b"")
        channel = writer.register_channel("/chatter", "text", schema)
        for i in range(num_chunks):
            for j in range(2):
                writer.add_message(channel, 10 * i + j, b"%s %d %d" % (path.name.encode(), i, j), 0, 2 * i + j)
            writer.flush()
            if attachment is not None and i == 0:
                writer.add_attachment(0, 0, "inside", "application/octet-stream", attachment)
        writer.finish()
    return path.read_bytes()


def test_an_intact_file_gives_all_records_and_no_lost_bytes(whole, pieces):
    items = records_in(whole)
    assert messages_of(items) == everything_in(pieces)
    kinds = kinds_of(items)
    assert kinds[LostBytes] == 0
    assert [kinds[kind] for kind in (Header, DataEnd, Footer, Statistics)] == [1, 1, 1, 1]
    assert (kinds[Attachment], kinds[Metadata]) == (NUM_ATTACHMENTS, NUM_METADATA)
    known: set[int] = set()
    for item in items:
        if isinstance(item, Channel):
            known.add(item.id)
        assert not isinstance(item, Message) or item.channel_id in known


@pytest.mark.parametrize("opcode", sorted(set(Opcode) - {Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL}))
def test_after_a_changed_bit_all_other_records_are_intact(whole, pieces, opcode):
    content, rng = whole.read_bytes(), np.random.default_rng(int(opcode))
    kind = of_kind(pieces, opcode)
    for piece in dict.fromkeys((kind[0], kind[-1])):
        others = everything_in(other for other in pieces if other is not piece)
        header = range(piece.start, min(piece.start + 9, piece.end))
        body = np.linspace(piece.start + 9, piece.end - 1, 9).astype(int).tolist()
        for place in {*header, *body}:
            items = intact_in(whole.parent, flipped(content, place, int(rng.integers(8))))
            assert messages_of(items) in (others, everything_in(pieces)), place
            kinds = kinds_of(items)
            assert kinds[Attachment] >= NUM_ATTACHMENTS - (opcode == Opcode.ATTACHMENT)
            assert kinds[Metadata] >= NUM_METADATA - (opcode == Opcode.METADATA)
            assert kinds[LostBytes] > 0 or kinds[DataEnd] == 0 or kinds[Footer] == 0, f"{place}: nothing was noticed"


def test_after_a_changed_bit_of_a_magic_all_records_are_intact(whole, pieces):
    content = whole.read_bytes()
    for place in (*range(8), *range(len(content) - 8, len(content))):
        items = intact_in(whole.parent, flipped(content, place, place % 8))
        assert messages_of(items) == everything_in(pieces)
        assert kinds_of(items)[LostBytes] == 1


def test_a_chunk_is_intact_whichever_bit_of_its_lengths_is_changed(whole, pieces):
    content = whole.read_bytes()
    chunk = of_kind(pieces, Opcode.CHUNK)[0]
    outer, inner = chunk.start + 1, chunk.start + 9 + 32 + len("lz4")
    assert struct.unpack_from("<Q", content, inner)[0] == chunk.end - inner - 8
    for bit in (*range(20), 30, 63):
        for place in (outer, inner):
            items = intact_in(whole.parent, flipped(content, place + bit // 8, bit % 8))
            assert messages_of(items) == everything_in(pieces), bit
            lost = [item.end - item.start for item in items if isinstance(item, LostBytes)]
            assert sum(lost) <= len("\0\0\0\0"), "no more than the mark that ends an LZ4 frame"
            assert kinds_of(items)[DataEnd] == 0


def test_lost_bytes_say_where_they_are_and_how_many_messages_they_held(whole, pieces):
    content = whole.read_bytes()
    chunk = of_kind(pieces, Opcode.CHUNK)[3]
    without_summary = content[: of_kind(pieces, Opcode.DATA_END)[0].start]
    for log in (content, without_summary):
        items = intact_in(whole.parent, flipped(log, chunk.end - 100, 0))
        (lost,) = (item for item in items if isinstance(item, LostBytes))
        assert (lost.start, lost.end) == (chunk.start, chunk.end)
        assert lost.why == "chunk whose checksum does not fit"
        assert lost.messages == Counter(message[0] for message in chunk.messages)


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_after_any_damage_a_chunk_is_whole_or_missing(whole, pieces, data):
    content = whole.read_bytes()
    changed = data.draw(damaged(content))
    items = intact_in(whole.parent, changed)
    kept, expected = Counter(messages_of(items)), []
    for piece in of_kind(pieces, Opcode.CHUNK):
        found = {message in kept for message in piece.messages}
        assert len(found) == 1
        assert found == {True} or content[piece.start : piece.end] not in changed
        expected += piece.messages if found == {True} else []
    assert messages_of(items) == expected
    attachments = [content[piece.start : piece.end] for piece in of_kind(pieces, Opcode.ATTACHMENT)]
    assert kinds_of(items)[Attachment] >= sum(attachment in changed for attachment in attachments)
    places = [edge for item in items if isinstance(item, LostBytes) for edge in (item.start, item.end)]
    assert places == sorted(places)
    assert all(0 <= place <= len(changed) for place in places)


def test_records_of_an_attached_log_are_not_read_as_the_logs_own(tmp_path):
    inner = written(tmp_path / "inner.mcap")
    content = written(tmp_path / "outer.mcap", attachment=inner)
    outer = [message for message in everything_in(pieces_of(content)) if b"outer" in message[-1]]
    assert len(outer) == 4
    (attachment,) = of_kind(pieces_of(content), Opcode.ATTACHMENT)
    for place in (*range(attachment.start, attachment.start + 60), attachment.end - 20, attachment.end - 1):
        for whole_end in (True, False):
            changed = flipped(content, place, place % 8)
            changed = changed if whole_end else changed[: of_kind(pieces_of(content), Opcode.DATA_END)[0].start]
            items = intact_in(tmp_path, changed)
            assert messages_of(items) == outer, place
            assert kinds_of(items)[Attachment] <= 1
    without_header = content[: attachment.start] + bytes(50) + content[attachment.start + 50 :]
    for end in (len(content), of_kind(pieces_of(content), Opcode.DATA_END)[0].start):
        assert messages_of(intact_in(tmp_path, without_header[:end])) == outer


@pytest.mark.parametrize("compression", CompressionType)
def test_no_message_of_a_damaged_chunk_is_read_with_any_compression(tmp_path, compression):
    content = written(tmp_path / "a.mcap", compression=compression, num_chunks=3)
    pieces = pieces_of(content)
    chunk = of_kind(pieces, Opcode.CHUNK)[1]
    others = everything_in(piece for piece in pieces if piece is not chunk)
    for place in range(chunk.start, chunk.end):
        items = intact_in(tmp_path, flipped(content, place, place % 8))
        assert messages_of(items) in (others, everything_in(pieces)), place
    items = intact_in(tmp_path, content[: chunk.start] + bytes(60) + content[chunk.start + 60 :])
    assert messages_of(items) == others


def test_a_chunk_without_checksum_is_lost_where_others_have_one(tmp_path):
    content = bytearray(written(tmp_path / "a.mcap"))
    chunk = of_kind(pieces_of(bytes(content)), Opcode.CHUNK)[1]
    content[chunk.start + 9 + 24 : chunk.start + 9 + 28] = bytes(4)
    assert len(messages_of(intact_in(tmp_path, bytes(content)))) == 2


def test_a_record_with_missing_bytes_does_not_swallow_the_next(tmp_path):
    """Missing bytes of an index or of an attachment of equal bytes leave something that reads like the whole."""
    content = written(tmp_path / "a.mcap", attachment=b"x" * 300)
    pieces = pieces_of(content)
    for piece in (of_kind(pieces, Opcode.ATTACHMENT)[0], *of_kind(pieces, Opcode.MESSAGE_INDEX)):
        for num_missing in range(1, 30):
            items = intact_in(tmp_path, content[: piece.end - 32] + content[piece.end - 32 + num_missing :])
            assert messages_of(items) == everything_in(pieces)
            assert kinds_of(items)[Attachment] == (piece.opcode != Opcode.ATTACHMENT)


def test_messages_outside_of_chunks_with_checksums_are_unchecked(tmp_path):
    content = written(tmp_path / "flat.mcap", use_chunking=False)
    (tmp_path / "flat.mcap").write_bytes(content[:-100])
    written(tmp_path / "bare.mcap", enable_crcs=False, enable_data_crcs=False)
    for name in ("flat.mcap", "bare.mcap"):
        checked = [checked for record, checked in intact_records(tmp_path / name) if isinstance(record, Message)]
        assert checked == [False] * 4
    assert kinds_of(records_in(tmp_path / "bare.mcap"))[Footer] == 1


def test_schemas_come_from_the_summary_where_the_first_chunk_is_lost(whole, pieces):
    content = whole.read_bytes()
    first = of_kind(pieces, Opcode.CHUNK)[0]
    undamaged = records_in(whole)
    for start in (0, 40):  # damaged in its place, and with the file's beginning gone
        items = intact_in(whole.parent, flipped(content, first.end - 50, 3)[start:])
        for kind in (Schema, Channel):
            defined = {item.id: item for item in undamaged if isinstance(item, kind)}
            assert {item.id: item for item in items if isinstance(item, kind)} == defined


def test_a_hole_of_64_MB_is_read_in_pieces(tmp_path):
    path = tmp_path / "a.mcap"
    content = written(path)
    chunk = of_kind(pieces_of(content), Opcode.CHUNK)[1]
    with open(path, "wb") as file:
        file.write(content[: chunk.start])
        file.seek(2**26, 1)
        file.write(content[chunk.start :])
    tracemalloc.start()
    try:
        assert len(messages_of(records_in(path))) == 4
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()
