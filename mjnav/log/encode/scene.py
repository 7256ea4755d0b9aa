"""/scene: what stands in the room, the robot, and the people as they are and as they are believed to be.

Each is a Foxglove entity with a name: `robot`, `person0`, `person0_estimate` beside it, and `person0_future` where a
model of prediction says more than straight on; `plan`, with its fan, of a method that plans ahead. Where people are
tracked by scans, estimates are `track7_estimate` and labelled, those that the latest scan does not show are pale, and
`detections` are discs with their 95 % ellipses.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import atan2, cos, hypot, isnan, sin

from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.duration_pb2 import Duration

from mjnav.geometry.distances import ellipse_95
from mjnav.log.encode import geometry as wire
from mjnav.log.encode.geometry import TRUE_FRAME, WORLD_FRAME, pose, time_ns
from mjnav.log.encode.plan import future_entities, plan_entity
from mjnav.messages import Detection, Observation, PlanShown, Track, WorldState
from mjnav.scene.spec import Scenario, Table

ROBOT_HEIGHT = 0.35  # [m]
PERSON_HEIGHT = 1.7  # [m]
TABLE_TOP = 0.03  # [m] thickness
ESTIMATE_HEIGHT = 0.05  # [m]
SAME_TIME = 1e-3  # [s]
FLAT = 0.01  # [m] thickness of what lies on the floor
LETTERS = 0.3  # [m] high
AHEAD = 1.0  # [s] that a believed velocity is drawn for

_GREY = Color(r=0.55, g=0.57, b=0.6, a=1.0)
_WOOD = Color(r=0.65, g=0.45, b=0.25, a=1.0)
_GLASS = Color(r=0.65, g=0.45, b=0.25, a=0.35)
_YELLOW = Color(r=0.95, g=0.8, b=0.1, a=1.0)
_GREEN = Color(r=0.15, g=0.75, b=0.3, a=0.6)
_BLUE = Color(r=0.15, g=0.4, b=0.9, a=0.9)
_RED = Color(r=0.9, g=0.35, b=0.25, a=0.8)
_ORANGE = Color(r=1.0, g=0.6, b=0.1, a=0.7)
_PALE_ORANGE = Color(r=1.0, g=0.6, b=0.1, a=0.25)
_TEAL, _PALE_TEAL = Color(r=0.0, g=0.5, b=0.5, a=1.0), Color(r=0.0, g=0.6, b=0.6, a=0.4)
_BLACK = Color(r=0.1, g=0.1, b=0.1, a=1.0)


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

    def __init__(self, scenario: Scenario, epoch: int = 0):
        self._epoch = epoch
        self._still = _still(scenario)
        self._radius = scenario.robot.radius
        self._people = [_person(f"person{i}", person.radius) for i, person in enumerate(scenario.people)]
        self._seen = scenario.sensors.longest_pause - SAME_TIME  # [s] that a track may be unseen between two scans
        self._named = frozenset(f"person{i}" for i in range(len(scenario.people)))
        # A person who is no longer tracked disappears.
        lifetime = Duration()
        lifetime.FromNanoseconds(time_ns(2.0 * scenario.control.period))
        self._lifetime = wire.delimited(4, lifetime.SerializeToString())

    def encode(
        self,
        truth: WorldState,
        tracks: tuple[Track, ...] = (),
        observation: Observation | None = None,
        detections: tuple[Detection, ...] = (),
        plan: PlanShown | None = None,
    ) -> bytes:
        """The scene at one moment: where people are seen and believed to be, how they and the robot are to go on."""
        time = wire.timestamp(1, time_ns(truth.time, self._epoch))
        parts = [self._still]
        for i, (person, (x, y)) in enumerate(zip(self._people, truth.people_position.tolist(), strict=True)):
            if isnan(x):  # not there: viewers keep an entity until it is deleted
                parts.append(wire.delimited(1, time + wire.delimited(3, f"person{i}".encode())))
            else:
                parts.append(wire.delimited(2, time + person.fill((x, y, x, y))))
        for track in tracks:
            x, y, vx, vy = track.mean.tolist()
            half, length, width = 0.5 * atan2(vy, vx), AHEAD * hypot(vx, vy), 2.0 * track.radius
            holes = (x, y, sin(half), cos(half), length, x, y, width, width)
            if track.name in self._named:
                believed = _estimate(track.name).fill(holes)
            else:
                believed = _track(track.name, coasts=track.unseen > self._seen).fill((*holes, x, y))
            parts.append(wire.delimited(2, time + self._lifetime + believed))
        if detections:
            discs = b"".join(_detected(one) for one in detections)
            parts.append(wire.delimited(2, time + self._lifetime + _DETECTIONS + discs))
        parts += [wire.delimited(2, time + self._lifetime + future) for future in future_entities(observation, tracks)]
        if plan is not None:
            parts.append(wire.delimited(2, time + self._lifetime + plan_entity(plan, self._radius)))
        return b"".join(parts)


def _person(name: str, radius: float) -> wire.Template:
    """A person's entity, but for its time; x and y of the body and of the name above it are open."""

    def encode(holes: Sequence[float]) -> bytes:
        x, y, text_x, text_y = holes
        text = TextPrimitive(
            pose=pose(text_x, text_y, PERSON_HEIGHT + LETTERS),
            billboard=True,
            font_size=LETTERS,
            color=_BLACK,
            text=name,
        )
        return _entity(name, cylinders=[_cylinder(x, y, radius, PERSON_HEIGHT, _RED)], texts=[text]).SerializeToString()

    return wire.Template(encode, 4)


@lru_cache(maxsize=1024)  # one for each person of a run
def _estimate(name: str) -> wire.Template:
    """A believed person's entity, but for its time and lifetime.

    Open are x, y, the rotation's z, w and the length of the arrow along the velocity, and x, y and width of the disc.
    """

    def encode(holes: Sequence[float]) -> bytes:
        return _believed(name, holes, _ORANGE).SerializeToString()

    return wire.Template(encode, 9)


@lru_cache(maxsize=1024)  # two for each track that lives
def _track(name: str, *, coasts: bool) -> wire.Template:
    """As `_estimate`, of a track that carries no person's name: pale where it coasts, with its name at x and y."""

    def encode(holes: Sequence[float]) -> bytes:
        entity = _believed(name, holes[:-2], _PALE_ORANGE if coasts else _ORANGE)
        x, y = holes[-2:]
        place = pose(x, y, LETTERS)
        entity.texts.add(pose=place, billboard=True, font_size=0.5 * LETTERS, color=_BLACK, text=name)
        return entity.SerializeToString()

    return wire.Template(encode, 11)


def _believed(name: str, holes: Sequence[float], color: Color) -> SceneEntity:
    arrow_x, arrow_y, z, w, length, x, y, width, depth = holes
    place = pose(arrow_x, arrow_y, ESTIMATE_HEIGHT)
    place.orientation.z, place.orientation.w = z, w
    arrow = ArrowPrimitive(
        pose=place, shaft_length=length, shaft_diameter=0.05, head_length=0.1, head_diameter=0.12, color=color
    )
    disc = _cylinder(x, y, 0.0, ESTIMATE_HEIGHT, color)
    disc.size.x, disc.size.y = width, depth
    return _entity(f"{name}_estimate", cylinders=[disc], arrows=[arrow])


_DETECTIONS = _entity("detections").SerializeToString()


def _flat_ellipse(color: Color) -> wire.Template:
    """A thin cylinder on the floor, of which x, y, the rotation's z, w, width and depth are open."""

    def encode(holes: Sequence[float]) -> bytes:
        x, y, z, w, width, depth = holes
        flat = _cylinder(x, y, 0.0, FLAT, color)
        flat.pose.orientation.z, flat.pose.orientation.w = z, w
        flat.size.x, flat.size.y = width, depth
        return flat.SerializeToString()

    return wire.Template(encode, 6)


_DISC, _REGION = _flat_ellipse(_PALE_TEAL), _flat_ellipse(_TEAL)


def _detected(found: Detection) -> bytes:
    """Field `cylinders` twice: the body, and the 95 % region of its centre."""
    x, y = found.position.tolist()
    longer, shorter, direction = ellipse_95(found.covariance)
    half, width = 0.5 * direction, 2.0 * found.radius
    body = _DISC.fill((x, y, 0.0, 1.0, width, width))
    region = _REGION.fill((x, y, sin(half), cos(half), 2.0 * longer, 2.0 * shorter))
    return wire.delimited(10, body) + wire.delimited(10, region)
