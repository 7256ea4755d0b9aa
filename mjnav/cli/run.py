"""`mjnav run SCENE`: one episode."""

import argparse
import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjnav.cli import options
from mjnav.cli.import_file import tell_left_out
from mjnav.cli.main import INTERRUPTED
from mjnav.cli.terminal import compile_notice, interruptible, progress, shown, tell
from mjnav.errors import unknown_name
from mjnav.log.live import PORT, LiveServer
from mjnav.log.log_format import check_path
from mjnav.loop.pacer import POLICIES, profile_table
from mjnav.loop.prepare import episode_label, load_scenario
from mjnav.loop.supervision import MAX_SECONDS, RunFault
from mjnav.messages import TickRecord
from mjnav.scene.floor_import import WORLDS, floor_tables
from mjnav.scene.spec import Scenario

if TYPE_CHECKING:
    from mjnav.loop.result import Result

MAX_REFUSED = 5  # reasons for which --live refused a client that are reported


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    options.run(parser)
    parser.add_argument(
        "--real-time",
        action=argparse.BooleanOptionalAction,
        help="pace the loop by the wall clock, where the process may under SCHED_FIFO on one CPU with locked memory, "
        "which one line says; the default with --live and --view",
    )
    parser.add_argument(
        "--overruns",
        metavar="skip|abort",
        help="at a missed deadline, skip periods (the default) or abort the run with exit code 1",
    )
    parser.add_argument("--live", action="store_true", help="serve the run to Foxglove or Lichtblick while it runs")
    parser.add_argument("--port", type=int, metavar="N", help=f"port for --live; {PORT} by default, 0 for any free one")
    parser.add_argument(
        "--allow-origin",
        action="append",
        dest="origin",
        metavar="ORIGIN",
        help="a page that may connect, such as https://viewer.example.org; Foxglove, Lichtblick and local pages may",
    )
    parser.add_argument("--view", action="store_true", help="show the run in a window; closing it ends the run")
    log = parser.add_mutually_exclusive_group()
    log.add_argument("--log", "-o", "--output", metavar="PATH", help="where the log goes; runs/out/ by default")
    log.add_argument("--no-log", action="store_true", help="write no log")
    options.max_seconds(parser)
    options.require(parser, "success==1")
    parser.add_argument("--profile", action="store_true", help="print how long the parts of a tick take")
    parser.add_argument(
        "--detour", action="store_true", help="also run the people without the robot: what it adds to their ways"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Runs the episode and prints how it went."""
    overruns = arguments.overruns
    if overruns is not None and overruns not in POLICIES:
        raise unknown_name("--overruns", overruns, POLICIES)
    real_time = (arguments.live or arguments.view) if arguments.real_time is None else arguments.real_time
    options.check_needs("--overruns", "--real-time, --live or --view", given=overruns is not None, met=real_time)
    if arguments.log is not None:
        check_path(arguments.log)
    if arguments.scene.endswith(WORLDS):
        tell_left_out(floor_tables(arguments.scene, Path())[1])
    scenario = load_scenario(arguments.scene, arguments.overrides, controller=arguments.controller, seed=arguments.seed)
    required = options.required_of_run(arguments, scenario)
    max_seconds = arguments.max_seconds or MAX_SECONDS + (scenario.time_limit if real_time else 0.0)
    from mjnav.loop.events import warnings_of
    from mjnav.loop.run import run, warm_up

    for warning in warnings_of(scenario):
        tell(warning.text)
    with ExitStack() as stack:
        live, watch, closed = stack.enter_context(_views(arguments, scenario))
        heart = stack.enter_context(arguments.guard.episode(episode_label(scenario), max_seconds))
        with compile_notice():
            warm_up(scenario)
        interrupted = stack.enter_context(interruptible())
        show = stack.enter_context(progress(scenario.name, scenario.time_limit))
        fault = None

        def show_progress(time: float) -> None:
            heart(time)
            show(time)

        try:
            result = run(
                scenario,
                real_time=real_time,
                overruns=overruns or POLICIES[0],
                log=None if arguments.no_log else True if arguments.log is None else arguments.log,
                stop=lambda: interrupted() or closed(),
                progress=show_progress,
                watch=watch,
                live=live,
                profile=arguments.profile,
                detour=arguments.detour,
                warmed_up=True,
                tell=tell,
            )
        except RunFault as error:
            if error.result is None:
                raise
            result, fault = error.result, error
    answers = options.answers_of_run(required, result.summary)
    if arguments.json:
        print(json.dumps({**result.summary, **options.answers_document(answers)}))
    else:
        print(*describe(result), sep="\n")
        if result.profile is not None:
            print(f"\n{profile_table(result.profile)}")
    for text in result.metrics.faults:
        tell(text)
    if fault is not None:
        raise fault
    if interrupted():
        tell(f"interrupted: {_ending(result.summary)}")
        return INTERRUPTED
    if overruns == "abort" and result.summary["deadline_misses"]:
        tell(f"a deadline was missed: {_ending(result.summary)}")
        return 1
    return options.exit_code(answers)


def _ending(summary: dict[str, Any]) -> str:
    """How a run ended, and where its log is, in one line."""
    place = f"; the log is {summary['log']}" if summary["log"] else ""
    return f"{summary['outcome']} after {summary['time_s']:.1f} s, {summary['ticks']} ticks{place}"


Views = tuple[LiveServer | None, Callable[[TickRecord], None] | None, Callable[[], bool]]


@contextmanager
def _views(arguments: argparse.Namespace, scenario: Scenario) -> Iterator[Views]:
    """Opens the viewers as `mjnav.run` takes them, and says where they are; whether the window was closed.

    Raises InputError where one cannot be opened.
    """
    options.check_needs("--port", "--live", given=arguments.port is not None, met=arguments.live)
    options.check_needs("--allow-origin", "--live", given=bool(arguments.origin), met=arguments.live)
    told: set[str] = set()

    def refused(reason: str) -> None:
        if reason not in told and len(told) < MAX_REFUSED:
            told.add(reason)
            tell(f"live: refused {reason}")

    live, watch, closed = None, None, lambda: False
    with ExitStack() as stack:
        if arguments.view:
            from mjnav.world.viewer import Viewer

            viewer = stack.enter_context(Viewer(scenario))
            watch, closed = lambda record: viewer.show(record.truth), lambda: viewer.closed
        if arguments.live:
            port = PORT if arguments.port is None else arguments.port
            origins = arguments.origin or ()
            live = stack.enter_context(LiveServer(scenario, port=port, origins=origins, refused=refused))
            tell(f"live at {live.url}: in Foxglove or Lichtblick, open a Foxglove WebSocket connection to it")
        yield live, watch, closed


def describe(result: "Result") -> Iterator[str]:
    """How a run went, for people, a line a subject."""
    s = result.summary
    compute, detour = s["compute_ms"], s["detour"]
    collisions = ", ".join(f"{n} × {kind}" for kind, n in s["collisions"].items() if n) or "none"
    if s["collisions"]["person"]:
        collisions += f"; {s['robot_at_fault']} by the robot's fault, {s['collisions_at_rest']} while it stood"
    yield f"{s['scene']}, {s['controller']}, seed {s['seed']}: {s['outcome']} after {shown(s['time_s'], '.1f')} s"
    yield f"  collisions      {collisions}"
    if s["lane_violation_s"]:
        yield f"  outside lanes   {s['lane_violation_s']:.1f} s"
    yield f"  min clearance   {shown(s['min_clearance_m'], '.2f')} m"
    if s["people_see_robot"] is not None:
        share = None if s["personal_space_share"] is None else 100.0 * s["personal_space_share"]
        yield (
            f"  people          least distance {shown(s['min_human_distance_m'], '.2f')} m, {shown(share, '.0f')} %"
            f" of the time below 1.2 m; {s['people_see_robot']} see the robot"
        )
    if detour["displacement_m"] is not None:
        yield (
            f"  detour          people are {shown(detour['displacement_m'], '.2f')} m from where they would be"
            f" without the robot; {shown(detour['path_m'], '.2f')} m and {shown(detour['delay_s'], '.2f')} s more"
            " to their waypoints"
        )
    yield (
        f"  path            {shown(s['path_length_m'], '.2f')} m, straight {shown(s['straight_line_m'], '.2f')} m, "
        f"deviation {shown(s['mean_deviation_m'], '.2f')} m mean, {shown(s['max_deviation_m'], '.2f')} m max"
    )
    yield f"  control cost    {shown(s['control_cost'], '.2f')}"
    yield (
        f"  estimates       robot {shown(s['localization_rmse_m'], '.3f')} m, "
        f"people {shown(s['tracking_rmse_m'], '.3f')} m RMSE"
    )
    yield f"  infeasible      {s['infeasible_ticks']} of {s['ticks']} ticks"
    phases = ", ".join(f"{name} {shown(compute[name]['p50'], '.2f')}" for name in compute if name != "tick")
    yield (
        f"  speed           {shown(s['real_time_factor'], '.1f')} × real time; "
        f"tick {shown(compute['tick']['p50'], '.2f')} ms p50, {shown(compute['tick']['p99'], '.2f')} ms p99"
    )
    yield f"                  ms p50 by phase: {phases}"
    for name, figure in result.metrics.figures.items():
        yield f"  {name:<15} {shown(s['metrics'][name], '.4g')} {figure.unit}".rstrip()
    if result.real_time is not None:
        yield f"  real time       {s['deadline_misses']} of {s['ticks']} deadlines missed; {result.real_time}"
    if s["clipped_ticks"]:
        yield f"  clipped         {s['clipped_ticks']} of {s['ticks']} ticks: commands beyond the robot's limits"
    if s["cautious_ticks"]:
        yield f"  cautious        {s['cautious_ticks']} of {s['ticks']} ticks: slower than decided, or stopped"
    if s["kidnappings"]:
        yield f"  kidnappings     the robot found itself again after {s['kidnappings_recovered']} of {s['kidnappings']}"
    if s["log"]:
        lost = f" ({result.log_dropped} parts of ticks are missing: the disk could not keep up)"
        yield f"  log             {s['log']}{lost * bool(result.log_dropped)}"
