"""The sensors of a run file: the table [sensors]."""

from dataclasses import dataclass, fields
from math import ceil
from typing import Annotated

from mjnav.config import Range, below, settle
from mjnav.errors import InvalidValue
from mjnav.scenarios.lidar import Lidar, LidarSpec, lidar_of
from mjnav.scenarios.lidar_models import LIDARS
from mjnav.scenarios.ranges import Rate


@dataclass(frozen=True, slots=True)
class Sensors:
    """Rates and ranges of the sensors; they do not follow the control rate."""

    rate: Annotated[Rate, "readings a second, of all sensors"] = 10.0
    lidar_beams: Annotated[int, Range(1, 10_000), "beams in a whole turn of the lidar ideal"] = 360
    lidar_range: Annotated[float, Range(0.1, 1000.0, "m"), "beyond which a beam of the lidar ideal meets nothing"] = (
        10.0
    )
    lidar: LidarSpec | None = None  # not in a dump unless it was given

    def __post_init__(self):
        settle(self)
        if self.lidar is None:
            return
        defaults = {field.name: field.default for field in fields(Sensors)}
        for key in ("beams", "max_range"):
            outer = "lidar_range" if key == "max_range" else "lidar_beams"
            own = getattr(self.lidar, key) is not None
            if (own or getattr(LIDARS[self.lidar.model], key) is not None) and getattr(self, outer) != defaults[outer]:
                why = "is given" if own else f"is {self.lidar.model}'s"
                allowed = f"nothing, as sensors.lidar.{key} {why}"
                raise InvalidValue(outer, getattr(self, outer), allowed)
        with below("lidar"):
            self.scanner  # noqa: B018 - checks the figures against one another

    @property
    def longest_pause(self) -> float:
        """[s] from a reading with a scan to the next one, at most: periods of the sensors, and at least a turn."""
        turn = self.scanner.rate
        return (1 if turn is None else ceil(self.rate / turn - 1e-9)) / self.rate

    @property
    def scanner(self) -> Lidar:
        """The lidar with every figure."""
        return lidar_of(self.lidar or LidarSpec(), self.lidar_beams, self.lidar_range)
