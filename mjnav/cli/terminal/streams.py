"""The way of every line to a terminal: nothing in it moves the cursor, colours or turns the text around.

Names and messages come from logs, run files, file names and users' code, and any of them may hold anything. Width is
kept: each character that is not text becomes one replacement character.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO, cast
from unicodedata import category

if TYPE_CHECKING:
    from rich.console import Console

NOT_TEXT = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")  # controls, formats, lone surrogates, private, unknown, line ends


def plain(text: str) -> str:
    """Text of which only line breaks and tabs are not shown as themselves."""
    if text.isprintable():
        return text
    return "".join(c if c in "\n\t" or category(c) not in NOT_TEXT else "\N{REPLACEMENT CHARACTER}" for c in text)


class _PlainStream:
    """A text stream that takes `plain` text only; all else is the stream's below it."""

    def __init__(self, stream: TextIO):
        self.below = stream

    def write(self, text: str) -> int:
        """Writes what is left of the text; the number of characters that were given."""
        self.below.write(plain(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.below, name)


@contextmanager
def plain_output() -> Iterator[None]:
    """Standard output and standard error take plain text only, whoever writes to them."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (stream and cast(TextIO, _PlainStream(stream)) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def console(*, stderr: bool = False, width: int | None = None) -> "Console":
    """A console of rich's that styles plain text, and knows no markup; `width` where there is no terminal."""
    from rich.console import Console
    from rich.segment import Segment

    class PlainConsole(Console):
        def render(self, renderable: Any, options: Any = None) -> Iterator[Segment]:
            for text, style, control in super().render(renderable, options):
                yield Segment(text if control else plain(text), style, control)

    stream = sys.stderr if stderr else sys.stdout
    below = stream.below if isinstance(stream, _PlainStream) else stream
    on_terminal = below is not None and below.isatty()
    return PlainConsole(file=below, width=None if on_terminal else width, highlight=False, markup=False, emoji=False)


def show(styled: str) -> None:
    """Prints what a `console` captured."""
    stream = sys.stdout
    print(styled, end="", file=stream.below if isinstance(stream, _PlainStream) else stream)
