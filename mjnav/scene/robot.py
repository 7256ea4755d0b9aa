"""Robots: what a run file's `robot.model` names, a file of a maker's figures with an MJCF beside it.

    [robot]
    model = "burger"            # models/robots/burger/robot.toml, or the path of such a file of one's own

The file's figures hold where the run file says nothing else. Loading puts the MJCF and the drive into `robot.base`, so
a log has them and a replay needs no file.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from math import hypot
from pathlib import Path
from typing import Annotated, Any

from mjnav import settings
from mjnav.errors import InvalidValue, unknown_name
from mjnav.motion.unicycle import Drive
from mjnav.scene import toml as files
from mjnav.scene.library import data_folder
from mjnav.settings import Length, Range, Settled, below

OWN = "mjnav"  # the robot of this project, which needs no base
Wheels = Annotated[tuple[str, ...], Length(1, 8), "names of the joints of one side's wheels, which turn alike"]
_MAX_BYTES = 1_000_000


@dataclass(frozen=True, slots=True)
class Base(Settled):
    """The body and the drive of a robot that is not mjnav's own."""

    mjcf: Annotated[str, "MJCF, as text: one body with a free joint, wheels on hinges with velocity actuators"]
    wheel_radius: Annotated[float, Range(0.005, 1.0, "m"), "from the hinge to the floor"]
    track_width: Annotated[float, Range(0.02, 3.0, "m"), "between the wheels' contact points"]
    left_wheels: Wheels = ("left_wheel",)
    right_wheels: Wheels = ("right_wheel",)
    turn_factor: Annotated[
        float, Range(0.5, 4.0), "by which wheels differ more than rolling asks for, where they skid in turns"
    ] = 1.0
    encoder_ticks: Annotated[float, Range(0.0, 1e7), "a turn of a wheel, to which readings are cut; 0: exact"] = 0.0

    @property
    def drive(self) -> Drive:
        """Wheel speeds and twists."""
        return Drive(self.wheel_radius, self.turn_factor * self.track_width)


def covering(length: float, width: float, num: int) -> tuple[tuple[float, float], ...]:
    """The smallest `num` like discs in a row that cover a box: how far ahead of its centre each is, and its radius [m].

    Each covers a part of the box, length / num by width, as the circle around it.
    """
    part = length / num
    radius = hypot(0.5 * part, 0.5 * width)
    return tuple((part * (i + 0.5) - 0.5 * length, radius) for i in range(num))


@dataclass(frozen=True, slots=True)
class LidarPlace(Settled):
    """The lidar that a robot usually has."""

    model: Annotated[str, "a lidar by name"] = "ideal"
    height: Annotated[float, Range(0.02, 3.0, "m"), "of the scan above the floor"] = 0.33
    mount: Annotated[tuple[float, float, float], "x, y and yaw on the robot"] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class RobotFile(Base):
    """A maker's figures; `mjcf` is the path of the MJCF, from this file's folder."""

    description: str = ""
    source: Annotated[str, "of the figures"] = ""
    robot: Annotated[
        Mapping[str, float],
        settings.Named((
            "radius", "max_speed", "min_speed", "preferred_speed", "max_turn_rate", "max_acceleration",
            "max_turn_acceleration",
        )),
        "keys of the run file's [robot], where it says nothing else",
    ] = field(default_factory=dict)  # fmt: skip
    footprint: Annotated[tuple[float, float] | None, "the run file's robot.footprint"] = None
    lidar: LidarPlace | None = None


@cache
def robots() -> dict[str, str]:
    """The shipped robots and what each is."""
    found = {OWN: "The robot of this project: a round base on two wheels, 12.6 kg and 1 m/s."}
    for path in sorted((data_folder("models") / "robots").glob("*/robot.toml")):
        found[path.parent.name] = read_robot(path).description
    return found


def robot_path(name: str, folder: Path | None) -> Path:
    """The file of a robot by its shipped name or its path. Raises InvalidValue."""
    if name in robots():
        return data_folder("models") / "robots" / name / "robot.toml"
    if not name.endswith(".toml"):
        raise unknown_name("robot.model", name, robots(), also="the path of a robot's file, .toml")
    return files.found("robot.model", name, folder, "a shipped robot")


def read_robot(path: Path) -> RobotFile:
    """A maker's figures. Raises InvalidValue with the file and its key."""
    return settings.read(RobotFile, files.parse(_text(path, "a robot's file"), os.fspath(path)))


def _text(path: Path, what: str) -> str:
    with files.readable(what, "robot.model", os.fspath(path)):
        return files.read_regular(path, _MAX_BYTES).decode()


def put_robot(document: dict[str, Any], folder: Path | None) -> None:
    """Puts a robot's base, limits and lidar where the tables of a run file name its `model`. Raises InvalidValue."""
    robot = document.get("robot")
    name = robot.get("model") if isinstance(robot, dict) else None
    if not isinstance(robot, dict) or not isinstance(name, str) or name == OWN or "base" in robot:
        return
    path = robot_path(name, folder)
    try:
        found = read_robot(path)
        mjcf = _text(path.parent / found.mjcf, "an MJCF")
    except InvalidValue as error:
        raise InvalidValue("robot.model", name, f"a robot's file that can be read ({error})") from None
    for key, value in found.robot.items():
        robot.setdefault(key, value)
    if found.footprint is not None:
        robot.setdefault("footprint", list(found.footprint))
    drive = {one.name: getattr(found, one.name) for one in fields(Base)}
    robot["base"] = {**drive, "mjcf": mjcf}
    with below("sensors"):
        sensors = document.setdefault("sensors", {})
        if found.lidar is not None and isinstance(sensors, dict):
            sensors.setdefault("lidar", {**settings.tables(found.lidar)})
