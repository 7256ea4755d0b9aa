"""What a run was to the people in it."""

from collections.abc import Mapping
from types import MappingProxyType

from mjnav.metrics.definitions.definition import HIGHER, LOWER, Definition
from mjnav.metrics.definitions.outcome import NOBODY, TABLE_1

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
