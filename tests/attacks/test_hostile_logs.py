"""Logs of sound records whose contents mean harm: a line and an exit code, and no more output than is read."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import pytest

from mjnav.cli.main import main
from tests.attacks.test_bombs import channel, chunk, text, with_chunks
from tests.log.conftest import made_up_log
from tests.log.mutated_logs import MESSAGE, Record, joined, split

METADATA, CHANNEL = 12, 4
_MESSAGE = struct.Struct("<HIQQ")


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    return made_up_log(tmp_path_factory.mktemp("hostile") / "a.mcap", 4).read_bytes()


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def altered(sound: bytes, topic: str, change) -> bytes:
    """The log whose documents of one topic are `change`d, each told the number of its tick."""
    records = split(sound)
    bodies = [one.body for outer in records for one in (outer, *(outer.inside or ())) if one.opcode == CHANNEL]
    number = next(struct.unpack_from("<H", body)[0] for body in bodies if text(topic.encode()) in body)

    def of(one: Record) -> Record:
        if one.inside is not None:
            return replace(one, inside=tuple(map(of, one.inside)))
        if one.opcode != MESSAGE or _MESSAGE.unpack_from(one.body)[0] != number:
            return one
        document = json.loads(one.body[_MESSAGE.size :])
        change(document, _MESSAGE.unpack_from(one.body)[1])
        return replace(one, body=one.body[: _MESSAGE.size] + json.dumps(document).encode())

    return joined(tuple(map(of, records)))


def nested(depth: int) -> list:
    return json.loads("[" * depth + "]" * depth)


@pytest.mark.parametrize("key", ["pose", "estimate"])
def test_a_page_is_made_of_numbers_whose_difference_overflows(sound, folder, capsys, key):
    def huge(document, tick):
        if key == "pose":
            document["pose"] = [1e308, -1e308, (-1) ** tick * 1e308]
        elif document["estimate"] is not None:
            document["estimate"]["mean"] = [(-1) ** tick * 1e308] * 3

    (folder / "a.mcap").write_bytes(altered(sound, "/robot/state", huge))
    assert main(["report", "a.mcap"]) == 0
    assert capsys.readouterr().err == ""


def test_a_number_beyond_a_double_is_bad_input(sound, folder, capsys):
    content = altered(sound, "/decision", lambda document, _: document["cost"].update(goal=10**400))
    (folder / "a.mcap").write_bytes(content)
    assert main(["report", "a.mcap"]) == 2
    assert "/decision of tick 0 is not what mjnav writes" in capsys.readouterr().err


def test_a_list_nested_too_deeply_for_the_interpreter_is_damage(sound, folder, capsys):
    content = altered(sound, "/robot/state", lambda document, _: document.update(pose=nested(900)))
    (folder / "a.mcap").write_bytes(content)
    assert main(["export", "a.mcap", "out", "--format", "csv"]) == 3
    said = capsys.readouterr().err
    assert "not one of mjnav's" in said
    assert len(said.splitlines()) == 1


def test_a_page_with_new_names_in_every_tick_is_refused(sound, folder, capsys, monkeypatch):
    monkeypatch.setattr("mjnav.log.read.records.FREE_EXPORT", 0)  # few names are too many
    monkeypatch.setattr("mjnav.log.read.records.EXPORT", 1)

    def more(document, tick):
        document["people"] += [{**document["people"][0], "name": f"{tick}.{i}"} for i in range(2000)]

    (folder / "a.mcap").write_bytes(altered(sound, "/people/estimate", more))
    assert main(["report", "a.mcap"]) == 3
    assert "the columns of its page" in capsys.readouterr().err


@pytest.mark.parametrize("last", [1e18, float("nan")])
def test_a_film_of_a_log_with_impossible_times_is_refused(sound, folder, capsys, last):
    pytest.importorskip("av")
    content = altered(sound, "/robot/state", lambda document, tick: tick == 4 and document.update(time=last))
    (folder / "a.mcap").write_bytes(content)
    assert main(["render", "a.mcap", "-o", "a.mp4"]) == 3
    assert "states are not 0.1 s apart" in capsys.readouterr().err


def test_printed_text_is_bounded_however_many_topics_there_are(sound, folder, capsys):
    names = [channel(100 + i, b"/%d" % i) for i in range(2000)] + [channel(99, b"/" + b"x" * 100_000)]
    (folder / "a.mcap").write_bytes(with_chunks(sound, chunk(b"".join(names))))
    main(["inspect", "a.mcap"])
    said = capsys.readouterr().out
    assert "topics more, which --json has" in said
    assert len(said) < 400_000
