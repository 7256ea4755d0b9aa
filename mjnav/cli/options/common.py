"""Options of the command line: checks beyond the parser's, errors in the words of options, options of every command.

Checks that the parser cannot make raise InputError. The library's errors name arguments of Python; a command's errors
name its options instead. Nearly every command has -q and --traceback.
"""

import argparse
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from types import MappingProxyType

from mjnav.errors import InputError, InvalidValue, MjnavError, UntrustedCode

# --------------------------------------------------------------------------------------------- checks


def check_needs(option: str, needed: str, *, given: bool, met: bool) -> None:
    """An option that was given has what it needs: `--port needs --live`."""
    if given and not met:
        raise InputError(f"{option} needs {needed}")


def check_whole(option: str, value: int, low: int, high: int | None = None) -> None:
    """A whole number is in its range."""
    if value < low or (high is not None and value > high):
        allowed = f"a whole number >= {low}" if high is None else f"a whole number from {low} to {high}"
        raise InvalidValue(option, value, allowed)


# --------------------------------------------------------------------------------------------- errors


OPTIONS: Mapping[str, str] = MappingProxyType(
    {
        "controller": "--controller",
        "overrides": "--set",
        "seed": "--seed",
        "scenes": "--scene",
        "seeds": "--seeds",
        "scheduler": "--scheduler",
    }
)
_WITH = " with "  # between a file and the arguments that changed it


def in_options(error: MjnavError) -> MjnavError:
    """The error with options in place of arguments."""
    if isinstance(error, UntrustedCode):
        other = "--controller NAME" if error.other == "controller=NAME" else None
        return UntrustedCode(error.what, trust="--trust", other=other)
    if not isinstance(error, InvalidValue) or error.file is None:
        return error
    head, between, tail = error.file.rpartition(_WITH)
    words = tail.split(", ")
    if not all(word in OPTIONS for word in words) or (head and not between):
        return error
    return error.within(file=f"{head}{between}{', '.join(OPTIONS[word] for word in words)}")


def shows_options(command: str) -> str:
    """Where the options of a command are shown."""
    return f"`{command} --help` shows what it takes"


def unknown_words(parser: argparse.ArgumentParser, words: Sequence[str]) -> InputError:
    """The error for words that a command does not take, with what the first option among them may have meant."""
    option = next((word.partition("=")[0] for word in words if word.startswith("-")), None)
    if option is None:
        return InputError(f"{parser.prog} does not take {' '.join(words)!r}; {shows_options(parser.prog)}")
    nearest = get_close_matches(option.lower(), parser._option_string_actions, n=1) if len(option) > 2 else []
    instead = f"did you mean {nearest[0]}?" if nearest else shows_options(parser.prog)
    return InputError(f"{parser.prog} has no option {option}; {instead}")


# --------------------------------------------------------------------------- options of every command


SAYING = ("list", "show", "keys", "schema", "completion")  # commands that only print: there is nothing to leave out


def configure(parser: argparse.ArgumentParser, command: str) -> None:
    """-q, where the command does more than print, and --traceback."""
    group = parser.add_argument_group("everywhere")
    if command not in SAYING:
        group.add_argument(
            "-q", "--quiet", action="store_true", help="print neither results nor progress; the exit code says"
        )
    group.add_argument("--traceback", action="store_true", help="where a fault came from, for code of your own")
