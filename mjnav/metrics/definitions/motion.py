"""How the robot went: its path, how close it came to things, how smoothly it moved."""

from collections.abc import Mapping
from types import MappingProxyType

from mjnav.metrics.definitions.definition import HIGHER, LOWER, Definition
from mjnav.metrics.definitions.outcome import TABLE_1

PATH: Mapping[str, Definition] = MappingProxyType(
    {
        "path_length_m": Definition(
            text="length of the driven path",
            unit="m", better=LOWER, equation=r"\sum_k \lvert p_{k+1} - p_k\rvert", source=TABLE_1,
        ),
        "straight_line_m": Definition(
            text="length of the polyline from the start over the waypoints to the goal", unit="m"
        ),
        "path_ratio": Definition(
            text="path_length_m / straight_line_m",
            better=LOWER, words="path over straight line", null="a polyline without length",
        ),
        "spl": Definition(
            text="success weighted by path length: 0 without success, else straight_line_m over the longer of "
            "path_length_m and itself",
            better=HIGHER, words="success weighted by path length", equation=r"S\,\ell / \max(\ell, L)",
            source="Anderson et al. (2018)", null="a polyline without length", over_all=True,
        ),
        "mean_deviation_m": Definition(
            text="lateral distance from the polyline of start, waypoints and goal, mean over time by trapezoids; "
            "beyond an end it is the distance from the line prolonged, so that being early or late is no deviation",
            unit="m", better=LOWER, words="mean deviation",
            equation=r"\frac{1}{t_T - t_0}\int \delta(t)\,dt",
        ),
        "max_deviation_m": Definition(
            text="lateral distance from the polyline of start, waypoints and goal, maximum",
            unit="m", better=LOWER, words="greatest deviation", equation=r"\max_k \delta(t_k)",
        ),
        "min_clearance_m": Definition(
            text="least distance of the robot's surface from any other, over straight moves between ticks; 0 or "
            "negative in contact, but for a millimetre in the kinematic engine. Table tops do not count",
            unit="m", better=HIGHER, words="least clearance", null="an empty room", over_all=True,
        ),
        "min_obstacle_clearance_m": Definition(
            text="the same from walls, legs of tables and pillars alone",
            unit="m", better=HIGHER, words="least clearance from things", source=f"{TABLE_1}: clearing distance",
            null="nothing but people", over_all=True,
        ),
        "mean_obstacle_clearance_m": Definition(
            text="the same, mean over the ticks of the least distance in each",
            unit="m", words="mean clearance from things", source=f"{TABLE_1}: clearing distance",
            null="nothing but people", over_all=True,
        ),
        "lane_violation_s": Definition(
            text="time for which any part of the robot was beyond a lane's boundary, linear between ticks",
            unit="s", better=LOWER, words="time over a lane's edge", null="no lanes",
        ),
        "min_lane_clearance_m": Definition(
            text="from the robot's edge to the nearer boundary, minimum; negative beyond it",
            unit="m", better=HIGHER, words="least distance from the lane's edge", null="no lanes", over_all=True,
        ),
        "mean_lane_clearance_m": Definition(
            text="from the robot's edge to the nearer boundary, mean over time; negative beyond it",
            unit="m", better=HIGHER, words="mean distance from the lane's edge", null="no lanes", over_all=True,
        ),
        "time_to_avoid_s": Definition(
            text="from the first to the last tick at which 1 s of the nominal control ends more than 0.2 rad to the "
            "side of the next waypoint; ticks before the first that keeps the way do not count; 0 where it never "
            "leaves",
            unit="s", better=LOWER, null="no nominal control",
        ),
    }
)  # fmt: skip

_EXTREMES = MappingProxyType({"min": "minimum", "mean": "mean", "max": "maximum"})


def _extremes(what: str, unit: str, text: str, equation: str, better: str = "") -> dict[str, Definition]:
    """Minimum, mean and maximum of one quantity over the ticks."""
    suffix = unit.replace("/", "_").replace("²", "2").replace("³", "3")
    return {
        f"{part}_{what}_{suffix}": Definition(
            text=f"{text}, {word} over the ticks", unit=unit, equation=equation, source=TABLE_1, null="too few ticks",
            better=better if part != "min" else "", words=f"{word} {what}",
        )
        for part, word in _EXTREMES.items()
    }  # fmt: skip


MOTION: Mapping[str, Definition] = MappingProxyType(
    {
        "control_cost": Definition(
            text="sum of (dv^2 + (track_width/2)^2 domega^2)/dt over the commands, from rest: both terms are changes "
            "of the wheels' speeds",
            unit="m²/s³", better=LOWER,
            equation=r"\sum_k \left((v_k - v_{k-1})^2 + (b/2)^2 (\omega_k - \omega_{k-1})^2\right)/\Delta t",
        ),
        **_extremes("speed", "m/s", "the robot's true speed", r"\lvert u_k\rvert"),
        **_extremes(
            "acceleration", "m/s²", "magnitude of the change of the robot's true velocity in the plane from tick to "
            "tick, over the period: turning counts", r"\lvert a_k\rvert,\ a_k = (u_{k+1} - u_k)/\Delta t", LOWER,
        ),
        **_extremes(
            "jerk", "m/s³", "magnitude of the change of that acceleration from tick to tick, over the period",
            r"\lvert a_{k+1} - a_k\rvert/\Delta t", LOWER,
        ),
        "stalled_s": Definition(
            text="time with a true speed below 0.1 m/s", unit="s", better=LOWER, words="time stalled", source=TABLE_1
        ),
        "not_moving_s": Definition(
            text="time with a true speed below 0.001 m/s and a turn rate below 0.01 rad/s; actuation noise alone "
            "moves a robot faster",
            unit="s", better=LOWER, words="time not moving", source="Perez-Higueras et al. (2023); Tsoi et al. (2022)",
        ),
        "heading_change_rad": Definition(
            text="sum of the changes of the heading from tick to tick, each without its sign",
            unit="rad", better=LOWER, words="cumulative heading change",
            equation=r"\sum_k \lvert \theta_{k+1} - \theta_k\rvert", source="Perez-Higueras et al. (2018)",
        ),
    }
)  # fmt: skip
