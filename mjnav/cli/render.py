"""`mjnav render LOG -o OUT.png`: a picture of the scene at one moment of a run, with the way that the robot came."""

import argparse

import numpy as np

from mjnav.cli.output import output_path, written
from mjnav.errors import InvalidValue
from mjnav.messages import Trajectory, WorldState

SIZE = (1280, 560)  # [pixels]


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="the log of a run")
    parser.add_argument("-o", "--output", metavar="OUT.png", required=True, help="where the picture goes")
    parser.add_argument("--at", type=float, metavar="T", help="the moment [s]; the end of the run by default")


def execute(arguments: argparse.Namespace) -> int:
    """Draws the picture off screen."""
    output = output_path("--output", arguments.output, ".png")

    from PIL import Image

    from mjnav.recording.reader import open_log
    from mjnav.world.render import render

    log = open_log(arguments.log)
    trajectory = log.trajectory()
    index = _index(trajectory, arguments.at)
    trail = trajectory.robot_pose[: index + 1, :2]
    picture = render(log.scenario(), _state(trajectory, index), size=SIZE, trail=trail)
    with written(output) as file:
        Image.fromarray(picture).save(file, format="png", optimize=True)
    print(f"{output}: {trajectory.time[index]:.1f} s")
    return 0


def _index(trajectory: Trajectory, time: float | None) -> int:
    """The tick nearest to `time`, the last one by default."""
    last = len(trajectory.time) - 1
    if time is None:
        return last
    if not 0.0 <= time <= trajectory.time[last]:
        raise InvalidValue("--at", time, f"a time from 0 to {trajectory.time[last]:g} s")
    return int(np.abs(trajectory.time - time).argmin())


def _state(trajectory: Trajectory, index: int) -> WorldState:
    return WorldState(
        time=float(trajectory.time[index]),
        robot_pose=trajectory.robot_pose[index],
        robot_twist=trajectory.robot_twist[index],
        people_position=trajectory.people_position[index],
        people_velocity=trajectory.people_velocity[index],
    )
