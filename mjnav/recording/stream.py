"""The records of an MCAP file from its beginning to its end, or to where its writer was killed."""

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from mcap.exceptions import EndOfFile
from mcap.records import DataEnd, Footer, Header, McapRecord
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

from mjnav.errors import DamagedLogError, InputError

_FOOTER_SIZE = 1 + 8 + 20  # [bytes] opcode, length, three fields of which the checksum is the last
_CUT_OFF = (EndOfFile, struct.error, UnicodeDecodeError)  # what the reader makes of a record without its end


def read_records(path: Path) -> Iterator[McapRecord]:
    """Every record, those inside chunks too, with every checksum verified.

    A file without its end yields all whole records; that there is no Footer among them tells. Raises InputError where
    the file is missing or not MCAP, DamagedLogError where a checksum fails or a record makes no sense.
    """
    try:
        file = open(path, "rb")  # noqa: SIM115 - closed below
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    with file:
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise InputError(f"{path}: not an MCAP file")
        size = file.seek(0, 2)
        has_end = size >= 2 * len(MCAP0_MAGIC) and _tail(file, size) == MCAP0_MAGIC
        file.seek(0)
        records = StreamReader(file, validate_crcs=True).records
        yield from _checked(records, file, size, has_end, path)


def _tail(file: IO[bytes], size: int) -> bytes:
    file.seek(size - len(MCAP0_MAGIC))
    return file.read()


def _checked(
    records: Iterator[McapRecord], file: IO[bytes], size: int, has_end: bool, path: Path
) -> Iterator[McapRecord]:
    """The records, with the errors of a damaged file told from the end of an unfinished one."""
    data_ended = found_any = False
    while True:
        try:
            record = next(records)
        except StopIteration:
            return
        except Exception as error:
            cut_off = isinstance(error, _CUT_OFF) and not has_end and file.tell() >= size
            if cut_off and found_any:
                return
            what = "nothing in it can be read" if cut_off else str(error) or type(error).__name__
            raise DamagedLogError(f"{path}: damaged before byte {file.tell()} of {size}: {what}") from error
        data_ended = data_ended or isinstance(record, DataEnd)
        found_any = found_any or not isinstance(record, Header)
        if isinstance(record, Footer) and not (data_ended and _summary_intact(file, record)):
            raise DamagedLogError(f"{path}: damaged: the index at the end does not match its checksum")
        yield record


def _summary_intact(file: IO[bytes], footer: Footer) -> bool:
    """Verifies the checksum of all between the data and the last field of the footer just read, where there is one."""
    if footer.summary_crc == 0:
        return True
    end = file.tell()
    file.seek(footer.summary_start or end - _FOOTER_SIZE)
    intact = zlib.crc32(file.read(max(0, end - 4 - file.tell()))) == footer.summary_crc
    file.seek(end)
    return intact
