"""Shards appear whole or not at all, and the ids in them say what is done."""

import resource
import signal
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace

import pyarrow.parquet as pq
import pytest

from mjnav.errors import InputError, MjnavError
from mjnav.study.store import COLUMNS, Row, Store, digest
from tests.study import made_up


def row(number: int, error: str | None = None) -> Row:
    return made_up.row("mean", number, 0.05 * number, error=error, id=f"{number:04d}")


def seeds(store: Store) -> set[int]:
    return {seed for *_, seed in store.done()}


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "results")
    with store.writing("# mjnav the study"):
        yield store


def test_what_was_added_is_there(store):
    rows = [row(0), row(1), row(2), row(3, "broke")]
    store.append(rows[:2])
    store.append(rows[2:])
    table = store.rows()
    assert table.column_names == list(COLUMNS)
    assert sorted(table.to_pylist(), key=lambda r: r["id"]) == [row.values() for row in rows]
    assert seeds(store) == {0, 1, 2, 3}
    assert store.rows(["seed"], failed=False)["seed"].to_pylist() == [0, 1, 2]
    assert (store.study(), store.has_rows()) == ("# mjnav the study", True)


def test_only_the_failures_of_wanted_episodes_are_forgotten_with_their_logs(store):
    (store.folder / "logs").mkdir()
    rows = [row(0), *(replace(row(i, "broke"), log=f"logs/e-{i:016x}.mcap") for i in range(1, 5))]
    for failed in rows[1:]:
        (store.folder / str(failed.log)).touch()
    store.append(rows[:4])
    store.append(rows[4:])
    store.forget_failures({place for place in store.done() if place[-1] in (0, 2, 4)})
    assert sorted(store.rows().to_pylist(), key=lambda r: r["id"]) == [rows[i].values() for i in (0, 1, 3)]
    assert {path.name for path in (store.folder / "logs").iterdir()} == {f"e-{i:016x}.mcap" for i in (1, 3)}
    assert len(list(store.folder.glob("failed-*"))) == 1


def test_an_id_in_two_shards_is_told(store):
    store.append([row(0)])
    store.append([row(0)])
    with pytest.raises(MjnavError, match="an episode stands in two shards"):
        store.rows()


def test_a_writer_that_comes_after_a_killed_one_cleans_up(tmp_path):
    folder = tmp_path / "results"
    code = f"""
import time
from mjnav.study.store import Store
from tests.study import made_up
with Store({str(folder)!r}).writing("# mjnav the first"):
    open({str(folder / ".mjnav-1.tmp")!r}, "w").close()
    open({str(folder / "notes.tmp")!r}, "w").close()
    print("writing", flush=True)
    time.sleep(60)
"""
    writer = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    with writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "writing\n"
        with pytest.raises(InputError, match=f"{folder}: another sweep writes to it"), Store(folder).writing(""):
            pass
        writer.send_signal(signal.SIGKILL)
    with Store(folder).writing("# mjnav the second"):
        assert sorted(path.name for path in folder.iterdir()) == ["lock", "notes.tmp", "study.toml"]
    assert Store(folder).study() == "# mjnav the second"


def test_a_column_that_came_later_is_null_in_older_shards(store):
    store.append([row(0)])
    (shard,) = store.folder.glob("*.parquet")
    pq.write_table(pq.read_table(shard).drop_columns(["time_s", "row_schema"]), shard)
    shard.rename(shard.with_name(f"part-000000-{digest(shard.read_bytes())}.parquet"))
    store.append([row(1)])
    assert sorted(store.rows(["id", "time_s", "row_schema"]).to_pylist(), key=str) == [
        {"id": "0000", "time_s": None, "row_schema": None},
        {"id": "0001", "time_s": 0.5, "row_schema": 2},
    ]


@contextmanager
def no_file_larger_than(size: int):
    """As a full disk, for this process."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_what_the_disk_refuses_leaves_the_store_as_it_was(store):
    store.append([row(0)])
    before = sorted(store.folder.iterdir())
    with no_file_larger_than(2000), pytest.raises(MjnavError, match=r"part-000001-.*\.parquet: File too large$"):
        store.append([row(1)])
    assert sorted(store.folder.iterdir()) == before
    store.append([row(1)])
    assert seeds(store) == {0, 1}
