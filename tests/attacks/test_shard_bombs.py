"""A folder of results from a stranger costs memory in proportion to its files, whatever they say that they hold."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mjnav.cli.main import main
from mjnav.study.store import FREE_MEMORY, Store, digest, schema
from tests.study.made_up import row

MEMORY = 50 * 2**20  # [bytes] that reading all of these bombs, none larger than 100 kB, may take
# Reads each folder in turn; says what was said of each, and last by how much the process has grown at most [kB].
READER = """
import resource, sys
from mjnav.errors import MjnavError
from mjnav.study.store import Store
Store(sys.argv[1]).rows()
def peak(): return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
before = peak()
for folder in sys.argv[2:]:
    try:
        Store(folder).rows()
        print("read")
    except MjnavError as error:
        print(error)
print(peak() - before)
"""


def packed(table: pa.Table, **options: Any) -> bytes:
    content = pa.BufferOutputStream()
    pq.write_table(table, content, compression="zstd", write_page_checksum=True, **options)
    return content.getvalue().to_pybytes()


def rows(num: int, **columns: Any) -> pa.Table:
    """So many equal rows, but for these columns."""
    values = row("rkhs", 1, 1.0).values()
    whole = {
        field.name: columns.get(field.name, pa.array([values[field.name]] * num, field.type)) for field in schema()
    }
    return pa.table(whole, schema=schema())


def nulls_and_runs() -> bytes:
    """Twenty thousand rows in a few kB."""
    return packed(rows(20_000))


def text_of_sixty_megabytes() -> bytes:
    return packed(rows(1, study=pa.array(["x" * 60_000_000])))


def no_column_but_the_id() -> bytes:
    return packed(pa.table({"id": ["a"]}))


def rows_without_labels() -> bytes:
    return packed(pa.table({field.name: pa.nulls(1, field.type) for field in schema()}))


# what is said of each
BOMBS: dict[Callable[[], bytes], str] = {
    nulls_and_runs: "20000 rows, more than a file of ",
    text_of_sixty_megabytes: "takes more memory than a file of its size may",
    no_column_but_the_id: "not of a sweep",
    rows_without_labels: "a row without ",
}


def shard(folder: Path, content: bytes) -> Path:
    folder.mkdir()
    path = folder / f"part-000000-{digest(content)}.parquet"
    path.write_bytes(content)
    return path


def test_a_shard_that_holds_more_than_its_size_allows_is_named_and_not_unpacked(tmp_path):
    sound = shard(tmp_path / "sound", packed(rows(1)))
    paths = []
    for bomb in BOMBS:
        paths.append(shard(tmp_path / bomb.__name__, bomb()))
        assert paths[-1].stat().st_size < 100_000
    command = [sys.executable, "-c", READER, sound.parent, *(path.parent for path in paths)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    *said, grown = done.stdout.splitlines()
    assert len(said) == len(BOMBS)
    for path, line, reason in zip(paths, said, BOMBS.values(), strict=True):
        assert line.startswith(f"{path}: damaged (")
        assert reason in line
    assert 1024 * int(grown) < MEMORY


def test_a_large_study_of_one_scenario_is_read(tmp_path):
    """Every row repeats 30 kB of text: in memory it is far more than the file."""
    num = 600
    unlike = {name: pa.array([f"{name} {digest(b'%d' % i)}" for i in range(num)]) for name in ("id", "state_hash")}
    table = rows(num, scenario=pa.array(["#" * 30_000] * num), seed=pa.array(range(num)), **unlike)
    path = shard(tmp_path / "large", packed(table))
    assert table.nbytes > FREE_MEMORY // 2
    assert Store(path.parent).rows().equals(table)


@pytest.mark.parametrize("name", ["study.toml", "shard"])
@pytest.mark.parametrize("make", [os.mkfifo, lambda at: os.symlink("/dev/zero", at)], ids=["fifo", "zero"])
def test_what_is_no_regular_file_in_results_is_refused_at_once(make, name, tmp_path, capsys):
    path = shard(tmp_path / "results", packed(rows(1)))
    place = path.with_name("study.toml") if name == "study.toml" else path
    place.unlink(missing_ok=True)
    make(place)

    assert main(["compare", str(path.parent)]) in (1, 2)
    said = capsys.readouterr().err
    assert said.startswith(f"mjnav: {place}: ")
    assert said.count("\n") == 1
