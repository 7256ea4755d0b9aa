"""Sensors of a run file: lidar models with their makers' figures, the table [sensors.lidar], the table [sensors].

A maker bounds errors: accuracy +-a bounds the systematic error of any unit, precision +-p the scatter of repeated
measurements. Here the unit that is simulated has the mean size of an error that is uniform within +-a, bias = a/2, and
+-p holds 95 % of the scatter, spread = p/2. Where a maker gives one figure for both, it is taken for both.

No maker of these lidars gives the width of the beam in the plane, how often a beam at an edge returns a range between
the two surfaces, or how often nothing returns. These are this project's assumptions, the same for all four.

The table [sensors.lidar] names a lidar and may replace its figures (`LidarSpec`); `Lidar` is the lidar that results.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from itertools import pairwise
from math import ceil, pi
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from mjnav.constant import Constant
from mjnav.errors import InvalidValue
from mjnav.geometry.distances import WHOLE_TURN, beam_angles
from mjnav.messages import Array
from mjnav.noise import Distribution
from mjnav.scene.ranges import Rate
from mjnav.sealed import sealed
from mjnav.settings import Choice, Length, Range, Settled, below
from mjnav.short_repr import ShortRepr

# ------------------------------------------------------------------------------------- lidar models


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


_ASSUMED: dict[str, Any] = {"beam_width": BEAM_WIDTH, "mixed": MIXED_SHARE, "missing": ((0.0, MISSING_SHARE),)}
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
            **_ASSUMED,
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
            **_ASSUMED,
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
            **_ASSUMED,
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
            **_ASSUMED,
        ),
    }
)


# ------------------------------------------------------------------------ the table [sensors.lidar]


_MAX_RANGE = 1000.0  # [m]
_Distance = Annotated[float, Range(0.0, _MAX_RANGE, "m")]
_Bias = Annotated[float, Range(-10.0, 10.0, "m")]
_Spread = Annotated[float, Range(0.0, 10.0, "m")]
_Share = Annotated[float, Range(0.0, 1.0)]
_OnBody = Annotated[float, Range(-0.5, 0.5, "m")]
_ROWS = Length(1, 100)
_BY_RANGE = "; or [[range, value], ...], straight between the rows"


@dataclass(frozen=True, slots=True)
class LidarSpec(Settled):
    """A lidar by name, and figures of one's own in place of the maker's."""

    model: Annotated[str, Choice(LIDARS), "whose figures hold for the keys that are not given"] = "ideal"
    beams: Annotated[Annotated[int, Range(1, 10_000)] | None, "in the field of view"] = None
    field_of_view: Annotated[Annotated[float, Range(0.01, WHOLE_TURN, "rad")] | None, "around the lidar's heading"] = (
        None
    )
    rate: Annotated[
        Annotated[float, Range(0.1, 100.0, "Hz")] | None, "turns a second; of ideal, all beams at once at each reading"
    ] = None
    min_range: Annotated[_Distance | None, "below which nothing returns"] = None
    max_range: Annotated[Annotated[float, Range(0.1, _MAX_RANGE, "m")] | None, "beyond which a beam meets nothing"] = (
        None
    )
    bias: Annotated[
        _Bias | Annotated[tuple[tuple[_Distance, _Bias], ...], _ROWS] | None, f"mean error of a range{_BY_RANGE}"
    ] = None
    spread: Annotated[
        _Spread | Annotated[tuple[tuple[_Distance, _Spread], ...], _ROWS] | None,
        f"standard deviation of a range; its shape is the noise profile's{_BY_RANGE}",
    ] = None
    resolution: Annotated[
        Annotated[float, Range(0.0, 1.0, "m")] | None, "ranges are whole multiples of it; 0 for none"
    ] = None
    beam_width: Annotated[Annotated[float, Range(0.0, 0.5, "rad")] | None, "angle over which a beam meets surfaces"] = (
        None
    )
    mixed: Annotated[_Share | None, "share of the beams on two surfaces that return a range between them"] = None
    missing: Annotated[
        _Share | Annotated[tuple[tuple[_Distance, _Share], ...], _ROWS] | None,
        f"share of the beams from which nothing returns{_BY_RANGE}",
    ] = None
    calibrated: Annotated[bool, "estimators know the bias and take it off"] = True
    height: Annotated[float, Range(0.02, 3.0, "m"), "of the scan above the floor"] = 0.33
    mount: Annotated[
        tuple[_OnBody, _OnBody, Annotated[float, Range(-pi, pi, "rad")]],
        "x forwards, y to the left and yaw of the lidar on the robot",
    ] = (0.0, 0.0, 0.0)

    def _check(self):
        for key in ("bias", "spread", "missing"):
            rows = getattr(self, key)
            if isinstance(rows, tuple):
                for i, (before, after) in enumerate(pairwise(rows), 1):
                    if after[0] < before[0]:
                        raise InvalidValue(
                            f"{key}.{i}.0", after[0], f"a range from {before[0]:g} m on, of the row before"
                        )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Lidar(Constant, ShortRepr):
    """A lidar with every figure. Its beams turn counter-clockwise; where nothing returned, a range is inf."""

    model: str
    angles: Array  # (B,) [rad] of the beams against the mount's heading, in the order in which they are taken
    field_of_view: float  # [rad]
    mount: Array  # (3,) x, y [m], yaw [rad] of the lidar on the robot's body
    height: float  # [m] of the scan above the floor: mjnav's own is over the robot's back and under every table's top
    rate: float | None  # [Hz]; None: all beams at the moment of each reading
    min_range: float  # [m]
    max_range: float  # [m]
    resolution: float  # [m], 0 for none
    beam_width: float  # [rad]
    mixed: float  # share of the beams on two surfaces that return a range between them
    calibrated: bool  # whether the robot knows the bias
    bias_rows: ByRange | None  # None: the mean of the noise profile's law of a range
    spread_rows: ByRange | None  # None: its standard deviation
    missing_rows: ByRange

    @property
    def step(self) -> float:
        """[rad] between neighbouring beams; a whole turn where there is one beam."""
        return float(self.angles[1] - self.angles[0]) if len(self.angles) > 1 else WHOLE_TURN

    @property
    def turn_offsets(self) -> Array:
        """(B,) [s] of each beam behind the first one of its turn; zero where all are taken at once."""
        if self.rate is None:
            return np.zeros(len(self.angles))
        return (self.angles - self.angles[0]) / (WHOLE_TURN * self.rate)

    @property
    def has_own_errors(self) -> bool:
        """Whether bias or spread is its own; otherwise errors are draws of the noise profile's law as they are."""
        return self.bias_rows is not None or self.spread_rows is not None

    def bias(self, ranges: ArrayLike, noise: Distribution) -> Array:
        """The mean error [m] at true ranges, of their shape; `noise` is the law of the channel lidar.range."""
        if self.bias_rows is None:
            return np.full(np.shape(ranges), noise.mean)
        return by_range(self.bias_rows, ranges)

    def known_bias(self, ranges: ArrayLike, noise: Distribution) -> Array:
        """The part of `bias` that an estimator takes off: of a lidar that is not calibrated, none of its own."""
        if self.calibrated or self.bias_rows is None:
            return self.bias(ranges, noise)
        return np.zeros(np.shape(ranges))

    def std(self, ranges: ArrayLike, noise: Distribution) -> Array:
        """The standard deviation [m] at true ranges, of their shape; `noise` is the law of the channel lidar.range.

        0 where that law has none, as under the profile none.
        """
        if self.spread_rows is None or noise.std == 0.0:
            return np.full(np.shape(ranges), noise.std)
        return by_range(self.spread_rows, ranges)

    def missing(self, ranges: ArrayLike) -> Array:
        """The share of beams from which nothing returns, at true ranges, of their shape."""
        return by_range(self.missing_rows, ranges)


def by_range(rows: ByRange, ranges: ArrayLike) -> Array:
    """The value at each range: straight between the rows, constant before the first and behind the last one.

    Two rows at one range are a step.
    """
    at, values = np.array(rows).T
    return np.asarray(np.interp(np.asarray(ranges, float), at, values), float)


@lru_cache(maxsize=64)  # asked for by whatever meets a scan
def lidar_of(spec: LidarSpec, beams: int, max_range: float) -> Lidar:
    """The lidar of a run file; `ideal` has no `beams` and `max_range` of its own, but those of the keys beside it.

    Raises InvalidValue with a key of [sensors.lidar].
    """
    model: LidarModel = LIDARS[spec.model]
    defaults = {field.name: getattr(model, field.name) for field in fields(model)}
    own = {key: getattr(spec, key) for key in defaults if getattr(spec, key, None) is not None}
    found: dict[str, Any] = {"beams": beams, "max_range": max_range}
    found |= {key: value for key, value in defaults.items() if value is not None} | own
    if found["min_range"] >= found["max_range"]:
        key = "min_range" if spec.min_range is not None else "max_range"
        other = "max_range" if key == "min_range" else "min_range"
        side = "below" if key == "min_range" else "above"
        raise InvalidValue(key, found[key], f"a range {side} {other} ({found[other]:g} m)")
    same = ("field_of_view", "min_range", "max_range", "resolution", "beam_width", "mixed")
    return Lidar(
        model=spec.model,
        angles=sealed(beam_angles(found["beams"], found["field_of_view"])),
        mount=sealed(np.array(spec.mount)),
        height=spec.height,
        rate=found.get("rate"),
        calibrated=spec.calibrated,
        bias_rows=_rows(found.get("bias")),
        spread_rows=_rows(found.get("spread")),
        missing_rows=_rows(found["missing"]) or ((0.0, 0.0),),
        **{key: found[key] for key in same},
    )


def check_lidar(lidar: Lidar, radius: float, timestep: float) -> None:
    """Raises InvalidValue where the lidar stands beside the body of this radius [m], or turns within a step [s]."""
    away = float(np.hypot(lidar.mount[0], lidar.mount[1]))
    if away > radius:
        allowed = f"a place on the body, within robot.radius ({radius:g} m) of its centre"
        raise InvalidValue("sensors.lidar.mount", tuple(lidar.mount[:2].tolist()), allowed)
    if lidar.rate is not None and lidar.rate * timestep > 1.0:
        allowed = f"at most a turn in each step of physics.timestep ({timestep:g} s)"
        raise InvalidValue("sensors.lidar.rate", lidar.rate, allowed)


def _rows(value: float | ByRange | None) -> ByRange | None:
    return value if value is None or isinstance(value, tuple) else ((0.0, value),)


# ------------------------------------------------------------------------------ the table [sensors]


@dataclass(frozen=True, slots=True)
class Sensors(Settled):
    """Rates and ranges of the sensors; they do not follow the control rate."""

    rate: Annotated[Rate, "readings a second, of all sensors"] = 10.0
    lidar_beams: Annotated[int, Range(1, 10_000), "beams in a whole turn of the lidar ideal"] = 360
    lidar_range: Annotated[float, Range(0.1, 1000.0, "m"), "beyond which a beam of the lidar ideal meets nothing"] = (
        10.0
    )
    # These are not in a dump unless they were given.
    lidar: LidarSpec | None = None
    detection_range: Annotated[
        Annotated[float, Range(0.1, 1000.0, "m")] | None,
        "between the surfaces of robot and person, beyond which nobody is detected; unlimited by default",
    ] = None

    def _check(self):
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
