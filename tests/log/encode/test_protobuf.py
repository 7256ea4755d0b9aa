"""Protobuf's wire format: what is written as bytes is what protobuf reads."""

import numpy as np
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.log.encode.protobuf import encode_fields, encode_points, numbered, protobuf_schema
from tests.log.conftest import message_class

finite = st.floats(allow_nan=False, allow_infinity=False)
FIELDS = (("text", "string", False), ("number", "double", False), ("doubles", "double", True))
FIELDS += (("floats", "float", True), ("whole", "int32", False), ("yes", "bool", False), ("parts", "mjnav.Part", True))
PART = (("values", "float", True),)


@given(arrays(float, st.tuples(st.integers(0, 40), st.just(2)), elements=finite))
def test_points_are_what_protobuf_reads_as_the_same_points(xy):
    parsed = LinePrimitive.FromString(encode_points(5, xy))
    assert [(p.x, p.y, p.z) for p in parsed.points] == [(*row, 0.0) for row in xy.tolist()]


@given(arrays(float, st.integers(0, 50), elements=st.floats(allow_nan=False)), st.integers(-(2**31), 2**31 - 1))
def test_a_message_reads_back_through_the_schema_of_its_fields(values, whole):
    schema = protobuf_schema("mjnav.Made", {"mjnav.Part": PART, "mjnav.Made": FIELDS})
    part = encode_fields(PART, values[:3])
    data = encode_fields(FIELDS, "né", -1.25, values, values, whole, True, [part, b""])
    message = message_class(schema).FromString(data)
    assert (message.text, message.number, message.whole, message.yes) == ("né", -1.25, whole, True)
    np.testing.assert_array_equal(np.array(message.doubles), values)
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(np.array(message.floats, "f4"), values.astype("f4"))
        assert [np.array(part.values, "f4").tolist() for part in message.parts] == [
            values[:3].astype("f4").tolist(),
            [],
        ]


def cube(height: float, numbers) -> CubePrimitive:
    x, y, side = numbers
    return CubePrimitive(pose={"position": {"x": x, "y": y, "z": height}}, size={"x": side, "y": side, "z": y})


@given(st.lists(st.sampled_from((0.0, -0.0)) | st.floats(), min_size=3, max_size=3))
def test_numbers_put_in_their_places_are_the_bytes_that_protobuf_writes(numbers):
    assert numbered(cube)(0.5, numbers) == cube(0.5, numbers).SerializeToString()
