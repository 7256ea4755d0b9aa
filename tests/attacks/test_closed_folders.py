"""Every command that writes a file refuses, before it starts, a folder that it may not write to."""

import json
import subprocess
import sys

import pytest

from mjnav import load_scenario, run

CALLS = """
    run hall --log closed/a.mcap
    rate-test hall --log closed/a.mcap
    surface crossing1 --at 1 -o closed/a.png
    calibrate hall --seeds 1 -o closed/a.png
    export whole.mcap --format csv closed/out
    export whole.mcap --format rosbag2 closed/out
    recover whole.mcap closed/a.mcap
    report whole.mcap -o closed/a.html
    render whole.mcap -o closed/a.png
    render whole.mcap -o closed/a.mp4
    sweep crossings --seeds 1 -o closed/out
    paper --quick -o closed/out
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


def test_every_command_that_writes_refuses_a_closed_folder_in_one_line(bound_by_permissions, tmp_path):
    pytest.importorskip("pyarrow", reason="the sweep extra is not installed")
    run(load_scenario("crossing1", ["time_limit=0.3"]), log=tmp_path / "whole.mcap")
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    calls = [line.split() for line in CALLS.strip().splitlines()]
    done = subprocess.run(
        [*bound_by_permissions, sys.executable, "-c", RUN_ALL],
        input=json.dumps(calls),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    for words, (code, err) in zip(calls, json.loads(done.stdout), strict=True):
        (line,) = [line for line in err.splitlines() if "compiling" not in line]
        assert code == 2, words
        assert line.startswith("mjnav: closed/"), words
        assert line.endswith(("not writable", "Permission denied")), words
    assert not any(closed.iterdir())
