import zlib

import numpy as np
import pytest
from mcap.writer import Writer

from mjnav.recording.recover.one_bit import changed_bit


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("one_bit") / "a.mcap"
    with open(path, "wb") as file:
        writer = Writer(file, enable_data_crcs=True)
        writer.start()
        channel = writer.register_channel("/noise", "", 0)
        writer.add_message(channel, 0, np.random.default_rng(0).bytes(150_000), 0)
        writer.finish()
    return path


def with_changed(log, bits) -> str:
    content = bytearray(log.read_bytes())
    for bit in bits:
        content[bit // 8] ^= 1 << bit % 8
    path = log.with_name("changed.mcap")
    path.write_bytes(content)
    return path


def data_end(log) -> int:
    """Where the record that ends the data stands."""
    content = log.read_bytes()
    return content.index(b"\x0f\x04" + bytes(7))


def test_any_single_changed_bit_of_the_data_or_their_checksum_is_found(log):
    end = 8 * data_end(log)
    rng = np.random.default_rng(1)
    for bit in (0, 7, 8, end - 8, end - 1, end + 72, end + 103, *rng.integers(0, end, 12).tolist()):
        assert changed_bit(with_changed(log, [bit])) == bit


def test_no_bit_is_found_for_an_intact_log_or_two_changed_bits(log):
    """Two bits, by chance, look like a third once in 2^32 / 1.2 million."""
    end = 8 * data_end(log)
    rng = np.random.default_rng(2)
    assert changed_bit(log) is None
    for _ in range(10):
        assert changed_bit(with_changed(log, rng.choice(end, 2, replace=False).tolist())) is None
    assert changed_bit(with_changed(log, [end + 80, end + 90])) is None


def test_no_bit_is_found_without_a_checksum_or_an_end(log, tmp_path):
    content = log.read_bytes()
    stated = data_end(log) + 9
    assert zlib.crc32(content[: stated - 9]) == int.from_bytes(content[stated : stated + 4], "little")
    path = tmp_path / "b.mcap"
    path.write_bytes(content[:stated] + bytes(4) + content[stated + 4 :])
    assert changed_bit(path) is None
    path.write_bytes(b"\x88" + content[1:stated])
    assert changed_bit(path) is None
