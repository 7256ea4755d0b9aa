"""The lidars that a run file names, with their makers' figures.

A maker bounds errors: accuracy +-a bounds the systematic error of any unit, precision +-p the scatter of repeated
measurements. Here the unit that is simulated has the mean size of an error that is uniform within +-a, bias = a/2, and
+-p holds 95 % of the scatter, spread = p/2. Where a maker gives one figure for both, it is taken for both.

No maker of these gives the width of the beam in the plane, how often a beam at an edge returns a range between the two
surfaces, or how often nothing returns. These are this project's assumptions, the same for all four.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from types import MappingProxyType

from mjnav.constant import Constant

ByRange = tuple[tuple[float, float], ...]  # (range [m], value) of each corner; straight between them

BEAM_WIDTH = 0.005  # [rad], 2.5 cm at 5 m; assumed
MIXED_SHARE = 0.5  # of the beams at edges; assumed
MISSING_SHARE = 0.005  # of all beams; assumed
MILLIMETRE = 0.001  # [m], the unit in which they tell a range, but for one


@dataclass(frozen=True, slots=True)
class LidarModel(Constant):
    """A lidar by its figures; where `bias` or `spread` is None, the noise profile's law of a range holds as it is."""

    source: str  # of the figures, in a line
    beams: int | None = None  # None: sensors.lidar_beams
    field_of_view: float = 2.0 * pi  # [rad]
    rate: float | None = None  # [Hz] turns a second; None: all beams at once, with each reading
    min_range: float = 0.0  # [m]
    max_range: float | None = None  # [m]; None: sensors.lidar_range
    bias: ByRange | None = None  # [m]
    spread: ByRange | None = None  # [m], standard deviation
    resolution: float = 0.0  # [m]
    beam_width: float = 0.0  # [rad]
    mixed: float = 0.0
    missing: ByRange = ((0.0, 0.0),)


LIDARS: Mapping[str, LidarModel] = MappingProxyType(
    {
        "ideal": LidarModel(source="none: exact ranges with the noise profile's law, all beams at one moment"),
        # Accuracy +-15 mm below 0.5 m, then +-5 %; precision +-10 mm, then +-3.5 %.
        "lds-01": LidarModel(
            source="Robotis, e-manual of TurtleBot3, appendix LDS-01",
            beams=360,
            rate=5.0,
            min_range=0.12,
            max_range=3.5,
            bias=((0.0, 0.0075), (0.5, 0.0075), (0.5, 0.0125), (3.5, 0.0875)),
            spread=((0.0, 0.005), (0.5, 0.005), (0.5, 0.00875), (3.5, 0.06125)),
            resolution=MILLIMETRE,
            beam_width=BEAM_WIDTH,
            mixed=MIXED_SHARE,
            missing=((0.0, MISSING_SHARE),),
        ),
        # 2300 ranges a second at 5 turns. +-10 mm below 0.3 m, +-3 % to 6 m, +-5 % to 8 m; no other precision is given.
        "lds-02": LidarModel(
            source="Robotis, e-manual of TurtleBot3, appendix LDS-02",
            beams=460,
            rate=5.0,
            min_range=0.16,
            max_range=8.0,
            bias=((0.0, 0.005), (0.3, 0.005), (0.3, 0.0045), (6.0, 0.09), (6.0, 0.15), (8.0, 0.2)),
            spread=((0.0, 0.005), (0.3, 0.005), (0.3, 0.0045), (6.0, 0.09), (6.0, 0.15), (8.0, 0.2)),
            resolution=MILLIMETRE,
            beam_width=BEAM_WIDTH,
            mixed=MIXED_SHARE,
            missing=((0.0, MISSING_SHARE),),
        ),
        # Resolution 0.5 mm below 1.5 m, 1 % of the range beyond, read as the precision; no accuracy is given.
        "rplidar-a1": LidarModel(
            source="Slamtec, RPLIDAR A1M8 data sheet, rev. 3.0 (2020)",
            beams=360,
            rate=5.5,
            min_range=0.15,
            max_range=12.0,
            bias=((0.0, 0.0),),
            spread=((0.0, 0.00025), (1.5, 0.00025), (1.5, 0.0075), (12.0, 0.06)),
            resolution=0.25 * MILLIMETRE,
            beam_width=BEAM_WIDTH,
            mixed=MIXED_SHARE,
            missing=((0.0, MISSING_SHARE),),
        ),
        # Accuracy +-30 mm below 10 m, then +-50 mm; std of repeated ranges 10 mm, then 30 mm, given as such.
        "utm-30lx": LidarModel(
            source="Hokuyo, UTM-30LX specification",
            beams=1081,
            field_of_view=1.5 * pi,
            rate=40.0,
            min_range=0.1,
            max_range=30.0,
            bias=((0.0, 0.015), (10.0, 0.015), (10.0, 0.025), (30.0, 0.025)),
            spread=((0.0, 0.01), (10.0, 0.01), (10.0, 0.03), (30.0, 0.03)),
            resolution=MILLIMETRE,
            beam_width=BEAM_WIDTH,
            mixed=MIXED_SHARE,
            missing=((0.0, MISSING_SHARE),),
        ),
    }
)
