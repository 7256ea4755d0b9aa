"""`mjnav map save LOG|SCENE -o FILE.yaml`: the floor of a scene as a map of ROS map_server, for other tools."""

import argparse

import numpy as np

from mjnav.cli import options
from mjnav.cli.terminal import answer
from mjnav.errors import InputError
from mjnav.log import open_log
from mjnav.output_files import new_path, written
from mjnav.scene.load import load
from mjnav.scene.map_file import OCCUPIED, map_of, written_map
from mjnav.scene.ways import floor_of_robot

RESOLUTION = 0.05  # [m], that of most maps


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("action", choices=("save",), help="write what stands on the floor as YAML and PGM")
    parser.add_argument("scene", metavar="LOG|SCENE", help="a log, .mcap, or a scene: its name or its file")
    parser.add_argument(
        "-o", "--output", metavar="FILE.yaml", required=True, help="a new file, with FILE.pgm beside it"
    )
    parser.add_argument(
        "--resolution",
        type=options.number(float, 0.001, 100.0, "m"),
        default=RESOLUTION,
        metavar="M",
        help=f"of a cell [m]; {RESOLUTION:g} by default",
    )
    options.start_and_goal(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Writes both files."""
    output = new_path("--output", arguments.output, ".yaml")
    picture = new_path("--output", output.with_suffix(".pgm"), ".pgm")
    if arguments.scene.endswith(".mcap"):
        if arguments.overrides:
            raise InputError("--start and --goal need a scene: a log has its own")
        scenario = open_log(arguments.scene).scenario()
    else:
        scenario = load(arguments.scene, arguments.overrides)
    floor = floor_of_robot(scenario.walls, scenario.tables, scenario.pillars)
    points = np.array([scenario.robot.start[:2], *scenario.robot.route], float)
    grid = map_of(floor, points, arguments.resolution, picture.name)
    for path, content in zip((output, picture), written_map(grid), strict=True):
        with written(path) as file:
            file.write(content)
    rows, columns = grid.cells.shape
    occupied = int((grid.cells == OCCUPIED).sum())
    document = {"file": str(output), "image": str(picture), "cells": [columns, rows], "occupied": occupied}
    text = f"{output} and {picture}: {columns} x {rows} cells, {occupied} occupied"
    answer(arguments, document, lambda: print(text))
    return 0
