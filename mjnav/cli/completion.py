"""`mjnav completion SHELL`: a script that completes command lines of mjnav.

shtab writes it, not argcomplete: its script is static, so pressing Tab starts no Python. The script therefore knows
the names of the moment at which it was written.
"""

import argparse
from collections.abc import Collection, Mapping

SHELLS = ("bash", "zsh", "fish")  # of shtab's, those in which the script was tried
FILES = (  # metavars
    *("LOG", "PATH", "FILE", "OUT", "FILE.html", "FILE.toml", "FILE.yaml", "FILE.csv", "OUT.png", "OUT.npz", "SOURCE"),
    *("LOG|SCENE", "NAME|PATH"),
)
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

    names = _names()
    parser, commands = command_parser(COMMANDS)
    for sub in commands.values():
        for action in sub._actions:
            metavar = str(action.metavar)
            key = next((key for key in (*action.option_strings, metavar) if key in names), None)
            if key is not None:
                action.choices = names[key]
            elif metavar in FILES + FOLDERS:
                action.complete = shtab.FILE if metavar in FILES else shtab.DIRECTORY  # type: ignore[attr-defined]
            elif "|" in metavar:
                action.choices = metavar.split("|")
    return shtab.complete(parser, shell)


def _names() -> Mapping[str, Collection[str]]:
    """The values of options and arguments, by option or metavar."""
    from mjnav.log.export.export import TOPICS
    from mjnav.metrics.summary import GROUPS
    from mjnav.paper import ITEMS
    from mjnav.study.compare.cell_rows import SETS, numbers
    from mjnav.study.key_reference import KINDS, run_keys
    from mjnav.study.key_reference import names as listed

    listed_studies = [*listed("studies")]
    return {
        "SCENE": [*listed("scenes")],
        "STUDY": listed_studies,
        "AFTER": listed_studies,
        "--controller": [*listed("controllers")],
        "--topic": [*TOPICS],
        "--figure": [*SETS, *GROUPS, *numbers()],
        "--only": [*ITEMS],
        "KIND": [kind.replace(" ", "-") for kind in KINDS],
        "PREFIX": sorted({row.key for row in run_keys()}),
    }
