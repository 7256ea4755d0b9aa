"""`mjnav robot check NAME|PATH`: whether a robot does in MuJoCo what it is commanded."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from mjnav.cli.terminal import answer, compile_notice, print_table
from mjnav.loop.robot_check import Figure, checked
from mjnav.scene import loads
from mjnav.scene.robot import OWN, read_robot, robot_path
from mjnav.scene.toml import toml_text

FLOOR = {
    "schema": 1,
    "name": "robot-check",
    "time_limit": 1000.0,
    "noise": {"profile": "none"},
    "control": {"rate": 50.0, "delay": 0},
    "sensors": {"rate": 50.0},
}


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("action", choices=("check",), help="drive straight, spin, an eight, and stop")
    parser.add_argument("robot", metavar="NAME|PATH", help="a robot that `mjnav list robots` prints, or a file, .toml")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Drives and prints the figures; 1 where one is out of its bounds."""
    robot = {"model": arguments.robot, "start": [0.0, 0.0, 0.0], "goal": [900.0, 0.0]}
    scenario = loads(toml_text({**FLOOR, "robot": robot}), file=arguments.robot, folder=Path.cwd())
    with compile_notice():
        figures = list(checked(scenario))
    holds = all(figure.holds for figure in figures)
    document = {"robot": arguments.robot, "holds": holds, "figures": [asdict(figure) for figure in figures]}
    answer(arguments, document, lambda: _print(arguments.robot, figures))
    return 0 if holds else 1


def _print(robot: str, figures: Sequence[Figure]) -> None:
    if robot != OWN:
        print(read_robot(robot_path(robot, Path.cwd())).source)
    heads, rows = ("drive", "figure", "found", "allowed", ""), []
    for f in figures:
        value, allowed = f"{f.value:.4g} {f.unit}".strip(), f"{f.low:.3g} to {f.high:.3g}"
        rows.append((f.manoeuvre, f.name, value, allowed, "" if f.holds else "out"))
    print_table(rows, heads)
