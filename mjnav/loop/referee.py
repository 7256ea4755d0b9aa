"""Says from the truth how a run goes: contacts, goal, time, lanes. The robot never hears of it."""

from mjnav.messages import WorldState
from mjnav.scenarios.spec import Scenario

GOAL, COLLISION, TIMEOUT, ABORTED = "goal", "collision", "timeout", "aborted"


class Referee:
    """Watches the true states of one run."""

    def __init__(self, scenario: Scenario):
        self._goal = scenario.robot.route[-1]
        self._tolerance = scenario.robot.goal_tolerance
        self._time_limit = scenario.time_limit
        self._stop = scenario.stop_on_collision

    def outcome(self, truth: WorldState, *, on_last_leg: bool) -> str | None:
        """How the run has ended, or None while it goes on. A collision counts before the goal, the goal before time."""
        if truth.contacts and self._stop:
            return COLLISION
        dx, dy = truth.robot_pose[0] - self._goal[0], truth.robot_pose[1] - self._goal[1]
        if on_last_leg and dx * dx + dy * dy <= self._tolerance**2:
            return GOAL
        return TIMEOUT if truth.time >= self._time_limit - 1e-9 else None
