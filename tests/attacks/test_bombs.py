"""A small file that says it holds much costs memory and time in proportion to its size, whatever reads it."""

import json
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard

from mjnav.log import Recorder
from mjnav.log.encode.candidates import encode_cone
from mjnav.log.read.records import CONTENTS_PER_BYTE as CONTENTS
from mjnav.log.read.records import FREE_CONTENTS
from mjnav.messages import ConeDistribution
from tests.log.conftest import MadeUpRun, make_scenario
from tests.log.mutated_logs import CHUNK, MESSAGE, Record, joined, split

MEMORY = 600 * 2**20  # [bytes] that a reader may grow by, and
A_BYTE = 300  # so many for each of the file
SLOWER = 60.0  # times a reader may take longer than for a run's log of some MB
COMMANDS = {
    "inspect": ("inspect", "log.mcap", "--json"),
    "recover": ("recover", "log.mcap", "out.mcap"),
    "report": ("report", "log.mcap", "-o", "out.html"),
    "csv": ("export", "log.mcap", "out", "--format", "csv"),
    "replay": ("replay", "log.mcap"),
    "render": ("render", "log.mcap", "-o", "out.png"),
}


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def text(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


def channel(number: int, topic: bytes) -> bytes:
    return record(4, struct.pack("<HH", number, 0) + text(topic) + text(b"json") + struct.pack("<I", 0))


def message(number: int, sequence: int, data: bytes = b"") -> bytes:
    return record(5, struct.pack("<HIQQ", number, sequence, sequence, sequence) + data)


def chunk(content: bytes, pack=zstandard.compress, name: bytes = b"zstd") -> bytes:
    packed = pack(content)
    head = struct.pack("<QQQII", 0, 0, len(content), zlib.crc32(content), len(name)) + name
    return record(6, head + struct.pack("<Q", len(packed)) + packed)


def with_chunks(sound: bytes, *chunks: bytes) -> bytes:
    """A run's log, with these chunks before its end."""
    records = list(split(sound))
    last = max(i for i, one in enumerate(records) if one.opcode == CHUNK)
    more = [Record(CHUNK, one[9:]) for one in chunks]
    return joined((*records[: last + 1], *more, *records[last + 1 :]))


def zeros(sound: bytes) -> bytes:
    """Chunks of one record of 200 MB each, which nobody knows."""
    return with_chunks(sound, *[chunk(record(200, bytes(200_000_000)))] * 30)


def zeros_in_lz4(sound: bytes) -> bytes:
    return with_chunks(sound, *[chunk(record(200, bytes(60_000_000)), lz4.frame.compress, b"lz4")] * 3)


def tiny_messages(sound: bytes) -> bytes:
    return with_chunks(sound, chunk(b"".join(message(1, i) for i in range(100_000))))


def tiny_channels(sound: bytes) -> bytes:
    return with_chunks(sound, chunk(b"".join(channel(i % 65536, b"/%d" % i) for i in range(100_000))))


def long_names(sound: bytes) -> bytes:
    return with_chunks(sound, *(chunk(channel(i + 100, b"/%d" % i + bytes(1_000_000))) for i in range(100)))


def repeated_names(sound: bytes) -> bytes:
    """Many samples of an obstacle whose name is long: each row of the table has the name."""
    cone = encode_cone(ConeDistribution("x" * 100_000, np.zeros(250_000), np.zeros(1), 1.0))

    def bombed(one: Record) -> Record:
        if one.inside is not None:
            return Record(one.opcode, one.body, tuple(map(bombed, one.inside)), b"zstd")
        if one.opcode == MESSAGE and struct.unpack_from("<H", one.body)[0] == topic:
            return Record(MESSAGE, one.body[:22] + cone)
        return one

    records = split(sound)
    channels = [one.body for outer in records for one in (outer, *(outer.inside or ())) if one.opcode == 4]
    topic = next(struct.unpack_from("<H", body)[0] for body in channels if b"/cone" in body)
    return joined(tuple(map(bombed, records)))


BOMBS = {
    zeros: ("inspect", "recover", "report", "csv", "replay", "render"),
    zeros_in_lz4: ("inspect",),
    tiny_messages: ("inspect", "recover", "csv"),
    tiny_channels: ("inspect", "recover"),
    long_names: ("inspect",),
    repeated_names: ("csv",),
}


def written(path: Path, ticks: int) -> Path:
    run = MadeUpRun(num_people=2, num_candidates=400)
    with Recorder(path, make_scenario(2), {"seed": "3", "scene": "made-up"}, "<mujoco/>") as recorder:
        for tick in range(ticks):
            recorder.write(run.record(tick))
            recorder.write_timing(run.timing(tick))
        recorder.finish(run.truth(ticks), {"outcome": "goal", "ticks": ticks, "deadline_misses": 0})
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bombs")


@pytest.fixture(scope="module")
def sound(folder):
    return written(folder / "small.mcap", 4).read_bytes()


@pytest.fixture(scope="module")
def reader(folder, sound):
    """Runs a command on a log, in a process of its own with bounded memory."""
    command = [sys.executable, str(Path(__file__).parent / "forked_readers.py"), "small.mcap", str(folder)]
    with subprocess.Popen(
        command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as server:

        def read(name: str, content: bytes) -> dict:
            place = folder / str(len(os.listdir(folder)))
            place.mkdir()
            (place / "log.mcap").write_bytes(content)
            request = {"argv": COMMANDS[name], "folder": str(place), "memory": MEMORY + A_BYTE * len(content) + 2**30}
            server.stdin.write(json.dumps(request) + "\n")
            server.stdin.flush()
            return json.loads(server.stdout.readline())

        yield read
        server.stdin.close()


@pytest.fixture(scope="module")
def ordinary(reader, folder):
    """Processor time [s] that it takes to inspect a run's log of some MB."""
    content = written(folder / "ordinary.mcap", 300).read_bytes()
    return reader("inspect", content)["seconds"]


@pytest.mark.parametrize("bomb", BOMBS, ids=lambda bomb: bomb.__name__)
def test_a_bomb_costs_memory_and_time_in_proportion_to_its_size(bomb, reader, sound, ordinary):
    content = bomb(sound)
    for name in BOMBS[bomb]:
        done = reader(name, content)
        assert done["code"] in (0, 2, 3) or (name, done["code"]) == ("replay", 1), done
        assert len(done["err"].splitlines()) <= 2, done["err"][:1000]  # the second says what to do
        assert done["grown"] <= MEMORY + A_BYTE * len(content), (name, done)
        assert done["seconds"] <= SLOWER * ordinary, (name, done, ordinary)


def test_a_chunk_that_claims_too_much_is_named_and_not_decompressed(reader, sound):
    size = 2 * FREE_CONTENTS + CONTENTS * len(sound)
    done = reader("csv", with_chunks(sound, chunk(record(200, bytes(size)))))
    assert done["code"] == 3
    assert f"a chunk that claims {size + 9} bytes of contents for " in done["err"]
    assert done["grown"] < size


@pytest.mark.parametrize("kind", ["fifo", "zero", "folder"])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_pipe_a_device_and_a_folder_are_refused_at_once(name, kind, tmp_path, monkeypatch, capsys):
    from mjnav.cli.main import main

    monkeypatch.chdir(tmp_path)
    make = {"fifo": os.mkfifo, "zero": lambda path: os.symlink("/dev/zero", path), "folder": os.mkdir}
    make[kind]("log.mcap")
    assert main(list(COMMANDS[name])) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
