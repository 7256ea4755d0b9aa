"""Standard output and standard error that are not UTF-8: what they cannot hold is replaced, by every command."""

import json
import os
import pty
import subprocess
import sys

import pytest

from mjnav.cli.main import COMMANDS
from mjnav.cli.terminal.streams import HANDLER
from tests.cli.test_compare_command import fill

ENVIRONMENTS = (
    {"PYTHONIOENCODING": "ascii"},
    {"PYTHONIOENCODING": "latin-1"},
    {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
)
RUN = "run ./gäng×.toml --set physics.engine=kinematic --set time_limit=0.5"
WORDS = [
    *(f"{command} --help" for command in COMMANDS),
    *("list", "list --json", "show ./gäng×.toml --seed 3", "keys", "keys --json", "schema run", "completion zsh"),
    *(f"{RUN} --log gäng×.mcap", f"{RUN} --no-log --json", "inspect gäng×.mcap", "inspect gäng×.mcap --json"),
    *("report gäng×.mcap", "compare crossings", "compare crossings --json"),
]
# One process for all commands, each as `start` runs it in a child.
PROGRAM = """
import sys
from mjnav.cli.main import main
from mjnav.cli.terminal.streams import readable_output
readable_output()
for words in sys.argv[1:]:
    try:
        code = main(words.split())
    except SystemExit as ended:
        code = ended.code
    sys.stdout.flush()
    assert code == 0, words
"""


@pytest.fixture
def folder(tmp_path, mjnav):
    (tmp_path / "gäng×.toml").write_text(mjnav("show", "crossing1").out.replace('name = "', 'name = "λ × '))
    fill(tmp_path / "runs/out/crossings", study="crossings")
    return tmp_path


@pytest.mark.parametrize(
    "environment",
    [ENVIRONMENTS[0], *(pytest.param(environment, marks=pytest.mark.nightly) for environment in ENVIRONMENTS[1:])],
    ids=lambda environment: "-".join(environment.values()),
)
def test_every_command_prints_on_a_stream_that_is_not_utf_8(folder, environment):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *WORDS], cwd=folder, env={**os.environ, **environment}, capture_output=True
    )
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr.decode(errors="replace")[-2000:]
    encoding = environment.get("PYTHONIOENCODING", "ascii")
    out = done.stdout.decode(encoding)
    assert ("x real time" in out, "× real time" in out) == (encoding == "ascii", encoding != "ascii")
    for line in out.splitlines():
        if line.startswith('{"'):
            json.loads(line)


def test_a_program_whose_output_is_ascii_runs_on_a_terminal_and_tells_of_its_end(folder):
    terminal, other = pty.openpty()
    words = [sys.executable, "-m", "mjnav.cli.main", *RUN.split(), "--no-log", "--require", "success==1"]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "COLUMNS": "60"}
    with subprocess.Popen(words, cwd=folder, env=environment, stdout=other, stderr=other) as process:
        os.close(other)
        shown = b""
        with open(terminal, "rb", buffering=0) as read:
            try:
                while more := read.read(1 << 16):
                    shown += more
            except OSError:  # the other end is closed
                pass
    assert process.returncode == 1
    assert b"lamda x crossing1, rkhs, seed 0: timeout" in shown
    assert b"Traceback" not in shown
    assert shown.isascii()


def test_what_stands_for_a_character_is_readable_and_no_syntax_of_json():
    assert "R² ≤ 3 × Δω – “é” \N{SNOWMAN}".encode("ascii", HANDLER) == b"R2 <= 3 x deltaomega - 'e' ?"
    assert "3 × ≤ ²".encode("latin-1", HANDLER) == "3 × <= ²".encode("latin-1")
