"""`mjnav completion`: the script completes command lines in a real shell."""

import subprocess

import pytest

from mjnav import control, scene
from mjnav.cli.main import COMMANDS
from mjnav.study.study_file import studies

FILES = ("mine.toml", "hall.mcap")
ASK = """
source ./script
while IFS= read -r line; do
  read -ra COMP_WORDS <<< "$line"
  [[ $line == *" " ]] && COMP_WORDS+=("")
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  _shtab_mjnav
  echo "${COMPREPLY[*]}"
done
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    from mjnav.cli.completion import completion_script

    folder = tmp_path_factory.mktemp("completion")
    (folder / "script").write_text(completion_script("bash"))
    for name in FILES:
        (folder / name).touch()
    return folder


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("mjnav ", {*COMMANDS}),
        ("mjnav run ", {*scene.names()}),
        ("mjnav run hall --no-log --controller m", {n for n in control.names() if n[0] == "m"}),
        ("mjnav run hall --overruns ", {"skip", "abort"}),
        ("mjnav sweep ", {*studies()}),
        ("mjnav report hall.mcap h", {"hall.mcap"}),
        ("mjnav map save h", {"hall.mcap"}),
        ("mjnav predict m", {"mine.toml"}),
        ("mjnav schema ", {"run", "study"}),
        ("mjnav keys robot.goal", {"robot.goal", "robot.goal_area", "robot.goal_tolerance"}),
        ("mjnav replay x.mcap --tr", {"--trust", "--traceback"}),
    ],
)
def test_bash_completes(folder, line, words):
    said = subprocess.run(
        ["bash", "-c", ASK], cwd=folder, input=line + "\n", capture_output=True, text=True, check=True
    )
    assert said.stderr == ""
    assert set(said.stdout.split()) == words


@pytest.mark.parametrize(("shell", "head"), [("zsh", "#compdef mjnav\n"), ("fish", "# AUTOMATICALLY GENERATED")])
def test_the_other_shells_get_the_same_names(mjnav, shell, head):
    said = mjnav("completion", shell)
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith(head)
    for name in (*COMMANDS, *scene.names(), *studies(), *control.names()):
        assert name in said.out
