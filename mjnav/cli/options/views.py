"""--live and --view: how a run is looked at while it goes."""

import argparse
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from mjnav.cli.terminal.progress import tell
from mjnav.errors import InvalidValue
from mjnav.messages import TickRecord
from mjnav.recording.live import PORT, LiveServer
from mjnav.scenarios.spec import Scenario

MAX_REFUSED = 5  # reasons that are told


@dataclass(frozen=True, slots=True)
class Views:
    """What a run needs to be looked at."""

    live: LiveServer | None = None
    watch: Callable[[TickRecord], None] | None = None
    closed: Callable[[], bool] = lambda: False  # whether somebody closed the window


def configure(parser: argparse.ArgumentParser) -> None:
    """--live, --port, --allow-origin and --view."""
    parser.add_argument("--live", action="store_true", help="serve the run to Foxglove or Lichtblick while it goes")
    parser.add_argument("--port", type=int, metavar="N", help=f"of this machine, for --live; {PORT} by default, 0 any")
    parser.add_argument(
        "--allow-origin",
        action="append",
        metavar="ORIGIN",
        help="a web page that may connect, as https://viewer.example.org; Foxglove, Lichtblick and this machine's may",
    )
    parser.add_argument("--view", action="store_true", help="show the run in a window; closing it ends the run")


def looked_at(arguments: argparse.Namespace) -> bool:
    """Whether somebody wants to see the run while it goes."""
    return arguments.live or arguments.view


@contextmanager
def open_views(arguments: argparse.Namespace, scenario: Scenario) -> Iterator[Views]:
    """Opens what was asked for, and says where. Raises InputError where that cannot be."""
    if arguments.port is not None and not arguments.live:
        raise InvalidValue("--port", arguments.port, "nothing without --live")
    if arguments.allow_origin and not arguments.live:
        raise InvalidValue("--allow-origin", arguments.allow_origin[0], "nothing without --live")
    told: set[str] = set()

    def refused(reason: str) -> None:
        if reason not in told and len(told) < MAX_REFUSED:
            told.add(reason)
            tell(f"live: refused {reason}")

    with ExitStack() as stack:
        views = Views()
        if arguments.view:
            from mjnav.world.viewer import Viewer

            viewer = stack.enter_context(Viewer(scenario))
            views = Views(watch=lambda record: viewer.show(record.truth), closed=lambda: viewer.closed)
        if arguments.live:
            port = PORT if arguments.port is None else arguments.port
            try:
                origins = arguments.allow_origin or ()
                live = stack.enter_context(LiveServer(scenario, port=port, origins=origins, refused=refused))
            except InvalidValue as error:
                option = "--port" if error.key == "port" else "--allow-origin"
                raise InvalidValue(option, error.found, error.allowed) from None
            tell(f"live at {live.url}: in Foxglove or Lichtblick, open a Foxglove WebSocket connection to it")
            views = Views(live, views.watch, views.closed)
        yield views
