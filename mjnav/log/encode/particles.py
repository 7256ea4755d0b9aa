"""/belief/robot and /belief/obstacles: the particles as clouds of points.

x and y are float32, which viewers draw; what they only colour by is a 16-bit integer, in the steps below. That rounds a
heading by 0.05 mrad, a speed by 0.5 mm/s and a weight by a part in 131 070 of the largest: far below what a few hundred
particles tell, at two thirds of the bytes.
"""

from collections.abc import Sequence
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud

from mjnav.geometry.angles import wrap
from mjnav.log.encode.geometry import WORLD_FRAME, pose, stamped
from mjnav.log.encode.protobuf import delimited
from mjnav.messages import Array, RobotBelief, Track

STEPS = MappingProxyType({"theta": 10_000, "vx": 1000, "vy": 1000})  # of the integers: in a radian, in a metre a second
TINY = 1e-300  # a weight
LARGEST_WEIGHT = 65535  # the integer of a belief's largest weight

_PLACE = [("x", "<f4"), ("y", "<f4")]
_ROBOT = np.dtype([*_PLACE, ("theta", "<i2"), ("weight", "<u2")])
_TRACKS = np.dtype([*_PLACE, ("vx", "<i2"), ("vy", "<i2"), ("weight", "<u2"), ("track", "<u2")])
_FIELD = PackedElementField
_TYPES = MappingProxyType({"<f4": _FIELD.FLOAT32, "<i2": _FIELD.INT16, "<u2": _FIELD.UINT16})


@cache  # of the two kinds of rows
def _cloud_columns(rows: np.dtype) -> bytes:
    """foxglove.PointCloud, but for its time and data."""
    fields = [
        PackedElementField(name=name, offset=place[1], type=_TYPES[place[0].str])
        for name, place in (rows.fields or {}).items()
    ]
    cloud = PointCloud(frame_id=WORLD_FRAME, pose=pose(0.0, 0.0), point_stride=rows.itemsize, fields=fields)
    return cloud.SerializeToString()


def _cloud(time: float, epoch: int, table: np.ndarray) -> bytes:
    """foxglove.PointCloud of the rows of a table."""
    data = delimited(6, table.tobytes()) if table.size else b""
    return _cloud_columns(table.dtype) + stamped(time, epoch) + data


def _integers(values: Array, steps: int) -> Array:
    """So many steps in each unit; what 16 bits cannot hold is brought to what they can, NaN to the least."""
    scaled = np.rint(values * steps)
    if not (scaled.min() >= -32768.0 and scaled.max() <= 32767.0):
        scaled = np.fmin(np.fmax(scaled, -32768.0), 32767.0)
    return scaled


def _shares(weights: Array, sizes: Sequence[int]) -> Array:
    """The weights of beliefs one after another, (n,), in steps of each one's largest; 0 for what is not a number."""
    largest = np.fmax.reduceat(weights, np.cumsum([0, *sizes[:-1]]))
    scaled = np.rint(weights * np.repeat(LARGEST_WEIGHT / np.fmax(largest, TINY), sizes))
    return scaled if scaled.min() >= 0.0 else np.fmax(scaled, 0.0)


def encode_robot_particles(belief: RobotBelief, epoch: int = 0) -> bytes:
    """foxglove.PointCloud of x, y, theta and weight."""
    table = np.empty(belief.weights.size, _ROBOT)
    table["x"], table["y"], heading = belief.particles.T
    table["theta"] = _integers(_wrapped(heading), STEPS["theta"])
    table["weight"] = _shares(belief.weights, [belief.weights.size])
    return _cloud(belief.time, epoch, table)


def _wrapped(heading: Array) -> Array:
    """`wrap`, which takes most of its time for the remainder, that of angles within (-pi, pi] leaves as they are."""
    within = np.pi - heading
    return np.pi - within if within.min() >= 0.0 and within.max() < 2.0 * np.pi else wrap(heading)


def encode_track_particles(time: float, tracks: tuple[Track, ...], epoch: int = 0) -> bytes:
    """foxglove.PointCloud of all tracks' x, y, vx, vy, weight, and the track's place in the tuple."""
    if not tracks:
        return _cloud(time, epoch, np.empty(0, _TRACKS))
    x, y, vx, vy = np.concatenate([track.particles.T for track in tracks], axis=1)
    sizes = [track.weights.size for track in tracks]
    table = np.empty(sum(sizes), _TRACKS)
    table["x"], table["y"] = x, y
    table["vx"], table["vy"] = _integers(vx, STEPS["vx"]), _integers(vy, STEPS["vy"])
    table["weight"] = _shares(np.concatenate([track.weights for track in tracks]), sizes)
    table["track"] = np.repeat(np.arange(len(tracks)), sizes)
    return _cloud(time, epoch, table)


def decode_particles(cloud: Any) -> dict[str, Array]:
    """The columns of a cloud in SI units, each (n,), by name; weights add up to 1 in each belief.

    Reads the float32 columns of older logs, too. Raises ValueError or LookupError for what is no cloud of particles.
    """
    formats = {number: name for name, number in _TYPES.items()}
    points = np.dtype(
        {
            "names": [field.name for field in cloud.fields],
            "formats": [formats[field.type] for field in cloud.fields],
            "offsets": [field.offset for field in cloud.fields],
            "itemsize": cloud.point_stride,
        }
    )
    table = np.frombuffer(cloud.data, points)
    columns = {name: table[name].astype(float) for name in points.names or ()}
    for name in STEPS.keys() & columns.keys():
        if points[name].kind == "i":
            columns[name] /= STEPS[name]
    if points["weight"].kind == "u":
        several = "track" in columns and points["track"].kind == "u"
        track = table["track"] if several else np.zeros(table.size, np.uint16)
        columns["weight"] /= np.maximum(np.bincount(track, columns["weight"]), 1.0)[track]
    return columns
