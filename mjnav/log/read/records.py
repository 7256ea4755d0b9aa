"""Reads MCAP records from untrusted files: nothing that a damaged or foreign file says about itself is believed.

Each record is parsed by mcap's own reader, from bytes of its own, so that a record with wrong lengths inside cannot
spoil the next one. `Budget` limits how much memory a file may cost, in proportion to its size. A log of `hall`
decompresses to 1.5 times its size, with a record for each 2600 bytes; LZ4 can make 255 bytes of one byte, Zstandard a
hundred thousand. A message has an index entry of 16 bytes, which no compression makes smaller.

Source: https://mcap.dev/spec
"""

import os
import struct
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO

import lz4.frame
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, DataEnd, Footer, Header, McapRecord
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

from mjnav.errors import InputError

# a constant part, and a part for each byte of the file
FREE_CONTENTS, CONTENTS_PER_BYTE = 16 * 2**20, 100  # [bytes] of chunks decompressed
FREE_RECORDS, BYTES_A_RECORD = 30_000, 8  # records in chunks; one for so many bytes
FREE_EXPORT, EXPORT = 64 * 2**20, 100  # [bytes] of tables and of a page's columns


class Budget:
    """What one reading of a file of `size` bytes may still cost; what is allowed is deducted."""

    def __init__(self, size: int):
        self._contents = FREE_CONTENTS + CONTENTS_PER_BYTE * size
        self._records = FREE_RECORDS + size // BYTES_A_RECORD
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

    def allows_export(self, size: int) -> bool:
        """Whether `size` more bytes of tables may be made of it."""
        self._export -= size
        return self._export >= 0


LIMIT = 256 * 1024 * 1024  # [bytes] of one record, and of one chunk decompressed; writers' chunks are around 1 MiB
HEADER = struct.Struct("<BQ")  # of a record: opcode, length
_FOOTER = struct.Struct("<BQQQI")  # header, start of the summary, start of its offsets, checksum of the summary
_KNOWN = frozenset(Opcode)
_INDICES = frozenset(  # read from the summary, or not at all: they follow from what they point to
    {
        Opcode.MESSAGE_INDEX,
        Opcode.CHUNK_INDEX,
        Opcode.ATTACHMENT_INDEX,
        Opcode.METADATA_INDEX,
        Opcode.STATISTICS,
        Opcode.SUMMARY_OFFSET,
    }
)


CUT_OFF = "cut off"


class BadRecord(ValueError):
    """A record that contradicts itself; the text says how."""


@dataclass(frozen=True, slots=True)
class LostBytes:
    """Bytes from `start` to before `end` that are no intact record."""

    start: int
    end: int
    why: str

    @property
    def is_damage(self) -> bool:
        """False where no more is wrong than that the writer was killed within a record."""
        return self.why != CUT_OFF


class _Exact(BytesIO):
    """Reads all that is asked for or nothing."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is None or not 0 <= size <= self.getbuffer().nbytes - self.tell():
            raise EndOfFile
        return super().read(size)


def parsed(data: bytes) -> Iterator[McapRecord]:
    """The records in some bytes, each as it stands; unknown ones are left out. Raises BadRecord."""
    stream = _Exact(data)
    try:
        yield from StreamReader(stream, skip_magic=True, emit_chunks=True).records
    except EndOfFile:
        if stream.tell() < len(data):
            raise BadRecord("a record that is longer than it says, or shorter") from None
    except (McapError, struct.error, ValueError) as error:
        raise BadRecord(f"a record that makes no sense ({error or type(error).__name__})") from error


def unpacked(record: bytes, budget: Budget) -> Iterator[McapRecord]:
    """A record with its header, or those in it if it is a chunk, once its checksum was verified. Raises BadRecord.

    What a chunk holds is taken off the `budget` of the file that it is in.
    """
    for found in parsed(record):
        if isinstance(found, Chunk):
            for inner in parsed(_content(found, budget)):
                if not budget.allows_record():
                    raise BadRecord("more records in its chunks than a file of its size may hold")
                yield inner
            continue
        if isinstance(found, Attachment):
            (checksum,) = struct.unpack("<I", record[-4:])
            if checksum not in (0, zlib.crc32(record[HEADER.size : -4])):
                raise BadRecord("an attachment that does not match its checksum")
        yield found


def _content(chunk: Chunk, budget: Budget) -> bytes:
    """What a chunk holds, decompressed and with its checksum verified. Raises BadRecord."""
    size = chunk.uncompressed_size
    if size > LIMIT:
        raise BadRecord(f"a chunk of {size} bytes decompressed, more than the {LIMIT} that are read")
    if not budget.allows_contents(size):
        raise BadRecord(
            f"a chunk that claims {size} bytes of contents for {len(chunk.data)} compressed: more than allowed"
        )
    try:
        match chunk.compression:
            case "lz4":
                content = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
            case "zstd":
                content = zstandard.ZstdDecompressor().stream_reader(chunk.data).read(size + 1)
            case "":
                content = chunk.data
            case _:
                raise BadRecord(f"a chunk whose compression {chunk.compression[:20]!r} is unknown")
    except (RuntimeError, EOFError, zstandard.ZstdError, MemoryError) as error:
        raise BadRecord(f"a chunk that cannot be decompressed ({error})") from error
    if len(content) != size:
        raise BadRecord(f"a chunk of {size} bytes that holds {'more' if len(content) > size else len(content)}")
    if chunk.uncompressed_crc not in (0, zlib.crc32(content)):
        raise BadRecord("a chunk that does not match its checksum")
    return content


def open_file(path: str | os.PathLike[str]) -> IO[bytes]:
    """A regular file, open for reading. Raises InputError where it cannot be read."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise InputError(f"{path}: cannot be read: not a regular file")
    try:
        return open(path, "rb")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


def read_records(path: Path, on_byte: Callable[[int], None] = lambda place: None) -> Iterator[McapRecord | LostBytes]:
    """Every intact record, those inside chunks too, and LostBytes for those that are damaged, in the file's order.

    What the summary at the end says comes first, where its checksum fits: schemas and channels, which come again where
    they stand, statistics and indices. So the topics are known also where the chunk that names them is lost. A damaged
    record is skipped by its length; where that leads nowhere, all that follows is lost. A file without a Footer was
    cut off: its last LostBytes are no damage where its writer was killed within a record. `on_byte` is told how far the
    reading is. Raises InputError where the file is missing or not MCAP. Takes no more memory than the largest record,
    and that decompressed.
    """
    with open_file(path) as file:
        try:
            if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise InputError(f"{path}: not an MCAP file")
            yield from _records(file, on_byte)
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


def _records(file: IO[bytes], on_byte: Callable[[int], None]) -> Iterator[McapRecord | LostBytes]:
    """See `read_records`."""
    size = os.fstat(file.fileno()).st_size
    has_end, summary = _summary(file, size)
    with suppress(BadRecord):
        yield from parsed(summary or b"")
    budget, start, checksum = Budget(size), len(MCAP0_MAGIC), zlib.crc32(MCAP0_MAGIC)
    damaged, is_empty = False, True
    file.seek(start)
    while True:
        on_byte(start)
        raw, record = b"", None
        try:
            raw = _next_record(file, size - start)
            if not raw:
                break
            for record in list(unpacked(raw, budget)) if raw[0] not in _INDICES else ():  # all of a chunk or nothing
                is_empty = is_empty and isinstance(record, Header)
                yield record
            if isinstance(record, DataEnd) and not damaged and record.data_section_crc not in (0, checksum):
                raise BadRecord("the messages do not match their checksum")
            if isinstance(record, Footer) and has_end and summary is None:
                raise BadRecord("the index at the end does not match its checksum")
        except BadRecord as error:
            damaged = True
            yield LostBytes(start, start + len(raw) if raw else size, str(error))
            if not raw:
                return
        start, checksum = start + len(raw), zlib.crc32(raw, checksum)
        if isinstance(record, Footer):
            rest = file.read(len(MCAP0_MAGIC) + 1)
            if rest != MCAP0_MAGIC:
                is_cut = MCAP0_MAGIC.startswith(rest)
                yield LostBytes(start, size, CUT_OFF if is_cut else "something else than the end follows the footer")
            return
    if has_end or is_empty:
        yield LostBytes(start, size, "a record that goes beyond the end" if has_end else "nothing in it can be read")
    elif start < size:
        yield LostBytes(start, size, CUT_OFF)


def _next_record(file: IO[bytes], rest: int) -> bytes:
    """The next record and its header; empty where the file ends within it. Raises BadRecord where none can follow."""
    head = file.read(HEADER.size)
    if len(head) < HEADER.size:
        return b""
    opcode, length = HEADER.unpack(head)
    beyond = length > rest - HEADER.size
    if opcode == 0 or (beyond and opcode not in _KNOWN):
        raise BadRecord(f"a record of opcode {opcode}, which does not exist")
    if length > LIMIT:
        raise BadRecord(f"a record of {length} bytes, more than the {LIMIT} that are read")
    body = b"" if beyond else file.read(length)
    return head + body if len(body) == length else b""  # the file may have become shorter meanwhile


def _summary(file: IO[bytes], size: int) -> tuple[bool, bytes | None]:
    """Whether the file has an end; and its summary: empty where it has no checksum, None where that does not fit."""
    footer_start = size - len(MCAP0_MAGIC) - _FOOTER.size
    if footer_start < len(MCAP0_MAGIC):
        return False, None
    file.seek(footer_start)
    tail = file.read()
    if not tail.endswith(MCAP0_MAGIC):
        return False, None
    opcode, _, start, _, checksum = _FOOTER.unpack_from(tail)
    start = start or footer_start
    if opcode != Opcode.FOOTER or not 0 < footer_start - start + 1 <= LIMIT:
        return True, None
    file.seek(start)
    summary = file.read(footer_start - start + _FOOTER.size)
    if checksum == 0:
        return True, b""
    return True, summary if zlib.crc32(summary[:-4]) == checksum else None
