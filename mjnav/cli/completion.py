"""`mjnav completion SHELL`: a script that completes command lines of mjnav.

shtab writes it, not argcomplete: its script is static, so pressing Tab starts no Python. The script therefore knows
the names of the moment at which it was written.
"""

import argparse
from collections.abc import Collection, Mapping
from shlex import join, quote
from typing import Any

SHELLS = ("bash", "zsh", "fish")  # of shtab's, those in which the script was tried
FILES = ("LOG", "PATH", "FILE", "OUT", "FILE.html", "FILE.toml", "OUT.png", "OUT.npz")  # metavars
FOLDERS = ("FOLDER",)


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help="bash, zsh or fish")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the script."""
    print(completion_script(arguments.shell))
    return 0


def completion_script(shell: str) -> str:
    """The script for bash, zsh or fish."""
    import shtab

    from mjnav.cli.main import COMMANDS, command_parser

    names, names_or_files = _names(), _names_or_files()
    parser, commands = command_parser(COMMANDS)
    for sub in commands.values():
        for action in sub._actions:
            metavar = str(action.metavar)
            key = next((key for key in (*action.option_strings, metavar) if key in names or key in names_or_files), "")
            if key in names:
                action.choices = names[key]
            elif key in names_or_files:
                action.complete = _function(names_or_files[key])  # type: ignore[attr-defined]
            elif "|" in metavar:
                action.choices = metavar.split("|")
            elif metavar in FILES + FOLDERS:
                action.complete = shtab.FILE if metavar in FILES else shtab.DIRECTORY  # type: ignore[attr-defined]
    return shtab.complete(parser, shell)


def _names() -> Mapping[str, Collection[str]]:
    """The values of options and arguments, by option or metavar."""
    from mjnav.metrics.summary import GROUPS
    from mjnav.paper import ITEMS
    from mjnav.study.compare.chosen_figures import SETS, numbers
    from mjnav.study.key_reference import kinds, names, run_keys

    return {
        "--topic": [*names("topics")],
        "--figure": [*SETS, *GROUPS, *numbers()],
        "--only": [*ITEMS],
        "KIND": [kind.replace(" ", "-") for kind in kinds()],
        "PREFIX": sorted({row.key for row in run_keys()}),
    }


def _names_or_files() -> Mapping[str, Collection[str]]:
    """The names where a file may stand, too, by option or metavar."""
    from mjnav.study.key_reference import names

    studies = [*names("studies")]
    return {"SCENE": [*names("scenes")], "STUDY": studies, "AFTER": studies, "--controller": [*names("controllers")]}


def _function(names: Collection[str]) -> Mapping[str, Any]:
    """What shtab takes: the name of a shell function that completes names and files, and its definition by shell."""
    import shtab

    function = f"_mjnav_file_{shtab.sha(tuple(names))}"  # where it finds _file, shtab makes bash end folders by a slash
    lines = {
        "bash": (f"{function}() {{", f'compgen -W {quote(" ".join(names))} -- "$1"', 'compgen -f -- "$1"', "}"),
        "zsh": (f"{function}() {{", f"compadd -- {join(names)}", "_files", "}"),
        "fish": (
            f"function {function}", f"printf '%s\\n' {join(names)}", "__fish_complete_path (commandline -ct)", "end"
        ),
    }  # fmt: skip
    preamble = {shell: "\n".join(words) for shell, words in lines.items()}
    return {"bash": function, "zsh": function, "fish": f"({function})", "preamble": preamble}
