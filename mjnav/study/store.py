"""A sweep's results: a folder of immutable Parquet shards. The ids in them say which episodes are done.

    study.toml              what was asked for
    part-000003-1f6c0a.parquet     rows with a result, `row.COLUMNS`, zstd
    failed-000004-9ab341.parquet   rows with an error; a retry removes them first
    lock                    held by the sweep that writes

A shard appears whole or not at all: it is written under another name, flushed to the disk and renamed. Whatever is
killed at whatever moment, each id stands in one shard at most. Everything that reads Parquet reads them:

    SELECT method, avg(success::int) FROM 'runs/out/NAME/part-*.parquet' GROUP BY method
"""

import fcntl
import os
import uuid
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjnav.errors import InputError, MjnavError, missing_extra
from mjnav.study.row import COLUMNS, Row

if TYPE_CHECKING:
    import pyarrow

STUDY_FILE = "study.toml"
DONE, FAILED = "part", "failed"


class Store:
    """The results in a folder, which need not exist yet. Raises InputError where pyarrow is missing."""

    def __init__(self, folder: str | os.PathLike[str]):
        self.folder = Path(folder)
        _parquet()

    def done(self) -> set[str]:
        """The ids of all episodes with a row, failed ones too."""
        return set(self.rows(["id"])["id"].to_pylist())

    def has_rows(self) -> bool:
        """Whether there is any."""
        return bool(self._shards(DONE) or self._shards(FAILED))

    def num_failed(self) -> int:
        """How many rows have an error."""
        return sum(_parquet().read_metadata(shard).num_rows for shard in self._shards(FAILED))

    def causes(self) -> Counter[str]:
        """How many episodes failed of each cause."""
        return Counter(
            error for shard in self._shards(FAILED) for error in _read(shard, ["error"])["error"].to_pylist()
        )

    def revisions(self) -> set[str]:
        """The revisions of mjnav that the rows are of."""
        return set(self.rows(["revision"])["revision"].unique().to_pylist())

    def study(self) -> str:
        """The text of the study file that was last swept into this folder; empty where there is none."""
        with suppress(FileNotFoundError):
            return (self.folder / STUDY_FILE).read_text(encoding="utf-8")
        return ""

    def rows(self, columns: Sequence[str] | None = None, *, failed: bool = True) -> "pyarrow.Table":
        """All rows, each id once, in no order that means anything; `columns` of `row.COLUMNS`.

        Without `failed`, rows with an error are left out. Raises MjnavError for a shard that cannot be read, and where
        an id stands in two.
        """
        import pyarrow as pa

        names = list(COLUMNS if columns is None else columns)
        wanted = list(dict.fromkeys(["id", *names]))
        shards = [*self._shards(DONE), *(self._shards(FAILED) if failed else ())]
        tables = [_read(shard, wanted) for shard in shards]
        # Columns that a shard of an older version lacks are null.
        table = pa.concat_tables([_schema().empty_table().select(wanted), *tables], promote_options="default")
        if len(table) != len(table["id"].unique()):
            raise MjnavError(f"{self.folder}: an episode stands in two shards; shards were copied into this folder?")
        return table.select(names)

    def append(self, rows: Sequence[Row]) -> None:
        """Adds rows, none of whose ids is in the store; they are on the disk when this returns.

        Raises MjnavError where the disk refuses; what was there stays.
        """
        for kind, of_kind in (
            (DONE, [row for row in rows if row["error"] is None]),
            (FAILED, [row for row in rows if row["error"] is not None]),
        ):
            if of_kind:
                self._write_shard(kind, of_kind)

    def forget_failures(self) -> int:
        """Removes the rows with an error, so that their episodes are no longer done; says how many."""
        count = self.num_failed()
        for shard in self._shards(FAILED):
            shard.unlink()
        return count

    @contextmanager
    def writing(self, study: str) -> Iterator[None]:
        """Makes the folder and holds its lock; removes what a killed writer left, and keeps the text of the study.

        Raises InputError where another sweep writes to it, or the folder cannot be made.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            lock = os.open(self.folder / "lock", os.O_CREAT | os.O_RDWR, 0o644)
        except OSError as error:
            raise InputError(f"{self.folder}: {error.strerror}") from None
        try:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise InputError(f"{self.folder}: another sweep writes to it") from None
            for left in self.folder.glob("*.parquet.tmp"):
                left.unlink()
            self._write(STUDY_FILE, lambda file: file.write(study.encode()))
            yield
        finally:
            os.close(lock)

    def _shards(self, kind: str) -> list[Path]:
        return sorted(self.folder.glob(f"{kind}-*.parquet"))

    def _write_shard(self, kind: str, rows: Iterable[Row]) -> None:
        import pyarrow as pa

        table = pa.Table.from_pylist(list(rows), schema=_schema())
        number = len(self._shards(DONE)) + len(self._shards(FAILED))
        name = f"{kind}-{number:06d}-{uuid.uuid4().hex[:8]}.parquet"
        self._write(name, lambda file: _parquet().write_table(table, file, compression="zstd"))

    def _write(self, name: str, write: Callable[[Any], object]) -> None:
        """A whole file or none."""
        path = self.folder / name
        temporary = self.folder / f"{name}.tmp"
        try:
            with open(temporary, "wb") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
            folder = os.open(self.folder, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        except OSError as error:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
            reason = error.strerror or " ".join(str(error).split())
            raise MjnavError(f"{path}: {reason}") from None


def _parquet() -> Any:
    try:
        import pyarrow.parquet
    except ImportError:
        raise missing_extra("pyarrow", "sweep") from None
    return pyarrow.parquet


def _schema() -> "pyarrow.Schema":
    import pyarrow as pa

    return pa.schema([(name, pa.type_for_alias(kind)) for name, (kind, _) in COLUMNS.items()])


def _read(shard: Path, columns: list[str]) -> "pyarrow.Table":
    import pyarrow as pa

    try:
        return _parquet().ParquetFile(shard).read(columns)
    except (OSError, pa.ArrowException) as error:
        reason = " ".join(str(error).split())
        raise MjnavError(f"{shard}: not readable ({reason}); without it, --resume runs its episodes again") from None
