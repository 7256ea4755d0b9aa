"""The summary section at the end of an MCAP file, where its checksum fits.

It repeats every schema and channel and counts the messages, which helps to read a damaged log. Where bytes were
inserted or removed before it, it stands elsewhere: then it is searched for behind the record that ends the data.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, Footer, McapRecord, MetadataIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from mjnav.recording.read.file_bytes import FileBytes, record_at
from mjnav.recording.read.records import FOOTER_SIZE, HEADER

DATA_END_SIZE = HEADER.size + 4
_FOOTER_HEADER = HEADER.pack(Opcode.FOOTER, FOOTER_SIZE - HEADER.size)
_DATA_END_HEADER = HEADER.pack(Opcode.DATA_END, DATA_END_SIZE - HEADER.size)
_FOOTER_SEARCH = 2**20  # [bytes] from the end
_START_SEARCH = 2**26  # [bytes] before the footer
_MAX_STARTS = 64  # that are tried
_WANTED = (Schema, Channel, Statistics, AttachmentIndex, MetadataIndex)


@dataclass(frozen=True, slots=True)
class SummarySection:
    """Where the summary stands, and what it says of the data; nothing where it has no checksum."""

    start: int
    end: int  # of the footer
    footer: Footer
    records: tuple[McapRecord, ...]  # Schema, Channel, Statistics, AttachmentIndex and MetadataIndex


def find_summary(file: FileBytes) -> SummarySection | None:
    """The summary, or None where none is left whose checksum fits."""
    tail_start = max(0, file.size - _FOOTER_SEARCH)
    tail = file.read(tail_start, file.size)
    at = len(tail)
    while (at := tail.rfind(_FOOTER_HEADER, 0, at)) >= 0:
        found = record_at(file, tail_start + at, file.size)
        if found is not None and isinstance(footer := found.records[0], Footer):
            for start in _starts(file, tail_start + at, footer):
                if _intact(file, start, tail_start + at, footer):
                    return _read(file, start, found.end, footer)
    return None


def _starts(file: FileBytes, footer_at: int, footer: Footer) -> Iterator[int]:
    """Where the summary may start: where the footer says, and behind each record that may end the data."""
    yield footer.summary_start or footer_at
    first = max(0, footer_at - _START_SEARCH)
    blocks = [place for place, _ in file.blocks(first, footer_at)]
    tried = 0
    for place, stop in zip(reversed(blocks), reversed([*blocks[1:], footer_at]), strict=True):
        block = file.read(place, min(stop + HEADER.size - 1, footer_at))
        at = len(block)
        while tried < _MAX_STARTS and (at := block.rfind(_DATA_END_HEADER, 0, at)) >= 0:
            tried += 1
            yield place + at + DATA_END_SIZE


def _intact(file: FileBytes, start: int, footer_at: int, footer: Footer) -> bool:
    if not DATA_END_SIZE <= start <= footer_at or _belongs_inside(file, start - footer.summary_start):
        return False
    if footer.summary_crc == 0:  # written without: where it stands can still be told
        found = record_at(file, start - DATA_END_SIZE, start)
        return found is not None and found.opcode == Opcode.DATA_END
    return file.checksum(start, footer_at + FOOTER_SIZE - 4) == footer.summary_crc


def _belongs_inside(file: FileBytes, shift: int) -> bool:
    """Whether the summary that stands `shift` bytes behind where its footer says is of a log attached to this one."""
    if shift <= 0 or file.read(shift, shift + len(MCAP0_MAGIC)) != MCAP0_MAGIC:
        return False
    return record_at(file, len(MCAP0_MAGIC), file.size) is not None


def _read(file: FileBytes, start: int, end: int, footer: Footer) -> SummarySection:
    described: list[McapRecord] = []
    place = start
    while footer.summary_crc != 0 and (found := record_at(file, place, end)) is not None:
        described += [record for record in found.records if isinstance(record, _WANTED)]
        place = found.end
    return SummarySection(start, end, footer, tuple(described))
