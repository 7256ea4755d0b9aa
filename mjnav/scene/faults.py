"""What goes wrong in a run: the table [faults] of a run file.

A sensor or the wheels have a table of their own, and in it a table for each kind of fault, so that one fault is one
key: faults.lidar.dropout.share = 0.5.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from math import inf
from typing import Annotated

from mjnav.errors import InvalidValue
from mjnav.geometry.floor import TOUCH
from mjnav.scene.bodies import Box, Disc
from mjnav.scene.ranges import MAX_BODIES, MAX_TIME, Angle, Coordinate
from mjnav.settings import Choice, Key, Length, Range, Settled, below

Time = Annotated[float, Range(0.0, MAX_TIME, "s")]
Share = Annotated[float, Range(0.0, 1.0)]
Magnitude = Annotated[float, Range(0.0, 1e4)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault(Settled):
    """A fault that lasts from one moment to another."""

    start: Annotated[Time, Key("from"), "when it begins"] = 0.0
    end: Annotated[float, Range(0.0, MAX_TIME, "s", or_inf=True), Key("to"), "when it is over"] = inf

    def _check(self):
        if self.end <= self.start:
            raise InvalidValue("to", self.end, f"a time after `from` ({self.start:g} s)")

    def lasts(self, time: float) -> bool:
        """Whether it is there at a moment [s]."""
        return self.start - 1e-9 <= time < self.end - 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Dropout(Fault):
    """Messages are lost, each independently of the others."""

    share: Annotated[Share, "of messages that are lost"] = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Outliers(Fault):
    """Values are off by `size` to either side: of a scan single beams, of detections single people, else all."""

    share: Annotated[Share, "of values that are off"] = 0.1
    size: Annotated[Magnitude, "by how much, in the units of the sensor: m, rad, m/s or rad/s"] = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class BiasWalk(Fault):
    """An error that starts at zero and walks at random; of a scan and of detections all values share it."""

    size: Annotated[
        Magnitude, "its std after one second, in the units of the sensor; it grows with the root of time"
    ] = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Stuck(Fault):
    """Messages go on with the value that was the last one before, or the first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Late(Fault):
    """Messages arrive late, the newest that has arrived with each reading. They say when they were measured."""

    delay: Annotated[float, Range(0.0, 1000.0, "s"), "between measurement and arrival"] = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeated(Fault):
    """In place of a message the one before comes again."""

    share: Annotated[Share, "of messages in whose place the one before comes"] = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class NotANumber(Fault):
    """Messages hold NaN in place of numbers."""

    share: Annotated[Share, "of messages that hold NaN"] = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocked(Fault):
    """Something on the lidar covers a sector: its beams meet that in place of the world."""

    angles: Annotated[tuple[Angle, Angle], "against the robot's heading, counter-clockwise from the first"] = (
        -0.5,
        0.5,
    )
    range: Annotated[
        float, Range(0.0, 1000.0, "m", or_inf=True), "what beams of the sector measure; inf where they return nothing"
    ] = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Slip(Fault):
    """Wheels turn as they should and the robot moves less; its encoders do not know."""

    side: Annotated[str, Choice(("left", "right", "both")), "the wheel that slips"] = "both"
    factor: Annotated[Share, "speed over the floor, of the speed that the wheel would have without slip"] = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelFaults(Settled):
    """What goes wrong with one sensor's messages."""

    dropout: Dropout | None = None
    outliers: Outliers | None = None
    bias_walk: BiasWalk | None = None
    stuck: Stuck | None = None
    late: Late | None = None
    repeated: Repeated | None = None
    nan: NotANumber | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LidarFaults(ChannelFaults):
    """What goes wrong with the lidar, whose messages are scans."""

    blocked: Blocked | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelFaults(ChannelFaults):
    """What goes wrong with the wheels; their messages are the commands, one a control period."""

    slip: Slip | None = None


@dataclass(frozen=True, slots=True)
class Kidnapping(Settled):
    """The robot is put elsewhere, and none of its sensors but the lidar and the pose sensor notices."""

    time: Annotated[Time, "when that happens"]
    pose: Annotated[tuple[Coordinate, Coordinate, Angle], "x, y and heading where it is put"]


@dataclass(frozen=True, slots=True)
class Faults(Settled):
    """What goes wrong in the run, by sensor or actuator and kind."""

    kidnap: Annotated[
        Kidnapping | Annotated[tuple[Kidnapping, ...], Length(1, MAX_BODIES)] | None,
        "the robot is put elsewhere, once or several times",
    ] = None
    lidar: LidarFaults | None = None
    odometry: ChannelFaults | None = None
    gyro: ChannelFaults | None = None
    pose: ChannelFaults | None = None
    detections: ChannelFaults | None = None
    wheels: WheelFaults | None = None

    def _check(self):
        times = [kidnapping.time for kidnapping in self.kidnappings]
        if sorted(set(times)) != times:
            raise InvalidValue("kidnap", times, "times that increase")

    @property
    def kidnappings(self) -> tuple[Kidnapping, ...]:
        """All of them, in order of time."""
        if self.kidnap is None:
            return ()
        return self.kidnap if isinstance(self.kidnap, tuple) else (self.kidnap,)

    def each(self) -> Iterator[tuple[str, str, Fault]]:
        """Channel ("lidar"), kind ("dropout") and fault of all that have a time of their own, in a fixed order."""
        for channel in ("lidar", "odometry", "gyro", "pose", "detections", "wheels"):
            given = getattr(self, channel)
            for field in () if given is None else fields(given):
                if (fault := getattr(given, field.name)) is not None:
                    yield channel, field.name, fault


def check_kidnappings(faults: Faults | None, radius: float, bodies: Sequence[Box | Disc]) -> None:
    """Raises InvalidValue for a pose at which the robot would stand in a body."""
    if faults is None or faults.kidnap is None:
        return
    for i, kidnapping in enumerate(faults.kidnappings):
        with below("faults"), below("kidnap"), below(str(i) if isinstance(faults.kidnap, tuple) else ""):
            for body in bodies:
                missing = radius - body.distance(kidnapping.pose[:2])
                if missing > TOUCH:
                    allowed = f"a place clear of {body.key}, {missing:.3f} m further away"
                    raise InvalidValue("pose", kidnapping.pose, allowed)
