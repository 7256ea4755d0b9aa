"""An export is there whole or not at all, and replaces nothing."""

import os

import pytest

from mjnav.errors import InputError, InvalidValue, MjnavError
from mjnav.recording import open_log
from mjnav.recording.export import FORMATS, check_format, export
from mjnav.recording.export.folder import new_folder


def test_an_empty_folder_may_be_filled(tmp_path):
    (tmp_path / "out").mkdir()
    with new_folder(tmp_path / "out") as folder:
        folder.mkdir()
        (folder / "a").write_text("whole")
    assert (tmp_path / "out" / "a").read_text() == "whole"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("kind", ["file", "full folder", "link to nothing"])
def test_what_is_there_stays(tmp_path, kind):
    path = tmp_path / "out"
    if kind == "file":
        path.write_text("mine")
    elif kind == "full folder":
        path.mkdir()
        (path / "mine").touch()
    else:
        path.symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="exists already"), new_folder(path):
        pytest.fail("it was begun")
    assert [found.name for found in tmp_path.iterdir()] == ["out"]


def test_a_folder_that_appears_meanwhile_stays(recorded, tmp_path):
    def interfere(time):
        (tmp_path / "out").mkdir(exist_ok=True)
        (tmp_path / "out" / "mine").touch()

    with pytest.raises(MjnavError, match="writing failed: Directory not empty"):
        export(open_log(recorded), "tum", tmp_path / "out", progress=interfere)
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "mine"]


def test_the_folder_around_it_must_be_there_and_take_it(tmp_path):
    with pytest.raises(InputError, match="there is no folder"), new_folder(tmp_path / "none" / "out"):
        pass
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="there is no folder"), new_folder(tmp_path / "file" / "out"):
        pass
    if os.geteuid() != 0:  # to root everything is writable
        (tmp_path / "closed").mkdir(mode=0o555)
        with pytest.raises(InputError, match="not writable"), new_folder(tmp_path / "closed" / "out"):
            pass


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("error", [KeyboardInterrupt, MjnavError])
def test_an_export_that_is_broken_off_leaves_nothing(recorded, tmp_path, form, error):
    def broken_off(time):
        if time > 0.35:
            raise error

    with pytest.raises(error):
        export(open_log(recorded), form, tmp_path / "out", progress=broken_off)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_told_in_one_line_and_leaves_nothing(recorded, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mjnav.recording.export.tum._poses", full)
    with pytest.raises(MjnavError, match=r"out: writing failed: No space left on device$"):
        export(open_log(recorded), "tum", tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_unknown_formats_and_topics_are_answered_with_the_nearest():
    with pytest.raises(InvalidValue) as error:
        check_format("rosbag")
    assert error.value.nearest == "rosbag2"
    with pytest.raises(InvalidValue) as error:
        check_format("csv", ["/people/estimat"])
    assert error.value.nearest == "/people/estimate"
