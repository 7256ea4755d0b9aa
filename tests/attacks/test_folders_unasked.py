"""No command makes a folder that nobody asked for, and each refuses, before it starts, one that it may not write to."""

import json
import subprocess
import sys

import pytest

from mjnav.cli.main import main

SHORT = ("--set", "time_limit=0.2", "--controller", "mean")
CALLS = """
    run crossing1 --log new/a.mcap
    rate-test crossing1 --log new/a.mcap
    surface crossing1 --at 0 -o new/a.png
    render whole.mcap -o new/a.png
    render whole.mcap -o new/a.mp4
    report whole.mcap -o new/a.html
    recover whole.mcap new/a.mcap
    export whole.mcap new/a --format csv
"""
MORE = """
    compare crossings -o new/a.csv
"""
MAKING = """
    export whole.mcap --format rosbag2 new/out
    sweep crossings --seeds 1 -o new/out
    paper --quick -o new/out
"""
RUN_ALL = """
import contextlib, io, json, sys
from mjnav.cli.main import main
said = []
for words in json.load(sys.stdin):
    with contextlib.redirect_stderr(io.StringIO()) as err, contextlib.redirect_stdout(io.StringIO()):
        code = main(words)
    said.append((code, err.getvalue()))
json.dump(said, sys.stdout)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "crossing1", "--log", "whole.mcap", *SHORT]) == 0
    return tmp_path


def lines(text):
    return [words for line in text.splitlines() if (words := line.split())]


def test_a_folder_that_is_missing_is_named_before_anything_starts(folder, capsys):
    for words in lines(CALLS + MORE):
        capsys.readouterr()
        assert main(words) == 2, words
        said = capsys.readouterr()
        (line,) = said.err.splitlines()
        assert (said.out, line.partition(": there is no folder ")[2]) == ("", str(folder / "new")), words
        assert [path.name for path in folder.iterdir()] == ["whole.mcap"]


def test_every_command_that_writes_refuses_a_closed_folder_in_one_line(bound_by_permissions, folder):
    pytest.importorskip("pyarrow", reason="the sweep extra is not installed")
    closed, calls = folder / "new", lines(CALLS + MAKING)
    closed.mkdir(mode=0o500)
    command, asked = [*bound_by_permissions, sys.executable, "-c", RUN_ALL], json.dumps(calls)
    done = subprocess.run(command, input=asked, cwd=folder, check=True, capture_output=True, text=True)
    for words, (code, err) in zip(calls, json.loads(done.stdout), strict=True):
        (line,) = [line for line in err.splitlines() if "compiling" not in line]
        assert code == 2, words
        assert line.startswith("mjnav: new/"), words
        assert line.endswith(("not writable", "Permission denied")), words
    assert not any(closed.iterdir())


def test_the_default_folder_is_made_or_it_is_told_in_a_line_that_it_cannot_be(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").write_text("")
    assert main(["run", "crossing1", *SHORT]) == 2
    assert capsys.readouterr().err == "mjnav: runs/out: cannot be made: Not a directory\n"
    (tmp_path / "runs").unlink()
    assert main(["run", "crossing1", *SHORT]) == 0
    assert len(list(tmp_path.glob("runs/out/*.mcap"))) == 1
