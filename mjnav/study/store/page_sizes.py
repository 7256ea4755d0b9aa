"""The unpacked sizes of a Parquet file's pages, from their headers: a reader allocates what these say.

A header is a struct in Thrift's compact protocol; its fields 2 and 3 are the page's sizes, unpacked and in the file.

Sources: https://parquet.apache.org/docs/file-format/data-pages/ and the compact protocol's specification,
https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md
"""

from typing import Any

_STOP, _TRUE, _FALSE, _BYTE, _I64, _DOUBLE, _BINARY, _STRUCT = 0, 1, 2, 3, 6, 7, 8, 12
_UNPACKED, _PACKED = 2, 3  # fields of a page's header
_DEPTH = 4  # of nested structs: the statistics in a data page's header are the second


def unpacked_size(content: bytes, chunk: Any) -> int:
    """Bytes of all pages of a column's chunk (of pyarrow's metadata). Raises OSError where they are impossible."""
    at = min(chunk.data_page_offset, chunk.dictionary_page_offset or chunk.data_page_offset)
    end = at + chunk.total_compressed_size
    if not 0 <= at <= end <= len(content):
        raise OSError("a column that is not within the file")
    total = 0
    while at < end:
        try:
            fields, at = _struct(content, at, _DEPTH)
            unpacked, packed = fields[_UNPACKED], fields[_PACKED]
        except LookupError:
            raise OSError("a page without its header") from None
        if min(unpacked, packed) < 0:
            raise OSError("a page of a negative size")
        total += unpacked
        at += packed
    return total


def _struct(data: bytes, at: int, depth: int) -> tuple[dict[int, int], int]:
    """The whole numbers in a struct by field, and where it ends. Raises LookupError."""
    fields: dict[int, int] = {}
    number = 0
    while (head := data[at]) != _STOP:
        at += 1
        kind, step = head & 15, head >> 4
        if step:
            number += step
        else:
            number, at = _whole(data, at)
        if _BYTE < kind <= _I64:
            fields[number], at = _whole(data, at)
        elif kind == _BINARY:
            size, at = _varint(data, at)
            at += size
        elif kind == _STRUCT and depth:
            _, at = _struct(data, at, depth - 1)
        elif kind in (_BYTE, _DOUBLE):
            at += 1 if kind == _BYTE else 8
        elif kind not in (_TRUE, _FALSE):
            raise LookupError(kind)  # a page's header has no lists
    return fields, at + 1


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for place in range(10):  # 70 bits
        byte = data[at + place]
        value |= (byte & 127) << 7 * place
        if byte < 128:
            return value, at + place + 1
    raise LookupError(at)


def _whole(data: bytes, at: int) -> tuple[int, int]:
    """A number in zigzag form: its lowest bit is the sign."""
    value, at = _varint(data, at)
    return value >> 1 ^ -(value & 1), at
