"""/cone: the constraint's samples for the closest obstacle at the chosen control."""

from mjnav.messages import ConeDistribution
from mjnav.recording.encode import wire
from mjnav.recording.encode.schemas import Schema, protobuf_schema


def cone_schema() -> Schema:
    """mjnav.ConeDistribution: hundreds of samples a tick as JSON text take longer than the whole tick."""
    fields = (("obstacle", "string", False), ("samples", "float", True), ("desired", "float", True))
    return protobuf_schema(
        "mjnav.ConeDistribution", {"mjnav.ConeDistribution": (*fields, ("safe_share", "double", False))}
    )


def encode_cone(cone: ConeDistribution) -> bytes:
    """F and F^des as float32, the safe share exactly."""
    return b"".join(
        (
            wire.delimited(1, cone.obstacle.encode()),
            wire.packed_floats(2, cone.samples),
            wire.packed_floats(3, cone.desired),
            wire.double(4, cone.safe_share),
        )
    )
