"""A cache folder gives back what was written, or nothing; others can put nothing into it; what is old goes."""

import os
import resource
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.compile.cache_folder import DAY, UNFINISHED, UNUSED, CacheFolder
from mjnav.geometry import cache_folder

DATA = bytes(range(256)) * 4


@pytest.fixture
def path(tmp_path):
    return tmp_path / "cache" / "mjnav" / "kernels"


@pytest.fixture
def folder(path):
    return CacheFolder(path)


def test_what_was_written_is_read_by_another_process(path, folder):
    folder.write("a", DATA)
    folder.write("a", DATA[::-1])
    assert CacheFolder(path).read("a") == DATA[::-1]
    assert folder.read("b") is None
    assert sorted(os.listdir(path)) == ["a.kernel"]


def test_folders_and_files_are_for_their_user_alone(tmp_path, path):
    before = os.umask(0)
    try:
        CacheFolder(path).write("a", DATA)
    finally:
        os.umask(before)
    made = (tmp_path / "cache", path.parent, path)
    assert [folder.stat().st_mode & 0o777 for folder in made] == [0o700] * 3
    assert (path / "a.kernel").stat().st_mode & 0o777 == 0o600


@given(st.integers(0, 8 * (len(DATA) + 32) - 1))
def test_one_flipped_bit_is_seen(tmp_path_factory, bit):
    path = tmp_path_factory.mktemp("flips")
    folder = CacheFolder(path)
    folder.write("a", DATA)
    content = bytearray((path / "a.kernel").read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    (path / "a.kernel").write_bytes(content)
    assert folder.read("a") is None


def test_one_kernels_file_is_not_taken_for_anothers(path, folder):
    folder.write("a", DATA)
    os.rename(path / "a.kernel", path / "b.kernel")
    assert folder.read("b") is None


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702, 0o1777])
def test_a_folder_that_others_can_write_is_not_used(path, folder, capsys, mode):
    folder.write("a", DATA)
    path.chmod(mode)
    open_folder = CacheFolder(path)
    assert open_folder.read("a") is None
    open_folder.write("b", DATA)
    assert sorted(os.listdir(path)) == ["a.kernel"]
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"mjnav: kernels are compiled anew at every start: {path}: others can write into it"


def test_a_folder_of_another_user_is_not_used(path, folder, capsys):
    folder.write("a", DATA)
    if os.getuid() == 0:
        os.chown(path, 65534, -1)
    else:  # only root can give a folder away
        path = Path("/usr")
    assert CacheFolder(path).read("a") is None
    assert "it belongs to another user" in capsys.readouterr().err


def test_a_link_in_place_of_the_folder_is_not_followed(tmp_path, path, folder, capsys):
    folder.write("a", DATA)
    (tmp_path / "link").symlink_to(path)
    assert CacheFolder(tmp_path / "link").read("a") is None
    assert "kernels are compiled anew" in capsys.readouterr().err


def test_a_link_on_the_way_to_the_folder_is_followed(tmp_path, path, folder):
    folder.write("a", DATA)
    (tmp_path / "link").symlink_to(path.parent)
    assert CacheFolder(tmp_path / "link" / "kernels").read("a") == DATA


def test_neither_a_link_nor_a_pipe_nor_what_others_can_write_is_read(tmp_path, path, folder):
    folder.write("a", DATA)
    os.rename(path / "a.kernel", tmp_path / "elsewhere")
    (path / "a.kernel").symlink_to(tmp_path / "elsewhere")
    os.mkfifo(path / "b.kernel")
    folder.write("c", DATA)
    (path / "c.kernel").chmod(0o666)
    assert [folder.read(name) for name in "abc"] == [None, None, None]


def test_a_full_disk_leaves_no_half_file(path, folder, capsys):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(DATA) // 2, before[1]))
    try:
        folder.write("a", DATA)
        folder.write("b", DATA)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert os.listdir(path) == []
    assert capsys.readouterr().err.splitlines() == [
        f"mjnav: kernels are compiled anew at every start: {path}: File too large"
    ]


def test_what_no_process_used_for_weeks_is_swept_and_what_is_read_stays(path, folder):
    for name in ("old", "read", "young"):
        folder.write(name, DATA)
    for name, age in (("old.kernel", UNUSED), ("read.kernel", UNUSED), ("x.tmp", UNFINISHED), ("y.tmp", 0.0)):
        (path / name).touch()
        moment = time.time() - age - DAY / 2
        os.utime(path / name, (moment, moment))
    (path / "a note").touch()
    assert CacheFolder(path).read("read") == DATA
    CacheFolder(path).write("new", DATA)
    assert sorted(os.listdir(path)) == ["a note", "new.kernel", "read.kernel", "y.tmp", "young.kernel"]


def test_the_least_recently_used_go_where_there_are_too_many(path, folder, monkeypatch):
    for i in range(4):
        folder.write(str(i), DATA)
        os.utime(path / f"{i}.kernel", (time.time() - i, time.time() - i))
    monkeypatch.setattr(cache_folder, "MAX_BYTES", 3 * (len(DATA) + 32))
    CacheFolder(path).write("new", DATA)
    assert sorted(os.listdir(path)) == ["0.kernel", "1.kernel", "new.kernel"]


def test_a_killed_process_holds_nobody_up(path):
    reader, writer = os.pipe()
    number = os.fork()
    if number == 0:
        with CacheFolder(path).making("a"):
            os.write(writer, b"!")
            time.sleep(60.0)
        os._exit(0)
    os.read(reader, 1)
    os.kill(number, 9)
    os.waitpid(number, 0)
    folder = CacheFolder(path)
    with folder.making("a"):
        folder.write("a", DATA)
    assert folder.read("a") == DATA


def test_a_sleeping_process_is_not_waited_for_without_end(path, folder, monkeypatch):
    monkeypatch.setattr(cache_folder, "PATIENCE", 0.1)
    with CacheFolder(path).making("a"), folder.making("a"):
        folder.write("a", DATA)
    assert folder.read("a") == DATA
