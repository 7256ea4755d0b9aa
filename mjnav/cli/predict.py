"""`mjnav predict SOURCE`: how well each model of prediction foretells where people go."""

import argparse
from typing import Any

from mjnav.cli import options
from mjnav.cli.terminal import answer, compile_notice, print_table, shown

EVERY = options.number(float, 0.0, 1e6, "s", open_low=True)
RATE = options.number(float, 0.0, 1e6, "Hz", open_low=True)
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
    parser.add_argument(
        "--exact",
        action="store_true",
        help="predict from the truth in place of a tracker's beliefs; always so of a recording",
    )
    parser.add_argument(
        "--every", type=EVERY, default=0.4, metavar="S", help="seconds between predictions that count; 0.4 by default"
    )
    parser.add_argument(
        "--frame-rate", type=RATE, metavar="HZ", help="what a recording's column of frames counts a second"
    )
    parser.add_argument("--seed", type=int, metavar="N", help="seed, in place of the run file's")
    options.overrides(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Measures and prints the tables."""
    from mjnav.scene.prediction import CONSTANT_VELOCITY
    from mjnav.study.prediction import Plan, measure

    models = tuple(dict.fromkeys(arguments.model or (CONSTANT_VELOCITY,)))
    given = arguments.exact, arguments.every, arguments.seed, tuple(arguments.overrides)
    plan = Plan(models, *given, arguments.frame_rate)
    with compile_notice():
        measured = measure(arguments.source, plan)
    answer(arguments, {**measured, "samples": plan.samples}, lambda: _print(measured))
    return 0


def _print(measured: dict[str, Any]) -> None:
    from mjnav.study.prediction import BY_HORIZON

    first, *others = measured["models"]
    one = measured["models"][first]
    print(measured["source"])
    people = f"{one['people']} {'person' if one['people'] == 1 else 'people'}"
    knowledge = "exact positions" if measured["exact"] else "beliefs of the tracker"
    means = "; means over people, [95 %]" if one["people"] > 1 else ""
    ahead = f"{measured['steps']} steps of {measured['step_s']:g} s"
    print(f"{one['predictions']} predictions of {people}, {ahead}, from {knowledge}{means}")
    if not one["predictions"]:
        print("nobody was there long enough")
        return
    print()
    rows = [(name, *map(_text, of["figures"].values())) for name, of in measured["models"].items()]
    print_table(rows, ("model", *(HEADS[key] for key in one["figures"])), numbers=range(1, len(one["figures"]) + 1))
    windows = {name: "{ade_m:.2f} / {fde_m:.2f}".format_map(of["by_window"]) for name, of in measured["models"].items()}
    print(f"\nmeans over predictions, ADE / FDE [m]: {', '.join(f'{name} {text}' for name, text in windows.items())}")
    for name in others:
        print(f"energy [m], {name} less {first}: {_text(measured['models'][name]['energy_beyond_first'])}\n")
    heads = ("model", "ahead", *(HEADS[key] for key in BY_HORIZON))
    rows = [
        (name, f"{row['time_s']:.1f} s", *(_text(row[key]) for key in BY_HORIZON))
        for name, of in measured["models"].items()
        for row in of["by_horizon"]
    ]
    print_table(rows, heads, numbers=range(1, len(heads)))


def _text(figure: dict[str, Any]) -> str:
    if figure["interval"] is None:
        return shown(figure["value"], ".2f")
    low, high = (round(end, 2) + 0.0 for end in figure["interval"])  # no -0.00
    return f"{figure['value']:.2f} [{low:.2f}, {high:.2f}]"
