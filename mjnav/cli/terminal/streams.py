"""Standard output and standard error, to which every command writes printable text only."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import TYPE_CHECKING, Any, TextIO, cast

from mjnav.printable import printable

if TYPE_CHECKING:
    from rich.console import Console


def readable_output() -> None:
    """Makes both write a question mark for what their encoding cannot hold, for this process's life."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            cast(Any, stream).reconfigure(errors="replace")


def on_terminal() -> bool:
    """Whether standard output is one."""
    return sys.stdout is not None and sys.stdout.isatty()


class _PlainStream:
    """A text stream that writes printable text to the stream below it."""

    def __init__(self, stream: TextIO, *, terminal: bool = True):
        self.below, self._terminal = stream, terminal

    def write(self, text: str) -> int:
        """Writes the text made printable; returns the number of characters given."""
        self.below.write(printable(text, keep="\n\t"))
        return len(text)

    def isatty(self) -> bool:
        """Whether it is shown on a terminal; where it is not, there is no progress."""
        return self._terminal and self.below.isatty()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.below, name)


@contextmanager
def plain_output() -> Iterator[None]:
    """Makes everything that is written to standard output and standard error printable."""
    out, err = (stream and cast(TextIO, _PlainStream(stream)) for stream in (sys.stdout, sys.stderr))
    with redirect_stdout(out), redirect_stderr(err):
        yield


@contextmanager
def quiet_output() -> Iterator[None]:
    """Drops standard output and shows no progress; messages on standard error stay."""
    err = sys.stderr and cast(TextIO, _PlainStream(sys.stderr, terminal=False))
    with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stdout(nowhere), redirect_stderr(err):
        yield


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
