"""Errors in the words of the command line: the library names arguments of Python, a command its options."""

from collections.abc import Mapping
from types import MappingProxyType

from mjnav.errors import InvalidValue, MjnavError, UntrustedCode

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
