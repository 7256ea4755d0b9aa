"""What a log or a folder of results names is not imported, and no file that it names is opened, by reading it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.writer import Writer

import mjnav
from mjnav.cli.main import main
from mjnav.errors import InputError
from mjnav.scene import dumps, load

MODULE = "from mjnav.control.methods.mean import Mean\n\nclass Own(Mean): ...\n"
STUDY = """
schema = 1
name = "paper-degree"
scenes = ["crossing1"]
seeds = [0]
methods = [{ controller = "from_a_log:Own" }]
"""
READ = (
    (0, "inspect a.mcap"),
    (0, "inspect a.mcap --json"),
    (0, "report a.mcap"),
    (0, "render a.mcap -o a.png --size 64x64"),
    (0, "render a.mcap -o a.mp4 --size 64x64 --fps 5"),
    (0, "export a.mcap csv --format csv"),
    (0, "export a.mcap bag --format rosbag2"),
    (0, "recover a.mcap b.mcap"),
    (2, "replay a.mcap"),
    (0, "compare paper/rows"),
    (0, "compare paper/rows -o x.csv -o x.html --json"),
    (0, "paper --draw --only degree -o paper"),
)
# The module could be imported: it lies on the path. Whatever looks for it ends the process.
ALL = """
import sys
sys.path.append({folder!r})

class Hook:
    def find_spec(self, name, path=None, target=None):
        if name == "from_a_log":
            raise SystemExit("somebody imports what the log names")

sys.meta_path.insert(0, Hook())
from mjnav.cli.main import main
for code, line in {commands!r}:
    assert main(line.split()) == code, line
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A log and rows of a sweep, both of a controller of somebody else's."""
    folder = tmp_path_factory.mktemp("logs")
    (folder / "from_a_log.py").write_text(MODULE)
    (folder / "study.toml").write_text(STUDY)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        short = ("--set", "time_limit=0.5")
        assert main(["run", "crossing1", "--controller", "from_a_log:Own", "--log", "a.mcap", *short]) == 0
        assert main(["sweep", "study.toml", "--workers", "1", "-o", "paper/rows", *short]) == 0
    return folder


def test_no_reading_command_imports_the_module_a_log_names(folder, tmp_path):
    script = tmp_path / "all"
    script.write_text(ALL.format(folder=str(folder), commands=READ))
    done = subprocess.run([sys.executable, script], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "its controller is 'from_a_log:Own', code that a replay imports and runs: --trust" in done.stderr


def test_open_log_reads_all_without_importing(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "from_a_log", None)  # an import would raise
    log = mjnav.open_log(folder / "a.mcap")
    assert log.scenario().control.method == "from_a_log:Own"
    assert len(log.trajectory().status) == 5
    with pytest.raises(InputError, match="trust=True"):
        mjnav.replay(log)


@pytest.mark.parametrize("attachment", ["scenario.toml", "replay.toml"])
def test_a_log_opens_no_file_that_it_names(tmp_path, attachment, monkeypatch):
    """A pipe would hang whoever opens it."""
    os.mkfifo(tmp_path / "trace.txt")
    text = dumps(load("crossing1")) + '\n[control.latency]\ntrace = "trace.txt"\n'
    path = with_attachments(tmp_path, {"scenario.toml": text, attachment: text})
    log = mjnav.open_log(path)
    for read in (lambda: log.scenario(attachment), lambda: mjnav.replay(log)):
        with pytest.raises(InputError, match=r"latency\.trace: found 'trace\.txt'; allowed: numbers"):
            read()
    monkeypatch.chdir(tmp_path)
    assert main(["inspect", str(path)]) == 0
    assert main(["report", str(path)]) == 2


def with_attachments(folder: Path, texts: dict[str, str]) -> Path:
    """A log without messages that has these attachments."""
    path = folder / "a.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("mjnav/run", {"seed": "0", "log_format": "2"})
        for name, text in texts.items():
            writer.add_attachment(0, 0, name, "application/toml", text.encode())
        writer.finish()
    return path
