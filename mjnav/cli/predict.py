"""`mjnav predict SOURCE`: how well each model of prediction foretells where people go."""

import argparse
import json
from typing import TYPE_CHECKING

from mjnav.cli.options import scene_options
from mjnav.cli.options.common import check_whole
from mjnav.cli.terminal.progress import compile_notice
from mjnav.cli.terminal.tables import print_table
from mjnav.errors import InvalidValue

if TYPE_CHECKING:
    from mjnav.metrics.intervals import Interval
    from mjnav.study.prediction import Measured

HEADS = {
    "ade_m": "ADE [m]",
    "fde_m": "FDE [m]",
    "min_ade_m": "min ADE [m]",
    "error_m": "error [m]",
    "energy_m": "energy [m]",
    "inside_50": "in 50 %",
    "inside_90": "in 90 %",
    "inside_95": "in 95 %",
}


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument(
        "source",
        metavar="SOURCE",
        help="a log, a scene's name or run file (the robot stands at its start), or a text file of recorded people",
    )
    parser.add_argument(
        "--model",
        nargs="+",
        action="extend",
        metavar="NAME",
        help="one or more, each with its default parameters; constant_velocity by default",
    )
    parser.add_argument("--exact", action="store_true", help="predict from the truth in place of a tracker's beliefs")
    parser.add_argument("--samples", type=int, default=25, metavar="N", help="samples of each person; 25 by default")
    parser.add_argument(
        "--every", type=float, default=0.4, metavar="S", help="seconds between predictions that count; 0.4 by default"
    )
    parser.add_argument(
        "--frame-rate", type=float, metavar="HZ", help="what a recording's column of frames counts a second"
    )
    parser.add_argument("--seed", type=int, metavar="N", help="seed, in place of the run file's")
    scene_options.overrides(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Measures and prints the tables."""
    check_whole("--samples", arguments.samples, 1)
    if not 0.0 < arguments.every < 1e6:
        raise InvalidValue("--every", arguments.every, "a number of seconds > 0")
    if arguments.frame_rate is not None and not 0.0 < arguments.frame_rate <= 1e6:
        raise InvalidValue("--frame-rate", arguments.frame_rate, "a number > 0 and <= 1000000 Hz")
    from mjnav.scene.prediction import CONSTANT_VELOCITY
    from mjnav.study.prediction import Plan, measure

    models = tuple(dict.fromkeys(arguments.model or (CONSTANT_VELOCITY,)))
    asked = arguments.exact, arguments.samples, arguments.every, arguments.seed, tuple(arguments.overrides)
    plan = Plan(models, *asked, arguments.frame_rate)
    with compile_notice():
        found = measure(arguments.source, plan)
    if arguments.json:
        print(json.dumps({"schema": 1, **_document(found), "samples": arguments.samples}))
    else:
        _print(found)
    return 0


def _print(found: "Measured") -> None:
    one = next(iter(found.models.values()))
    known = "exact positions" if found.exact else "beliefs of the tracker"
    print(found.what)
    people = f"{one.people} {'person' if one.people == 1 else 'people'}"
    ahead = f"{found.steps} steps of {found.step:g} s"
    means = "; means over people, [95 %]" if one.people > 1 else ""
    print(f"{one.predictions} predictions of {people}, {ahead}, from {known}{means}")
    if not one.predictions:
        print("nobody was there long enough")
        return
    print()
    rows = [(name, *(_text(*of.figures[key]) for key in of.figures)) for name, of in found.models.items()]
    print_table(rows, ("model", *(HEADS[key] for key in one.figures)), numbers=range(1, len(one.figures) + 1))
    said = [f"{name} {of.by_window[0]:.2f} / {of.by_window[1]:.2f}" for name, of in found.models.items()]
    print(f"\nmeans over predictions, ADE / FDE [m]: {', '.join(said)}")
    first, *others = found.models
    for name in others:
        print(f"energy [m], {name} less {first}: {_text(*found.models[name].beyond_first)}")
    for name, of in found.models.items():
        print(f"\n{name}")
        rows = [
            (f"{(h + 1) * found.step:.1f} s", *(_text(*of.by_horizon[key][h]) for key in of.by_horizon))
            for h in range(found.steps)
        ]
        print_table(rows, ("ahead", *(HEADS[key] for key in of.by_horizon)), numbers=range(1, len(of.by_horizon) + 1))


def _text(value: float | None, interval: "Interval") -> str:
    if value is None:
        return "-"
    low, high = (0.0, 0.0) if interval is None else (round(end, 2) + 0.0 for end in interval)  # no -0.00
    return f"{value:.2f}" + ("" if interval is None else f" [{low:.2f}, {high:.2f}]")


def _document(found: "Measured") -> dict[str, object]:
    def one(value: float | None, interval: "Interval") -> dict[str, object]:
        return {"value": value, "interval": interval}

    models = {
        name: {
            "people": of.people,
            "predictions": of.predictions,
            "by_window": {"ade_m": of.by_window[0], "fde_m": of.by_window[1]},
            "energy_beyond_first": one(*of.beyond_first),
            "figures": {key: one(*figure) for key, figure in of.figures.items()},
            "by_horizon": [
                {"time_s": (h + 1) * found.step, **{key: one(*of.by_horizon[key][h]) for key in of.by_horizon}}
                for h in range(found.steps if of.predictions else 0)
            ],
        }
        for name, of in found.models.items()
    }
    return {"source": found.what, "step_s": found.step, "steps": found.steps, "exact": found.exact, "models": models}
