"""An export of any format is there whole or not at all, and replaces nothing."""

import pytest
from mcap.writer import Writer
from rosbags.rosbag2 import Reader

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


def test_evos_error_of_a_bag_is_the_result(driven, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))  # where evo keeps its settings
    from evo.core import metrics, sync
    from evo.tools import file_interface

    export(driven, "rosbag2", tmp_path / "bag")
    with Reader(tmp_path / "bag") as reader:
        topics = ("/robot/truth", "/robot/estimate")
        both = [file_interface.read_bag_trajectory(reader, topic) for topic in topics]
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data(sync.associate_trajectories(*both))
    rmse = error.get_statistic(metrics.StatisticsType.rmse)
    assert rmse == pytest.approx(driven.result["localization_rmse_m"], abs=1e-12)
