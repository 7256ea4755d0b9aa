"""A folder of downloads runs nothing: no command takes a module from the working folder but the one that it is told."""

import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

pytestmark = pytest.mark.xdist_group("real time")

SCRIPTS = Path(sysconfig.get_path("scripts"))
IMPORTS = re.compile(
    rb"^[ \t]*(?:import|from)[ \t]+(\w+)|import_module\(\s*[\"'](\w+)|^[ \t]*import .*, *(\w+)", re.MULTILINE
)
OWN = "from mjnav.control.methods.mean import Mean\n\nclass Own(Mean): ...\n"
STUDY = 'schema = 1\nname = "tiny"\nscenes = ["crossing1"]\nseeds = [0, 1]\nmethods = [{ controller = "my_own:Own" }]\n'
SHORT = "--set time_limit=0.3 --set physics.engine=kinematic"
COMMANDS = (
    "list",
    f"run crossing1 {SHORT} --log a.mcap --profile",
    f"run crossing1 {SHORT} --live --port 0 --no-real-time --no-log",
    "rate-test crossing1 --rate 20 --duration 0.5 --stress",
    "surface crossing1 --at 0.1 --grid 5 -o s.png",
    f"sweep tiny.toml {SHORT} --workers 1 -o out-rows",
    "compare out-rows -o x.csv -o x.tex -o x.html",
    "paper --draw --only degree -o out-paper",
    "render a.mcap -o a.png --size 64x64",
    "render a.mcap -o a.mp4 --size 64x64 --fps 5",
    "report a.mcap",
    "replay a.mcap",
    "inspect a.mcap",
    "recover a.mcap b.mcap",
    "export a.mcap out-csv --format csv",
    "export a.mcap out-bag --format rosbag2",
)
# As the console script, but for one command after another: its folder is on the path, the working folder is not.
ALL = """
from mjnav.cli.main import main
if __name__ == "__main__":
    for line in {!r}:
        assert main(line.split()) in (0, 1), line
"""


def imported_names() -> set[str]:
    """What mjnav, the standard library and whatever is installed beside them import, or try to."""
    found = {name.encode() for name in sys.stdlib_module_names}
    for path in (*Path(sysconfig.get_path("purelib")).rglob("*.py"), *Path(__file__).parents[2].glob("mjnav/**/*.py")):
        found.update(name for names in IMPORTS.findall(path.read_bytes()) for name in names if name)
    return {text for name in found if (text := name.decode("utf-8", "ignore")).isidentifier()}


def environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONSAFEPATH", "PYTHONPATH")}


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A folder in which every name that anything imports is a module that says so in a file."""
    folder = tmp_path_factory.mktemp("downloads")
    for number, name in enumerate(sorted(imported_names())):
        path = folder / f"{name}.py" if number % 2 else folder / name / "__init__.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"open({str(folder / 'ran')!r}, 'a').write({name!r} + '\\n')\n")
    (folder / "tiny.toml").write_text(STUDY)
    (folder / "my_own.py").write_text(OWN)
    return folder


def ran(folder: Path) -> list[str]:
    path = folder / "ran"
    return sorted(set(path.read_text().split())) if path.exists() else []


def test_no_command_runs_what_lies_in_the_working_folder(hostile, tmp_path):
    script = tmp_path / "all"
    script.write_text(ALL.format(COMMANDS))
    done = subprocess.run(
        [sys.executable, script],
        cwd=hostile,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert (done.returncode, ran(hostile)) == (0, []), done.stderr


def test_the_console_script_runs_nothing_either(hostile):
    lies = {path.stem for path in hostile.iterdir()}
    assert {"numpy", "json", "coverage", "compression", "ctypes", "mcap", "mjnav"} <= lies
    done = subprocess.run([SCRIPTS / "mjnav", "list"], cwd=hostile, env=environment(), capture_output=True, check=False)
    assert (done.returncode, ran(hostile)) == (0, []), done.stderr
