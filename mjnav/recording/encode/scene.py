"""/scene: what stands in the room, the robot and the people, as Foxglove entities."""

from collections.abc import Sequence
from math import atan2, hypot

from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from mjnav.messages import WorldState
from mjnav.recording.encode import wire
from mjnav.recording.encode.geometry import TRUE_FRAME, WORLD_FRAME, pose, time_ns
from mjnav.scenarios.spec import Scenario, Table

ROBOT_HEIGHT = 0.35  # [m]
PERSON_HEIGHT = 1.7  # [m]
TABLE_TOP = 0.03  # [m] thickness

_GREY = Color(r=0.55, g=0.57, b=0.6, a=1.0)
_WOOD = Color(r=0.65, g=0.45, b=0.25, a=1.0)
_GLASS = Color(r=0.65, g=0.45, b=0.25, a=0.35)
_YELLOW = Color(r=0.95, g=0.8, b=0.1, a=1.0)
_GREEN = Color(r=0.15, g=0.75, b=0.3, a=0.6)
_BLUE = Color(r=0.15, g=0.4, b=0.9, a=0.9)
_RED = Color(r=0.9, g=0.35, b=0.25, a=0.8)


def _cylinder(x: float, y: float, radius: float, height: float, color: Color, *, bottom: float = 0.0):
    return CylinderPrimitive(
        pose=pose(x, y, bottom + 0.5 * height),
        size=Vector3(x=2.0 * radius, y=2.0 * radius, z=height),
        bottom_scale=1.0,
        top_scale=1.0,
        color=color,
    )


def _entity(name: str, *, frame: str = WORLD_FRAME, **primitives) -> SceneEntity:
    """An entity that stays until it is replaced, and with its frame where that moves."""
    return SceneEntity(frame_id=frame, id=name, frame_locked=True, **primitives)


def _walls(scenario: Scenario) -> SceneEntity:
    cubes = []
    for wall in scenario.walls:
        (x0, y0), (x1, y1) = wall.start, wall.end
        cubes.append(
            CubePrimitive(
                pose=pose(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * wall.height, atan2(y1 - y0, x1 - x0)),
                size=Vector3(x=hypot(x1 - x0, y1 - y0), y=wall.thickness, z=wall.height),
                color=_GREY,
            )
        )
    return _entity("walls", cubes=cubes)


def _table(name: str, table: Table) -> SceneEntity:
    legs = [_cylinder(x, y, table.leg_radius, table.height - TABLE_TOP, _WOOD) for x, y in table.legs.tolist()]
    width, depth = (side + 2.0 * table.leg_radius for side in table.size)
    top = CubePrimitive(
        pose=pose(*table.position, table.height - 0.5 * TABLE_TOP, table.yaw),
        size=Vector3(x=width, y=depth, z=TABLE_TOP),
        color=_GLASS,
    )
    return _entity(name, cylinders=legs, cubes=[top])


def _lanes(scenario: Scenario) -> SceneEntity:
    """Each boundary as a line as long as the way, beside it."""
    route = (scenario.robot.start[:2], *scenario.robot.route)
    lines = []
    for a, b, c in (scenario.lanes.left, scenario.lanes.right) if scenario.lanes else ():
        feet = [  # the way's corners dropped onto a x + b y + c = 0
            (x - a * (a * x + b * y + c) / (a * a + b * b), y - b * (a * x + b * y + c) / (a * a + b * b))
            for x, y in route
        ]
        lines.append(
            LinePrimitive(
                type=LinePrimitive.LINE_STRIP,
                pose=pose(0.0, 0.0, 0.01),
                thickness=0.05,
                points=[Point3(x=x, y=y) for x, y in feet],
                color=_YELLOW,
            )
        )
    return _entity("lanes", lines=lines)


def _robot(scenario: Scenario) -> SceneEntity:
    """Fixed in the robot's own frame, which /tf moves."""
    radius = scenario.robot.radius
    arrow = ArrowPrimitive(
        pose=pose(0.0, 0.0, ROBOT_HEIGHT + 0.02),
        shaft_length=0.6 * radius,
        shaft_diameter=0.2 * radius,
        head_length=0.4 * radius,
        head_diameter=0.5 * radius,
        color=_YELLOW,
    )
    return _entity(
        "robot", frame=TRUE_FRAME, cylinders=[_cylinder(0.0, 0.0, radius, ROBOT_HEIGHT, _BLUE)], arrows=[arrow]
    )


def _still(scenario: Scenario) -> bytes:
    robot = scenario.robot
    goals = [_cylinder(x, y, robot.goal_tolerance, 0.02, _GREEN) for x, y in robot.route]
    pillars = [_cylinder(*pillar.position, pillar.radius, pillar.height, _GREY) for pillar in scenario.pillars]
    entities = [
        _walls(scenario),
        *(_table(f"table{i}", table) for i, table in enumerate(scenario.tables)),
        _entity("pillars", cylinders=pillars),
        _lanes(scenario),
        _entity("goal", cylinders=goals),
        _robot(scenario),
    ]
    return SceneUpdate(entities=entities).SerializeToString()


class SceneEncoder:
    """Every message holds the whole scene, so that a reader who jumps to any moment sees it.

    What stands still is encoded once: joined messages are one message with the entities of both.
    """

    def __init__(self, scenario: Scenario):
        self._still = _still(scenario)
        self._people = _people(tuple(person.radius for person in scenario.people))

    def encode(self, truth: WorldState) -> bytes:
        """The scene at one moment."""
        people = self._people.fill(truth.people_position.ravel().tolist())
        return self._still + wire.delimited(2, wire.timestamp(1, time_ns(truth.time)) + people)


def _people(radii: tuple[float, ...]) -> wire.Template:
    """The people's entity, but for its time; x and y of each are open."""

    def encode(places: Sequence[float]) -> bytes:
        cylinders = [
            _cylinder(x, y, radius, PERSON_HEIGHT, _RED)
            for x, y, radius in zip(places[0::2], places[1::2], radii, strict=True)
        ]
        return SceneEntity(frame_id=WORLD_FRAME, id="people", cylinders=cylinders).SerializeToString()

    return wire.Template(encode, 2 * len(radii))
