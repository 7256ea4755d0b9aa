"""An export is there whole or not at all, and replaces nothing."""

import os

import pytest

from mjnav.errors import InputError, MjnavError
from mjnav.recording import open_log
from mjnav.recording.export.export import export, new_folder


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
