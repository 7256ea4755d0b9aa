"""The one changed bit of a file, computed from the checksum of all its data.

A changed bit that has m - 1 bits behind it (a byte's lowest comes first) changes CRC-32 by x^31 x^m in GF(2)[x] modulo
the polynomial, whatever the other bits are. The powers of x repeat only after 2^32 - 1, so the change determines m: a
discrete logarithm, by baby steps and giant steps. As CRC-32 is stored, x^31 is the number 1.
"""

import os

from mcap.records import DataEnd

from mjnav.recording.read.file_bytes import DATA_END_SIZE, file_bytes, find_summary, record_at
from mjnav.recording.read.records import HEADER

_POLYNOMIAL = 0xEDB88320  # of CRC-32, its highest power first and x^32 left out
_HIGHEST_BIT = 1 << 31
_LOG_STEPS = 16
_STEPS = 1 << _LOG_STEPS  # small ones to a giant one
_MAX_BYTES = 2**29 - 8  # from here on two bits may change the checksum alike


def changed_bit(path: str | os.PathLike[str]) -> int | None:
    """The bit that, if it alone was changed, explains the checksum of the data; bit 0 is the lowest of byte 0.

    None where no single bit does, or the end of the file is damaged. Other damage may be explained too, by chance: the
    caller checks that the file is intact with that bit changed back.
    """
    with file_bytes(path) as file:
        summary = find_summary(file)
        if summary is None:
            return None
        size = summary.start - DATA_END_SIZE
        found = record_at(file, size, summary.start)
        if found is None or not isinstance(end := found.records[0], DataEnd) or end.data_section_crc == 0:
            return None
        change = end.data_section_crc ^ file.checksum(0, size)
    if change.bit_count() == 1:  # no bit of the data does that: it is one of the checksum itself
        return 8 * (size + HEADER.size) + change.bit_length() - 1
    if size >= _MAX_BYTES or (power := _logarithm(change, 8 * size)) is None:
        return None
    from_end, bit = divmod(power - 1, 8)
    return 8 * (size - 1 - from_end) + 7 - bit


def _logarithm(value: int, largest: int) -> int | None:
    """The m from 1 to `largest` for which x^31 x^m is `value`; None if no m does."""
    powers, power = {}, 1
    for m in range(_STEPS):
        powers[power] = m
        power = power >> 1 ^ (_POLYNOMIAL if power & 1 else 0)
    step = [_divided(1 << i) for i in range(32)]
    for _ in range(_LOG_STEPS):
        step = [_mapped(step, column) for column in step]
    for giant in range(0, largest + 1, _STEPS):
        if (small := powers.get(value)) is not None:
            return giant + small if 1 <= giant + small <= largest else None
        value = _mapped(step, value)
    return None


def _divided(value: int) -> int:
    """`value` / x."""
    return (value ^ _POLYNOMIAL) << 1 | 1 if value & _HIGHEST_BIT else value << 1


def _mapped(columns: list[int], value: int) -> int:
    """A linear map's image of `value`: the sum of the images of its bits."""
    image = 0
    for column in columns:
        if value & 1:
            image ^= column
        value >>= 1
    return image
