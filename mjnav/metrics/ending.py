"""How a run ended, how long it took, and what became of its decisions."""

from mjnav.messages import Trajectory
from mjnav.metrics.definitions import HIGHER, INTEGER, LOWER, STRING, TABLE_1, TRUTH, Definition, figures
from mjnav.metrics.safety import collisions
from mjnav.scene.check import is_avoidable
from mjnav.scene.spec import Scenario

TIMEOUTS = ("timeout", "believed")  # outcomes
INFEASIBLE = ("infeasible_nominal", "infeasible")  # statuses


@figures(
    "ending",
    Definition("outcome", type=STRING, null="while the run goes on"),
    Definition("success", type=TRUTH, better=HIGHER, source=TABLE_1, over_all=True),
    Definition("timeout", type=TRUTH, better=LOWER, source=TABLE_1, over_all=True),
)  # fmt: skip
def ending(outcome: str | None, success: bool) -> tuple[str | None, bool, bool]:
    """Of a run that ended with `outcome`, or goes on.

    * outcome: goal, believed, collision, timeout or aborted. `believed` is a timeout of a robot that took itself to be
      at the goal, where the goal lay within 3 standard deviations of its belief
    * success: the goal was reached in time without contact
    * timeout: the time limit ended the run before the goal was reached
    """
    return outcome, success, outcome in TIMEOUTS


def succeeded(trajectory: Trajectory, scenario: Scenario, outcome: str | None) -> bool:
    """Whether the goal was reached without contact."""
    return outcome == "goal" and not any(collisions(trajectory.contacts, scenario.control.period).values())


@figures(
    "ending",
    Definition("layout", type=STRING, null="a scene that draws nothing"),
    Definition("avoidable_start", type=TRUTH, over_all=True, words="starts that can be avoided"),
)  # fmt: skip
def start(scenario: Scenario) -> tuple[str | None, bool]:
    """Of the layout that a run starts from.

    * layout: purpose and seed of the layout that was drawn, such as "reporting 7"; "case 7" of a published crowd
    * avoidable_start: whether a robot that knows how all people will walk can avoid contact in the first 3 s, by a
      sampled control. Where it is false, the run is no test of a method
    """
    drawn, published = scenario.layout, scenario.published
    if drawn is not None:
        return drawn.label, is_avoidable(scenario)
    return None if published is None else f"case {published.case}", is_avoidable(scenario)


@figures(
    "ending",
    Definition("time_s", better=LOWER, words="simulated time", equation="t_T - t_0", source=TABLE_1),
    Definition("ticks", type=INTEGER),
)  # fmt: skip
def duration(trajectory: Trajectory) -> tuple[float, int]:
    """The simulated time [s] and the number of ticks.

    * time_s: simulated time from the start to the end of the run
    * ticks: decisions
    """
    return round(float(trajectory.time[-1] - trajectory.time[0]), 9), len(trajectory.status)  # sums of periods round


@figures(
    "decisions",
    Definition("infeasible_ticks", better=LOWER),
    Definition("clipped_ticks"),
    Definition("cautious_ticks"),
    type=INTEGER,
)  # fmt: skip
def decisions(trajectory: Trajectory) -> tuple[int, int, int]:
    """Counts of ticks whose decision could not be carried out as it was meant.

    * infeasible_ticks: ticks at which nothing met the constraints: ticks_without_nominal and ticks_without_own together
    * clipped_ticks: ticks whose decision was beyond the robot's limits; the command within them counts
    * cautious_ticks: ticks at which the robot drove more slowly than decided, or stopped, as it did not know enough
    """
    infeasible = sum(trajectory.status.count(status) for status in INFEASIBLE)
    return infeasible, trajectory.clipped_ticks, trajectory.cautious_ticks


@figures(
    "decisions",
    Definition("ticks_without_nominal", better=LOWER),
    Definition("ticks_without_own", better=LOWER),
    Definition("stopped_ticks"),
    type=INTEGER,
)  # fmt: skip
def statuses(trajectory: Trajectory) -> tuple[int, ...]:
    """How many ticks had each of three statuses.

    * ticks_without_nominal: status infeasible_nominal: nothing met the constraints at the mean of the samples
    * ticks_without_own: status infeasible: candidates met those, none the method's own constraint
    * stopped_ticks: ticks of status stopped
    """
    return tuple(trajectory.status.count(status) for status in (*INFEASIBLE, "stopped"))


STATE_HASH = Definition(
    "state_hash", "SHA-256 of all true poses, estimated poses and commands, and of the world's last state: equal where "
    "two episodes are the same", type=STRING, group="ending",
)  # fmt: skip
SAFE_SHARES = tuple(  # which sweeps count
    Definition(f"{name}_safe_share", "share of the closest obstacle's samples that are safe at the chosen control, "
               f"{text} over ticks", better=HIGHER, words=f"{words} share of safe samples", group="decisions",
               null="never met an obstacle", equation=r"f \le 0")
    for name, words, text in (("min", "least", "minimum"), ("mean", "mean", "mean"))
)  # fmt: skip
