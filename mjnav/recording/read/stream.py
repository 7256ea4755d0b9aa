"""The records of an MCAP file from its beginning to its end, or to where its writer was killed."""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode
from mcap.records import DataEnd, Footer, Header, McapRecord
from mcap.writer import MCAP0_MAGIC

from mjnav.errors import DamagedLogError, InputError
from mjnav.recording.read.budget import Budget
from mjnav.recording.read.chunks import LIMIT, BadRecord, chunk_records, parse_record

_RECORD = struct.Struct("<BQ")  # opcode, length
_FOOTER_SIZE = _RECORD.size + 20  # [bytes] three fields, of which the checksum is the last
_PIECE = 1 << 20  # [bytes] that are read at once of what is passed over

_KNOWN = frozenset(Opcode)
# What an index says can be seen from what it points to, and a checksum covers it: its bytes are not looked at.
_INDICES = frozenset(
    {
        Opcode.MESSAGE_INDEX,
        Opcode.CHUNK_INDEX,
        Opcode.ATTACHMENT_INDEX,
        Opcode.METADATA_INDEX,
        Opcode.STATISTICS,
        Opcode.SUMMARY_OFFSET,
    }
)


@dataclass(frozen=True, slots=True)
class CutOff:
    """The file ends within the record that starts at byte `start`."""

    start: int
    end: int


def read_records(path: Path) -> Iterator[McapRecord | CutOff]:
    """Every record but indices and statistics, those inside chunks too, with every checksum verified.

    A file without its end yields all whole records, no Footer among them, and CutOff at last where it ends within one:
    the writer was killed meanwhile, or that record's length is damaged. Raises InputError where the file is missing or
    not MCAP, DamagedLogError where a checksum fails or a record makes no sense. Takes no more memory than the largest
    record, and that decompressed.
    """
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: cannot be read: not a regular file")
    try:
        with open(path, "rb") as file:
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

    def records(self) -> Iterator[McapRecord | CutOff]:
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
                    return self._end()
                found_any = found_any or not isinstance(record, Header)
                yield record
            start, before = self._file.tell(), self._checksum
        self._file.seek(self.size)
        if self._has_end:
            raise BadRecord("a record that goes beyond the end")
        if not found_any:
            raise BadRecord("nothing in it can be read")
        if start < self.size:
            yield CutOff(start, self.size)

    def _next(self) -> tuple[int, bytes] | None:
        """Opcode and body of the next record, no body where nobody looks at it; None where the file ends before it."""
        head = self._file.read(_RECORD.size)
        if len(head) < _RECORD.size:
            return None
        opcode, length = _RECORD.unpack(head)
        known, beyond = opcode in _KNOWN, length > self.size - self._file.tell()
        looked_at = known and opcode not in _INDICES
        if opcode == 0 or (beyond and not known):
            raise BadRecord(f"a record of kind {opcode}, which does not exist")
        if looked_at and length > LIMIT:
            raise BadRecord(f"a record of {length} bytes, more than the {LIMIT} that are read")
        if beyond:
            return None
        self._checksum = zlib.crc32(head, self._checksum)
        while length > 0:
            piece = self._file.read(length if looked_at else min(length, _PIECE))
            if not piece:  # somebody made the file shorter meanwhile
                return None
            self._checksum = zlib.crc32(piece, self._checksum)
            length -= len(piece)
            if looked_at:
                return (opcode, piece) if length == 0 else None
        return opcode, b""

    def _summary_intact(self, footer: Footer) -> bool:
        """Verifies the checksum of all between the data and the last field of the footer just read, if there is one."""
        if footer.summary_crc == 0:
            return True
        end = self._file.tell()
        start = footer.summary_start or end - _FOOTER_SIZE
        if not 0 <= start <= end - 4 or end - 4 - start > LIMIT:
            return False
        self._file.seek(start)
        intact = zlib.crc32(self._file.read(end - 4 - start)) == footer.summary_crc
        self._file.seek(end)
        return intact

    def _end(self) -> None:
        """Nothing but the magic bytes may follow the footer; they may be cut off."""
        rest = self._file.read(len(MCAP0_MAGIC) + 1)
        if not MCAP0_MAGIC.startswith(rest):
            raise BadRecord("something else than the end follows the footer")
