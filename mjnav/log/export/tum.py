"""Trajectories in the format of the TUM RGB-D benchmark, which evo reads: one file each, one pose a line.

Of the robot: robot_truth.tum and robot_estimate.tum; of each person: person0_truth.tum and person0_estimate.tum. Times
are simulated seconds, exact to the nanosecond and the same in all files; every number reads back to the last bit. A
person has no heading of its own and faces its velocity.

Source: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from collections.abc import Iterator, Mapping, Sequence
from math import atan2, cos, sin
from pathlib import Path
from typing import Any

from mjnav.log.read.log import Log, LogMessage

TOPICS = ("/robot/state", "/people/truth", "/people/estimate")

_HEADER = "# timestamp tx ty tz qx qy qz qw\n"


def write(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """One file a trajectory; gives the number of poses in each. A pose that is not finite is left out."""
    lines: dict[str, list[str]] = {}  # in memory: there may be more tracks than files that can be open
    for message in messages:
        time = _seconds(message.time_ns)
        for name, (x, y, heading) in _poses(message):
            z, w = sin(0.5 * heading), cos(0.5 * heading)
            lines.setdefault(name, []).append(f"{time} {x!r} {y!r} 0 0 0 {z!r} {w!r}\n")
    folder.mkdir()
    for name in sorted(lines):
        (folder / name).write_text(_HEADER + "".join(lines[name]), encoding="utf-8")
    return {name: len(lines[name]) for name in sorted(lines)}


def _seconds(time_ns: int) -> str:
    """Nanoseconds as seconds, every digit."""
    seconds, nanos = divmod(time_ns, 1_000_000_000)
    return f"{seconds}.{nanos:09d}"


def _poses(message: LogMessage) -> Iterator[tuple[str, list[float]]]:
    """File names with x, y [m], heading [rad]."""
    document = message.value
    if message.topic == "/robot/state":
        poses = {"robot_truth": document["pose"], "robot_estimate": (document["estimate"] or {}).get("mean")}
    else:
        kind = message.topic.rpartition("/")[2]
        poses = {f"{person['name']}_{kind}": _walking(person) for person in document["people"]}
    for name, pose in poses.items():
        if pose is not None and None not in pose:
            yield f"{name.replace('/', '_')}.tum", pose


def _walking(person: Mapping[str, Any]) -> list[float] | None:
    """x, y and the direction of the velocity; None where something is not finite."""
    vx, vy = person["velocity"]
    return None if vx is None or vy is None else [*person["position"], atan2(vy, vx)]
