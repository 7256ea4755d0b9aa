"""The results of a sweep: a folder of immutable Parquet files, called shards. Their labels say which episodes are done.

    study.toml                       the study file
    part-000003-<digest>.parquet     rows with a result, `row.COLUMNS`, zstd
    failed-000004-<digest>.parquet   rows with an error; a retry removes them first
    logs/                            logs of episodes, where the sweep was to keep any
    lock                             empty; locked by the sweep that writes

A shard appears whole or not at all: it is written under another name, flushed to the disk and renamed. Each id is in at
most one shard, also after a process was killed. A shard's name has the digest of its content, which is checked before
anything in it is used. Every reader of Parquet reads the shards:

    SELECT method, avg(success::int) FROM 'runs/out/NAME/part-*.parquet' GROUP BY method

A file with one of these names that no sweep wrote is neither overwritten nor removed: the folder is refused.

A few bytes of Parquet can expand to any number of rows and to any length of text. The memory that reading a shard may
take is therefore limited by the size of the file: a shard of a sweep has 70 bytes or more a row, and unpacks to 20
times its size.
"""

import fcntl
import hashlib
import os
import re
import resource
import stat
import uuid
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjnav.errors import InputError, MjnavError, missing_extra
from mjnav.scene.toml import read_regular
from mjnav.study.keep import remove_logs
from mjnav.study.store.row import COLUMNS, PLACE_IN_STUDY, Row

if TYPE_CHECKING:
    import pyarrow

STUDY_FILE, LOCK = "study.toml", "lock"
MAX_STUDY = 10_000_000  # [bytes] of the study file
MARK = "# mjnav "  # first characters of a study file that a sweep wrote; the command follows
TEMPORARY = ".mjnav-*.tmp"  # files that are being written
FILE = "a file"

DONE, FAILED = "part", "failed"
DIGITS = 32  # of a shard's digest: 128 bits
SHARD = re.compile(rf"({DONE}|{FAILED})-\d{{6,}}-([0-9a-f]{{{DIGITS}}})\.parquet")
ALWAYS = frozenset(("id", *PLACE_IN_STUDY, "revision"))  # columns without nulls, in every version
MAX_SIZE = 256 * 2**20  # [bytes] of a shard
# What any shard may have, and what is added for its size:
FREE_ROWS, BYTES_A_ROW = 10_000, 8  # rows; one more for each 8 bytes
FREE_MEMORY, MEMORY = 32 * 2**20, 500  # [bytes] of memory; 500 more for each byte
MAX_LIST = 10_000  # elements of a list in the footer

EpisodePlace = tuple[str, str, str, str, int]  # the values of PLACE_IN_STUDY

# ---------------------------------------------------------------------------------------------- shard


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


@contextmanager
def memory_limit(size: int) -> Iterator[None]:
    """This process may take at most `size` bytes more meanwhile; Arrow's allocation beyond raises MemoryError.

    Arrow allocates from the system: its own allocator has reserved memory beforehand.
    """
    import pyarrow as pa

    pool, (soft, hard) = pa.default_memory_pool(), resource.getrlimit(resource.RLIMIT_DATA)
    pages = int(Path("/proc/self/statm").read_text().split()[5])  # of data and stack
    ends = [end for end in (soft, hard) if end != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_DATA, (min([pages * resource.getpagesize() + size, *ends]), hard))
    pa.set_memory_pool(pa.system_memory_pool())
    try:
        yield
    finally:
        pa.set_memory_pool(pool)
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def read_shard(shard: Path, columns: Sequence[str]) -> "pyarrow.Table":
    """These columns of a shard, null where a shard of an earlier version lacks one.

    Raises MjnavError where it is damaged or not of a sweep.
    """
    import pyarrow as pa

    name = SHARD.fullmatch(shard.name)
    if name is None:
        raise MjnavError(f"{shard}: not written by mjnav; move it elsewhere")
    try:
        content = read_regular(shard, MAX_SIZE)
        if digest(content) != name[2]:
            raise OSError("its content has changed since it was written")
        with memory_limit(FREE_MEMORY + MEMORY * len(content)):
            return _read(content, columns)
    except MemoryError:
        raise MjnavError(f"{shard}: damaged (takes more memory than a file of its size may); remove it") from None
    except (OSError, pa.ArrowException) as error:
        reason = " ".join(str(error.args[-1] if error.args else error).split())
        raise MjnavError(f"{shard}: damaged ({reason}); remove it, then --resume runs its episodes again") from None


def _read(content: bytes, columns: Sequence[str]) -> "pyarrow.Table":
    """Raises OSError, ArrowException and MemoryError."""
    import pyarrow as pa

    file = parquet().ParquetFile(
        pa.BufferReader(content),
        page_checksum_verification=True,
        thrift_string_size_limit=len(content),
        thrift_container_size_limit=MAX_LIST,
    )
    present, expected = file.schema_arrow, schema()
    if not ALWAYS.issubset(present.names) or len(set(present.names)) < len(present):
        raise OSError("not of a sweep")
    if file.metadata.num_rows > FREE_ROWS + len(content) // BYTES_A_ROW:
        raise OSError(f"{file.metadata.num_rows} rows, more than a file of {len(content)} bytes may hold")
    read = [name for name in columns if name in present.names]
    for name in read:
        if present.field(name).type != expected.field(name).type:
            raise OSError(
                f"{name} of type {present.field(name).type}, where a sweep writes {expected.field(name).type}"
            )
    # On this thread: one of Arrow's that frees `content` while the interpreter ends would abort the process.
    table = file.read(read, use_threads=False)
    table.validate(full=True)
    for name in columns:
        if name not in read:
            table = table.append_column(name, pa.nulls(len(table), expected.field(name).type))
        elif name in ALWAYS and table[name].null_count:
            raise OSError(f"a row without {name}")
    return table.select(list(columns))


# ---------------------------------------------------------------------------------------------- store


class Store:
    """The results in a folder, which need not exist yet. Raises InputError where pyarrow is missing."""

    def __init__(self, folder: str | os.PathLike[str]):
        self.folder = Path(folder)
        parquet()

    def done(self) -> set[EpisodePlace]:
        """The places of all episodes with a row, failed ones too."""
        columns = self.rows(PLACE_IN_STUDY)
        return set(zip(*(columns[name].to_pylist() for name in PLACE_IN_STUDY), strict=True))

    def has_rows(self) -> bool:
        """Whether there is any row."""
        return bool(self._shards(DONE, FAILED))

    def num_failed(self) -> int:
        """How many rows have an error."""
        return self.causes().total()

    def count_by(self, columns: Sequence[str], *, failed: bool = True) -> Counter[tuple[str | None, ...]]:
        """The number of rows for each combination of values of these text columns. Raises MjnavError as `rows` does."""
        counts: Counter[tuple[str | None, ...]] = Counter()
        for shard in self._shards(DONE, *[FAILED] * failed):  # one at a time: run files are long
            counted = read_shard(shard, columns).group_by(list(columns)).aggregate([([], "count_all")]).to_pydict()
            for *values, count in zip(*(counted[name] for name in (*columns, "count_all")), strict=True):
                counts[tuple(values)] += count
        return counts

    def causes(self) -> Counter[str]:
        """The number of failed episodes by cause."""
        return Counter(
            error for shard in self._shards(FAILED) for error in read_shard(shard, ["error"])["error"].to_pylist()
        )

    def study(self) -> str:
        """The text of the study file that was last swept into this folder; empty before the first sweep.

        Raises InputError where it cannot be read.
        """
        try:
            return read_regular(self.folder / STUDY_FILE, MAX_STUDY).decode(errors="replace")
        except FileNotFoundError:
            return ""
        except OSError as error:
            raise InputError(f"{self.folder / STUDY_FILE}: cannot be read: {error.strerror}") from None

    def rows(self, columns: Sequence[str] | None = None, *, failed: bool = True) -> "pyarrow.Table":
        """These `columns` of all rows (all of `row.COLUMNS` by default), in no particular order.

        Without `failed`, rows with an error are left out. Raises MjnavError for a shard that cannot be read, and where
        two shards have the same id.
        """
        import pyarrow as pa

        names = list(COLUMNS if columns is None else columns)
        wanted = list(dict.fromkeys(["id", *names]))
        shards = self._shards(DONE, *[FAILED] * failed)
        table = pa.concat_tables(
            [schema().empty_table().select(wanted), *(read_shard(path, wanted) for path in shards)]
        )
        if len(table) != len(table["id"].unique()):
            raise MjnavError(f"{self.folder}: an episode stands in two shards; shards were copied into this folder?")
        return table.select(names)

    def append(self, rows: Sequence[Row]) -> None:
        """Adds rows whose ids are not in the store; they are on the disk when this returns.

        Raises MjnavError where the disk refuses; the rows that were there stay.
        """
        self._write_shard(DONE, [row for row in rows if row.error is None])
        self._write_shard(FAILED, [row for row in rows if row.error is not None])

    def forget_failures(self) -> None:
        """Removes the rows with an error and their logs, so that their episodes are run again."""
        for shard in self._shards(FAILED):
            remove_logs(self.folder, read_shard(shard, ["log"])["log"].to_pylist())
            shard.unlink()

    def check_own(self) -> None:
        """Raises InputError where something has the name of a sweep's file but was not written by one."""
        if not os.path.lexists(self.folder):
            return
        if not self.folder.is_dir():
            raise InputError(f"{self.folder}: found {_kind(self.folder)}; allowed: a folder for results, or none yet")
        lock, study = self.folder / LOCK, self.folder / STUDY_FILE
        foreign = [path for path in self._shards(DONE, FAILED) if not SHARD.fullmatch(path.name) or _kind(path) != FILE]
        if os.path.lexists(lock) and (_kind(lock) != FILE or lock.stat().st_size):
            foreign.append(lock)
        swept = os.path.lexists(lock) or self.has_rows()
        if os.path.lexists(study) and not (swept and _kind(study) == FILE and self.study()[: len(MARK)] in ("", MARK)):
            foreign.append(study)
        if foreign:
            raise InputError(f"{foreign[0]}: not written by mjnav, and never overwritten: -o names another folder")

    @contextmanager
    def writing(self, study: str, check: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Makes the folder and holds its lock; removes a killed writer's temporary files and writes the study's text.

        `check` is called with the lock held, before anything is removed or written. Raises InputError where another
        sweep writes to the folder, where it cannot be made, and where `check_own` does.
        """
        self.check_own()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            lock = os.open(self.folder / LOCK, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o644)
        except OSError as error:
            raise InputError(f"{self.folder}: {error.strerror}") from None
        try:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise InputError(f"{self.folder}: another sweep writes to it") from None
            check()
            for left in self.folder.glob(TEMPORARY):
                left.unlink()
            self._write(STUDY_FILE, study.encode())
            yield
        finally:
            os.close(lock)

    def _shards(self, *kinds: str) -> list[Path]:
        return [path for kind in kinds for path in sorted(self.folder.glob(f"{kind}-*.parquet"))]

    def _write_shard(self, kind: str, rows: Sequence[Row]) -> None:
        import pyarrow as pa

        if not rows:
            return
        table = pa.Table.from_pylist([row.values() for row in rows], schema=schema())
        content = pa.BufferOutputStream()
        parquet().write_table(table, content, compression="zstd", write_page_checksum=True)
        data = content.getvalue().to_pybytes()
        self._write(f"{kind}-{len(self._shards(DONE, FAILED)):06d}-{digest(data)}.parquet", data)

    def _write(self, name: str, content: bytes) -> None:
        """Writes the whole file or none of it."""
        path, partial = self.folder / name, self.folder / TEMPORARY.replace("*", uuid.uuid4().hex)
        try:
            with open(partial, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.replace(partial, path)
            folder = os.open(self.folder, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        except OSError as error:
            with suppress(OSError):
                partial.unlink(missing_ok=True)
            reason = error.strerror or " ".join(str(error).split())
            raise MjnavError(f"{path}: {reason}") from None


def _kind(path: Path) -> str:
    """What is at a path; links are not followed."""
    mode = path.lstat().st_mode
    if stat.S_ISLNK(mode):
        return f"a link to {os.readlink(path)}"
    return FILE if stat.S_ISREG(mode) else "a folder" if stat.S_ISDIR(mode) else "a device"
