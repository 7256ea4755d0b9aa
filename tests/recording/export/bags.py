"""What tests of bags share: a log's messages beside those of its bag."""

from math import cos, sin


def logged(log, topic):
    """Time [ns] and value of each of the log's messages."""
    return [(message.time_ns, message.value) for message in log.messages(topic)]


def pairs(log, topic, bag, ros_topic):
    """The log's values with the bag's messages, which have the same times."""
    ours, theirs = logged(log, topic), bag[ros_topic]
    assert [time for time, _ in ours] == [time for time, _ in theirs]
    assert ours
    return [(time, value, message) for (time, value), (_, message) in zip(ours, theirs, strict=True)]


def assert_header(header, time_ns: int, frame: str = "map") -> None:
    assert (header.stamp.sec, header.stamp.nanosec, header.frame_id) == (*divmod(time_ns, 10**9), frame)


def assert_pose(pose, x: float, y: float, heading: float) -> None:
    p, q = pose.position, pose.orientation
    assert (p.x, p.y, p.z) == (x, y, 0.0)
    assert (q.x, q.y, q.z, q.w) == (0.0, 0.0, sin(heading / 2), cos(heading / 2))


def same(vector) -> tuple[float, ...]:
    return vector.x, vector.y, vector.z
