"""`mjnav completion SHELL`: a script that completes command lines of mjnav.

shtab writes it, not argcomplete: its script is static, so pressing Tab starts no Python. The script therefore knows
the names of the moment at which it was written.
"""

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from shlex import join, quote
from types import MappingProxyType
from typing import Any

SHELLS = ("bash", "zsh", "fish")  # of shtab's, those in which the script was tried


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

    parser, commands = command_parser(COMMANDS)
    for command, sub in commands.items():
        for action in sub._actions:
            _complete(command, action)
    return shtab.complete(parser, shell)


def _complete(command: str, action: argparse.Action) -> None:
    """Sets what the values of an option or argument are completed with, where the parser does not know it."""
    metavar = str(action.metavar)
    kind = next((key for key in (f"{command} {metavar}", *action.option_strings, metavar) if key in _VALUES), None)
    if kind is not None:
        names, patterns = _VALUES[kind]
        action.complete = _names_and_files(tuple(names()), patterns)  # type: ignore[attr-defined]
    elif "|" in metavar:
        action.choices = metavar.split("|")


def _scenes() -> Iterable[str]:
    from mjnav.scene import names

    return names()


def _studies() -> Iterable[str]:
    from mjnav.study.study_file import studies

    return studies()


def _controllers() -> Iterable[str]:
    from mjnav.study.key_reference import names

    return names("controllers")


def _kinds() -> Iterable[str]:
    from mjnav.study.key_reference import kinds

    return (kind.replace(" ", "-") for kind in kinds())


def _run_keys() -> Iterable[str]:
    from mjnav.study.key_reference import run_keys

    return sorted({row.key for row in run_keys()})


def _topics() -> Iterable[str]:
    from mjnav.study.key_reference import names

    return names("topics")


def _figures() -> Iterable[str]:
    from mjnav.metrics.summary import GROUPS
    from mjnav.study.compare.chosen_figures import SETS, numbers

    return (*SETS, *GROUPS, *numbers())


def _paper_items() -> Iterable[str]:
    from mjnav.paper import ITEMS

    return ITEMS


def _nothing() -> Iterable[str]:
    return ()


FILES, FOLDERS = "*", "*/"

# option, metavar, or command and metavar -> the names that it may have, and the pattern of its files
_VALUES: Mapping[str, tuple[Callable[[], Iterable[str]], str | None]] = MappingProxyType(
    {
        "show SCENE": (lambda: (*_scenes(), *_studies()), None),
        "SCENE": (_scenes, "*.toml"),
        "STUDY": (_studies, "*.toml"),
        "AFTER": (_studies, "*.toml"),
        "--controller": (_controllers, "*.py"),
        "--topic": (_topics, None),
        "--figure": (_figures, None),
        "--only": (_paper_items, None),
        "KIND": (_kinds, None),
        "PREFIX": (_run_keys, None),
        "avoidable LOG": (_studies, "*.mcap"),
        "LOG": (_nothing, "*.mcap"),
        "PATH": (_nothing, FILES),
        "FILE": (_nothing, FILES),
        "OUT": (_nothing, FILES),
        "FOLDER": (_nothing, FOLDERS),
        "FILE.html": (_nothing, "*.html"),
        "FILE.toml": (_nothing, "*.toml"),
        "OUT.png": (_nothing, "*.png"),
        "OUT.npz": (_nothing, "*.npz"),
    }
)


def _names_and_files(names: Sequence[str], pattern: str | None) -> Mapping[str, Any]:
    """What shtab takes: the name of a shell function that completes, and its definition, for each shell."""
    import shtab

    kind = "name" if pattern is None else "file"  # shtab makes bash end folders with a slash where it finds _file
    function = f"_mjnav_{kind}_{shtab.sha((names, pattern))}"
    return {
        "bash": function,
        "zsh": function,
        "fish": f"({function})",
        "preamble": {
            "bash": _function(f"{function}() {{", _bash_lines(names, pattern), "}"),
            "zsh": _function(f"{function}() {{", _zsh_lines(names, pattern), "}"),
            "fish": _function(f"function {function}", _fish_lines(names, pattern), "end"),
        },
    }


def _function(head: str, lines: Iterable[str], end: str) -> str:
    return "\n".join([head, *(f"  {line}" for line in lines), end])


def _bash_lines(names: Sequence[str], pattern: str | None) -> Iterable[str]:
    if names:
        yield f'compgen -W {quote(" ".join(names))} -- "$1"'
    if pattern == FILES:
        yield 'compgen -f -- "$1"'
    elif pattern is not None:
        if pattern != FOLDERS:
            yield f'compgen -f -X {quote(f"!{pattern}")} -- "$1"'
        yield 'compgen -d -- "$1"'


def _zsh_lines(names: Sequence[str], pattern: str | None) -> Iterable[str]:
    if names:
        yield f"compadd -- {join(names)}"
    if pattern == FOLDERS:
        yield "_files -/"
    elif pattern is not None:
        yield f"_files -g {quote(pattern)}"


def _fish_lines(names: Sequence[str], pattern: str | None) -> Iterable[str]:
    if names:
        yield f"printf '%s\\n' {join(names)}"
    if pattern == FOLDERS:
        yield "__fish_complete_directories (commandline -ct)"
    elif pattern == FILES:
        yield "__fish_complete_path (commandline -ct)"
    elif pattern is not None:
        yield f"__fish_complete_suffix {pattern.removeprefix('*')}"
