"""A log's file holds whole records, whatever becomes of the disk."""

import os
import resource
from contextlib import closing

import pytest

from mjnav.log.write.writer import LogFile


@pytest.fixture
def file(tmp_path):
    with closing(LogFile(tmp_path / "a.mcap")) as file:
        file.write(b"first")
        yield file


@pytest.fixture
def content(tmp_path):
    return (tmp_path / "a.mcap").read_bytes


def test_bytes_go_in_whole_or_not_at_all(file, content):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            file.write(bytes(2000))  # of which the system takes 995
        assert content() == b"first"
        file.write(b"second")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert content() == b"firstsecond"


def test_a_deleted_file_takes_no_more(tmp_path, file):
    (tmp_path / "a.mcap").unlink()
    with pytest.raises(OSError, match="it was deleted"):
        file.write(b"second")


def test_a_file_that_was_cut_short_takes_no_more(tmp_path, file, content):
    os.truncate(tmp_path / "a.mcap", 2)
    with pytest.raises(OSError, match="it was truncated"):
        file.write(b"second")
    assert content() == b"fi"


@pytest.mark.parametrize("reused", [False, True])
def test_a_closed_file_takes_no_more_nor_does_another_of_its_number(tmp_path, file, content, reused):
    number = file._file.fileno()
    os.close(number)
    other = tmp_path / "other"
    if reused:
        assert os.open(other, os.O_WRONLY | os.O_CREAT) == number
    with pytest.raises(OSError, match="its descriptor was closed"):
        file.write(b"second")
    file.close()
    assert content() == b"first"
    assert not reused or other.read_bytes() == b""
