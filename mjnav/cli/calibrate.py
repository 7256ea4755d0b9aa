"""`mjnav calibrate SCENE`: how far the predicted risk of the chosen controls can be believed, method by method."""

import argparse
import json
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict

from mjnav.cli.options import scene_options
from mjnav.cli.options.common import check_whole
from mjnav.cli.terminal.progress import compile_notice, progress, tell
from mjnav.cli.terminal.tables import print_table
from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import warm_up
from mjnav.metrics.prediction import Calibration, Interval
from mjnav.output_files import output_path, written
from mjnav.scene.ranges import MAX_SEED
from mjnav.study.calibration import EVENT, SETTINGS, CalibrationPlan, calibrate, run_label
from mjnav.study.sweep.workers import TimeLimit

PLAN = CalibrationPlan()


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    scene_options.scene(parser)
    parser.add_argument(
        "--controller",
        nargs="+",
        action="extend",
        metavar="NAME",
        help="one or more, each with its default parameters; the run file's by default",
    )
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="runs of each controller; 10 by default")
    parser.add_argument("--first", type=int, default=0, metavar="S", help="the first seed; 0 by default")
    parser.add_argument(
        "--every", type=int, default=PLAN.every, metavar="K", help=f"every K-th decision; {PLAN.every} by default"
    )
    parser.add_argument(
        "--draws", type=int, default=PLAN.draws, metavar="N", help=f"fresh draws a decision; {PLAN.draws} by default"
    )
    scene_options.overrides(parser)
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="processes; 1 by default")
    scene_options.max_seconds(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")
    parser.add_argument("-o", "--output", metavar="OUT.png", help="a picture of the reliability curves")


def execute(arguments: argparse.Namespace) -> int:
    """Runs every controller under every seed and prints the tables."""
    for key, low in (("seeds", 1), ("first", 0), ("every", 1), ("draws", 1), ("workers", 1)):
        check_whole(f"--{key}", getattr(arguments, key), low)
    last = arguments.first + arguments.seeds - 1
    if last > MAX_SEED:
        raise InvalidValue("--first", arguments.first, f"a number for which the last seed is at most {MAX_SEED}")
    max_seconds = scene_options.checked_max_seconds(arguments)
    picture = None if arguments.output is None else output_path("--output", arguments.output, ".png")
    names = dict.fromkeys(arguments.controller or [None])
    scenarios = [load_scenario(arguments.scene, arguments.overrides, controller=name) for name in names]
    plan = CalibrationPlan(arguments.draws, arguments.every)
    seeds = range(arguments.first, last + 1)

    with _terminable():
        with compile_notice():
            for scenario in scenarios:
                warm_up(scenario)
        with progress(scenarios[0].name, len(scenarios) * len(seeds), "runs") as show:
            limit = TimeLimit(run_label, max_seconds, tell)
            calibrations = calibrate(scenarios, seeds, plan, workers=arguments.workers, limit=limit, progress=show)
    runs = f"seed {last}" if len(seeds) == 1 else f"seeds {seeds[0]} to {last}"
    heading = f"{scenarios[0].name}, {runs}, every {plan.every} ticks, {plan.draws} draws"
    if picture is not None:
        from mjnav.report.decision_figures import calibration_figure

        with written(picture) as file:
            calibration_figure(calibrations, heading).savefig(file, format="png")
    if arguments.json:
        about = {"scene": scenarios[0].name, "seeds": list(seeds), "every": plan.every, "draws": plan.draws}
        event = {
            "form": EVENT.form,
            "horizon_s": EVENT.horizon,
            "preview_s": EVENT.preview,
            "margin_m": EVENT.safety_margin,
        }
        methods = {name: {setting: asdict(c) for setting, c in row.items()} for name, row in calibrations.items()}
        print(json.dumps({"schema": 1, **about, "event": event, "methods": methods, "picture": arguments.output}))
        return 0
    print(heading)
    print(f"event: the control, kept for {EVENT.horizon:g} s, hits a person, leg or pillar; [95 %] over seeds\n")
    _print(calibrations)
    if picture is not None:
        print(f"\n{picture}")
    return 0


def _print(calibrations: Mapping[str, Mapping[str, Calibration]]) -> None:
    """The methods side by side, then each one's reliability curve."""
    rows = [
        (
            setting,
            name,
            str(c.count),
            _share(c.predicted),
            _share(c.observed),
            f"{_share(c.bias, '+')}{_interval(c.bias_interval, '+')}",
            f"{_share(c.ece)}{_interval(c.ece_interval)}",
            _share(c.brier),
        )
        for setting in SETTINGS
        for name, c in ((name, by_setting[setting]) for name, by_setting in calibrations.items())
    ]
    heads = ("setting", "controller", "decisions", "predicted", "observed", "bias", "calibration error", "Brier")
    print_table(rows, heads, numbers=(2, 3, 4))
    for name, by_setting in calibrations.items():
        for setting, c in by_setting.items():
            print(f"\n{name}, {setting}")
            bins = [
                (
                    f"{b.low:g} to {b.high:g}",
                    str(b.count),
                    _share(b.predicted),
                    f"{_share(b.observed)}{_interval(b.observed_interval)}",
                )
                for b in c.bins
            ]
            print_table(bins, ("predicted", "decisions", "mean", "observed"), numbers=(1, 2))


def _share(value: float | None, sign: str = "") -> str:
    return "-" if value is None else format(value, f"{sign}.3f")


def _interval(interval: Interval | None, sign: str = "") -> str:
    return "" if interval is None else f" [{', '.join(_share(end, sign) for end in interval)}]"


@contextmanager
def _terminable() -> Iterator[None]:
    """SIGTERM ends workers too: it is taken for an interrupt."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
