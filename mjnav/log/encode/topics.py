"""The table of topics: what a tick writes, with which schema."""

from collections.abc import Callable
from dataclasses import dataclass

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjnav.log.encode import geometry, json_messages, particles
from mjnav.log.encode.candidates import (
    candidates_schema,
    cone_schema,
    encode_arcs,
    encode_candidates,
    encode_cone,
)
from mjnav.log.encode.json_messages import document_schema
from mjnav.log.encode.plan import encode_plan, plan_schema
from mjnav.log.encode.protobuf import Schema, foxglove_schema
from mjnav.log.encode.scene import SceneEncoder
from mjnav.messages import Event, Reading, TickRecord, WorldState
from mjnav.scene.spec import Scenario

TIMING = "/tick"
PLAN = "/plan"
LIDAR = "lidar"  # the source of tracks that come about by scans
EVENTS = "/events"


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of the log; an encoder may be missing or, where there is nothing to say, return None."""

    name: str
    schema: Schema
    encode: Callable[[TickRecord], bytes | None] | None = None
    encode_final: Callable[[int, WorldState], bytes] | None = None  # of the state in which the run ended
    encode_reading: Callable[[Reading], bytes | None] | None = None  # of each reading before the tick's last
    drawing: bool = False  # shows what another topic says: for the live view, and in a log on request
    occasional: bool = False  # a log has it from its first message on, and not where there is none


def encode_event(time: float, event: Event, epoch: int = 0) -> bytes:
    """foxglove.Log."""
    level = {"info": Log.INFO, "warning": Log.WARNING, "error": Log.ERROR}.get(event.level, Log.UNKNOWN)
    message = Log(timestamp=geometry.stamp(time, epoch), level=level, name=event.name, message=event.text)
    return message.SerializeToString()


def _candidates(record: TickRecord) -> bytes | None:
    costs, belief = record.decision.costs, record.belief
    return None if costs is None or belief is None else encode_candidates(belief.mean, record.decision, costs)


def _arcs(record: TickRecord, epoch: int) -> bytes | None:
    decision, belief = record.decision, record.belief
    if decision.costs is None or belief is None:
        return None
    return encode_arcs(record.truth.time, belief.mean, (decision.v, decision.omega), decision.costs, epoch)


def topics(scenario: Scenario, epoch: int = 0) -> tuple[Topic, ...]:
    """Every topic of a run, in the order in which a tick writes them. /events and /tick have writers of their own.

    `epoch` [ns] is added to simulated time in the stamps of protobuf messages.
    """
    scene = SceneEncoder(scenario, epoch)
    lidar = scenario.sensors.scanner
    pose, cloud = foxglove_schema(PoseInFrame), foxglove_schema(PointCloud)
    scene_update, people = foxglove_schema(SceneUpdate), document_schema("mjnav.People")
    by_scan = scenario.estimation.obstacles.source == LIDAR
    return (
        Topic(
            "/tf",
            foxglove_schema(FrameTransforms),
            lambda r: geometry.encode_transforms(r, lidar.mount, epoch),
            lambda tick, final: geometry.encode_true_transform(final, epoch),
        ),
        Topic(
            "/robot/truth",
            pose,
            lambda r: geometry.encode_pose(r.truth.time, r.truth.robot_pose, epoch),
            lambda tick, final: geometry.encode_pose(final.time, final.robot_pose, epoch),
        ),
        Topic("/robot/estimate", pose, lambda r: r.belief and geometry.encode_pose(r.truth.time, r.belief.mean, epoch)),
        Topic(
            "/robot/state",
            document_schema("mjnav.RobotState"),
            lambda r: json_messages.encode_robot(r.tick, r.truth, r.belief),
            lambda tick, final: json_messages.encode_robot(tick, final, None),
        ),
        Topic(
            "/people/truth",
            people,
            lambda r: json_messages.encode_people_truth(r.tick, r.truth),
            json_messages.encode_people_truth,
        ),
        Topic("/people/estimate", people, json_messages.encode_people_estimate),
        Topic(
            "/contacts",
            document_schema("mjnav.Contacts"),
            lambda r: json_messages.encode_contacts(r.tick, r.truth),
            json_messages.encode_contacts,
        ),
        Topic(
            "/scene",
            scene_update,
            lambda r: scene.encode(r.truth, r.tracks, r.observation, r.detections, r.decision.plan),
            lambda tick, final: scene.encode(final),
        ),
        Topic(
            "/scan",
            foxglove_schema(LaserScan),
            lambda r: r.reading and geometry.encode_scan(r.reading, lidar, epoch),
            encode_reading=lambda reading: geometry.encode_scan(reading, lidar, epoch),
        ),
        Topic(
            "/odometry",
            document_schema("mjnav.Odometry"),
            lambda r: r.reading and json_messages.encode_odometry(r.reading),
            encode_reading=json_messages.encode_odometry,
        ),
        Topic(
            "/detections",
            document_schema("mjnav.Detections"),
            lambda r: (
                json_messages.encode_detections(r.tick, r.detections)
                if r.detections or (by_scan and r.reading is not None and r.reading.scan.size)
                else None
            ),
        ),
        Topic("/belief/robot", cloud, lambda r: r.belief and particles.encode_robot_particles(r.belief, epoch)),
        Topic("/belief/obstacles", cloud, lambda r: particles.encode_track_particles(r.truth.time, r.tracks, epoch)),
        Topic(
            "/decision", document_schema("mjnav.Decision"), lambda r: json_messages.encode_decision(r.tick, r.decision)
        ),
        Topic("/command", document_schema("mjnav.Command"), lambda r: json_messages.encode_command(r.tick, r.command)),
        Topic("/cone", cone_schema(), lambda r: r.cone and encode_cone(r.cone)),
        Topic("/candidates", candidates_schema(), _candidates),
        Topic("/candidates/arcs", scene_update, lambda r: _arcs(r, epoch), drawing=True),
        Topic(PLAN, plan_schema(), lambda r: r.decision.plan and encode_plan(r.decision.plan), occasional=True),
        Topic(EVENTS, foxglove_schema(Log)),
        Topic(TIMING, document_schema("mjnav.TickTiming")),
    )
