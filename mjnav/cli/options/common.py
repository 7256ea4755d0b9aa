"""Options of nearly every command: -q and --traceback."""

import argparse
from collections.abc import Sequence

SAYING = ("list", "show", "keys", "schema", "completion")  # commands that only print: there is nothing to leave out


def configure(parser: argparse.ArgumentParser, command: str) -> None:
    """-q, where the command does more than print, and --traceback."""
    group = parser.add_argument_group("everywhere")
    if command not in SAYING:
        group.add_argument(
            "-q", "--quiet", action="store_true", help="print neither results nor progress; the exit code says"
        )
    group.add_argument("--traceback", action="store_true", help="where a fault came from, for code of your own")


def wants_traceback(words: Sequence[str]) -> bool:
    """Whether the words of a command line ask for it, also where they cannot be parsed."""
    return "--traceback" in words
