"""What the robot carries: estimators, prediction, route, controller and the commands under way."""

import reprlib
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mjnav import messages
from mjnav.control import Controller
from mjnav.errors import InvalidValue, PluginFault
from mjnav.filters.particles import shuffled
from mjnav.geometry.angles import circular_mean, mean_pose, mean_position
from mjnav.messages import Array, Beliefs
from mjnav.motion.unicycle import command_bounds
from mjnav.rng import stream
from mjnav.robot.caution import Caution
from mjnav.robot.controller import build_controller, num_samples, plans_in_time
from mjnav.robot.estimation import Localizer, Tracker, assumed_noise, make_localizer, make_tracker
from mjnav.robot.estimation.base import DRAWS
from mjnav.robot.latency import CommandHistory, RobotPrediction, check_decision, make_latency
from mjnav.robot.prediction import Crowd, OwnPredictor, Predictor, RobotNow, make_predictor
from mjnav.robot.sanity import Sanity
from mjnav.robot.seen_space import FloorMap
from mjnav.robot.wayfinder import Wayfinder
from mjnav.scene.spec import Scenario
from mjnav.sealed import sealed, sealed_costs, sealed_plan

if TYPE_CHECKING:
    from mjnav.robot.estimation.lidar.local_map import LocalMap


class Navigator:
    """The robot's side of a tick: estimate, predict, decide, actuate (`loop.tick`).

    It knows the scenario's map and noise, and sees the world through readings alone.
    """

    def __init__(self, scenario: Scenario, seed: int, controller: Controller | None = None, *, estimators: bool = True):
        """The scenario's own controller is made when it is first asked for, unless another is given.

        Without `estimators` the beliefs are those that somebody else hands over.
        """
        self._scenario = scenario
        if controller is not None:
            self.controller = controller
        self.floor_map = FloorMap(scenario)
        self._local: LocalMap | None = None
        if scenario.draws_map:  # only then are it and its kernels imported
            from mjnav.robot.estimation.lidar import local_map

            self._local = local_map.LocalMap(scenario)
        self._sanity = Sanity(scenario)
        self._caution = Caution(scenario, self._sanity) if estimators else None
        # By the robot's own estimators, of the tick that is predicted.
        self._believed: messages.RobotBelief | None = None
        self._effect = 0.0  # [s] at which a decision of that tick takes effect
        self._localizer: Localizer | None = make_localizer(scenario, seed) if estimators else None
        self._tracker: Tracker | None = make_tracker(scenario, seed) if estimators else None
        self._seed = seed
        self._draws: dict[str, np.random.Generator] = {}  # from beliefs that are handed over, by the body's name
        noise = assumed_noise(scenario)
        limits = scenario.robot.limits
        self._robot_prediction = RobotPrediction(noise, limits, seed)
        self._history = CommandHistory(limits)
        self._low, self._high = (bound.tolist() for bound in command_bounds(limits))
        self.latency = make_latency(scenario, seed)
        self.period = scenario.control.period
        self._predicts = scenario.control.prediction
        self._lanes = scenario.lanes
        self._lane_noise = noise["lane.offset"]
        self._lane_rng = stream(seed, "prediction", "lane.offset")
        self._route = [np.array(point) for point in scenario.robot.route]
        self.on_last_leg = len(self._route) == 1  # only the goal is left of it
        self._tolerance = scenario.robot.goal_tolerance
        self._decided = np.zeros(2)
        self._wayfinder = None if scenario.route is None else Wayfinder(scenario.route, limits)
        self._lidar = scenario.sensors.scanner
        self._scanned: messages.Reading | None = None  # the latest one with a scan

    @cached_property
    def controller(self) -> Controller:
        """Decides."""
        return build_controller(self._scenario)

    @cached_property
    def controller_is_shipped(self) -> bool:
        """Whether it is one of mjnav's own methods, which write to nothing that they are shown."""
        return type(self.controller).__module__.startswith("mjnav.control.methods.")

    @cached_property
    def _predictor(self) -> Predictor:
        known = None if "controller" in self.__dict__ else plans_in_time(self._scenario)
        in_time = getattr(self.controller, "plans_in_time", False) if known is None else known
        return make_predictor(self._scenario, self._seed, in_time=in_time)

    @cached_property
    def _num_samples(self) -> int:
        known = None if "controller" in self.__dict__ else num_samples(self._scenario)
        return self.controller.parameters.samples if known is None else known

    @property
    def goal(self) -> Array:
        """The point of the route that the robot is on its way to, (2,)."""
        return self._route[0]

    def estimate(self, readings: tuple[messages.Reading, ...], beliefs: Beliefs | None) -> Beliefs | None:
        """The beliefs after the readings; those before where there are none. The first tick always has one.

        Without estimators there are none.
        """
        readings = tuple(map(self._sanity.checked, readings))
        self._scanned = next((reading for reading in reversed(readings) if reading.scan.size), self._scanned)
        if self._localizer is None or self._tracker is None:
            return None
        for reading in readings:
            robot = self._localizer.update(reading)
            beliefs = Beliefs(robot, self._tracker.update(reading, robot), self._tracker.detections)
            if self._local is not None:
                self._draw_map(self._local, reading, beliefs)
            if self._caution is not None:
                self._caution.follow(reading, beliefs)
        if beliefs is None:
            raise RuntimeError("the first tick has no reading")
        self.follow_route(beliefs.robot.mean)
        return beliefs

    def _draw_map(self, local: "LocalMap", reading: messages.Reading, beliefs: Beliefs) -> None:
        """Everything on board goes by what the scans have shown so far."""
        from mjnav.robot.estimation.lidar.local_map import MappingLocalizer
        from mjnav.robot.estimation.lidar.tracker import LidarTracker

        maps = self._localizer if isinstance(self._localizer, MappingLocalizer) else None
        frame = np.zeros(6) if maps is None else maps.frame
        if not local.follow(reading, beliefs.robot, beliefs.people, frame):
            return
        self.floor_map = FloorMap(self._scenario, local.floor.discs)
        if maps is not None:
            maps.learn(local)
        if isinstance(self._tracker, LidarTracker):
            self._tracker.learn(local.field)
        if self._caution is not None:
            self._caution.learn(local)

    def take_events(self) -> tuple[messages.Event, ...]:
        """What the robot noticed since the last call."""
        noticed = (self._sanity, self._caution, self._wayfinder)
        return tuple(event for part in noticed if part is not None for event in part.take_events())

    def follow_route(self, pose: Array) -> None:
        """Goes on to the next point of the route where this one is reached from a pose (3,)."""
        while not self.on_last_leg and np.hypot(*(pose[:2] - self._route[0])) <= self._tolerance:
            self._route.pop(0)
            self.on_last_leg = len(self._route) == 1

    def predict(self, tick: int, beliefs: Beliefs, *, own: bool = True) -> messages.Observation:
        """Samples of all beliefs at the moment at which the decision of this tick takes effect.

        The beliefs are those of `estimate`, or with `own` false somebody else's. Without prediction the moment is taken
        to be now: the robot's samples stay where they are, and people are carried no further than to the time of the
        robot's belief. Its arrays are sealed.
        """
        num = self._num_samples
        belief = beliefs.robot
        self._believed = belief if own else None
        self._effect = self.latency.expected(tick)
        effect = self.latency.expected(tick) if self._predicts else belief.time
        self._history.forget(belief.time)
        stretches = self._history.stretches(belief.time, effect)
        robot, people = self._own_samples(num) if own else self._samples_of(beliefs, num)
        pose, noise = self._robot_prediction.robot(robot, belief.time, effect, stretches)
        floor, position = self.floor_map, mean_position(pose)
        goal, way = self.goal, None
        if self._wayfinder is not None:
            unseen = self._local.unseen if self._local is not None and self._wayfinder.minds_unseen else None
            mean = np.append(position, circular_mean(pose[:, 2]))
            self._wayfinder.follow(belief.time, mean, goal, floor.known, beliefs.people, unseen)
            goal, way = self._wayfinder.ahead(position)
        return messages.Observation(
            robot_pose=sealed(pose), control_noise=sealed(noise), twist=sealed(self._decided),
            obstacles=(*self._predict_people(beliefs.people, people, effect, pose), *floor.discs(position)),
            goal=sealed(goal), walls=sealed(floor.walls(position)), lanes=self._observe_lanes(num), time=effect,
            scan=self._observe_scan(), map=floor.known, way=way,
        )  # fmt: skip

    def _predict_people(
        self, tracks: tuple[messages.Track, ...], drawn: tuple[Array, ...], effect: float, pose: Array
    ) -> list[messages.ObstacleSamples]:
        """Everybody from the moment of effect on, at which the robot's poses are (N, 3)."""
        samples = np.array(drawn).reshape(-1, self._num_samples, 4)
        robot = self._robot_now(pose) if isinstance(self._predictor, OwnPredictor) else None  # mjnav's look at no robot
        people = self._predictor.predict(Crowd(tracks, samples, effect, self.floor_map.known, robot))
        radii = [track.radius for track in tracks]
        ahead, turns = people.ahead, [True] * len(tracks) if people.turns is None else people.turns.tolist()
        ways = [sealed(ahead[p]) if ahead is not None and turns[p] else None for p in range(len(tracks))]
        rows = zip(sealed(people.position), sealed(people.velocity), radii, ways, strict=True)
        return [messages.ObstacleSamples(*person, people.step) for person in rows]

    def _robot_now(self, pose: Array) -> RobotNow:
        """The robot at its mean of poses (N, 3), moving as was decided last."""
        mean = mean_pose(pose)
        velocity = self._decided[0] * np.array([np.cos(mean[2]), np.sin(mean[2])])
        return RobotNow(mean[:2], velocity, self._scenario.robot.radius)

    def decide(self, observation: messages.Observation) -> messages.Decision:
        """The controller's decision, brought within the robot's limits and within what the robot knows.

        Raises PluginFault for what is no decision of finite numbers.
        """
        decision = self.controller.decide(observation)
        name = self._scenario.control.method
        if not isinstance(decision, messages.Decision):
            found = f"{reprlib.repr(decision)} ({type(decision).__name__})"
            raise PluginFault(f"{name}: decide() returned {found} in place of a Decision")
        try:
            decision = self.limited(decision)
        except InvalidValue as error:
            raise PluginFault(f"{name}: decide() returned a Decision that cannot be used: {error}") from error
        if self._wayfinder is not None:
            decision = self._wayfinder.recovered(decision, mean_pose(observation.robot_pose))
        if self._caution is None or self._believed is None:
            return decision
        return self._caution.limited(decision, self._believed, self._effect, float(self._decided[0]))

    def limited(self, decision: messages.Decision) -> messages.Decision:
        """A decision within the robot's limits; what was chosen beyond them is its `wish`.

        Raises InvalidValue for what is no decision of finite numbers.
        The acceleration limits are the base's, which ramps towards every command. A controller may go on to write to
        what it returned: this is a copy.
        """
        check_decision(decision)
        costs = None if decision.costs is None else sealed_costs(decision.costs)
        plan = None if decision.plan is None else sealed_plan(decision.plan)
        wish = float(decision.v), float(decision.omega)
        v, omega = (min(high, max(low, u)) for low, u, high in zip(self._low, wish, self._high, strict=True))
        changed = None if (v, omega) == wish else wish
        return messages.Decision(v, omega, decision.status, costs, wish=changed, plan=plan)

    def actuate(self, tick: int, decision: messages.Decision, spent: float) -> tuple[Array, list[tuple[float, Array]]]:
        """Puts a decision under way, after `spent` [s] of computing.

        Returns the command in force when the period begins, and those that take force within it, by their offset [s].
        """
        begin, end = tick * self.period, (tick + 1) * self.period
        self._decided = np.array([decision.v, decision.omega])
        self._history.append(self.latency.actual(tick, spent), self._decided)
        return self._history.in_force(begin), self._history.switches(begin, end)

    def _own_samples(self, num: int) -> tuple[Array, tuple[Array, ...]]:
        """Of the estimators' latest beliefs: the robot's (num, 3), and (num, 4) of each person."""
        assert self._localizer is not None, "own beliefs come from estimators"
        assert self._tracker is not None
        return self._localizer.draw(num), self._tracker.draw(num)

    def _samples_of(self, beliefs: Beliefs, num: int) -> tuple[Array, tuple[Array, ...]]:
        """The same of beliefs that were handed over."""
        return self._draw("robot", beliefs.robot, num), tuple(self._draw(t.name, t, num) for t in beliefs.people)

    def _draw(self, body: str, belief: messages.RobotBelief | messages.Track, num: int) -> Array:
        """`num` particles by weight, from a stream that is named as the estimators': like beliefs, like samples."""
        if body not in self._draws:
            self._draws[body] = stream(self._seed, DRAWS, body)
        return shuffled(belief.particles, belief.weights, num, self._draws[body])

    def _observe_scan(self) -> messages.Scan | None:
        """The latest whole scan; a slow lidar has none for every reading."""
        reading, lidar = self._scanned, self._lidar
        if reading is None:
            return None
        return messages.Scan(reading.time, lidar.angles, sealed(reading.scan), sealed(reading.scan_times), lidar.mount)

    def _observe_lanes(self, num: int) -> messages.Lanes | None:
        if self._lanes is None:
            return None
        left, right = sealed(self._lane_noise.sample(self._lane_rng, (2, num)))
        return messages.Lanes(self._lanes.left, self._lanes.right, left, right)
