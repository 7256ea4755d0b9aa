"""Every intact record of an MCAP file that is damaged anywhere, and the bytes between them that are lost.

A file is a sequence of records. Where no intact record stands, reading continues with the record behind the damaged
one, if that one's length still leads there, or else at the next byte at which a record stands that

* is a chunk or an attachment whose checksum fits, or
* is the same bytes when written again and is followed by the header of another.

A chunk whose checksum does not fit is lost as a whole: nothing says which of its messages are right, and what LZ4 or
Zstandard decompress of the bytes before the damage has no checksum of its own.
"""

import os
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    DataEnd,
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    Schema,
    Statistics,
)
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from mjnav.recording.read.file_bytes import (
    FileBytes,
    FoundRecord,
    attachment_at,
    chunk_at,
    file_bytes,
    find_summary,
    record_at,
)
from mjnav.recording.read.records import FOOTER_SIZE, HEADER, KNOWN, LostBytes

_WITH_CHECKSUM = (Opcode.CHUNK, Opcode.ATTACHMENT)
_END = re.compile(rb"\x02\x14\x00{7}[\s\S]{20}\x89MCAP0\r\n")  # a footer and the magic
_END_SIZE = FOOTER_SIZE + len(MCAP0_MAGIC)

Item = tuple[McapRecord | LostBytes, bool]  # and whether a checksum of its own fits; that of all data still may


def intact_records(
    path: str | os.PathLike[str], *, inverted_bit: int | None = None, on_byte: Callable[[int], None] | None = None
) -> Iterator[Item]:
    """The intact records of a file in its order, each with whether it has a checksum, and LostBytes between them.

    What the summary at the file's end says comes first, where that is intact: Schema and Channel, which may come again
    where they stand, Statistics, AttachmentIndex and MetadataIndex. Then Header, Schema, Channel, Message, Attachment
    and Metadata, those inside chunks too. DataEnd comes only where its checksum, if it has one, is that of all before
    it: then nothing in the data was damaged. Footer comes only where the summary and the file's end are intact: a file
    without it was cut off or its end is damaged. Memory is bounded by the largest intact record.

    `inverted_bit` is one bit that is read as its opposite, counted from the lowest of byte 0; `on_byte` is told how far
    the reading is.

    Raises InputError where the file cannot be read; a file that is no MCAP at all is one LostBytes.
    """
    with file_bytes(path, inverted_bit) as file:
        yield from _joined(_Walk(file, on_byte).items())


def _joined(items: Iterable[Item]) -> Iterator[Item]:
    """The items, with adjacent losses as one that counts the messages of the indices behind it."""
    lost: LostBytes | None = None
    for item, checked in items:
        if isinstance(item, LostBytes) and lost is not None and lost.end == item.start:
            lost = replace(lost, end=item.end)
        elif isinstance(item, MessageIndex):
            if lost is not None:
                count = lost.messages.get(item.channel_id, 0) + len(item.records)
                lost = replace(lost, messages={**lost.messages, item.channel_id: count})
        else:
            if lost is not None:
                yield lost, False
            lost = item if isinstance(item, LostBytes) else None
            if lost is None:
                yield item, checked
    if lost is not None:
        yield lost, False


class _Walk:
    """From one record of a file to the next."""

    def __init__(self, file: FileBytes, on_byte: Callable[[int], None] | None = None):
        self._file, self._on_byte = file, on_byte or (lambda place: None)
        self._summary = summary = find_summary(file)
        self._end = file.size if summary is None else summary.start
        # Whether messages stand outside chunks: told by the summary, or by what comes first, before any damage.
        counted = [record.chunk_count for record in self._described() if isinstance(record, Statistics)]
        self._flat = counted[0] == 0 if counted else None
        self._checksums = False  # some record had one, so one without is not believed
        self._last: tuple[int, FoundRecord | None] = (-1, None)
        self._started = self._damaged = self._data_ended = False
        self._times: dict[int, list[int]] = {}  # of the messages of the last intact chunk, by channel

    def items(self) -> Iterator[Item]:
        """Everything; message indices only of chunks that were lost."""
        summary = self._summary
        yield from ((record, True) for record in self._described())
        self._damaged = self._file.read(0, len(MCAP0_MAGIC)) != MCAP0_MAGIC
        place = 0 if self._damaged else len(MCAP0_MAGIC)
        while place < self._end:
            self._on_byte(place)
            found = self._found(place)
            if found is not None:
                self._started = True
                yield from self._kept(place, found)
                place = found.end
            else:
                after, why = self._resynchronised(place)
                self._damaged = True
                yield LostBytes(place, after, why), False
                place = after
        if summary is not None:
            end = summary.end + len(MCAP0_MAGIC)
            closed = self._file.read(summary.end, end) == MCAP0_MAGIC
            if closed and end == self._file.size:
                yield summary.footer, True
            elif summary.end < self._file.size:
                start = end if closed else summary.end
                yield LostBytes(start, self._file.size, "not the end of an MCAP file"), False

    def _described(self) -> tuple[McapRecord, ...]:
        return () if self._summary is None else self._summary.records

    def _record(self, place: int) -> FoundRecord | None:
        """The record at a byte; the last is remembered, since a record is looked at once more before it is next."""
        if self._last[0] != place:
            self._last = place, record_at(self._file, place, self._end)
        return self._last[1]

    def _found(self, place: int) -> FoundRecord | None:
        """The intact record where one is due, also where only its opcode or length was damaged."""
        found = self._record(place)
        if found is None:
            for by_checksum in (chunk_at, attachment_at):
                found = by_checksum(self._file, place, self._end)
                if found is not None and found.checked:
                    return found
            return None
        if found.checked:
            return found
        if self._checksums and found.opcode in _WITH_CHECKSUM:
            return None
        return None if self._swallows(place, found.end) else found

    def _swallows(self, place: int, end: int) -> bool:
        """Whether what reads like one record runs into the next: bytes of it are missing."""
        if self._plausible(end):
            return False
        stop = min(end + HEADER.size - 1, self._end)
        return self._searched(place + 1, stop) < stop

    def _kept(self, place: int, found: FoundRecord) -> Iterator[Item]:
        """The records of what was found, as far as they are of use."""
        record = found.records[0] if found.records else None
        self._checksums = self._checksums or found.checked
        if found.opcode == Opcode.CHUNK:
            self._flat = False
            self._times = _times(found.records)
        elif isinstance(record, MessageIndex):
            if sorted(time for time, _ in record.records) != self._times.get(record.channel_id):
                yield record, False
            return
        elif isinstance(record, DataEnd):
            self._data_ended = True
            if record.data_section_crc in (0, self._file.checksum(0, place)):
                yield record, True
            return
        elif not (
            isinstance(record, Attachment | Header | Metadata)
            or (isinstance(record, Schema | Channel | Message) and self._outside_chunks())
        ):
            self._damaged = True
            yield LostBytes(place, found.end, "an index whose checksum does not fit"), False
            return
        for record in found.records:
            yield record, found.checked

    def _outside_chunks(self) -> bool:
        """Whether a schema, channel or message here is not a piece of a damaged chunk or summary."""
        if self._flat is None:
            self._flat = not self._damaged
        return self._flat and not self._data_ended

    def _resynchronised(self, place: int) -> tuple[int, str]:
        """Where the next intact record starts, or the data's end; and what stands before it."""
        opcode, length = self._file.header(place)
        after = place + HEADER.size + length
        if opcode in KNOWN and after <= self._end and self._plausible(after):
            name = Opcode(opcode).name.lower().replace("_", " ")
            fits = "whose checksum does not fit" if opcode in _WITH_CHECKSUM else "of no sense"
            return after, f"{name} {fits}"
        after = self._searched(place + 1, self._end)
        cut_off = after == self._file.size and opcode in KNOWN and place + HEADER.size + length > after
        return after, "cut off" if cut_off else "no record can be made out"

    def _searched(self, first: int, end: int) -> int:
        """The first byte from `first` on at which an intact record starts, its header before `end`; else `end`."""
        inside_until = first  # the end of a file inside this one: an attachment that is itself a log
        for start, block in self._file.blocks(first, end, overlap=HEADER.size - 1):
            self._on_byte(start)
            for place in (start + _candidates(block)).tolist():
                if place < inside_until:
                    continue
                if self._started and self._file.read(place, place + len(MCAP0_MAGIC)) == MCAP0_MAGIC:
                    inside_until = self._end_of_file_at(place)
                elif self._plausible(place):
                    return place
        return end

    def _end_of_file_at(self, place: int) -> int:
        """Where the MCAP file that starts at a byte ends; where it starts, if that is not before this one's own end."""
        for start, block in self._file.blocks(place, self._end, overlap=_END_SIZE - 1):
            if (match := _END.search(block)) is not None and start + match.end() < self._end:
                return start + match.end()
        return place

    def _plausible(self, place: int) -> bool:
        """Whether an intact record stands at a byte, so that chance bytes do not look like it."""
        if place == self._end:
            return True
        found = self._record(place)
        if found is None or found.checked:
            return found is not None
        opcode, length = self._file.header(found.end)
        return found.end == self._end or (opcode in KNOWN and found.end + HEADER.size + length <= self._file.size)


def _times(contents: Iterable[McapRecord]) -> dict[int, list[int]]:
    """The sorted log times of messages by channel."""
    times: defaultdict[int, list[int]] = defaultdict(list)
    for record in contents:
        if isinstance(record, Message):
            times[record.channel_id].append(record.log_time)
    return {channel: sorted(values) for channel, values in times.items()}


def _candidates(block: bytes) -> NDArray[np.intp]:
    """Where in a block an opcode and a length below 2^40 stand, or the first byte of a magic."""
    data = np.frombuffer(block, np.uint8)
    opcode, *_, length_5, length_6, length_7 = (
        data[i : max(0, len(data) - HEADER.size + 1 + i)] for i in range(HEADER.size)
    )
    is_header = (opcode - np.uint8(1) < max(Opcode)) & (length_5 | length_6 | length_7 == 0)
    return np.flatnonzero(is_header | (opcode == MCAP0_MAGIC[0]))
