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
"""

import fcntl
import os
import re
import stat
import uuid
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from mjnav.errors import InputError, MjnavError
from mjnav.scene.toml import read_regular
from mjnav.study.keep import remove_logs
from mjnav.study.store.row import COLUMNS, PLACE_IN_STUDY, Row
from mjnav.study.store.shard import DONE, FAILED, SHARD, digest, parquet, read_shard, schema

if TYPE_CHECKING:
    import pyarrow

STUDY_FILE, LOCK = "study.toml", "lock"
TEMPORARY = re.compile(rf"({SHARD.pattern}|{re.escape(STUDY_FILE)}\.[0-9a-f]{{8}})\.tmp")
MAX_STUDY = 10_000_000  # [bytes] of the study file
MARK = "# mjnav "  # first characters of a study file that a sweep wrote; the command follows

FILE = "a file"

EpisodePlace = tuple[str, str, str, str, int]  # the values of PLACE_IN_STUDY


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
        return sum(len(read_shard(shard, ["id"])) for shard in self._shards(FAILED))

    def count_by(self, columns: Sequence[str], *, failed: bool = True) -> Counter[tuple[str | None, ...]]:
        """The number of rows for each combination of values of these text columns. Raises MjnavError as `rows` does."""
        found: Counter[tuple[str | None, ...]] = Counter()
        for shard in self._shards(DONE, *[FAILED] * failed):
            table = _completed(read_shard(shard, columns), columns)
            counted = table.group_by(list(columns)).aggregate([([], "count_all")]).to_pydict()
            for *values, count in zip(*(counted[name] for name in (*columns, "count_all")), strict=True):
                found[tuple(values)] += count
        return found

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
        tables = [read_shard(shard, wanted) for shard in self._shards(DONE, *[FAILED] * failed)]
        table = pa.concat_tables([_completed(table, wanted) for table in (schema().empty_table(), *tables)])
        if len(table) != len(table["id"].unique()):
            raise MjnavError(f"{self.folder}: an episode stands in two shards; shards were copied into this folder?")
        return table.select(names)

    def append(self, rows: Sequence[Row]) -> None:
        """Adds rows whose ids are not in the store; they are on the disk when this returns.

        Raises MjnavError where the disk refuses; the rows that were there stay.
        """
        self._write_shard(DONE, [row for row in rows if row.error is None])
        self._write_shard(FAILED, [row for row in rows if row.error is not None])

    def forget_failures(self) -> int:
        """Removes the rows with an error and their logs, so that their episodes are run again; returns their number."""
        count = self.num_failed()
        for shard in self._shards(FAILED):
            table = read_shard(shard, ["log"])
            remove_logs(self.folder, _completed(table, ["log"])["log"].to_pylist())
            shard.unlink()
        return count

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
        known = os.path.lexists(lock) or self.has_rows()
        if os.path.lexists(study) and not (known and _kind(study) == FILE and self._marked()):
            foreign.append(study)
        if foreign:
            more = f" (nor {len(foreign) - 1} more)" * (len(foreign) > 1)
            raise InputError(
                f"{foreign[0]}: not written by mjnav{more}, and never overwritten: -o names another folder"
            )

    def _marked(self) -> bool:
        """Whether a sweep wrote the study file; an empty one may be overwritten, too."""
        with open(self.folder / STUDY_FILE, "rb") as file:
            return file.read(len(MARK)) in (b"", MARK.encode())

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
            for left in self.folder.glob("*.tmp"):
                if TEMPORARY.fullmatch(left.name):
                    left.unlink()
            self._write(STUDY_FILE, study.encode(), temporary=f"{STUDY_FILE}.{uuid.uuid4().hex[:8]}.tmp")
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
        name = f"{kind}-{len(self._shards(DONE, FAILED)):06d}-{digest(data)}.parquet"
        self._write(name, data, temporary=f"{name}.tmp")

    def _write(self, name: str, content: bytes, *, temporary: str) -> None:
        """Writes the whole file or none of it."""
        path, partial = self.folder / name, self.folder / temporary
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


def _completed(table: "pyarrow.Table", columns: Sequence[str]) -> "pyarrow.Table":
    """These columns in their order, null where a shard of an earlier version lacks one."""
    import pyarrow as pa

    for name in columns:
        if name not in table.column_names:
            table = table.append_column(name, pa.nulls(len(table), pa.type_for_alias(COLUMNS[name].type)))
    return table.select(list(columns))
