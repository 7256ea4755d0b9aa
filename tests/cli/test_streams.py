"""Standard output and standard error that are not UTF-8: no command breaks on what they cannot hold."""

import json
import os
import subprocess
import sys

import pytest

from mjnav.cli.main import COMMANDS

RUN = "run ./gäng×.toml --set physics.engine=kinematic --set time_limit=0.5"
WORDS = [
    *(f"{command} --help" for command in COMMANDS),
    *("list", "show ./gäng×.toml --seed 3", "keys", "schema run", f"{RUN} --log gäng×.mcap", f"{RUN} --no-log --json"),
    *("inspect gäng×.mcap", "inspect gäng×.mcap --json", "report gäng×.mcap"),
]
# One process for all commands, each as `start` runs it in a child.
PROGRAM = """
import sys
from mjnav.cli.main import main
from mjnav.cli.terminal import readable_output
readable_output()
for words in sys.argv[1:]:
    try:
        code = main(words.split())
    except SystemExit as ended:
        code = ended.code
    sys.stdout.flush()
    assert code == 0, words
"""


@pytest.mark.parametrize(
    "environment", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}]
)
def test_every_command_prints_on_a_stream_that_is_not_utf_8(mjnav, tmp_path, environment):
    (tmp_path / "gäng×.toml").write_text(mjnav("show", "crossing1").out.replace('name = "', 'name = "λ × '))
    command = [sys.executable, "-c", PROGRAM, *WORDS]
    done = subprocess.run(command, cwd=tmp_path, env={**os.environ, **environment}, capture_output=True, check=False)
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr.decode(errors="replace")[-2000:]
    out = done.stdout.decode("ascii")
    assert "? real time" in out  # for ×
    assert all(json.loads(line) for line in out.splitlines() if line.startswith('{"'))
