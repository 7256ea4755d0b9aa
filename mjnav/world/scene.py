"""Composes the MuJoCo model of a scenario from the parts in models/.

Parts are attached with prefixes: `robot/`, `table0/`, `pillar1/`, `person3/`. Walls are boxes on bodies of their own,
`wall2/`, or where there are MANY the boxes `wall2/wall` on one body, `walls`: MuJoCo finds near bodies by pairs, in
memory quadratic in their number, and near boxes of one body by a tree.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

import hashlib
from functools import cache, lru_cache
from math import atan2, hypot, pi
from typing import NamedTuple

import mujoco
import numpy as np

from mjnav.messages import Array
from mjnav.scene.library import data_folder
from mjnav.scene.ranges import Point
from mjnav.scene.spec import Pillar, Robot, Scenario, Table, Wall
from mjnav.world.robot_part import robot_part

PARTS = ("scene", "robot", "pedestrian", "table", "pillar")
WALLS, MANY = "walls", 500
SEEN_BY_LIDAR, UNSEEN, DECORATION = 0, 1, 2  # geom groups, as in models/
FIXED = 6  # contype of what the robot (2) and people (4) run into
SMOOTH = (
    0.1,
    0.005,
    0.0001,
)  # friction of walls, as of pillars and legs: people slide along them; the robot has its own

_SHIRTS = ((0.25, 0.45, 0.70), (0.72, 0.34, 0.30), (0.33, 0.57, 0.42), (0.55, 0.40, 0.66), (0.85, 0.64, 0.25))
_SHOULDER, _HEAD = 1.42, 1.54  # [m] heights


def _part(name: str) -> mujoco.MjSpec:
    return _read(name).copy()


@cache
def _read(name: str) -> mujoco.MjSpec:
    return mujoco.MjSpec.from_file(str(data_folder("models") / f"{name}.xml"))


def parts_hash() -> str:
    """SHA-256 over the MJCF parts, hexadecimal."""
    digest = hashlib.sha256()
    for name in PARTS:
        digest.update(name.encode() + b"\0" + (data_folder("models") / f"{name}.xml").read_bytes() + b"\0")
    return digest.hexdigest()


class Standing(NamedTuple):
    """A person at the start."""

    start: Point
    radius: float


class SceneBodies(NamedTuple):
    """All of a scenario on which its model depends."""

    name: str
    timestep: float  # [s]
    robot: Robot
    mount: tuple[float, ...]  # of the lidar on the robot: x, y, heading
    walls: tuple[Wall, ...]
    tables: tuple[Table, ...]
    pillars: tuple[Pillar, ...]
    people: tuple[Standing, ...]

    @classmethod
    def of(cls, scenario: Scenario) -> "SceneBodies":
        """Those of a scenario."""
        mount, people = scenario.sensors.scanner.mount, (Standing(one.start, one.radius) for one in scenario.people)
        return cls(
            scenario.name, scenario.physics.timestep, scenario.robot, tuple(mount.tolist()),
            scenario.walls, scenario.tables, scenario.pillars, tuple(people),
        )  # fmt: skip


def scene_points(scenario: Scenario | SceneBodies) -> Array:
    """Points on the floor that span everything in the scenario, (n, 2) [m]."""
    robot = scenario.robot
    points = [robot.start[:2], *robot.route]
    points += [point for wall in scenario.walls for point in (wall.start, wall.end)]
    points += [tuple(leg) for table in scenario.tables for leg in table.legs]
    points += [pillar.position for pillar in scenario.pillars]
    points += [person.start for person in scenario.people]
    return np.array(points, float)


def compose(scenario: Scenario) -> mujoco.MjSpec:
    """The scenario's model, not yet compiled, everything at its start."""
    return _composed(SceneBodies.of(scenario), decorated=True)


def compiled(scenario: Scenario) -> mujoco.MjModel:
    """The scenario's model, compiled, without what only pictures need, which costs a tenth of each step.

    Scenarios with the same bodies share it: nobody may write to it.
    """
    return _compiled(SceneBodies.of(scenario))


@lru_cache(maxsize=4)  # the seeds of a study, and the methods of a layout, have the same bodies
def _compiled(bodies: SceneBodies) -> mujoco.MjModel:
    model = _composed(bodies, decorated=False).compile()
    # MuJoCo would compute every sensor in every step, a step late; encoders and yaw are read from the state.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    # MuJoCo would put everything back to where the run began.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return model


def _composed(bodies: SceneBodies, *, decorated: bool) -> mujoco.MjSpec:
    scene = _part("scene")
    scene.modelname = bodies.name
    scene.option.timestep = bodies.timestep
    low, high = (extreme(scene_points(bodies), axis=0) for extreme in (np.min, np.max))
    scene.stat.center = [*(0.5 * (low + high)), 0.5]
    scene.stat.extent = max(2.0, 0.5 * float(np.hypot(*(high - low))))
    floor = scene.geom("floor")
    floor.pos = [*np.round(0.5 * (low + high)), 0.0]
    floor.size = [*np.ceil(0.5 * (high - low) + 20.0), 0.1]
    _attach(scene, _robot(bodies.robot, bodies.mount), "robot/", bodies.robot.start, decorated)
    together = scene.worldbody.add_body(name=WALLS) if len(bodies.walls) > MANY else None
    for i, wall in enumerate(bodies.walls):
        _add_wall(scene, wall, f"wall{i}/wall", together)
    for i, table in enumerate(bodies.tables):
        _attach(scene, _table(table), f"table{i}/", (*table.position, table.yaw), decorated)
    for i, pillar in enumerate(bodies.pillars):
        _attach(scene, _pillar(pillar), f"pillar{i}/", (*pillar.position, 0.0), decorated)
    for i, person in enumerate(bodies.people):
        shirt = _SHIRTS[i % len(_SHIRTS)]
        _attach(scene, _person(person, shirt), f"person{i}/", (*person.start, 0.0), decorated)
    return scene


def _attach(
    scene: mujoco.MjSpec, part: mujoco.MjSpec, prefix: str, pose: tuple[float, float, float], decorated: bool
) -> None:
    if not decorated:  # before it is attached: MuJoCo goes through the whole scene for each geom that is deleted
        for geom in [geom for geom in part.geoms if geom.group == DECORATION]:
            part.delete(geom)
    x, y, yaw = pose
    frame = scene.worldbody.add_frame(pos=[x, y, 0.0], quat=[np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw)])
    part.option = scene.option  # MuJoCo warns of others, and keeps the scene's
    scene.attach(part, prefix=prefix, frame=frame)


def _robot(robot: Robot, mount: tuple[float, ...]) -> mujoco.MjSpec:
    """The lidar, a site and for the eye a puck with a cap, stands at `mount` (3,) of mjnav's own robot."""
    if robot.base is not None:
        return robot_part(robot.base, robot.limits)
    part = _part("robot")
    x, y, yaw = mount
    for thing in (part.geom("puck"), part.geom("cap"), part.site("lidar")):
        thing.pos = [x, y, thing.pos[2]]
    part.site("lidar").quat = [np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw)]
    for name, margin in (("chassis", 0.0), ("bumper", 0.002), ("deck", -0.025)):
        geom = part.geom(name)
        geom.size = [robot.radius + margin, *geom.size[1:]]
    part.geom("mark").pos = [robot.radius - 0.095, 0.0, 0.301]
    return part


def _table(table: Table) -> mujoco.MjSpec:
    part = _part("table")
    x, y = 0.5 * table.size[0], 0.5 * table.size[1]
    half_height = 0.5 * table.height - 0.01  # ends within the top
    for i, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        leg = part.geom(f"leg{i}")
        leg.pos, leg.size = [sx * x, sy * y, half_height], [table.leg_radius, half_height, 0.0]
    top = part.geom("top")
    overhang = table.leg_radius + 0.02
    top.size, top.pos = [x + overhang, y + overhang, 0.015], [0.0, 0.0, table.height - 0.015]
    return part


def _pillar(pillar: Pillar) -> mujoco.MjSpec:
    part = _part("pillar")
    geom = part.geom("pillar")
    geom.size, geom.pos = [pillar.radius, 0.5 * pillar.height, 0.0], [0.0, 0.0, 0.5 * pillar.height]
    rim = min(0.03, 0.5 * pillar.height)
    part.geom("rim").size, part.geom("rim").pos = [pillar.radius + 0.002, rim, 0.0], [0.0, 0.0, rim]
    return part


def _person(person: Standing, shirt: tuple[float, float, float]) -> mujoco.MjSpec:
    part = _part("pedestrian")
    half = 0.5 * max(_SHOULDER - person.radius, 0.6)
    body = part.geom("body")
    body.size, body.pos = [person.radius, half, 0.0], [0.0, 0.0, half]
    part.geom("reach").size = [person.radius, 0.0, 0.0]
    part.geom("head").pos = [0.0, 0.0, 2.0 * half + person.radius + _HEAD - _SHOULDER]
    part.material("shirt").rgba = [*shirt, 1.0]
    return part


def _add_wall(scene: mujoco.MjSpec, wall: Wall, name: str, together: mujoco.MjsBody | None) -> None:
    (x0, y0), (x1, y1) = wall.start, wall.end
    yaw = atan2(y1 - y0, x1 - x0) % pi
    place = {
        "pos": [0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * wall.height],
        "quat": [np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw)],
    }
    body = scene.worldbody.add_body(name=name, **place) if together is None else together
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[0.5 * hypot(x1 - x0, y1 - y0), 0.5 * wall.thickness, 0.5 * wall.height],
        material="wall",
        group=SEEN_BY_LIDAR,
        contype=FIXED,
        conaffinity=0,
        friction=SMOOTH,
        **({} if together is None else place),
    )
