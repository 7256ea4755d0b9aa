"""A log of an older format is read but for what has changed since; one of a later format is refused in a line."""

import pytest

from mjnav.cli.main import main
from mjnav.errors import InputError
from mjnav.log import Recorder, open_log
from mjnav.log.log_format import FORMAT_KEY
from mjnav.log.write import writer

WRITER = {"version.mjnav": "0.1.0", "git_revision": "07a3331", "scene": "made-up"}


@pytest.fixture
def written(tmp_path, scenario, made_up, monkeypatch):
    """Writes a log that says that it has this format, or None as those of format 1."""

    def write(log_format):
        key, value = (FORMAT_KEY, log_format) if log_format is not None else ("unused", "")
        monkeypatch.setattr(writer, "FORMAT_KEY", key)
        monkeypatch.setattr(writer, "FORMAT", value)
        with Recorder(tmp_path / "run.mcap", scenario, WRITER, "<mujoco/>") as recorder:
            for tick in range(3):
                recorder.write(made_up.record(tick))
            recorder.finish(made_up.truth(3), {"outcome": "goal"})
        return tmp_path / "run.mcap"

    return write


@pytest.mark.parametrize("command", [["inspect"], ["report"], ["export", "--format", "csv"]])
def test_candidates_of_format_1_are_told_with_the_version_that_reads_them(written, tmp_path, capsys, command):
    path, name = written(None), command[0]
    output = {"export": [str(tmp_path / "out")], "report": ["-o", str(tmp_path / "out.html")]}.get(name, [])
    assert main([*command, str(path), *output]) == 0
    said = (tmp_path / "out.html").read_text() if name == "report" else capsys.readouterr().out
    (line,) = [line for line in said.splitlines() if "a log of format 1" in line and "<script" not in line]
    assert "/candidates: drawn lines in a log of format 1, which mjnav 0.1.0 07a3331 reads" in line
    assert name != "export" or not (tmp_path / "out" / "candidates.csv").exists()


def test_all_else_of_format_1_is_read(written):
    log = open_log(written(None))
    assert (len(log.trajectory().command), list(log.messages("/candidates"))) == (3, [])
    assert {message.topic for message in log.messages()} == {
        name for name, topic in log.topics.items() if topic.messages and name != "/candidates"
    }


@pytest.mark.parametrize("later", ["3", "x" * 1000])
def test_a_later_format_is_refused_in_one_line(written, later):
    with pytest.raises(InputError, match=r"of log format '.{1,20}'; this version of mjnav reads 1 and 2$"):
        open_log(written(later))
