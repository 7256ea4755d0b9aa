"""An export of any format is there whole or not at all, and replaces nothing."""

import os

import pytest
from mcap.writer import Writer

from mjnav.errors import DamagedLogError, InputError, MjnavError
from mjnav.log import open_log
from mjnav.log.export.export import FORMATS, check_new_folder, export


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("error", [KeyboardInterrupt, MjnavError])
def test_an_export_that_is_interrupted_leaves_nothing(recorded, tmp_path, form, error):
    def interrupted(time):
        if time > 0.35:
            raise error

    with pytest.raises(error):
        export(open_log(recorded), form, tmp_path / "out", progress=interrupted)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("form", FORMATS)
def test_a_foreign_message_is_an_error_of_one_line_and_leaves_nothing(recorded, tmp_path, form):
    whole, path = open_log(recorded), tmp_path / "strange.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("mjnav/run", dict(whole.run or {}))
        writer.add_attachment(0, 0, "scenario.toml", "application/toml", whole.attachments["scenario.toml"])
        channel = writer.register_channel("/robot/state", "json", 0)
        writer.add_message(channel, 0, b'{"tick": 0, "place": [1, 2, 3]}', 0)
        writer.finish()
    with pytest.raises(DamagedLogError, match=r"holds a message that is not one of mjnav's \(KeyError\('\w+'\)\)$"):
        export(open_log(path), form, tmp_path / "out")
    assert list(tmp_path.iterdir()) == [path]


def test_an_empty_folder_is_filled(recorded, tmp_path):
    (tmp_path / "out").mkdir()
    export(open_log(recorded), "tum", tmp_path / "out")
    assert (tmp_path / "out" / "robot_truth.tum").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("kind", ["file", "full folder", "link to nothing"])
def test_an_existing_file_or_folder_is_kept(tmp_path, kind):
    path = tmp_path / "out"
    if kind == "file":
        path.write_text("mine")
    elif kind == "full folder":
        path.mkdir()
        (path / "mine").touch()
    else:
        path.symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="exists already"):
        check_new_folder(path)
    assert [found.name for found in tmp_path.iterdir()] == ["out"]


def test_a_folder_that_appears_during_the_export_is_kept(recorded, tmp_path):
    def interfere(time):
        (tmp_path / "out").mkdir(exist_ok=True)
        (tmp_path / "out" / "mine").touch()

    with pytest.raises(MjnavError, match="writing failed: Directory not empty"):
        export(open_log(recorded), "tum", tmp_path / "out", progress=interfere)
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "mine"]


def test_the_parent_folder_must_exist_and_be_writable(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        check_new_folder(tmp_path / "none" / "out")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="there is no folder"):
        check_new_folder(tmp_path / "file" / "out")
    if os.geteuid() != 0:  # to root everything is writable
        (tmp_path / "closed").mkdir(mode=0o555)
        with pytest.raises(InputError, match="not writable"):
            check_new_folder(tmp_path / "closed" / "out")
