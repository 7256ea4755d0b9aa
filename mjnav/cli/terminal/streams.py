"""Standard output and standard error, to which every command writes printable text only."""

import codecs
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TextIO, cast
from unicodedata import name, normalize

from mjnav.printable import printable

if TYPE_CHECKING:
    from rich.console import Console

# What stands for a character that a stream cannot hold, beside the letters and digits that a character is made of and
# the names of Greek letters. No quotation mark and no backslash, which JSON would read.
STAND_INS: Mapping[str, str] = MappingProxyType(
    {"×": "x", "≤": "<=", "≥": ">=", "±": "+-", "√": "sqrt", "−": "-", "–": "-", "°": "deg", "·": "*", "µ": "u"}
    | {"’": "'", "“": "'", "”": "'", "█": "#", "■": "#"}
)
HANDLER = "mjnav.stand_in"  # its name among Python's handlers of encoding errors


def _stand_in(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_ascii, error.object[error.start : error.end])), error.end


def _ascii(character: str) -> str:
    script, _, letter = name(character, "").partition(" LETTER ")
    if script.startswith("GREEK"):
        return letter.lower()
    plain = STAND_INS.get(character) or normalize("NFKD", character)
    return plain.encode("ascii", "ignore").decode() or "?"


codecs.register_error(HANDLER, _stand_in)


def readable_output() -> None:
    """Makes standard output and standard error replace what their encoding cannot hold, for this process's life."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            cast(Any, stream).reconfigure(errors=HANDLER)


def as_held(text: str) -> str:
    """The text as standard output will hold it."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    return printable(text, keep="\n\t").encode(encoding, HANDLER).decode(encoding)


def on_terminal() -> bool:
    """Whether standard output is one."""
    return sys.stdout is not None and sys.stdout.isatty()


class _PlainStream:
    """A text stream that writes printable text to the stream below it."""

    def __init__(self, stream: TextIO):
        self.below = stream

    def write(self, text: str) -> int:
        """Writes the text made printable; returns the number of characters given."""
        self.below.write(printable(text, keep="\n\t"))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.below, name)


@contextmanager
def plain_output() -> Iterator[None]:
    """Makes everything that is written to standard output and standard error printable."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (stream and cast(TextIO, _PlainStream(stream)) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


class _QuietStream:
    """A stream that takes messages, and shows no progress because it is no terminal."""

    def __init__(self, stream: TextIO):
        self.below = stream

    def isatty(self) -> bool:
        """Never."""
        return False

    def __getattr__(self, name: str) -> Any:
        return getattr(self.below, name)


@contextmanager
def quiet_output() -> Iterator[None]:
    """Drops standard output and shows no progress; messages on standard error stay."""
    before = sys.stdout, sys.stderr
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        sys.stdout, sys.stderr = nowhere, before[1] and cast(TextIO, _QuietStream(before[1]))
        try:
            yield
        finally:
            sys.stdout, sys.stderr = before


def console(*, stderr: bool = False, width: int | None = None) -> "Console":
    """A rich console that prints printable text without markup; `width` is used where there is no terminal."""
    from rich.console import Console
    from rich.segment import Segment

    class PlainConsole(Console):
        def on_broken_pipe(self) -> None:
            raise  # BrokenPipeError: rich itself would exit with 1

        def render(self, renderable: Any, options: Any = None) -> Iterator[Segment]:
            for text, style, control in super().render(renderable, options):
                yield Segment(text if control else printable(text, keep="\n\t"), style, control)

    stream = sys.stderr if stderr else sys.stdout
    below = stream.below if isinstance(stream, _PlainStream) else stream
    on_terminal = below is not None and below.isatty()
    return PlainConsole(file=below, width=None if on_terminal else width, highlight=False, markup=False, emoji=False)


def show(styled: str) -> None:
    """Prints what a `console` captured."""
    stream = sys.stdout
    print(styled, end="", file=stream.below if isinstance(stream, _PlainStream) else stream)
