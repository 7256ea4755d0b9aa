"""--live and --view: watching a run while it runs."""

import argparse
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from mjnav.cli.options.common import check_needs
from mjnav.cli.terminal.progress import tell
from mjnav.errors import InvalidValue
from mjnav.log.live import PORT, LiveServer
from mjnav.messages import TickRecord
from mjnav.scene.spec import Scenario

MAX_REFUSED = 5  # reasons that are reported


@dataclass(frozen=True, slots=True)
class Views:
    """The viewers of a run, as `mjnav.run` takes them."""

    live: LiveServer | None = None
    watch: Callable[[TickRecord], None] | None = None
    closed: Callable[[], bool] = lambda: False  # whether the window was closed


def configure(parser: argparse.ArgumentParser) -> None:
    """--live, --port, --allow-origin and --view."""
    parser.add_argument("--live", action="store_true", help="serve the run to Foxglove or Lichtblick while it runs")
    parser.add_argument("--port", type=int, metavar="N", help=f"port for --live; {PORT} by default, 0 for any free one")
    parser.add_argument(
        "--allow-origin",
        action="append",
        metavar="ORIGIN",
        help="a page that may connect, such as https://viewer.example.org; Foxglove, Lichtblick and local pages may",
    )
    parser.add_argument("--view", action="store_true", help="show the run in a window; closing it ends the run")


def looked_at(arguments: argparse.Namespace) -> bool:
    """Whether the run is watched, and therefore paced by default."""
    return arguments.live or arguments.view


@contextmanager
def open_views(arguments: argparse.Namespace, scenario: Scenario) -> Iterator[Views]:
    """Opens the viewers and says where they are. Raises InputError where one cannot be opened."""
    check_needs("--port", "--live", given=arguments.port is not None, met=arguments.live)
    check_needs("--allow-origin", "--live", given=bool(arguments.allow_origin), met=arguments.live)
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
