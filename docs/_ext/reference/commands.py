"""The command line: every command with its arguments and options, as its parser has them."""

import argparse
from collections.abc import Iterator
from importlib import import_module

from mjnav.cli.main import COMMANDS

from .markdown import escape


def markdown() -> str:
    """A section a command."""
    return "\n".join(line for name, (module, text) in COMMANDS.items() for line in _command(name, module, text))


def parser_of(name: str) -> argparse.ArgumentParser:
    """The parser of a command."""
    parser = argparse.ArgumentParser(prog=f"mjnav {name}")
    import_module(COMMANDS[name][0]).configure(parser)
    return parser


def _command(name: str, module: str, text: str) -> Iterator[str]:
    parser = parser_of(name)
    yield f"## `mjnav {name}`\n\n{text[0].upper()}{text[1:]}.\n"
    yield f"```text\n{parser.format_usage().removeprefix('usage: ').strip()}\n```\n"
    for action in parser._actions:
        if action.help != argparse.SUPPRESS and action.dest != "help":
            yield f"{_term(action)}\n: {_sentence(action)}\n"


def _term(action: argparse.Action) -> str:
    """`-o OUT`, `--output OUT`, or the name of an argument."""
    value = _value(action)
    if not action.option_strings:
        return f"`{value}`"
    return ", ".join(f"`{option} {value}`" if value else f"`{option}`" for option in action.option_strings)


def _value(action: argparse.Action) -> str:
    if action.nargs == 0:
        return ""
    if isinstance(action.metavar, tuple):
        return " ".join(action.metavar)
    name = action.metavar
    if name is None:
        name = "|".join(map(str, action.choices)) if action.choices else action.dest
        name = name if not action.option_strings or action.choices else name.upper()
    return f"{name} ..." if action.nargs in ("+", "*") else name


def _sentence(action: argparse.Action) -> str:
    text = (action.help or "") % {**vars(action), "prog": "mjnav"}
    return escape(text) or "(no description)"
