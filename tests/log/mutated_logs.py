"""Hypothesis strategies that change a sound log as disks, networks, other programs and attackers do.

`mutated_logs(content)` draws from all of them. Some change bytes, so that checksums and lengths no longer fit; others
write contradictory records with checksums that fit, so that the code behind the checksums is reached.
"""

import json
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import lz4.frame
import zstandard
from hypothesis import strategies as st
from mcap.writer import MCAP0_MAGIC

MESSAGE, CHUNK, DATA_END, FOOTER = 5, 6, 15, 2
_CHUNK = struct.Struct("<QQQII")
_MESSAGE = struct.Struct("<HIQQ")
_COMPRESS: dict[bytes, Callable[[bytes], bytes]] = {
    b"lz4": lz4.frame.compress,
    b"zstd": zstandard.compress,
    b"": bytes,
}

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.sampled_from([10**400, -(2**63), 2**64, 1e308, -1e308, float("nan"), float("inf")])
    | st.floats()
    | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
NOT_DOCUMENTS = (
    b"",
    b"null",
    b"[]",
    b"{",
    b"[" * 100_000,
    b'{"a":' * 5_000,
    b"9" * 5_000,
    b"1e999",
    b'"\\ud800"',
    b"\xff\xfe{",
    b"\x00" * 30,
    b'{"people": 3, "contacts": 4, "pose": "x", "time": [], "estimate": {}}',
)


@dataclass(frozen=True)
class Record:
    """A record; of a chunk also what is in it, decompressed."""

    opcode: int
    body: bytes
    inside: tuple["Record", ...] | None = None
    compression: bytes = b""

    def encoded(self) -> bytes:
        body = self.body
        if self.inside is not None:
            data = b"".join(record.encoded() for record in self.inside)
            packed = _COMPRESS.get(self.compression, bytes)(data)
            head = _CHUNK.pack(0, 0, len(data), zlib.crc32(data), len(self.compression))
            body = head + self.compression + struct.pack("<Q", len(packed)) + packed
        return struct.pack("<BQ", self.opcode, len(body)) + body


def split(content: bytes) -> tuple[Record, ...]:
    """The records of a sound log, without its magic bytes."""
    return tuple(_opened(record) for record in _records(content[len(MCAP0_MAGIC) : -len(MCAP0_MAGIC)]))


def joined(records: tuple[Record, ...]) -> bytes:
    """A log of these records, without the checksums at its end that would contradict them."""
    quiet = (
        replace(record, body=bytes(len(record.body))) if record.opcode in (DATA_END, FOOTER) else record
        for record in records
    )
    return MCAP0_MAGIC + b"".join(record.encoded() for record in quiet) + MCAP0_MAGIC


def _records(data: bytes):
    place = 0
    while place < len(data):
        opcode, length = struct.unpack_from("<BQ", data, place)
        yield Record(opcode, data[place + 9 : place + 9 + length])
        place += 9 + length


def _opened(record: Record) -> Record:
    if record.opcode != CHUNK:
        return record
    name_length = _CHUNK.unpack_from(record.body)[-1]
    compression = record.body[_CHUNK.size : _CHUNK.size + name_length]
    data = record.body[_CHUNK.size + name_length + 8 :]
    unpack = {b"lz4": lz4.frame.decompress, b"zstd": zstandard.decompress, b"": bytes}[compression]
    return replace(record, inside=tuple(_records(unpack(data))), compression=compression)


@st.composite
def damaged(draw, content: bytes) -> bytes:
    """Bytes at one to five places are changed, inserted or removed, or the file's end is."""
    for _ in range(draw(st.integers(1, 5))):
        place = draw(st.integers(0, max(0, len(content) - 1)))
        size = draw(st.integers(1, 600) | st.integers(1, 20_000))
        before, after = content[:place], content[place:]
        match draw(st.sampled_from(("flip", "flip", "zero", "insert", "remove", "cut"))):
            case "flip" if after:
                content = before + bytes([after[0] ^ 1 << draw(st.integers(0, 7))]) + after[1:]
            case "zero":
                content = before + bytes(min(size, len(after))) + after[size:]
            case "insert":
                content = before + draw(st.binary(min_size=1, max_size=2000)) + after
            case "remove":
                content = before + after[size:]
            case "cut":
                content = before
    return content


@st.composite
def cut(draw, content: bytes) -> bytes:
    """The end is missing: at a record's end, or some bytes before or behind it."""
    place = draw(st.sampled_from(_ends(content))) + draw(st.integers(-12, 12) | st.just(0))
    return content[: max(0, place)]


def _ends(content: bytes) -> list[int]:
    """The byte behind the magic, and behind every record."""
    places = [len(MCAP0_MAGIC)]
    for record in _records(content[len(MCAP0_MAGIC) : -len(MCAP0_MAGIC)]):
        places.append(places[-1] + 9 + len(record.body))
    return places


@st.composite
def rewritten(draw, content: bytes) -> bytes:
    """Records inside and outside of chunks are changed, with checksums that fit."""
    records = list(split(content))
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, len(records) - 1))
        if records[place].inside and draw(st.integers(0, 9)):
            inside = draw(_changed_row(records[place].inside))
            compression = draw(st.sampled_from((records[place].compression, *_COMPRESS, b"lzma", b"\xff")))
            records[place] = replace(records[place], inside=inside, compression=compression)
        else:
            records = list(draw(_changed_row(tuple(records))))
    return joined(tuple(records))


@st.composite
def _changed_row(draw, row: tuple[Record, ...]) -> tuple[Record, ...]:
    """A row of records with one left out, twice, elsewhere or changed."""
    if not row:
        return row
    place, other = draw(st.integers(0, len(row) - 1)), draw(st.integers(0, len(row) - 1))
    record, rest = row[place], row[:place] + row[place + 1 :]
    match draw(
        st.sampled_from(("drop", "repeat", "move", "body", "message", "message", "document", "document", "kind"))
    ):
        case "drop":
            return rest
        case "repeat":
            return (*row[:other], record, *row[other:])
        case "move":
            return (*rest[:other], record, *rest[other:])
        case "kind":
            return (*row[:place], replace(record, opcode=draw(st.integers(0, 255))), *row[place + 1 :])
        case "body":
            body = bytearray(record.body or b"\0")
            body[draw(st.integers(0, len(body) - 1))] = draw(st.integers(0, 255))
            changed = replace(record, body=bytes(body[: draw(st.integers(0, len(body))) or None]), inside=None)
            return (*row[:place], changed, *row[place + 1 :])
    messages = [i for i, one in enumerate(row) if one.opcode == MESSAGE and len(one.body) >= _MESSAGE.size]
    if not messages:
        return row
    place = draw(st.sampled_from(messages))
    changed = replace(row[place], body=draw(_changed_message(row[place].body)))
    return (*row[:place], changed, *row[place + 1 :])


@st.composite
def _changed_message(draw, body: bytes) -> bytes:
    """Another channel, number, time or document."""
    channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(body)
    data = body[_MESSAGE.size :]
    match draw(st.sampled_from(("channel", "sequence", "time", "document", "document", "value", "value", "value"))):
        case "channel":
            channel = draw(st.integers(0, 30) | st.just(2**16 - 1))
        case "sequence":
            sequence = draw(st.integers(0, 20) | st.integers(0, 2**32 - 1))
        case "time":
            log_time = draw(st.integers(0, 2**64 - 1))
        case "document":
            data = draw(st.sampled_from(NOT_DOCUMENTS) | st.binary(max_size=40))
        case "value":
            data = draw(_changed_document(data))
    return _MESSAGE.pack(channel, sequence, log_time, publish_time) + data


@st.composite
def _changed_document(draw, data: bytes) -> bytes:
    """One value anywhere in a document is another, or missing."""
    try:
        document = inner = json.loads(data)
    except ValueError:
        return data
    while isinstance(inner, dict | list) and inner:
        key = draw(st.sampled_from(list(inner) if isinstance(inner, dict) else list(range(len(inner)))))
        if not isinstance(inner[key], dict | list) or not inner[key] or draw(st.integers(0, 3)) == 0:
            if draw(st.booleans()):
                inner[key] = draw(VALUES)
            else:
                del inner[key]
            break
        inner = inner[key]
    return json.dumps(document).encode()


def mutated_logs(content: bytes) -> st.SearchStrategy[bytes]:
    """A sound log with any of these changes, or bytes that never were a log."""
    garbage = st.binary(max_size=200) | st.binary(max_size=200).map(MCAP0_MAGIC.__add__)
    changes = (damaged, damaged, cut, rewritten, rewritten)
    return st.one_of(*(change(content) for change in changes), garbage)
