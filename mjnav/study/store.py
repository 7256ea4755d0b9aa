"""The results of a sweep: one episode as a row, and a folder of immutable Parquet files, called shards.

Every row has the same columns, each with its type and meaning. A figure that is undefined is null. A failed episode has
no figures; its `error` says why. The figures of users' own metrics share one column, `metrics`; tables name each of
these figures by itself.

    study.toml                       the study file
    part-000003-<digest>.parquet     rows with a result, `COLUMNS`, zstd
    failed-000004-<digest>.parquet   rows with an error; a retry first removes those of its episodes
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
import json
import os
import re
import resource
import shlex
import stat
import uuid
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mjnav.errors import InputError, MjnavError, of_extra, unknown_name
from mjnav.loop.provenance import FACTS
from mjnav.messages import Array
from mjnav.metrics import summary
from mjnav.metrics.definitions import INTEGER, NUMBER, STRING
from mjnav.scene.toml import read_regular
from mjnav.study.keep import remove_logs

if TYPE_CHECKING:
    import pyarrow

# ------------------------------------------------------------------------------------------------ row


COLUMN = "metrics"
_PREFIX = f"{COLUMN}_"


def figure_name(own: str) -> str:
    """The name of a metric's figure among all figures of a run: metrics_NAME."""
    return f"{_PREFIX}{own}"


def is_own(figure: str) -> bool:
    """Whether a figure is one of a user's own metrics, by its name."""
    return figure.startswith(_PREFIX)


def columns_of(figures: Iterable[str]) -> list[str]:
    """The columns of the store that hold these figures."""
    return list(dict.fromkeys(COLUMN if is_own(figure) else figure for figure in figures))


def own_columns(texts: Sequence[str | None]) -> dict[str, Array]:
    """Each figure of a column of JSON texts, by its name, as an array (n,); null and what is no number as NaN."""
    rows = [_figures(text) for text in texts]
    names = dict.fromkeys(name for row in rows for name in row)
    return {figure_name(name): np.array([_number(row.get(name)) for row in rows]) for name in names}


def check_own(figures: Iterable[str], known: Iterable[str]) -> None:
    """Raises InvalidValue for a figure of a user's own metric that no row has; `known` are names that rows have."""
    known = list(known)
    for figure in figures:
        if is_own(figure) and figure not in known:
            raise unknown_name("figure", figure, known)


def _figures(text: str | None) -> dict[str, Any]:
    """A row's figures. A shard may hold anything: what is no table of figures has none."""
    try:
        found = json.loads(text) if text else {}
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) and abs(value) < 1e300 else np.nan


ROW_SCHEMA = 2  # version of these columns; rows of version 1 do not have it

Value = str | int | float | bool | None


class Column(NamedTuple):
    """The type of a column, as Arrow calls it, and what it holds. A unit stands at the end of the column's name."""

    type: str
    text: str


def _columns(**columns: tuple[str, str]) -> Mapping[str, Column]:
    return MappingProxyType({name: Column(*column) for name, column in columns.items()})


LABELS = _columns(
    id=(STRING, "hash of the labels, the scenario, the parameters, the seed and all facts that decide the bits"),
    study=(STRING, "name in the study file"),
    scene=(STRING, "name of the scene"),
    setting=(STRING, "name of the setting and swept values of the study's grid; default without either"),
    method=(STRING, "name of the method and its swept values"),
    seed=(INTEGER, "seed of the episode"),
    controller=(STRING, "control.method"),
    parameters=(STRING, 'swept values by key as JSON: {"control.weight": 0.3}'),
    control=(STRING, "every parameter of the controller with its value, as JSON"),
    scenario=(STRING, "the run file with all defaults but the controller's, which `control` has"),
)
FIGURES: Mapping[str, Column] = MappingProxyType(
    {
        "error": Column(STRING, "why there is no result, in a line; null where there is one"),
        **{name: Column(figure.type, figure.line) for name, figure in summary.FIGURES.items()},
    }
)
OWN = _columns(
    metrics=(STRING, "figures of the user's own metrics by name, as JSON; null where the scenario names none"),
)
ORIGIN = _columns(
    wall_s=(NUMBER, "wall time of the episode"),
    machine=(STRING, "host name"),
    revision=(STRING, "mjnav's version and git revision"),
    log=(STRING, "the episode's log as a path from the results' folder, logs/NAME.mcap; null where none was kept"),
)
# What decides an episode's bits beside its labels: column -> the fact of `loop.provenance` that it holds.
MADE_WITH: Mapping[str, str] = MappingProxyType({fact.replace(".", "_"): fact for fact in FACTS})
COLUMNS: Mapping[str, Column] = MappingProxyType(
    {
        **LABELS,
        **FIGURES,
        **OWN,
        **ORIGIN,
        "row_schema": Column(INTEGER, "version of these columns"),
        **{column: Column(STRING, FACTS[fact][1]) for column, fact in MADE_WITH.items()},
    }
)
CELL = ("study", "scene", "setting", "method")  # the labels that all rows of a cell share
PLACE_IN_STUDY = (*CELL, "seed")  # the labels of one episode


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One episode, on its way from the process that ran it to the store. `LABELS` and `ORIGIN` describe the fields."""

    id: str
    study: str
    scene: str
    setting: str
    method: str
    seed: int
    controller: str
    parameters: str
    control: str
    scenario: str
    machine: str
    revision: str
    wall_s: float | None
    made_with: Mapping[str, str]  # by fact of `loop.provenance`
    figures: Mapping[str, Value]  # by column of `FIGURES`; empty where there is an error
    error: str | None = None
    log: str | None = None
    metrics: str | None = None

    def values(self) -> dict[str, Value]:
        """The value of each of `COLUMNS`."""
        fields = {name: getattr(self, name) for name in (*LABELS, *OWN, *ORIGIN, "error")}
        facts = {column: self.made_with.get(fact) for column, fact in MADE_WITH.items()}
        return dict.fromkeys(COLUMNS) | dict(self.figures) | fields | facts | {"row_schema": ROW_SCHEMA}


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
    with of_extra("pyarrow", "sweep"):
        import pyarrow.parquet
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

    def swept_with(self, option: str) -> list[str]:
        """The values of an option of the sweep that last wrote here, as "--set"; none where its command is not known.

        Raises InputError as `study` does.
        """
        first = self.study().partition("\n")[0]
        try:
            words = shlex.split(first.removeprefix(MARK)) if first.startswith(f"{MARK}sweep ") else []
        except ValueError:  # no command line
            return []
        in_two_words = [value for word, value in pairwise(words) if word == option]
        return in_two_words + [word.removeprefix(f"{option}=") for word in words if word.startswith(f"{option}=")]

    def rows(self, columns: Sequence[str] | None = None, *, failed: bool = True) -> "pyarrow.Table":
        """These `columns` of all rows (all of `COLUMNS` by default), in no particular order.

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
        self._write_shard(DONE, [row.values() for row in rows if row.error is None])
        self._write_shard(FAILED, [row.values() for row in rows if row.error is not None])

    def forget_failures(self, wanted: Set[EpisodePlace]) -> None:
        """Removes the rows of these episodes that have an error, and their logs, so that they are run again."""
        for shard in self._shards(FAILED):
            rows = read_shard(shard, list(COLUMNS)).to_pylist()
            kept = [row for row in rows if tuple(row[name] for name in PLACE_IN_STUDY) not in wanted]
            if len(kept) < len(rows):
                remove_logs(self.folder, {row["log"] for row in rows} - {row["log"] for row in kept})
                self._write_shard(FAILED, kept, replaced=shard)

    def check_own(self) -> None:
        """Raises InputError where something has the name of a sweep's file but was not written by one."""
        if not os.path.lexists(self.folder):
            return
        check_results_folder(self.folder)
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

    def _write_shard(self, kind: str, rows: Sequence[Mapping[str, Value]], replaced: Path | None = None) -> None:
        """Writes these rows, where there are any, in the place of the shard `replaced`."""
        import pyarrow as pa

        if not rows:
            if replaced is not None:
                replaced.unlink()
            return
        table = pa.Table.from_pylist(list(rows), schema=schema())
        content = pa.BufferOutputStream()
        parquet().write_table(table, content, compression="zstd", write_page_checksum=True)
        data = content.getvalue().to_pybytes()
        self._write(f"{kind}-{len(self._shards(DONE, FAILED)):06d}-{digest(data)}.parquet", data, replaced)

    def _write(self, name: str, content: bytes, replaced: Path | None = None) -> None:
        """Writes the whole file or none of it; `replaced` is removed just before it appears."""
        path, partial = self.folder / name, self.folder / TEMPORARY.replace("*", uuid.uuid4().hex)
        try:
            with open(partial, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            if replaced is not None:
                replaced.unlink()
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


def check_results_folder(folder: Path) -> None:
    """Raises InputError where the path is of something else than a folder."""
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"{folder}: found {_kind(folder)}; allowed: a folder for results, or none yet")


def _kind(path: Path) -> str:
    """What is at a path; links are not followed."""
    mode = path.lstat().st_mode
    if stat.S_ISLNK(mode):
        return f"a link to {os.readlink(path)}"
    return FILE if stat.S_ISREG(mode) else "a folder" if stat.S_ISDIR(mode) else "a device"
