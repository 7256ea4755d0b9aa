"""What the robot carries: estimators, prediction, route, controller and the commands under way."""

from dataclasses import dataclass
from math import isfinite

import numpy as np

from mjnav.control import Controller
from mjnav.estimation import Localizer, Tracker, assumed_noise, make_localizer, make_tracker
from mjnav.estimation.base import person_names
from mjnav.loop.onboard.commands import CommandHistory
from mjnav.loop.onboard.floor_map import FloorMap
from mjnav.loop.onboard.latency import make_latency
from mjnav.loop.onboard.prediction import Predictor, carry_people
from mjnav.messages import Array, Decision, Lanes, Observation, ObstacleSamples, Reading, RobotBelief, Track
from mjnav.motion.diff_drive import command_bounds
from mjnav.rng import stream
from mjnav.scenarios.spec import Scenario
from mjnav.sealed import sealed, sealed_costs


@dataclass(frozen=True, slots=True)
class Beliefs:
    """What is believed after the latest reading."""

    robot: RobotBelief
    people: tuple[Track, ...]


class Navigator:
    """The robot's side of a tick: estimate, predict, decide, actuate (`loop.tick`).

    It knows the scenario's map and noise, and sees the world through readings alone.
    """

    def __init__(self, scenario: Scenario, seed: int, controller: Controller):
        self.controller = controller
        self._num_samples = controller.parameters.samples
        self.floor_map = FloorMap(scenario)
        self.names = (*person_names(len(scenario.people)), *self.floor_map.names)
        self._localizer: Localizer = make_localizer(scenario, seed)
        self._tracker: Tracker = make_tracker(scenario, seed)
        noise = assumed_noise(scenario)
        limits = scenario.robot.limits
        self._predictor = Predictor(noise, limits, seed)
        self._history = CommandHistory(limits)
        self._low, self._high = command_bounds(limits)
        self.latency = make_latency(scenario, seed)
        self.period = scenario.control.period
        self._predicts = scenario.control.prediction
        self._lanes = scenario.lanes
        self._lane_noise = noise["lane.offset"]
        self._lane_rng = stream(seed, "prediction", "lane.offset")
        self._route = [np.array(point) for point in scenario.robot.route]
        self._tolerance = scenario.robot.goal_tolerance
        self._decided = np.zeros(2)

    @property
    def goal(self) -> Array:
        """The point of the route that the robot is on its way to, (2,)."""
        return self._route[0]

    @property
    def on_last_leg(self) -> bool:
        """Whether only the goal is left of the route."""
        return len(self._route) == 1

    def estimate(self, readings: tuple[Reading, ...], beliefs: Beliefs | None) -> Beliefs:
        """The beliefs after the readings; those before where there are none. The first tick always has one."""
        for reading in readings:
            beliefs = Beliefs(self._localizer.update(reading), self._tracker.update(reading))
        if beliefs is None:
            raise RuntimeError("the first tick has no reading")
        while not self.on_last_leg and np.hypot(*(beliefs.robot.mean[:2] - self.goal)) <= self._tolerance:
            self._route.pop(0)
        return beliefs

    def predict(self, tick: int, beliefs: Beliefs) -> Observation:
        """Samples of all beliefs at the moment at which the decision of this tick takes effect.

        Without prediction that is taken to be now: the robot's samples stay where they are, and people are carried no
        further than to the time of the robot's belief. Its arrays are sealed, and all else in it is made anew.
        """
        num = self._num_samples
        belief = beliefs.robot
        effect = self.latency.expected(tick) if self._predicts else belief.time
        self._history.forget(belief.time)
        stretches = self._history.stretches(belief.time, effect)
        pose, noise = self._predictor.robot(self._localizer.draw(num), belief.time, effect, stretches)
        samples = np.array(self._tracker.draw(num)).reshape(-1, num, 4)
        elapsed = np.array([effect - track.time for track in beliefs.people]).reshape(-1, 1, 1)
        positions, velocities = map(sealed, carry_people(samples, elapsed))
        radii = [track.radius for track in beliefs.people]
        people = [ObstacleSamples(*person) for person in zip(positions, velocities, radii, strict=True)]
        return Observation(
            robot_pose=sealed(pose),
            control_noise=sealed(noise),
            twist=sealed(self._decided),
            obstacles=(*people, *self.floor_map.discs),
            goal=sealed(self.goal),
            walls=sealed(self.floor_map.walls(pose[:, :2].mean(axis=0))),
            lanes=self._observe_lanes(num),
            time=effect,
        )

    def decide(self, observation: Observation) -> Decision:
        """The controller's decision, brought within the robot's limits; what it chose beyond them is its `wish`.

        The acceleration limits are the base's, which ramps towards every command. The controller may go on to write to
        what it returned: this is a copy.
        """
        decision = self.controller.decide(observation)
        if not (isfinite(decision.v) and isfinite(decision.omega)):
            raise ValueError(f"the controller decided v = {decision.v}, omega = {decision.omega}")
        wish = np.array([decision.v, decision.omega], float)
        self._decided = np.clip(wish, self._low, self._high)
        costs = None if decision.costs is None else sealed_costs(decision.costs)
        v, omega = self._decided.tolist()
        if (self._decided == wish).all():
            return Decision(v, omega, decision.status, costs)
        return Decision(v, omega, decision.status, costs, wish=(float(decision.v), float(decision.omega)))

    def actuate(self, tick: int, spent: float) -> tuple[Array, list[tuple[float, Array]]]:
        """Puts the last decision under way, after `spent` [s] of computing.

        Returns the command in force when the period begins, and those that take force within it, by their offset [s].
        """
        begin, end = tick * self.period, (tick + 1) * self.period
        self._history.append(self.latency.actual(tick, spent), self._decided)
        return self._history.in_force(begin), self._history.switches(begin, end)

    def _observe_lanes(self, num: int) -> Lanes | None:
        if self._lanes is None:
            return None
        left, right = self._lane_noise.sample(self._lane_rng, (2, num))
        return Lanes(self._lanes.left, self._lanes.right, sealed(left), sealed(right))
