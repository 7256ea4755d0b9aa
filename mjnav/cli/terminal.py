"""Standard output and standard error, tables, progress, signals, and the process that watches a command.

Every command writes printable text only. A table is as wide as the terminal, and in a pipe has one line a row.

The process that the user started watches a child process, which does the work of the command. A command ends in order
at the first signal. A process that ends by os._exit, a fault in compiled code or the kernel's out-of-memory killer
cannot report its end; its parent can. The child is forked before anything is loaded, so that Python need not start
again. The child has the terminal and the process group of its parent, gets from it the signals that were sent to the
parent alone, and ends with it.
"""

import argparse
import ctypes
import faulthandler
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from typing import TYPE_CHECKING, Any, TextIO, cast

from mjnav.loop.supervision import Heartbeat, describe_end, supervised
from mjnav.printable import printable

if TYPE_CHECKING:
    from rich.console import Console

# -------------------------------------------------------------------------------------------- streams


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


# ------------------------------------------------------------------------------ messages and progress


COMPILING = "numba:compile"  # numba's event; there is none for code from the cache


def tell(text: str) -> None:
    """Writes one line to standard error, if it is still open."""
    if sys.stderr is not None:
        with suppress(OSError):
            print(printable(f"mjnav: {text}", keep="\n\t"), file=sys.stderr, flush=True)


@contextmanager
def progress(name: str, total: float, unit: str = "s") -> Iterator[Callable[[float], None]]:
    """Shows a progress bar on a terminal; yields the function that gets the simulated time or the count of `unit`.

    A count is shown with its rate, and the time that is left.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda so_far: None
        return
    from rich.progress import BarColumn, Progress, TextColumn

    numbers = TextColumn(f"{{task.completed:.{int(unit == 's')}f}} of {{task.total:.0f}} {unit}{{task.fields[pace]}}")
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), numbers)
    with Progress(*columns, console=console(stderr=True), refresh_per_second=5, transient=True) as bar:
        bar.add_task(name, total=total, pace="")
        (task,) = bar.tasks
        first: list[float] = []

        def show(so_far: float) -> None:
            # Not bar.update: it waits for the thread that draws, and the caller may be in the middle of a tick.
            task.completed = so_far
            if unit in ("s", "%"):
                return
            first.extend([] if first else [so_far, time.monotonic()])
            if so_far > first[0]:
                task.fields["pace"] = f", {pace(so_far - first[0], total - so_far, time.monotonic() - first[1])}"

        yield show


def pace(done: float, left: float, seconds: float) -> str:
    """The rate, and how long the rest will take: 3.1 a second, 12 min left."""
    rate = done / max(seconds, 1e-9)
    rest = left / rate
    span = f"{rest:.0f} s" if rest < 100.0 else f"{rest / 60.0:.0f} min" if rest < 6000.0 else f"{rest / 3600.0:.1f} h"
    return f"{rate:.1f} a second, {span} left"


@contextmanager
def compile_notice() -> Iterator[None]:
    """Says that kernels are being compiled, at the first one; nothing where all come from the cache."""
    from numba.core import event

    class Notice(event.Listener):
        """One line, at the first kernel."""

        def __init__(self):
            self.told = False

        def on_start(self, event: event.Event) -> None:
            if not self.told:
                tell("compiling for this machine; later runs start at once")
            self.told = True

        def on_end(self, event: event.Event) -> None:
            """Others may follow."""

    with event.install_listener(COMPILING, Notice()):
        yield


# ------------------------------------------------------------------------------------ text and tables


PIPE_WIDTH = 10_000  # [characters] where there is no terminal: no line is broken
GAP = 2


def print_table(rows: Sequence[Sequence[str]], heads: Sequence[str] = (), *, numbers: Collection[int] = ()) -> None:
    """Prints a table, in which the columns `numbers` are flush right; on a terminal its cells wrap."""
    if not rows:
        return
    rows = [[printable(cell) for cell in row] for row in rows]
    heads = heads or [""] * len(rows[0])
    if not on_terminal():  # without rich, whose import and tables of hundreds of rows take longer than all else
        widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
        for row in [heads] * any(heads) + rows:
            cells = [f"{cell:{'>' if i in numbers else '<'}{widths[i]}}" for i, cell in enumerate(row)]
            print((" " * GAP).join(cells).rstrip())
        return
    from rich.table import Table

    table = Table(box=None, padding=(0, GAP, 0, 0), pad_edge=False, show_header=any(heads), header_style="bold")
    for i, head in enumerate(heads):
        table.add_column(head, justify="right" if i in numbers else "left", overflow="fold", no_wrap=i in (0, *numbers))
    for row in rows:
        table.add_row(*row)
    print_drawn(lambda console: console.print(table))


def answer(arguments: argparse.Namespace, document: Mapping[str, Any], write: Callable[[], None]) -> None:
    """Prints a command's result: with --json the document, the number of its schema first; else as `write` does."""
    if arguments.json:
        print(json.dumps({"schema": 1, **document}))
    else:
        write()


def shown(value: Any, form: str) -> str:
    """A value of the form; "-" for None."""
    text = "-" if value is None else format(value, form)
    return text if text.strip("-0.") else text.removeprefix("-") or text  # no -0.00


def print_drawn(draw: Callable[["Console"], None]) -> None:
    """Prints what is drawn on a rich console, without blanks at the ends of lines."""
    wide, stream = console(width=PIPE_WIDTH), sys.stdout
    with wide.capture() as captured:  # rich itself would end the process where the reader has gone
        draw(wide)
    styled = "".join(f"{line.rstrip()}\n" for line in captured.get().splitlines())
    print(styled, end="", file=stream.below if isinstance(stream, _PlainStream) else stream)


# -------------------------------------------------------------------------------------------- signals


# [s] within which signals count as one: `timeout` sends two, and the process that guards a command passes on another
# one, late where the machine is busy.
AT_ONCE = 0.5
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # Ctrl-C, `kill`, and a terminal that is closed


@contextmanager
def interruptible(*, raising: bool = False) -> Iterator[Callable[[], bool]]:
    """Yields whether one of SIGNALS came, so that the command ends in order; a second one later ends the process.

    With `raising` the first one raises KeyboardInterrupt, for what does not ask.

    Signals that the process was started to ignore, as under nohup, stay ignored. The handler takes no lock, not even
    that of a threading.Event: a signal that comes while another one's handler holds it would wait for ever.
    """
    first: float | None = None

    def ask(number: int, frame: object) -> None:
        nonlocal first
        now = time.monotonic()
        if first is None:
            first = now
            if raising:
                raise KeyboardInterrupt
        elif now - first > AT_ONCE:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)

    heeded = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, ask) for number in heeded}
    try:
        yield lambda: first is not None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def stoppable(name: str, total: float, unit: str = "s") -> Iterator[Callable[[float], None]]:
    """Like `progress`; the function that it yields raises KeyboardInterrupt once one of SIGNALS has come."""
    with interruptible() as asked, progress(name, total, unit) as show:

        def step(so_far: float) -> None:
            if asked():
                raise KeyboardInterrupt
            show(so_far)

        yield step


# ----------------------------------------------------------------------------------- parent and child


_BY_THE_KERNEL = 0x80  # si_code of what a terminal sends to the whole process group, the child too
_PR_SET_PDEATHSIG = 1  # from <sys/prctl.h>
_DONE = b"the command has ended in order\n"


class Guard:
    """The connection of a command to the process that watches it: a file for its last words."""

    def __init__(self, descriptor: int | None = None):
        self._descriptor = descriptor

    @contextmanager
    def episode(self, name: str, limit: float) -> Iterator[Heartbeat]:
        """Runs an episode of this name on the main thread, with a limit of wall time [s]."""
        with supervised(limit, lambda text: tell(f"{name} {text}"), self._descriptor) as heart:
            yield heart

    def done(self) -> None:
        """Reports that the command has ended in order, whatever its exit code is."""
        if self._descriptor is not None:
            os.write(self._descriptor, _DONE)


def guarded(command: Callable[[Guard], int]) -> int:
    """Runs the command in a child and returns its exit code. Call it with one thread, before anything is loaded."""
    words = os.memfd_create("last words")
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    heard = {*SIGNALS, signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, heard)
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
        faulthandler.enable(words, all_threads=False)  # type: ignore[arg-type] - a descriptor, as documented
        guard = Guard(words)
        try:
            with interruptible(raising=True):
                return command(guard)
        finally:
            guard.done()
    while True:
        got = signal.sigwaitinfo(heard)
        if got.si_signo in SIGNALS and got.si_code != _BY_THE_KERNEL:
            os.kill(child, got.si_signo)
        process, status = os.waitpid(child, os.WNOHANG)
        if process:
            return _ended(os.waitstatus_to_exitcode(status), words, before)


def _ended(code: int, words: int, before: Set[int]) -> int:
    """The exit code for a child that ended with `code`, after its last `words`."""
    if -code in SIGNALS:  # on request: as the parent process expects it
        signal.signal(-code, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.raise_signal(-code)
    if code >= 0 and os.pread(words, len(_DONE), max(0, os.fstat(words).st_size - len(_DONE))) == _DONE:
        return code
    tell(describe_end("the process ended in the middle of its work", code, words))
    return 1
