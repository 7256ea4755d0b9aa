"""What holds for an export of whatever format."""

import pytest
from mcap.writer import Writer

from mjnav.errors import DamagedLogError, InvalidValue, MjnavError
from mjnav.recording import open_log
from mjnav.recording.export.export import FORMATS, check_format, export


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


@pytest.mark.parametrize("form", FORMATS)
def test_a_strangers_message_is_told_in_one_line_and_leaves_nothing(recorded, tmp_path, form):
    whole, path = open_log(recorded), tmp_path / "strange.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("mjnav/run", dict(whole.run))
        writer.add_attachment(0, 0, "scenario.toml", "application/toml", whole.attachments["scenario.toml"])
        channel = writer.register_channel("/robot/state", "json", 0)
        writer.add_message(channel, 0, b'{"tick": 0, "place": [1, 2, 3]}', 0)
        writer.finish()
    with pytest.raises(DamagedLogError, match=r"holds a message that is not one of mjnav's \(KeyError\('\w+'\)\)$"):
        export(open_log(path), form, tmp_path / "out")
    assert list(tmp_path.iterdir()) == [path]


def test_a_topic_asked_for_twice_is_written_once(recorded, tmp_path):
    counts = export(open_log(recorded), "csv", tmp_path / "out", topics=["/tick", "/tick"])
    assert counts == {"tick.csv": 6}


def test_unknown_formats_and_topics_are_answered_with_the_nearest():
    with pytest.raises(InvalidValue) as error:
        check_format("rosbag")
    assert error.value.nearest == "rosbag2"
    with pytest.raises(InvalidValue) as error:
        check_format("csv", ["/people/estimat"])
    assert error.value.nearest == "/people/estimate"
