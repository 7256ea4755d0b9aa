"""What a command says on standard error while its user waits."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

COMPILE_NOTICE = 2.0  # [s] of silence before we say what takes so long


@contextmanager
def progress(name: str, total: float, unit: str = "s") -> Iterator[Callable[[float], None]]:
    """Shows what is done of a total, simulated time or a count of `unit`, on a terminal only."""
    if not sys.stderr.isatty():
        yield lambda so_far: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    done = "{task.completed:.1f}" if unit == "s" else "{task.completed:.0f}"
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn(f"{done} of {{task.total:.0f}} {unit}"))
    with Progress(*columns, console=Console(stderr=True), refresh_per_second=5, transient=True) as bar:
        bar.add_task(name, total=total)
        (task,) = bar.tasks
        # Not bar.update: it waits for the thread that draws, and the caller may be in the middle of a tick.
        yield lambda so_far: setattr(task, "completed", so_far)


@contextmanager
def compile_notice() -> Iterator[None]:
    """Says that kernels are being compiled, if it takes long enough to wonder."""
    text = "mjnav: compiling for this machine; later runs start at once"
    timer = threading.Timer(COMPILE_NOTICE, print, (text,), {"file": sys.stderr})
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
