"""Definitions of the figures of a run's outcome, of the people in it, and of the robot's path and motion.

A definition says a figure's type, its unit, what it is, and its source. The figures of the outcome say how a run ended
and what the robot touched; those of people, what the run was to them; those of motion, how close the robot came to
things and how smoothly it moved.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

# --------------------------------------------------------------------------------------- definition


STRING, INTEGER, NUMBER, TRUTH = "string", "int64", "double", "bool"  # as Arrow calls them
LOWER, HIGHER = "lower", "higher"


@dataclass(frozen=True, slots=True, kw_only=True)
class Definition:
    """One figure. `equation` is LaTeX, in the symbols of docs/method/figures.md."""

    text: str  # what it is, in a line
    type: str = NUMBER
    unit: str = ""  # "" of a plain number, a truth or a text
    better: str = ""  # LOWER or HIGHER; "" of what is neither good nor bad
    words: str = ""  # what tables and charts call it; made from its name where empty
    equation: str = ""
    null: str = ""  # when it is null although the episode has a result
    source: str = ""  # author (year)
    over_all: bool = False  # its mean is over all episodes, not only over those that succeeded

    @property
    def about(self) -> str:
        """The definition with when it is null, what is better and the source, in a line."""
        tail = [f"null: {self.null}"] * bool(self.null) + [f"{self.better} is better"] * bool(self.better)
        tail += [self.source] * bool(self.source)
        return self.text + (f" ({'; '.join(tail)})" if tail else "")

    @property
    def line(self) -> str:
        """The same behind the unit."""
        return f"[{self.unit}] {self.about}" if self.unit else self.about


# ------------------------------------------------------------------------------------------ outcome


TABLE_1 = "Francis et al. (2023), table 1"
NOBODY = "no people"

OUTCOME: Mapping[str, Definition] = MappingProxyType(
    {
        "outcome": Definition(text="goal, collision, timeout or aborted", type=STRING, null="while the run goes on"),
        "success": Definition(
            text="the goal was reached in time without contact",
            type=TRUTH, better=HIGHER, source=TABLE_1, over_all=True,
        ),
        "timeout": Definition(
            text="the time limit ended the run before the goal was reached",
            type=TRUTH, better=LOWER, source=TABLE_1, over_all=True,
        ),
        **{
            f"collisions_{kind}": Definition(
                text=f"contacts with a {kind}; the same body seen again within two control periods counts once",
                type=INTEGER, better=LOWER, source=TABLE_1, over_all=True, words=f"contacts with a {kind}",
            )
            for kind in ("person", "table", "wall", "pillar")
        },
        "collisions_moving": Definition(
            text="contacts with people while the robot moved: its speed at the tick before was above 0.1 m/s",
            type=INTEGER, better=LOWER, source="Tsoi et al. (2022): robot on person", over_all=True,
            words="contacts with people while moving",
        ),
        "collisions_at_rest": Definition(
            text="contacts with people while the robot stood: its speed at the tick before was at most 0.1 m/s",
            type=INTEGER, source="Tsoi et al. (2022): person on robot", over_all=True,
            words="contacts with people at rest",
        ),
        "robot_at_fault": Definition(
            text="contacts with people that are the robot's fault: it moved, and the person does not see it or "
            "approached no faster than it did",
            type=INTEGER, better=LOWER, over_all=True, words="contacts that are the robot's fault",
            source="at rest: passive motion safety, Macek et al. (2009); halves: van den Berg et al. (2011)",
        ),
        "people_see_robot": Definition(
            text='how many people see the robot and take account of it: "all", "none", or "3 of 5". Who walks on '
            "whatever happens takes none, whatever sees_robot says",
            type=STRING, null=NOBODY,
        ),
        "layout": Definition(
            text='purpose and seed of the layout that was drawn, such as "reporting 7"',
            type=STRING, null="a scene that draws nothing",
        ),
        "avoidable_start": Definition(
            text="whether a robot that knows how all people will walk can avoid contact in the first 3 s, by a sampled "
            "control. Where it is false, the run is no test of a method",
            type=TRUTH, over_all=True, words="starts that can be avoided",
        ),
        "time_s": Definition(
            text="simulated time from the start to the end of the run",
            unit="s", better=LOWER, words="time to the goal", equation="t_T - t_0", source=TABLE_1,
        ),
        "aggregated_time_s": Definition(
            text="sum of the times that the robot and all people whose route ends took to their goals",
            unit="s", better=LOWER, source=TABLE_1, words="time of all to their goals",
            null="nobody's route ends, or not all arrived",
        ),
        "failures_to_progress": Definition(
            text="how often the robot came no 0.1 m nearer to the goal, along its route, in 5 s",
            type=INTEGER, better=LOWER, source=TABLE_1, over_all=True,
        ),
        "ticks": Definition(text="decisions", type=INTEGER),
        "state_hash": Definition(
            text="SHA-256 of all true poses, estimated poses and commands, and of the world's last state: equal where "
            "two episodes are the same",
            type=STRING,
        ),
    }
)  # fmt: skip


# ------------------------------------------------------------------------------------------- people


HUNAVSIM = "Perez-Higueras et al. (2023)"
NOT_ASKED = "not asked for, or no such people"
HALL = f"Hall (1966); {HUNAVSIM}"


def _space(name: str, distance: str) -> Definition:
    return Definition(
        text=f"share of the ticks at which somebody's surface is less than {distance} from the robot's",
        better=LOWER, words=f"share of time in {name} space", null=NOBODY, source=HALL, over_all=True,
    )  # fmt: skip


PEOPLE: Mapping[str, Definition] = MappingProxyType(
    {
        "min_human_distance_m": Definition(
            text="least distance of the robot's surface from a person's, over straight moves between ticks",
            unit="m", better=HIGHER, words="least distance from people", null=NOBODY, source=TABLE_1, over_all=True,
        ),
        "mean_human_distance_m": Definition(
            text="distance of the robot's surface from the nearest person's, mean over the ticks at which somebody is "
            "there",
            unit="m", words="mean distance from the nearest person", null=NOBODY, source=HUNAVSIM, over_all=True,
        ),
        "space_compliance": Definition(
            text="share of the ticks at which every person's surface is at least 0.5 m from the robot's",
            better=HIGHER, null=NOBODY, source=TABLE_1, over_all=True,
        ),
        "intimate_space_share": _space("intimate", "0.45 m"),
        "personal_space_share": _space("personal", "1.2 m"),
        "social_space_share": _space("social", "3.6 m"),
        "min_time_to_collision_s": Definition(
            text="time after which robot and a person would touch if both kept their velocities, minimum over ticks "
            "and people",
            unit="s", better=HIGHER, words="least time to collision", source=TABLE_1, over_all=True,
            equation=r"\min_{k,i} \min\{\tau \ge 0 : \lvert r_{ki} + \tau q_{ki}\rvert \le \rho + \rho_i\}",
            null="nobody was ever on a collision course",
        ),
        "social_force_on_people_m_s": Definition(
            text="sizes of the social forces of the robot on people, each as if they saw it, summed over people and "
            "integrated over time, per unit of mass; law and constants are HuNavSim's",
            unit="m/s", better=LOWER, words="social force on people", null=NOBODY, source=HUNAVSIM,
            equation=r"\sum_k \Delta t \sum_i \lvert f_{ir}\rvert",
        ),
        "social_force_on_robot_m_s": Definition(
            text="size of the sum of the social forces of people on the robot, integrated over time",
            unit="m/s", better=LOWER, words="social force on the robot", null=NOBODY, source=HUNAVSIM,
            equation=r"\sum_k \Delta t\, \lvert\sum_i f_{ri}\rvert",
        ),
        "social_work_m_s": Definition(
            text="social_force_on_people_m_s + social_force_on_robot_m_s + that of the nearest wall, leg or pillar on "
            "the robot",
            unit="m/s", better=LOWER, words="social work", null=NOBODY, source=HUNAVSIM,
        ),
        "detour_path_m": Definition(
            text="what the robot adds to people's paths to the last waypoint that they reach with and without it, mean "
            "over the people who reach one; asked for by --detour",
            unit="m", better=LOWER, words="detour of people", null=NOT_ASKED, over_all=True,
            equation=r"\operatorname{mean}_i (L_i - L_i^0)",
        ),
        "detour_delay_s": Definition(
            text="by how much later than without the robot people reach that waypoint, mean; asked for by --detour",
            unit="s", better=LOWER, words="delay of people", null=NOT_ASKED, over_all=True,
            equation=r"\operatorname{mean}_i (\tau_i - \tau_i^0)",
        ),
        "detour_displacement_m": Definition(
            text="distance between where people are and where they are at the same time without the robot, mean over "
            "ticks and people; asked for by --detour",
            unit="m", better=LOWER, words="displacement of people", null=NOT_ASKED, over_all=True,
            equation=r"\operatorname{mean}_{k,i} \lvert p_i(t_k) - p_i^0(t_k)\rvert",
        ),
    }
)  # fmt: skip


# ---------------------------------------------------------------------------------- path and motion


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
