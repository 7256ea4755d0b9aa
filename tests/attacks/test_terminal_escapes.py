"""No control character of a log, a run file, a file name or a user's error reaches a terminal or a table's reader."""

import csv
import json
import os
import pty
import subprocess
import sys
from pathlib import Path
from unicodedata import category

import pytest
from mcap.writer import Writer

import mjnav
from mjnav.log.export.export import neutral
from mjnav.printable import printable
from mjnav.scene import dumps, load

HOSTILE = "[red]\x1b]0;owned\x07\x1b[2J\x9b31m\u202eabc\u200b\u2066\x7f\x08"
SHORT = ("--set", "time_limit=0.3", "--set", "physics.engine=kinematic")
OWN = f"""
from mjnav.control.methods.mean import Mean

class Own(Mean):
    def decide(self, observation):
        raise ValueError({HOSTILE!r})
"""
# One process, as a terminal's and as a pipe's; each line is a command's words in JSON.
ALL = """
import json, sys
from mjnav.cli.main import main
if __name__ == "__main__":
    for line in {!r}:
        assert main(json.loads(line)) in (0, 1, 2, 3), line
        print("=" * 10)
"""


def forbidden(text: str) -> set[str]:
    return {c for c in text if c not in "\n\t" and category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Logs, run files, studies and file names that all hold what a terminal would heed."""
    folder = tmp_path_factory.mktemp("hostile")
    name = json.dumps(HOSTILE).replace("\\x7f", "\\\\u007f")
    text = dumps(load("crossing1")).replace('name = "crossing1"', 'name = "[red]a"')
    (folder / "a.toml").write_text(text)
    (folder / "named.toml").write_text(text.replace('"[red]a"', name))
    (folder / f"{HOSTILE}.toml").write_text(text)
    (folder / "bad.toml").write_text(text.replace("time_limit", name))
    (folder / "own_hostile.py").write_text(OWN)
    formula = '{ controller = "rkhs", name = "=1+1" }'
    methods = f'[{{ controller = "mean", name = {name} }}, {formula}, {{ controller = "own_hostile:Own" }}]'
    (folder / "study.toml").write_text(
        f'schema = 1\nname = "s"\nscenes = ["a.toml"]\nseeds = [0, 1]\nmethods = {methods}\n'
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        mjnav.run(mjnav.load_scenario("a.toml", ("time_limit=1",), controller="mean"), log="a.mcap")
    with open(folder / "b.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("mjnav/run", {"log_format": "2", HOSTILE: HOSTILE, "scene": HOSTILE, "controller": HOSTILE})
        schema = writer.register_schema(HOSTILE, "jsonschema", b"{}")
        writer.add_message(writer.register_channel(HOSTILE, "json", schema), 0, b"{}", 0)
        writer.add_metadata("mjnav/result", {"outcome": HOSTILE, HOSTILE: HOSTILE})
        writer.add_attachment(0, 0, HOSTILE, HOSTILE, b"")
        writer.finish()
    return folder


COMMANDS = [
    ["run", "a.toml", *SHORT, "--no-log"],
    ["run", "a.toml", *SHORT, "--no-log", "--json"],
    ["run", "a.toml", *SHORT, "--no-log", "--controller", "own_hostile:Own"],
    ["run", "bad.toml"],
    ["run", "named.toml"],
    ["run", f"{HOSTILE}.toml", "--set", f"{HOSTILE}=1"],
    ["run", f"{HOSTILE}"],
    ["run", "a.toml", "--log", f"{HOSTILE}/a.mcap"],
    ["run", "a.toml", f"--{HOSTILE}"],
    [HOSTILE],
    ["surface", "a.toml", "--at", "0", "--grid", "3", "-o", f"{HOSTILE.replace('/', '')}.png"],
    ["sweep", "study.toml", "--workers", "1", "-o", "rows", *SHORT],
    ["compare", "rows", "-o", "x.csv", "-o", "x.html", "-o", "x.tex"],
    ["compare", "rows", "--json"],
    ["compare", HOSTILE],
    *([command, log] for log in ("a.mcap", "b.mcap") for command in ("inspect", "replay")),
    *(["inspect", log, "--json"] for log in ("a.mcap", "b.mcap")),
    *(["report", log, "-o", "x.html"] for log in ("a.mcap", "b.mcap")),
    *(["render", log, "-o", "x.png"] for log in ("a.mcap", "b.mcap")),
    *(["export", log, f"{log}-csv", "--format", "csv"] for log in ("a.mcap", "b.mcap")),
    ["recover", "b.mcap", "c.mcap"],
]  # fmt: skip


def said(folder: Path, script: Path, commands: list[list[str]], *, terminal: bool) -> str:
    """All that a process says which runs these commands."""
    script.write_text(ALL.format([json.dumps(words) for words in commands]))
    command = [sys.executable, str(script)]
    if not terminal:
        done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        return done.stdout.decode()
    ours, theirs = pty.openpty()
    with subprocess.Popen(command, cwd=folder, stdout=theirs, stderr=subprocess.DEVNULL):
        os.close(theirs)
        found = b""
        while True:
            try:
                block = os.read(ours, 65536)
            except OSError:  # the process has ended
                break
            if not block:
                break
            found += block
    os.close(ours)
    return found.decode().replace("\r\n", "\n")


@pytest.fixture(scope="module")
def told(folder, tmp_path_factory):
    """All that the commands say into a pipe."""
    return said(folder, tmp_path_factory.mktemp("script") / "all", COMMANDS, terminal=False)


def test_no_control_character_comes_out_of_any_command(folder, told):
    assert told.count("=" * 10) == len(COMMANDS), told[-3000:]
    assert forbidden(told) == set()
    assert told.count("[red]") > 20  # no markup either
    for path in ("x.tex", "x.html"):
        assert forbidden((folder / path).read_text()) <= {"\u200b"}, path


def test_on_a_terminal_there_are_styles_alone(folder, tmp_path):
    commands = [["inspect", "b.mcap"], ["inspect", "a.mcap"], ["run", HOSTILE]]
    text = said(folder, tmp_path / "all", commands, terminal=True)
    assert "\x1b[1m" in text
    for style in ("\x1b[1m", "\x1b[0m"):
        text = text.replace(style, "")
    assert forbidden(text) == set()
    assert "[red]" in text


def test_plain_text_stays_as_it_is():
    text = "Δv ≤ 0.3 m/s, 東京, é \u00a0 × \t tab\n"
    assert printable(text, keep="\n\t") == text
    assert printable(f"a{HOSTILE}") == "a[red]�]0;owned��[2J�31m�abc����"
    assert printable("\ud800") == "�"


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t", "\r", "\n", "＝"])
def test_a_cell_of_a_table_is_no_formula(start):
    assert neutral(f"{start}cmd|' /C calc'!A0") == f"'{start}cmd|' /C calc'!A0"


@pytest.mark.parametrize("cell", [-1.5, -3, None, "-1.5", "+2", "-inf", "", "rkhs", "a=b", True])
def test_numbers_and_names_stay_what_they_are(cell):
    assert neutral(cell) is cell


def test_a_method_with_a_formula_s_name_is_none_in_the_table(folder, told):
    with open(folder / "x.csv", newline="") as file:
        assert "'=1+1" in {row["method"] for row in csv.DictReader(file)}
