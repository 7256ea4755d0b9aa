import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.log.encode import geometry as wire

finite = st.floats(allow_nan=False, allow_infinity=False)


def points(number: int, xy: np.ndarray) -> bytes:
    table = wire.point_table(number, len(xy))
    table["x"], table["y"] = xy.T
    return table.tobytes()


@given(arrays(float, st.tuples(st.integers(0, 40), st.just(2)), elements=finite))
def test_a_table_of_points_is_what_protobuf_reads_as_the_same_points(xy):
    data = points(5, xy)
    assert len(data) == len(xy) * wire.POINT_SIZE
    parsed = LinePrimitive.FromString(data)
    assert [(p.x, p.y, p.z) for p in parsed.points] == [(*row, 0.0) for row in xy.tolist()]


def encode_line(values) -> bytes:
    x, y, thickness = values
    return LinePrimitive(points=[Point3(x=x, y=y, z=9.0)], thickness=thickness).SerializeToString()


@given(st.tuples(finite, finite, finite))
def test_a_filled_template_reads_as_the_message_with_these_values(values):
    x, thickness, y = values
    # In the order of the wire: the thickness is field 3, the points are field 5.
    template = wire.Template(lambda v: encode_line((v[1], v[2], v[0])), 3)
    assert LinePrimitive.FromString(template.fill([thickness, x, y])) == LinePrimitive.FromString(
        encode_line((x, y, thickness))
    )


def test_a_template_without_a_hole_for_each_value_is_refused():
    with pytest.raises(ValueError, match="hole 1 of 2"):
        wire.Template(lambda values: LinePrimitive(thickness=values[0]).SerializeToString(), 2)


@given(st.integers(0, 2**63 - 1))
def test_a_timestamp_keeps_its_nanoseconds(time_ns):
    parsed = LaserScan.FromString(wire.timestamp(1, time_ns)).timestamp
    assert parsed.seconds * 1_000_000_000 + parsed.nanos == time_ns


@given(arrays(float, st.integers(0, 50), elements=st.floats(allow_nan=False)))
def test_packed_doubles_keep_every_bit(values):
    scan = LaserScan.FromString(wire.packed_doubles(6, values) + wire.double(4, -1.25))
    assert scan.start_angle == -1.25
    np.testing.assert_array_equal(np.array(scan.ranges), values)


@pytest.mark.parametrize("length", [0, 1, 127, 128, 20_000])
def test_a_delimited_field_of_any_length_parses(length):
    assert LaserScan.FromString(wire.delimited(2, b"x" * length)).frame_id == "x" * length
