import struct
from collections import Counter
from dataclasses import dataclass
from io import BytesIO

import numpy as np
import pytest
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Header, Message, Metadata, Schema, Statistics
from mcap.stream_reader import breakup_chunk
from mcap.writer import MCAP0_MAGIC

from mjnav.recording import Recorder
from mjnav.recording.salvage import Lost, salvage
from tests.recording.conftest import MadeUpRun, make_scenario


@dataclass(frozen=True)
class Piece:
    """One record of an undamaged file; the messages in it if it is a chunk."""

    opcode: int
    start: int
    end: int
    messages: tuple[tuple, ...]


def key(message: Message) -> tuple:
    return message.channel_id, message.sequence, message.log_time, message.publish_time, message.data


def pieces_of(content: bytes) -> list[Piece]:
    pieces, at = [], len(MCAP0_MAGIC)
    while at < len(content) - len(MCAP0_MAGIC):
        opcode, length = struct.unpack_from("<BQ", content, at)
        end = at + 9 + length
        messages: tuple = ()
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(ReadDataStream(BytesIO(content[at + 9 : end])))
            messages = tuple(key(record) for record in breakup_chunk(chunk) if isinstance(record, Message))
        pieces.append(Piece(opcode, at, end, messages))
        at = end
    return pieces


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A log of seven chunks."""
    path = tmp_path_factory.mktemp("salvage") / "whole.mcap"
    run = MadeUpRun(num_people=1, num_candidates=5)
    with Recorder(path, make_scenario(1), {"seed": "3"}, "<mujoco/>") as recorder:
        for tick in range(12):
            recorder.write(run.record(tick))
            recorder.write_timing(run.timing(tick))
            if tick % 2:
                recorder._writer.flush()
        recorder.finish(run.truth(12), {"outcome": "goal"})
    return path


@pytest.fixture(scope="module")
def pieces(whole):
    return pieces_of(whole.read_bytes())


def salvaged(folder, content: bytes) -> list:
    path = folder / "damaged.mcap"
    path.write_bytes(content)
    return list(salvage(path))


def messages_of(items) -> list[tuple]:
    return [key(item) for item in items if isinstance(item, Message)]


def flipped(content: bytes, place: int, bit: int) -> bytes:
    changed = bytearray(content)
    changed[place] ^= 1 << bit
    return bytes(changed)


def of_kind(pieces, opcode) -> list[Piece]:
    return [piece for piece in pieces if piece.opcode == opcode]


def test_an_intact_file_gives_everything_and_nothing_lost(whole, pieces):
    items = list(salvage(whole))
    assert messages_of(items) == [message for piece in pieces for message in piece.messages]
    kinds = Counter(type(item) for item in items)
    assert kinds[Lost] == 0
    assert [kinds[kind] for kind in (Header, Attachment, Metadata, DataEnd, Footer, Statistics)] == [1, 3, 2, 1, 1, 1]
    first_message = next(i for i, item in enumerate(items) if isinstance(item, Message))
    assert {item.id for item in items[:first_message] if isinstance(item, Channel)} == {
        message[0] for piece in pieces for message in piece.messages
    } | {item.id for item in items if isinstance(item, Channel)}
    assert sum(isinstance(item, Schema) for item in items[:first_message]) > 0


SAMPLED = 40  # places in a record, its ends among them


@pytest.mark.parametrize("opcode", sorted(Opcode), ids=lambda opcode: opcode.name.lower())
def test_after_one_changed_bit_anywhere_all_other_records_are_there(whole, pieces, opcode):
    content = whole.read_bytes()
    rng = np.random.default_rng(int(opcode))
    of_opcode = of_kind(pieces, opcode)
    for piece in of_opcode[:1] + of_opcode[-1:]:
        num = min(SAMPLED, piece.end - piece.start)
        for place in np.unique(np.linspace(piece.start, piece.end - 1, num).astype(int)).tolist():
            items = salvaged(whole.parent, flipped(content, place, int(rng.integers(8))))
            kept = messages_of(items)
            intact = [message for other in pieces if other is not piece for message in other.messages]
            everything = [message for other in pieces for message in other.messages]
            assert kept in (intact, everything), place
            kinds = Counter(type(item) for item in items)
            assert kinds[Attachment] >= 3 - (opcode == Opcode.ATTACHMENT)
            assert kinds[Metadata] >= 2 - (opcode == Opcode.METADATA)
            assert kinds[Lost] or kinds[DataEnd] == 0 or kinds[Footer] == 0
