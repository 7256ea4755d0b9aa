"""How a run ended and what the robot touched."""

from collections.abc import Mapping
from types import MappingProxyType

from mjnav.metrics.definitions.definition import HIGHER, INTEGER, LOWER, STRING, TRUTH, Definition

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
