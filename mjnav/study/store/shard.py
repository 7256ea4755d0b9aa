"""A shard of a sweep: one Parquet file of rows, its name, and the checks of its content before anything in it is used.

A few bytes of Parquet can expand to any number of rows (nulls and runs of equal values are compressed away) and to any
length of text. So the numbers of rows, of bytes in pages and of bytes of text are limited by the size of the file
before they take memory. A shard of a sweep has 70 bytes or more a row; its pages unpack to 1.7 times the file, its
values to 20 times.

`unpacked_size` reads the unpacked sizes of pages from their headers: a Parquet reader allocates what these say. A
header is a struct in Thrift's compact protocol; its fields 2 and 3 are the page's sizes, unpacked and in the file.

Sources: https://parquet.apache.org/docs/file-format/data-pages/ and the compact protocol's specification,
https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md
"""

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjnav.errors import MjnavError, missing_extra
from mjnav.scene.toml import read_regular
from mjnav.study.store.row import COLUMNS, PLACE_IN_STUDY

if TYPE_CHECKING:
    import pyarrow

# ------------------------------------------------------------------------------------- sizes of pages


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


# ---------------------------------------------------------------------------------------------- shard


DONE, FAILED = "part", "failed"
DIGITS = 32  # of a shard's digest: 128 bits
# Names of earlier versions have eight random digits in place of the digest.
SHARD = re.compile(rf"({DONE}|{FAILED})-\d{{6,}}-([0-9a-f]{{8}}|[0-9a-f]{{{DIGITS}}})\.parquet")

ALWAYS = frozenset(("id", *PLACE_IN_STUDY, "revision"))  # columns without nulls, in every version
MAX_SIZE = 256 * 2**20  # [bytes] of a shard
# Limits, each a number that any file may have, and what is added for its size:
FREE_ROWS, BYTES_A_ROW = 10_000, 8  # rows; one more for each 8 bytes
FREE_PAGES, PAGES = 16 * 2**20, 50  # [bytes] of unpacked pages; 50 more for each byte
FREE_TEXT, TEXT = 16 * 2**20, 500  # [bytes] of text in all rows; 500 more for each byte
MAX_LIST = 10_000  # elements of a list in the footer


def digest(content: bytes) -> str:
    """The part of a shard's name that is computed from its content."""
    return hashlib.sha256(content).hexdigest()[:DIGITS]


def parquet() -> Any:
    """The module that reads and writes Parquet. Raises InputError where it is missing."""
    try:
        import pyarrow.parquet
    except ImportError:
        raise missing_extra("pyarrow", "sweep") from None
    return pyarrow.parquet


def schema() -> "pyarrow.Schema":
    """Of all columns."""
    import pyarrow as pa

    return pa.schema([(name, pa.type_for_alias(column.type)) for name, column in COLUMNS.items()])


def read_shard(shard: Path, columns: Sequence[str]) -> "pyarrow.Table":
    """Those of the `columns` that a shard has. Raises MjnavError where it is damaged or not of a sweep."""
    import pyarrow as pa

    name = SHARD.fullmatch(shard.name)
    if name is None:
        raise MjnavError(f"{shard}: not written by mjnav; move it elsewhere")
    try:
        content = read_regular(shard, MAX_SIZE)
        if len(name[2]) == DIGITS and digest(content) != name[2]:  # earlier versions have none
            raise OSError("its content has changed since it was written")
        return _read(content, columns)
    except (OSError, pa.ArrowException) as error:
        reason = " ".join(str(error.args[-1] if error.args else error).split())
        raise MjnavError(f"{shard}: damaged ({reason}); remove it, then --resume runs its episodes again") from None


def _read(content: bytes, columns: Sequence[str]) -> "pyarrow.Table":
    """Raises OSError and ArrowException."""
    import pyarrow as pa

    limits = {"thrift_string_size_limit": len(content), "thrift_container_size_limit": MAX_LIST}
    file = parquet().ParquetFile(pa.BufferReader(content), **limits)
    found, expected = file.schema_arrow, schema()
    if not ALWAYS.issubset(found.names) or len(set(found.names)) < len(found) or file.num_row_groups != 1:
        raise OSError("not of a sweep")
    there = [name for name in columns if name in found.names]
    for name in there:
        if found.field(name).type != expected.field(name).type:
            raise OSError(f"{name} of type {found.field(name).type}, where a sweep writes {expected.field(name).type}")
    _check_claims(file.metadata, there, content)
    file = parquet().ParquetFile(
        pa.BufferReader(content),
        metadata=file.metadata,
        page_checksum_verification=True,
        read_dictionary=[name for name in there if found.field(name).type == pa.string()],  # unpacked once each
        **limits,
    )
    # On this thread: one of Arrow's that frees `content` while the interpreter ends would abort the process.
    table = file.read(there, use_threads=False)
    table.validate(full=True)
    for name in there:
        if name in ALWAYS and table[name].null_count:
            raise OSError(f"a row without {name}")
    _check_text(table, len(content))
    return table.cast(pa.schema([expected.field(name) for name in there]))


def _check_claims(metadata: Any, columns: Sequence[str], content: bytes) -> None:
    """Raises OSError where the columns claim more than the limits of a file of this size."""
    group, size = metadata.row_group(0), len(content)
    chunks = [chunk for chunk in map(group.column, range(group.num_columns)) if chunk.path_in_schema in columns]
    rows = max(metadata.num_rows, group.num_rows, *(chunk.num_values for chunk in chunks))
    if rows > FREE_ROWS + size // BYTES_A_ROW:
        raise OSError(f"{rows} rows, more than a file of {size} bytes may hold")
    pages = sum(unpacked_size(content, chunk) for chunk in chunks)
    if pages > FREE_PAGES + PAGES * size:
        raise OSError(f"{pages} bytes when unpacked, more than a file of {size} bytes may hold")


def _check_text(table: "pyarrow.Table", size: int) -> None:
    """Raises OSError where the texts of all rows exceed the limit of a file of `size` bytes."""
    import pyarrow as pa
    from pyarrow import compute

    total = 0
    for column in table.columns:
        if pa.types.is_dictionary(column.type):
            for chunk in column.chunks:
                lengths = compute.call_function("binary_length", [chunk.dictionary]).take(chunk.indices)
                total += compute.call_function("sum", [lengths]).as_py() or 0
    if total > FREE_TEXT + TEXT * size:
        raise OSError(f"{total} bytes of text, more than a file of {size} bytes may hold")
