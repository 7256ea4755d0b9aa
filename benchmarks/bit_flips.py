"""What one changed bit costs a log: the messages of a real run that `mjnav recover` keeps.

    uv run python benchmarks/bit_flips.py hall

A run is logged and each of --flips seeded bits of the file is changed in turn: in the log as it is; in the log as a
killed writer leaves it, which has no checksum of all its data; and with a second bit 1 MiB further on, where that
checksum does not tell which they are. A message is intact if its chunk was not touched. One that comes out and was not
in the log, to the last bit, is wrong; one whose topic nothing tells any more is unnamed. A new log is exact if it is
the undamaged one, byte for byte.
"""

import argparse
import struct
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk

import mjnav
from mjnav.recording.recover.recover import recover

CHUNK, DATA_END = 6, 15
SECOND = 2**20  # [bytes] from the first changed bit to the second


def places(content: bytes, opcode: int) -> list[tuple[int, int]]:
    """Where each record of a kind starts and ends in an undamaged file."""
    found, at = [], 8
    while at < len(content) - 8:
        kind, length = struct.unpack_from("<BQ", content, at)
        if kind == opcode:
            found.append((at, at + 9 + length))
        at += 9 + length
    return found


def messages(path: Path) -> Counter[tuple]:
    """Every message, through the library's reader."""
    with open(path, "rb") as file:
        return Counter(
            (message.sequence, message.log_time, message.data)
            for _, _, message in make_reader(file, validate_crcs=True).iter_messages()
        )


def by_chunk(path: Path) -> list[int]:
    """How many messages are in each chunk."""
    counts: list[int] = []
    with open(path, "rb") as file:
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Chunk):
                counts.append(sum(isinstance(inner, Message) for inner in breakup_chunk(record)))
    return counts


def changed(content: bytes, bits: list[int]) -> bytes:
    """The content with these bits changed."""
    data = bytearray(content)
    for bit in bits:
        data[bit // 8] ^= 1 << bit % 8
    return bytes(data)


def print_row(name: str, content: bytes, original: Counter[tuple], counts: list[int], cases: list[list[int]]) -> bool:
    """One state of the log under all changes; whether all that was intact was kept, and nothing else came out."""
    chunks = places(content, CHUNK)
    shares, of_all, durations = [], [], []
    exact = unnamed = wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder) / "log.mcap", Path(folder) / "out.mcap"
        for bits in cases:
            log.write_bytes(changed(content, bits))
            start = time.perf_counter()
            recovery = recover(log, out)
            durations.append(time.perf_counter() - start)
            kept = messages(out)
            intact = sum(
                count
                for (first, end), count in zip(chunks, counts, strict=True)
                if not any(first <= bit // 8 < end for bit in bits)
            )
            unnamed += sum(count for topic, count in recovery.topics.items() if topic.startswith("/unknown/"))
            wrong += (kept - original).total()
            shares.append(kept.total() / intact)
            of_all.append(kept.total() / sum(counts))
            exact += out.read_bytes() == content
            out.unlink()
    figures = "   ".join(f"{100 * min(values):8.3f} {100 * np.mean(values):8.3f}" for values in (shares, of_all))
    print(f"{name:28}  {figures}   {exact:5} {unnamed:7} {wrong:5}  {1e3 * np.median(durations):6.0f} ms", flush=True)
    return min(shares) >= 1.0 and wrong == 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--flips", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        mjnav.run(mjnav.load_scenario(arguments.scene), seed=0, log=path)
        content, original, counts = path.read_bytes(), messages(path), by_chunk(path)
    data_end = places(content, DATA_END)[0][0]
    rng = np.random.default_rng(arguments.seed)
    bits = rng.integers(0, 8 * (data_end - SECOND), arguments.flips).tolist()
    print(f"{arguments.scene}: {len(content):,} bytes, {sum(counts)} messages in {len(counts)} chunks\n")
    print("messages kept, in %                of those intact           of all   exact unnamed wrong   median")
    print(f"{'':28}  {'least':>8} {'mean':>8}   {'least':>8} {'mean':>8}")
    sound = [
        print_row("one bit", content, original, counts, [[bit] for bit in bits]),
        print_row("one bit, writer killed", content[:data_end], original, counts, [[bit] for bit in bits]),
        print_row("two bits", content, original, counts, [[bit, bit + 8 * SECOND] for bit in bits]),
    ]
    return 0 if all(sound) else 1


if __name__ == "__main__":
    sys.exit(main())
