"""/scan as foxglove.LaserScan: a scan's ranges in the lidar's own frame, and where that frame is on the robot."""

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from mjnav.messages import Array, Reading
from mjnav.motion.diff_drive import LIDAR_HEIGHT
from mjnav.recording.encode import wire
from mjnav.recording.encode.geometry import LIDAR_FRAME, ROBOT_FRAME, pose, rotation, time_ns
from mjnav.scenarios.lidar import Lidar


class ScanEncoder:
    """Encodes a lidar's scans. The beams are evenly spread from the first one's angle to the last one's."""

    def __init__(self, lidar: Lidar, epoch: int = 0):
        self._epoch = epoch
        start, end = lidar.angles[[0, -1]].tolist()
        origin = wire.delimited(3, pose(0.0, 0.0).SerializeToString())
        self._header = wire.delimited(2, LIDAR_FRAME.encode()) + origin + wire.double(4, start) + wire.double(5, end)

    def encode(self, reading: Reading) -> bytes | None:
        """foxglove.LaserScan, stamped with the time of its first beam; None of a reading without a scan."""
        if not reading.scan.size:
            return None
        taken = reading.scan_times[0] if reading.scan_times.size else reading.time
        time = wire.timestamp(1, time_ns(float(taken), self._epoch))
        return time + self._header + wire.packed_doubles(6, reading.scan)


def encode_mount(mount: Array) -> bytes:
    """foxglove.FrameTransform, but for its time: the lidar's frame in the robot's."""
    x, y, yaw = mount.tolist()
    shift = Vector3(x=x, y=y, z=LIDAR_HEIGHT)
    return FrameTransform(
        parent_frame_id=ROBOT_FRAME, child_frame_id=LIDAR_FRAME, translation=shift, rotation=rotation(yaw)
    ).SerializeToString()
