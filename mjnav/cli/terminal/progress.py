"""Messages and progress on standard error."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from mjnav.cli.terminal.streams import console
from mjnav.printable import printable

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
