"""/belief/robot and /belief/obstacles: the particles as clouds of points.

x and y are float32, which viewers draw; what they only colour by is a 16-bit integer, in the steps below. That rounds a
heading by 0.05 mrad, a speed by 0.5 mm/s and a weight by a part in 131 070 of the largest: far below what a few hundred
particles tell, at two thirds of the bytes.
"""

from collections.abc import Sequence
from functools import cache
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from numpy.typing import NDArray

from mjnav.compile.compiled import Contiguous, Indices, Matrix, Vector, exact
from mjnav.geometry.angles import rounded
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


def _cloud(time: float, table: np.ndarray) -> bytes:
    """foxglove.PointCloud of the rows of a table."""
    data = delimited(6, table.tobytes()) if table.size else b""
    return _cloud_columns(table.dtype) + stamped(time) + data


def encode_robot_particles(belief: RobotBelief) -> bytes:
    """foxglove.PointCloud of x, y, theta and weight."""
    return _cloud(belief.time, _rows(_ROBOT, [belief], "theta"))


def encode_track_particles(time: float, tracks: tuple[Track, ...]) -> bytes:
    """foxglove.PointCloud of all tracks' x, y, vx, vy, weight, and the track's place in the tuple."""
    return _cloud(time, _rows(_TRACKS, tracks, "vx") if tracks else np.empty(0, _TRACKS))


def _rows(rows: np.dtype, beliefs: Sequence[RobotBelief | Track], first: str) -> np.ndarray:
    """The particles of beliefs one after another; the column `first` has the first of their integers."""
    sizes = [belief.weights.size for belief in beliefs]
    table = np.empty((sum(sizes), rows.itemsize), np.uint8)
    particles = np.ascontiguousarray(np.concatenate([belief.particles for belief in beliefs]))
    weights, turns = np.concatenate([belief.weights for belief in beliefs]), first == "theta"
    fill(table.view(np.float32), table.view(np.uint16), particles, weights, np.array(sizes), STEPS[first], turns)
    return table.view(rows)


@exact
def fill(
    floats: Annotated[NDArray[np.float32], Contiguous("float32", 2)],
    integers: Annotated[NDArray[np.uint16], Contiguous("uint16", 2)],
    particles: Matrix,
    weights: Vector,
    sizes: Indices,
    steps: int,
    turns: bool,
):
    """Fills rows, which are both `floats` and `integers`: place, the rest in `steps`, weight, number of the belief.

    What 16 bits cannot hold is brought to what they can, NaN to the least. Weights are in steps of each belief's
    largest. Where the rest `turns`, there is one belief, which has no number.
    """
    columns, last = particles.shape[1], 0
    for number in range(len(sizes)):
        first, last = last, last + sizes[number]
        largest = TINY
        for i in range(first, last):
            if weights[i] > largest:
                largest = weights[i]
        scale = LARGEST_WEIGHT / largest
        for i in range(first, last):
            floats[i, 0], floats[i, 1] = particles[i, 0], particles[i, 1]
            for j in range(2, columns):
                value = particles[i, j]
                if turns:
                    value = rounded(value)
                value = np.rint(value * steps)
                integers[i, 2 + j] = int(min(value, 32767.0)) if value > -32768.0 else -32768
            share = np.rint(weights[i] * scale)
            integers[i, 2 + columns] = int(share) if share > 0.0 else 0
            if not turns:
                integers[i, 3 + columns] = number


def decode_particles(cloud: Any) -> dict[str, Array]:
    """The columns of a cloud in SI units, each (n,), by name; weights add up to 1 in each belief.

    Raises ValueError, TypeError or LookupError for what is no cloud of particles.
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
        columns[name] /= STEPS[name]
    track = table["track"] if "track" in columns else np.zeros(table.size, np.uint16)
    columns["weight"] /= np.maximum(np.bincount(track, columns["weight"]), 1.0)[track]
    return columns
