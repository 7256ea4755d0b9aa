"""/scene: what stands in the room, the robot, and the people as they are and as they are believed to be.

Each is a Foxglove entity with a name: `robot`, `person0`, `person0_estimate` beside it, and `person0_future` where a
model of prediction says more than straight on; `plan`, with its fan, of a method that plans ahead. Where people are
tracked by scans, estimates are `track7_estimate` and labelled, those that the latest scan does not show are pale, and
`detections` are discs with their 95 % ellipses.
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, isnan, sin
from typing import Any

from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjnav.geometry.distances import ellipse_95
from mjnav.log.encode.geometry import TRUE_FRAME, WORLD_FRAME, cylinder, pose, stamp, stamped
from mjnav.log.encode.plan import future_entities, plan_entity, way_entity
from mjnav.log.encode.protobuf import delimited, numbered
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
_PALE = 0.25  # alpha of a track that is not seen
_TEAL, _PALE_TEAL = Color(r=0.0, g=0.5, b=0.5, a=1.0), Color(r=0.0, g=0.6, b=0.6, a=0.4)
_BLACK = Color(r=0.1, g=0.1, b=0.1, a=1.0)
_ARROW = {"shaft_diameter": 0.05, "head_length": 0.1, "head_diameter": 0.12}


def _entity(name: str, *, frame: str = WORLD_FRAME, **primitives) -> SceneEntity:
    """An entity that stays until it is replaced, and with its frame where that moves."""
    return SceneEntity(frame_id=frame, id=name, frame_locked=True, **primitives)


def _walls(scenario: Scenario) -> SceneEntity:
    cubes = []
    for wall in scenario.walls:
        (x0, y0), (x1, y1) = wall.start, wall.end
        middle = pose(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * wall.height, atan2(y1 - y0, x1 - x0))
        size = {"x": hypot(x1 - x0, y1 - y0), "y": wall.thickness, "z": wall.height}
        cubes.append({"pose": middle, "size": size, "color": _GREY})
    return _entity("walls", cubes=cubes)


def _table(name: str, table: Table) -> SceneEntity:
    legs = [cylinder(x, y, table.leg_radius, table.height - TABLE_TOP, _WOOD) for x, y in table.legs.tolist()]
    width, depth = (side + 2.0 * table.leg_radius for side in table.size)
    middle = pose(*table.position, table.height - 0.5 * TABLE_TOP, table.yaw)
    top = {"pose": middle, "size": {"x": width, "y": depth, "z": TABLE_TOP}, "color": _GLASS}
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
        strip = {"type": LinePrimitive.LINE_STRIP, "pose": pose(0.0, 0.0, 0.01), "thickness": 0.05, "color": _YELLOW}
        lines.append({**strip, "points": [{"x": x, "y": y} for x, y in feet]})
    return _entity("lanes", lines=lines)


def _robot(scenario: Scenario) -> SceneEntity:
    """Fixed in the robot's own frame, which /tf moves."""
    limits = scenario.robot.limits
    radius = limits.half_width
    arrow = ArrowPrimitive(
        pose=pose(0.0, 0.0, ROBOT_HEIGHT + 0.02),
        shaft_length=0.6 * radius,
        shaft_diameter=0.2 * radius,
        head_length=0.4 * radius,
        head_diameter=0.5 * radius,
        color=_YELLOW,
    )
    body = [cylinder(ahead, 0.0, own, ROBOT_HEIGHT, _BLUE) for ahead, own in limits.discs]
    return _entity("robot", frame=TRUE_FRAME, cylinders=body, arrows=[arrow])


def _still(scenario: Scenario) -> bytes:
    robot = scenario.robot
    goals = [cylinder(x, y, robot.goal_tolerance, 0.02, _GREEN) for x, y in robot.route]
    pillars = [cylinder(*pillar.position, pillar.radius, pillar.height, _GREY) for pillar in scenario.pillars]
    entities = [
        _walls(scenario),
        *(_table(f"table{i}", table) for i, table in enumerate(scenario.tables)),
        _entity("pillars", cylinders=pillars),
        _lanes(scenario),
        _entity("goal", cylinders=goals),
        _robot(scenario),
    ]
    return SceneUpdate(entities=entities).SerializeToString()


_DETECTIONS = _entity("detections").SerializeToString()


class SceneEncoder:
    """Every message holds the whole scene, so that a reader who jumps to any moment sees it.

    What stands still is encoded once: joined messages are one message with the entities of both. The entities of people
    are kept, and only their numbers are put in anew.
    """

    def __init__(self, scenario: Scenario):
        self._still = _still(scenario)
        self._radius = scenario.robot.limits.half_width
        self._predicts = scenario.prediction is not None  # by default nothing of it is drawn
        self._radii = [body.radius for body in scenario.people]
        self._people = {f"person{i}" for i in range(len(self._radii))}
        self._way: tuple[int | None, bytes] = None, b""  # number, drawn
        self._seen = scenario.sensors.longest_pause - SAME_TIME  # [s] that a track may be unseen between two scans
        # A person who is no longer tracked disappears.
        lifetime = stamp(2.0 * scenario.control.period)  # a Duration has the fields of a Timestamp
        self._lifetime = SceneEntity(lifetime=lifetime).SerializeToString()

    def encode(
        self,
        truth: WorldState,
        tracks: tuple[Track, ...] = (),
        observation: Observation | None = None,
        detections: tuple[Detection, ...] = (),
        plan: PlanShown | None = None,
    ) -> bytes:
        """foxglove.SceneUpdate: where people are seen and believed to be, how they and the robot are to go on."""
        time = stamped(truth.time)
        passing = time + self._lifetime
        parts, entities = [self._still], []
        radii = self._radii if truth.people_radius is None else truth.people_radius.tolist()
        for i, ((x, y), radius) in enumerate(zip(truth.people_position.tolist(), radii, strict=True)):
            if isnan(x):  # not there: viewers keep an entity until it is deleted
                gone = SceneEntityDeletion(timestamp=stamp(truth.time), id=f"person{i}")
                parts.append(SceneUpdate(deletions=[gone]).SerializeToString())
            else:
                entities.append(time + _person(f"person{i}", (x, y, 2.0 * radius)))
        believed = [self._believed(track) for track in tracks]
        if detections:
            believed.append(_DETECTIONS + b"".join(map(_discs, detections)))
        if self._predicts:
            believed += future_entities(observation, tracks)
        if plan is not None:
            believed.append(plan_entity(plan, self._radius))
        if observation is not None and (way := observation.way) is not None:
            if way.number != self._way[0]:
                self._way = way.number, way_entity(way)
            believed.append(self._way[1])
        entities += [passing + entity for entity in believed]
        return b"".join((*parts, *[delimited(2, entity) for entity in entities]))

    def _believed(self, track: Track) -> bytes:
        """A disc with an arrow along the velocity.

        A track that carries no person's name has its own name above it, and is pale where the latest scan does not
        show it.
        """
        x, y, vx, vy = track.mean.tolist()
        half, named = 0.5 * atan2(vy, vx), track.name in self._people
        alpha = _PALE if not named and track.unseen > self._seen else _ORANGE.a
        numbers = x, y, 2.0 * track.radius, AHEAD * hypot(vx, vy), sin(half), cos(half), alpha
        return _track(track.name, named, numbers)


@numbered
def _person(name: str, numbers: Sequence[float]) -> SceneEntity:
    """A person's body, and its name above it: x, y, diameter."""
    x, y, diameter = numbers
    body = cylinder(x, y, 0.5 * diameter, PERSON_HEIGHT, _RED)
    return _entity(name, cylinders=[body], texts=[_text(name, x, y, PERSON_HEIGHT + LETTERS, LETTERS)])


@numbered
def _track(name: str, named: bool, numbers: Sequence[float]) -> SceneEntity:
    """x, y, diameter, the shaft's length, z and w of its turn, alpha."""
    x, y, diameter, length, turn_z, turn_w, alpha = numbers
    color = Color(r=_ORANGE.r, g=_ORANGE.g, b=_ORANGE.b, a=alpha)
    disc, arrow = cylinder(x, y, 0.5 * diameter, ESTIMATE_HEIGHT, color), pose(x, y, ESTIMATE_HEIGHT)
    arrow["orientation"] = {"z": turn_z, "w": turn_w}
    return _entity(
        f"{name}_estimate",
        cylinders=[disc],
        arrows=[ArrowPrimitive(pose=arrow, shaft_length=length, **_ARROW, color=color)],
        texts=[] if named else [_text(name, x, y, LETTERS, 0.5 * LETTERS)],
    )


def _text(text: str, x: float, y: float, height: float, size: float) -> dict[str, Any]:
    return {"pose": pose(x, y, height), "billboard": True, "font_size": size, "color": _BLACK, "text": text}


def _discs(detection: Detection) -> bytes:
    """Fields `cylinders` of an entity: the body, and the 95 % region of its centre."""
    x, y = detection.position.tolist()
    longer, shorter, direction = ellipse_95(detection.covariance)
    half = 0.5 * direction
    return _cylinders((x, y, 2.0 * detection.radius, 2.0 * longer, 2.0 * shorter, sin(half), cos(half)))


@numbered
def _cylinders(numbers: Sequence[float]) -> SceneEntity:
    """x, y, diameter, both diameters of the region, z and w of its turn."""
    x, y, diameter, longer, shorter, turn_z, turn_w = numbers
    body, region = cylinder(x, y, 0.5 * diameter, FLAT, _PALE_TEAL), cylinder(x, y, 0.0, FLAT, _TEAL)
    region["pose"]["orientation"] = {"z": turn_z, "w": turn_w}
    region["size"].update(x=longer, y=shorter)
    return SceneEntity(cylinders=[body, region])
