"""`mjnav calibrate SCENE`: how far the predicted risk of the chosen controls can be believed, method by method."""

import argparse
import json
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict
from itertools import product

from mjnav.cli import options
from mjnav.cli.terminal import compile_notice, print_table, progress
from mjnav.errors import InvalidValue
from mjnav.loop.prepare import episode_label, load_scenario
from mjnav.loop.run import warm_up
from mjnav.loop.supervision import Heartbeat
from mjnav.metrics.prediction import Calibration, Interval
from mjnav.output_files import output_path, written
from mjnav.scene.ranges import MAX_SEED
from mjnav.scene.spec import Scenario
from mjnav.study.calibration import EVENT, SETTINGS, CalibrationPlan, calibrate

PLAN = CalibrationPlan()


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    options.scene(parser)
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
    options.overrides(parser)
    options.max_seconds(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")
    parser.add_argument("-o", "--output", metavar="OUT.png", help="a picture of the reliability curves")


def execute(arguments: argparse.Namespace) -> int:
    """Runs every controller under every seed and prints the tables."""
    for key, low in (("seeds", 1), ("first", 0), ("every", 1), ("draws", 1)):
        options.check_whole(f"--{key}", getattr(arguments, key), low)
    last = arguments.first + arguments.seeds - 1
    if last > MAX_SEED:
        raise InvalidValue("--first", arguments.first, f"a number for which the last seed is at most {MAX_SEED}")
    max_seconds = options.checked_max_seconds(arguments)
    picture = None if arguments.output is None else output_path("--output", arguments.output, ".png")
    names = dict.fromkeys(arguments.controller or [None])
    scenarios = [load_scenario(arguments.scene, arguments.overrides, controller=name) for name in names]
    plan = CalibrationPlan(arguments.draws, arguments.every)
    seeds = range(arguments.first, last + 1)

    with compile_notice():
        for scenario in scenarios:
            warm_up(scenario)

    def watched(run: Scenario) -> AbstractContextManager[Heartbeat]:
        return arguments.guard.episode(episode_label(run), max_seconds)

    with progress(scenarios[0].name, len(scenarios) * len(seeds), "runs") as show:
        calibrations = calibrate(scenarios, seeds, plan, watched=watched, progress=show)
    runs = f"seed {last}" if len(seeds) == 1 else f"seeds {seeds[0]} to {last}"
    heading = f"{scenarios[0].name}, {runs}, every {plan.every} ticks, {plan.draws} draws"
    if picture is not None:
        from mjnav.report.figures import calibration_figure

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
    """The methods side by side, then the reliability curve of each."""
    rows, bins = [], []
    for setting, name in product(SETTINGS, calibrations):
        c = calibrations[name][setting]
        bias, error = _share(c.bias, c.bias_interval, "+"), _share(c.ece, c.ece_interval)
        rows.append(
            (setting, name, str(c.count), *map(_share, (c.predicted, c.observed)), bias, error, _share(c.brier))
        )
        for b in c.bins:
            mean, observed = _share(b.predicted), _share(b.observed, b.observed_interval)
            bins.append((setting, name, str(b.count), f"{b.low:g} to {b.high:g}", mean, observed))
    heads = ("setting", "controller", "decisions", "predicted", "observed", "bias", "calibration error", "Brier")
    print_table(rows, heads, numbers=(2, 3, 4))
    print()
    print_table(bins, ("setting", "controller", "decisions", "predicted", "mean", "observed"), numbers=(2, 3, 4))


def _share(value: float | None, interval: Interval | None = None, sign: str = "") -> str:
    if value is None:
        return "-"
    ends = "" if interval is None else f" [{', '.join(format(end, f'{sign}.3f') for end in interval)}]"
    return f"{value:{sign}.3f}{ends}"
