"""`mjnav recover` on logs that `mjnav run` wrote, damaged in every way that a file is."""

import json
import os
import resource
import signal
import struct
from collections import Counter

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.records import Message, Metadata
from mcap.stream_reader import StreamReader

import mjnav as package
from mjnav.cli.main import main
from mjnav.log import open_log
from mjnav.log.log_format import RECOVERED
from mjnav.log.recover import recover
from tests.log.mutated_logs import damaged

RUN = ("run", "crossing1", "--set", "time_limit=2.0", "--log")


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    path = tmp_path_factory.mktemp("recover") / "a.mcap"
    assert main([*RUN, str(path)]) == 0
    return path.read_bytes()


@pytest.fixture
def log(tmp_path, content):
    path = tmp_path / "log.mcap"
    path.write_bytes(content)
    return path


def chunks(content: bytes) -> list[tuple[int, int]]:
    """Where each chunk starts and ends."""
    places, at = [], 8
    while at < len(content) - 8:
        opcode, length = struct.unpack_from("<BQ", content, at)
        if opcode == 6:
            places.append((at, at + 9 + length))
        at += 9 + length
    return places


def zeroed(content: bytes, start: int, end: int) -> bytes:
    return content[:start] + bytes(end - start) + content[end:]


def messages_in(path) -> list[tuple]:
    """Through the library, every checksum verified."""
    with open(path, "rb") as file:
        return [
            (
                channel.topic,
                schema and (schema.name, schema.encoding, schema.data),
                message.sequence,
                message.log_time,
                message.publish_time,
                message.data,
            )
            for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)
        ]


def of_others(path) -> tuple[list, list]:
    """Attachments and metadata but that of the recovery."""
    with open(path, "rb") as file:
        reader = make_reader(file)
        metadata = [record for record in reader.iter_metadata() if record.name != RECOVERED]
        return list(reader.iter_attachments()), metadata


def test_an_intact_log_is_copied_byte_for_byte(mjnav, log, content, tmp_path):
    said = mjnav("recover", log, "out.mcap")
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith("out.mcap: the log is intact and was copied as it is; nothing was lost\n")
    assert (tmp_path / "out.mcap").read_bytes() == content


def test_all_but_a_damaged_chunk_is_kept_and_the_log_says_what_was_lost(mjnav, log, content, tmp_path):
    start, end = chunks(content)[2]
    log.write_bytes(zeroed(content, start + 100, end - 100))
    printed = json.loads(mjnav("recover", log, "out.mcap", "--json").out)
    before, after = Counter(m[0] for m in messages_in(log.with_name("out.mcap"))), open_log(tmp_path / "out.mcap")
    assert printed["topics"] == {topic: before[topic] for topic in printed["topics"]}
    assert printed["messages"] == before.total()
    assert printed["messages_lost_is_exact"]
    assert [(gap["start"], gap["end"]) for gap in printed["ranges"]] == [(start, end)]
    log.write_bytes(content)
    original = messages_in(log)
    assert printed["messages"] + printed["messages_lost"] == len(original)
    kept = messages_in(tmp_path / "out.mcap")
    assert kept == [message for message in original if message in kept]
    assert of_others(tmp_path / "out.mcap") == of_others(log)
    assert (after.complete, after.truncated) == (True, False)
    with open(tmp_path / "out.mcap", "rb") as file:
        (said,) = (record for record in make_reader(file).iter_metadata() if record.name == RECOVERED)
    assert said.metadata["file"] == "log.mcap"
    assert json.loads(said.metadata["ranges"]) == printed["ranges"]
    assert json.loads(said.metadata["topics_lost"]) == printed["topics_lost"] != {}
    assert mjnav("inspect", "out.mcap").code == 0


def test_an_interrupt_leaves_nothing_behind(log, content):
    log.write_bytes(zeroed(content, *chunks(content)[1]))
    passes = 0

    def interrupt(place: int) -> None:
        nonlocal passes
        passes += place <= 8
        if passes > 1 and len(os.listdir(log.parent)) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        recover(log, log.parent / "out.mcap", on_byte=interrupt)
    assert os.listdir(log.parent) == [log.name]


def test_a_full_disk_is_told_in_one_line(mjnav, log, content):
    start, end = chunks(content)[1]
    log.write_bytes(zeroed(content, start + 100, end))
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        said = mjnav("recover", log, "out.mcap")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert (said.code, said.out) == (1, "")
    assert said.err == "mjnav: out.mcap: writing failed: File too large\n"
    assert os.listdir(log.parent) == [log.name]


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_after_any_damage_the_new_log_is_sound_and_holds_nothing_new(tmp_path_factory, content, data):
    folder = tmp_path_factory.mktemp("any")
    (folder / "whole.mcap").write_bytes(content)
    original, others = messages_in(folder / "whole.mcap"), of_others(folder / "whole.mcap")
    (folder / "log.mcap").write_bytes(data.draw(damaged(content)))
    code = main(["recover", str(folder / "log.mcap"), str(folder / "out.mcap")])
    assert code in (0, 2, 3)
    assume(code == 0)
    kept = messages_in(folder / "out.mcap")
    with open(folder / "out.mcap", "rb") as file:
        written = list(StreamReader(file, validate_crcs=True).records)
    assert sum(isinstance(record, Message) for record in written) == len(kept)
    assert {message[2:] for message in kept} <= {message[2:] for message in original}
    named = [message for message in kept if not message[0].startswith("/unknown/")]
    assert Counter(named) <= Counter(original)
    attachments, _ = of_others(folder / "out.mcap")
    assert all(attachment in others[0] for attachment in attachments)
    names = [record.name for record in written if isinstance(record, Metadata)]
    assert (RECOVERED in names) == ((folder / "out.mcap").read_bytes() != content)
    assert package.open_log(folder / "out.mcap").path == folder / "out.mcap"
