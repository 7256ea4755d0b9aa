import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from google.protobuf.timestamp_pb2 import Timestamp
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.recording import wire

finite = st.floats(allow_nan=False, allow_infinity=False)


@given(arrays(float, st.tuples(st.integers(0, 40), st.just(2)), elements=finite))
def test_packed_points_are_what_protobuf_reads_as_the_same_points(xy):
    data = wire.points(5, *xy.T)
    assert len(data) == len(xy) * wire.POINT_SIZE
    parsed = LinePrimitive.FromString(data)
    assert [(p.x, p.y, p.z) for p in parsed.points] == [(*row, 0.0) for row in xy.tolist()]


def test_packed_points_equal_protobufs_own_bytes():
    message = LinePrimitive(points=[Point3(x=1.5, y=-2.5), Point3(x=4.0, y=5.0)])
    assert wire.points(5, [1.5, 4.0], [-2.5, 5.0]) == message.SerializeToString()


@given(st.integers(0, 2**63 - 1))
def test_a_timestamp_keeps_its_nanoseconds(time_ns):
    parsed = LaserScan.FromString(wire.timestamp(1, time_ns)).timestamp
    assert parsed.seconds * 1_000_000_000 + parsed.nanos == time_ns


@given(st.integers(0, 2**64 - 1))
def test_a_varint_equals_protobufs(value):
    assert wire.integer(1, value % 2**63) == (
        Timestamp(seconds=value % 2**63).SerializeToString() or wire.integer(1, 0)
    )


@given(arrays(float, st.integers(0, 50), elements=st.floats(allow_nan=False)))
def test_packed_doubles_keep_every_bit(values):
    scan = LaserScan.FromString(wire.packed_doubles(6, values) + wire.double(4, -1.25))
    assert scan.start_angle == -1.25
    np.testing.assert_array_equal(np.array(scan.ranges), values)


@pytest.mark.parametrize("length", [0, 1, 127, 128, 20_000])
def test_a_delimited_field_of_any_length_parses(length):
    assert LaserScan.FromString(wire.delimited(2, b"x" * length)).frame_id == "x" * length
