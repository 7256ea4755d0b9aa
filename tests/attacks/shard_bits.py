"""How many of 400 flipped bits of a shard come back as other values, as plain Parquet, with checksums, by the store.

uv run python -m tests.attacks.shard_bits
"""

import io
import random
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from mjnav.errors import MjnavError
from mjnav.study.store.store import Store
from tests.study.made_up import row

FLIPS = 400
ROWS = [row("rkhs", seed, 1.5 * seed, outcome="goal", state_hash=f"{seed:064x}") for seed in range(40)]


def survey(content: bytes, read: Callable[[bytes], pa.Table]) -> Counter[str]:
    """What becomes of each flip."""
    chance, whole, found = random.Random(11), read(content), Counter[str]()
    for _ in range(FLIPS):
        place = chance.randrange(8 * len(content))
        damaged = bytearray(content)
        damaged[place // 8] ^= 1 << place % 8
        try:
            found["the same values" if read(bytes(damaged)).equals(whole) else "other values"] += 1
        except (OSError, ValueError, MemoryError, pa.ArrowException, MjnavError):
            found["refused"] += 1
    return found


def main() -> None:
    """Prints a line for each way of reading."""
    with tempfile.TemporaryDirectory() as folder:
        store = Store(folder)
        with store.writing(""):
            store.append(ROWS)
        (shard,) = Path(folder).glob("part-*.parquet")
        content, table = shard.read_bytes(), store.rows()
        plain = io.BytesIO()
        pq.write_table(table, plain, compression="zstd")

        def by_store(data: bytes) -> pa.Table:
            shard.write_bytes(data)
            return store.rows()

        ways = {
            "as Parquet, no checksums": (plain.getvalue(), lambda data: pq.ParquetFile(pa.BufferReader(data)).read()),
            "as Parquet, page checksums": (
                content,
                lambda data: pq.ParquetFile(pa.BufferReader(data), page_checksum_verification=True).read(),
            ),
            "by the store, digest": (content, by_store),
        }
        for name, (data, read) in ways.items():
            print(f"{name:28}", dict(survey(data, read)))


if __name__ == "__main__":
    main()
