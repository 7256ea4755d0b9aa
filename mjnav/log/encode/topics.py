"""The table of topics: what a tick writes, with which schema."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjnav.log.encode import candidates, geometry, json_messages, particles
from mjnav.log.encode.plan import encode_plan, plan_schema
from mjnav.log.encode.protobuf import Schema, foxglove_schema
from mjnav.log.encode.scene import SceneEncoder
from mjnav.messages import Event, Reading, TickRecord, WorldState
from mjnav.scene.spec import Scenario

TIMING = "/tick"
PLAN, WAY = "/plan", "/way"
NO_DISCS = np.zeros((0, 3))
LIDAR = "lidar"  # the source of tracks that come about by scans
EVENTS = "/events"


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of the log, in one place; an encoder may be missing or, where there is nothing to say, return None."""

    name: str
    text: str  # what it holds, in a sentence
    schema: Schema
    encode: Callable[[TickRecord], bytes | None] | None = None
    encode_final: Callable[[int, WorldState], bytes] | None = None  # of the state in which the run ended
    encode_reading: Callable[[Reading], bytes | None] | None = None  # of each reading before the tick's last
    compared: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # by a replay: keys by the part of a tick
    drawing: bool = False  # shows what another topic says: for the live view, and in a log on request
    occasional: bool = False  # a log has it from its first message on, and not where there is none


def _true(name: str, text: str, schema: Schema, encode: Callable[[int, WorldState], bytes], *compared: str) -> Topic:
    """A topic of the truth alone, which it compares: of each tick, and of the state in which the run ended."""
    keys = {"truth": compared} if compared else {}
    return Topic(name, text, schema, lambda r: encode(r.tick, r.truth), encode, compared=keys)


def encode_event(time: float, event: Event) -> bytes:
    """foxglove.Log."""
    level = {"info": Log.INFO, "warning": Log.WARNING, "error": Log.ERROR}.get(event.level, Log.UNKNOWN)
    message = Log(timestamp=geometry.stamp(time), level=level, name=event.name, message=event.text)
    return message.SerializeToString()


def _candidates(record: TickRecord) -> bytes | None:
    costs, belief = record.decision.costs, record.belief
    return (
        None if costs is None or belief is None else candidates.encode_candidates(belief.mean, record.decision, costs)
    )


def _arcs(record: TickRecord) -> bytes | None:
    decision, belief = record.decision, record.belief
    if decision.costs is None or belief is None:
        return None
    return candidates.encode_arcs(record.truth.time, belief.mean, (decision.v, decision.omega), decision.costs)


class _Ways:
    """Encodes a planned way once: in the first tick that has it."""

    def __init__(self, *, draws_map: bool):
        self._draws_map, self._number = draws_map, -1

    def __call__(self, record: TickRecord) -> bytes | None:
        o = record.observation
        if o is None or o.way is None or o.way.number == self._number:
            return None
        self._number = o.way.number
        return json_messages.encode_way(record.tick, o.way, o.map.discs if o.map and self._draws_map else NO_DISCS)


def topics(scenario: Scenario) -> tuple[Topic, ...]:
    """Every topic of a run, in the order in which a tick writes them. /events and /tick have writers of their own."""
    scene = SceneEncoder(scenario)
    lidar = scenario.sensors.scanner
    pose, cloud = foxglove_schema(PoseInFrame), foxglove_schema(PointCloud)
    scene_update, people = foxglove_schema(SceneUpdate), json_messages.document_schema("mjnav.People")
    by_scan = scenario.estimation.obstacles.source == LIDAR
    return (
        Topic(
            "/tf",
            "The frames of the robot and of its lidar in the map, believed and true.",
            foxglove_schema(FrameTransforms),
            lambda r: geometry.encode_transforms(r, lidar),
            lambda tick, final: geometry.encode_true_transform(final),
        ),
        _true(
            "/robot/truth",
            "The robot's true pose.",
            pose,
            lambda tick, truth: geometry.encode_pose(truth.time, truth.robot_pose),
        ),
        Topic(
            "/robot/estimate",
            "The mean of the belief about the robot's pose.",
            pose,
            lambda r: r.belief and geometry.encode_pose(r.truth.time, r.belief.mean),
        ),
        Topic(
            "/robot/state",
            "The robot's true pose and twist, and mean and covariance of the belief about its pose.",
            json_messages.document_schema("mjnav.RobotState"),
            lambda r: json_messages.encode_robot(r.tick, r.truth, r.belief),
            lambda tick, final: json_messages.encode_robot(tick, final, None),
            compared={"truth": ("time", "pose", "twist"), "estimate": ("estimate",)},
        ),
        _true(
            "/people/truth",
            "Every person's true position and velocity.",
            people,
            json_messages.encode_people_truth,
            "people",
        ),
        Topic(
            "/people/estimate",
            "Every person's believed position and velocity with covariance; detections with identity.",
            people,
            json_messages.encode_people_estimate,
            compared={"reading": ("detections",), "tracks": ("people",)},
        ),
        _true(
            "/contacts",
            "What the robot touched since the tick before, and with which force.",
            json_messages.document_schema("mjnav.Contacts"),
            json_messages.encode_contacts,
            "contacts",
        ),
        Topic(
            "/scene",
            "Walls, tables, pillars, lanes, goal, robot and people as shapes that viewers draw.",
            scene_update,
            lambda r: scene.encode(r.truth, r.tracks, r.observation, r.detections, r.decision.plan),
            lambda tick, final: scene.encode(final),
        ),
        Topic(
            "/scan",
            "The ranges of each whole scan of the lidar, stamped with the time of its first beam.",
            foxglove_schema(LaserScan),
            lambda r: r.reading and geometry.encode_scan(r.reading, lidar),
            encode_reading=lambda reading: geometry.encode_scan(reading, lidar),
            compared={"reading": ("ranges",)},
        ),
        Topic(
            "/odometry",
            "Wheel odometry, gyro and pose sensor.",
            json_messages.document_schema("mjnav.Odometry"),
            lambda r: r.reading and json_messages.encode_odometry(r.reading),
            encode_reading=json_messages.encode_odometry,
            compared={"reading": ("time", "interval", "v", "omega", "gyro", "pose")},
        ),
        Topic(
            "/detections",
            "What a scan shows that the map does not explain, where people are tracked by scans.",
            json_messages.document_schema("mjnav.Detections"),
            lambda r: (
                json_messages.encode_detections(r.tick, r.detections)
                if r.detections or (by_scan and r.reading is not None and r.reading.scan.size)
                else None
            ),
            compared={"detections": ("detections",)},
        ),
        Topic(
            "/belief/robot",
            "The particles of the belief about the robot's pose.",
            cloud,
            lambda r: r.belief and particles.encode_robot_particles(r.belief),
        ),
        Topic(
            "/belief/obstacles",
            "The particles of the beliefs about the people.",
            cloud,
            lambda r: particles.encode_track_particles(r.truth.time, r.tracks),
        ),
        Topic(
            "/decision",
            "The control that the method chose, its status, and the terms of its cost.",
            json_messages.document_schema("mjnav.Decision"),
            lambda r: json_messages.encode_decision(r.tick, r.decision),
            compared={"decision": ("nominal", "cost", "wish", "caution", "v", "omega", "status")},
        ),
        Topic(
            "/command",
            "The command that is in force from the tick on.",
            json_messages.document_schema("mjnav.Command"),
            lambda r: json_messages.encode_command(r.tick, r.command),
            compared={"command": ("v", "omega")},
        ),
        Topic(
            "/cone",
            "Samples of the constraint of the closest obstacle at the chosen control, beside the desired ones.",
            candidates.cone_schema(),
            lambda r: r.cone and candidates.encode_cone(r.cone),
        ),
        Topic(
            "/candidates",
            "Every candidate control with the terms of its cost.",
            candidates.candidates_schema(),
            _candidates,
        ),
        Topic(
            "/candidates/arcs",
            "The candidates as coloured arcs: in a live view, not in a log.",
            scene_update,
            _arcs,
            drawing=True,
        ),
        Topic(
            PLAN,
            "The plan that is followed, some of the rollouts weighed, the violation: of methods that plan ahead.",
            plan_schema(),
            lambda r: r.decision.plan and encode_plan(r.decision.plan),
            compared={"decision": ("step", "path", "fan", "fan_cost", "violation", "feasible")},
            occasional=True,
        ),
        Topic(
            WAY,
            "The way to the goal and what the robot has drawn of the floor, each time it is planned: with [route].",
            json_messages.document_schema("mjnav.Way"),
            _Ways(draws_map=scenario.draws_map),
            occasional=True,
        ),
        Topic(
            EVENTS, "Contacts, infeasible decisions, filters that were reset, faults, in words.", foxglove_schema(Log)
        ),
        Topic(
            TIMING,
            "How long each phase of the tick took, and how late it began.",
            json_messages.document_schema("mjnav.TickTiming"),
        ),
    )
