"""Reads MCAP records from untrusted files: nothing that a damaged or foreign file says about itself is believed.

`Budget` limits how much memory and reading a file may cost, in proportion to its size. A log of `hall` decompresses to
1.5 times its size, with a record for each 2600 bytes; LZ4 can make 255 bytes of one byte, Zstandard a hundred thousand.
A message has an index entry of 16 bytes, which no compression makes smaller.

mcap's own reader allocates what a length field asks for, accepts a record that is cut short and decompresses without
bound. That is fine for the user's own files, but not for files from elsewhere.

Source: https://mcap.dev/spec
"""

import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import IO

import lz4.frame
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import DataEnd, Footer, Header, McapRecord, Message
from mcap.writer import MCAP0_MAGIC

from mjnav.errors import DamagedLogError, InputError

# a constant part, and a part for each byte of the file
FREE_CONTENTS, CONTENTS_PER_BYTE = 16 * 2**20, 100  # [bytes] of chunks decompressed
FREE_RECORDS, BYTES_A_RECORD = 30_000, 8  # records in chunks; one for so many bytes
FREE_READING, READING = 64 * 2**20, 64  # [bytes] read in search of intact records
FREE_EXPORT, EXPORT = 64 * 2**20, 100  # [bytes] of tables and of a page's columns
LEAST_READ = 512  # [bytes] that a read counts as at least, for what is tried at its place takes time


class Budget:
    """What one reading of a file of `size` bytes may still cost; what is allowed is deducted."""

    def __init__(self, size: int):
        self._contents = FREE_CONTENTS + CONTENTS_PER_BYTE * size
        self._records = FREE_RECORDS + size // BYTES_A_RECORD
        self._reading = FREE_READING + READING * size
        self._export = FREE_EXPORT + EXPORT * size

    def allows_contents(self, size: int) -> bool:
        """Whether `size` more bytes may be decompressed."""
        if size > self._contents:
            return False
        self._contents -= size
        return True

    def allows_record(self) -> bool:
        """Whether one more record may come out of a chunk."""
        self._records -= 1
        return self._records >= 0

    def allows_reading(self, size: int) -> bool:
        """Whether `size` more bytes may be read in search of intact records."""
        self._reading -= max(size, LEAST_READ)
        return self._reading >= 0

    def allows_export(self, size: int) -> bool:
        """Whether `size` more bytes of tables may be made of it."""
        self._export -= size
        return self._export >= 0


LIMIT = 256 * 1024 * 1024  # [bytes] of one record, and of one chunk decompressed; writers' chunks are around 1 MiB
LZ4_EXPANSION = 255  # at most: a byte of a match's length stands for 255
HEADER = struct.Struct("<BQ")  # of a record: opcode, length
CHUNK_FIELDS = struct.Struct("<QQQII")  # start and end time, size, checksum, length of the compression's name
FOOTER_SIZE = HEADER.size + 20  # [bytes] three fields, of which the checksum is the last
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_PIECE = 1 << 20  # [bytes] read at once of what is skipped

KNOWN = frozenset(Opcode)
# The contents of an index follow from what it points to, and a checksum covers it: strict reading skips it.
INDICES: Mapping[int, type] = MappingProxyType(
    {
        Opcode.MESSAGE_INDEX: records.MessageIndex,
        Opcode.CHUNK_INDEX: records.ChunkIndex,
        Opcode.ATTACHMENT_INDEX: records.AttachmentIndex,
        Opcode.METADATA_INDEX: records.MetadataIndex,
        Opcode.STATISTICS: records.Statistics,
        Opcode.SUMMARY_OFFSET: records.SummaryOffset,
    }
)
CONTENTS: Mapping[int, type] = MappingProxyType(
    {
        Opcode.HEADER: records.Header,
        Opcode.FOOTER: records.Footer,
        Opcode.SCHEMA: records.Schema,
        Opcode.CHANNEL: records.Channel,
        Opcode.METADATA: records.Metadata,
        Opcode.DATA_END: records.DataEnd,
    }
)


class BadRecord(ValueError):
    """A record that contradicts itself; the text says how."""


@dataclass(frozen=True, slots=True)
class LostBytes:
    """Bytes from `start` to before `end` that are no intact record."""

    start: int
    end: int
    why: str
    messages: Mapping[int, int] = field(default_factory=dict)  # lost, by channel, at least; from indices left intact


class _Exact(BytesIO):
    """Reads all that is asked for or nothing."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is None or not 0 <= size <= self.getbuffer().nbytes - self.tell():
            raise EndOfFile
        return super().read(size)


def parse_record(opcode: int, body: bytes) -> McapRecord | None:
    """A record that is no chunk; None for an index or an opcode that the format does not know. Raises BadRecord."""
    try:
        if opcode == Opcode.MESSAGE:
            return _message(memoryview(body))
        if opcode == Opcode.ATTACHMENT:
            return _attachment(body)
        kind = CONTENTS.get(opcode)
        return None if kind is None else kind.read(ReadDataStream(_Exact(body)))
    except (McapError, struct.error, ValueError) as error:
        name = Opcode(opcode).name.lower()
        raise BadRecord(f"a record that makes no sense ({name}: {error or type(error).__name__})") from error


def _message(content: memoryview) -> Message:
    if len(content) < _MESSAGE.size:
        raise BadRecord(f"a message of {len(content)} bytes")
    channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(content)
    return Message(channel, log_time, bytes(content[_MESSAGE.size :]), publish_time, sequence)


def _attachment(body: bytes) -> records.Attachment:
    attachment = records.Attachment.read(ReadDataStream(_Exact(body)))
    (checksum,) = struct.unpack("<I", body[-4:])
    if checksum and zlib.crc32(body[:-4]) != checksum:
        raise BadRecord("an attachment that does not match its checksum")
    return attachment


def chunk_records(body: bytes, budget: Budget | None = None) -> Iterator[McapRecord]:
    """The schemas, channels and messages in a chunk whose checksum holds. Raises BadRecord.

    What it holds is taken off the `budget` of the file that it is in.
    """
    budget = budget or Budget(len(body))
    data = memoryview(_chunk_data(body, budget))
    position, end = 0, len(data)
    while position < end:
        if end - position < HEADER.size:
            raise BadRecord("a chunk that ends within a record")
        opcode, length = HEADER.unpack_from(data, position)
        position += HEADER.size
        if opcode == 0:
            raise BadRecord("a chunk with a record of opcode 0, which does not exist")
        if length > end - position:
            raise BadRecord(f"a chunk with a record of {length} bytes, of which it holds {end - position}")
        if not budget.allows_record():
            raise BadRecord("more records in its chunks than a file of its size may hold")
        content = data[position : position + length]
        position += length
        if opcode == Opcode.MESSAGE:
            yield _message(content)
        elif (record := parse_record(opcode, bytes(content))) is not None:
            yield record


def _chunk_data(body: bytes, budget: Budget) -> bytes:
    """A chunk's content, decompressed and with its checksum verified. Raises BadRecord."""
    try:
        _, _, size, checksum, name_length = CHUNK_FIELDS.unpack_from(body)
        (length,) = struct.unpack_from("<Q", body, CHUNK_FIELDS.size + name_length)
    except struct.error as error:
        raise BadRecord(f"a chunk without its beginning ({error})") from error
    compression = body[CHUNK_FIELDS.size : CHUNK_FIELDS.size + name_length]
    data = memoryview(body)[CHUNK_FIELDS.size + name_length + 8 :]
    if length != len(data):
        raise BadRecord(f"a chunk of {length} bytes, of which it holds {len(data)}")
    if size > LIMIT:
        raise BadRecord(f"a chunk of {size} bytes decompressed, more than the {LIMIT} that are read")
    if not budget.allows_contents(size):
        raise BadRecord(f"a chunk that claims {size} bytes of contents for {length} compressed: more than allowed")
    content = _decompress(compression, data, size)
    if checksum and zlib.crc32(content) != checksum:
        raise BadRecord("a chunk that does not match its checksum")
    return content


def _decompress(compression: bytes, data: memoryview, size: int) -> bytes:
    """Exactly `size` bytes, never more. Raises BadRecord."""
    try:
        match compression:
            case b"lz4" if size <= LZ4_EXPANSION * len(data):
                content = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size) if size else b""
            case b"zstd" if zstandard.frame_content_size(data) in (-1, size):  # -1: it does not say
                content = zstandard.ZstdDecompressor().decompress(data, max_output_size=size) if size else b""
            case b"":
                content = bytes(data)
            case b"lz4" | b"zstd":
                raise BadRecord(f"a chunk that cannot hold the {size} bytes that it claims")
            case _:
                raise BadRecord(f"a chunk whose compression {compression[:20].decode(errors='replace')!r} is unknown")
    except (RuntimeError, EOFError, zstandard.ZstdError, MemoryError) as error:
        raise BadRecord(f"a chunk that cannot be decompressed ({error})") from error
    if len(content) != size:
        raise BadRecord(f"a chunk of {len(content)} bytes that claims {size}")
    return content


def open_file(path: str | os.PathLike[str]) -> IO[bytes]:
    """A regular file, open for reading. Raises InputError where it cannot be read."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise InputError(f"{path}: cannot be read: not a regular file")
    try:
        return open(path, "rb")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


def read_records(path: Path) -> Iterator[McapRecord | LostBytes]:
    """Every record but indices, those inside chunks too, with every checksum verified.

    A file without its end yields all whole records, no Footer among them. Where it ends within a record, because the
    writer was killed or that record's length is damaged, LostBytes come last. Raises InputError where the file is
    missing or not MCAP, DamagedLogError where a checksum fails or a record makes no sense. Takes no more memory than
    the largest record, and that decompressed.
    """
    with open_file(path) as file:
        try:
            if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise InputError(f"{path}: not an MCAP file")
            stream = _Stream(file)
            try:
                yield from stream.records()
            except BadRecord as error:
                raise DamagedLogError(f"{path}: damaged before byte {file.tell()} of {stream.size}: {error}") from error
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


class _Stream:
    """An open file behind its first magic bytes."""

    def __init__(self, file: IO[bytes]):
        self._file = file
        self._checksum = zlib.crc32(MCAP0_MAGIC)  # of all bytes so far
        self.size = file.seek(0, 2)
        self._budget = Budget(self.size)
        file.seek(max(0, self.size - len(MCAP0_MAGIC)))
        self._has_end = self.size >= 2 * len(MCAP0_MAGIC) and file.read() == MCAP0_MAGIC
        file.seek(len(MCAP0_MAGIC))

    def records(self) -> Iterator[McapRecord | LostBytes]:
        """See `read_records`. Raises BadRecord."""
        data_ended = found_any = False
        start, before = self._file.tell(), self._checksum
        while (found := self._next()) is not None:
            opcode, body = found
            if opcode == Opcode.CHUNK:
                for record in chunk_records(body, self._budget):
                    found_any = True
                    yield record
            elif (record := parse_record(opcode, body)) is not None:
                if isinstance(record, DataEnd):
                    data_ended = True
                    if record.data_section_crc not in (0, before):
                        raise BadRecord("the messages do not match their checksum")
                if isinstance(record, Footer):
                    if not (data_ended and self._summary_intact(record)):
                        raise BadRecord("the index at the end does not match its checksum")
                    yield record
                    return self._check_end()
                found_any = found_any or not isinstance(record, Header)
                yield record
            start, before = self._file.tell(), self._checksum
        self._file.seek(self.size)
        if self._has_end:
            raise BadRecord("a record that goes beyond the end")
        if not found_any:
            raise BadRecord("nothing in it can be read")
        if start < self.size:
            yield LostBytes(start, self.size, "cut off")

    def _next(self) -> tuple[int, bytes] | None:
        """Opcode and body of the next record, an empty body for one that is skipped; None where the file ends."""
        head = self._file.read(HEADER.size)
        if len(head) < HEADER.size:
            return None
        opcode, length = HEADER.unpack(head)
        known, beyond = opcode in KNOWN, length > self.size - self._file.tell()
        wanted = known and opcode not in INDICES
        if opcode == 0 or (beyond and not known):
            raise BadRecord(f"a record of opcode {opcode}, which does not exist")
        if wanted and length > LIMIT:
            raise BadRecord(f"a record of {length} bytes, more than the {LIMIT} that are read")
        if beyond:
            return None
        self._checksum = zlib.crc32(head, self._checksum)
        body = b""
        while length > 0:
            body = self._file.read(length if wanted else min(length, _PIECE))
            if not body or (wanted and len(body) < length):  # the file became shorter meanwhile
                return None
            self._checksum = zlib.crc32(body, self._checksum)
            length -= len(body)
        return opcode, body if wanted else b""

    def _summary_intact(self, footer: Footer) -> bool:
        """Verifies the checksum of the summary and of the footer just read, if there is one."""
        if footer.summary_crc == 0:
            return True
        end = self._file.tell()
        start = footer.summary_start or end - FOOTER_SIZE
        if not 0 <= start <= end - 4 or end - 4 - start > LIMIT:
            return False
        self._file.seek(start)
        intact = zlib.crc32(self._file.read(end - 4 - start)) == footer.summary_crc
        self._file.seek(end)
        return intact

    def _check_end(self) -> None:
        """Only the magic bytes may follow the footer, and they may be cut off. Raises BadRecord."""
        rest = self._file.read(len(MCAP0_MAGIC) + 1)
        if not MCAP0_MAGIC.startswith(rest):
            raise BadRecord("something else than the end follows the footer")
