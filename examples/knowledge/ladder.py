"""What it is worth to know how people go on: one planner under seven predictions, the last of them true.

    uv run python examples/knowledge/ladder.py --cases 250 --first 250 --workers 2
    uv run python examples/knowledge/ladder.py --scene crowds --cases 100 --first 1000 --workers 2

A unicycle is told the true positions and velocities within 5 m, decides every 0.25 s, and reaches speed and turn rate
of each decision at once, within its accelerations. Cases from 250 on are other layouts than the published ones. That is
CrowdNav++, whose people do not see the robot. In a scene of mjnav's, without noise, they may: the true future is then
what follows if the robot goes on as it was told last. There are no rows of reactions and goals there,
and one of waypoints only with --prediction waypoints, where all people have some.
"""

import argparse
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from copy import deepcopy
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np

import mjnav
from mjnav.control import make_controller
from mjnav.messages import Array, Observation, ObstacleSamples, RobotLimits
from mjnav.metrics.intervals import wilson
from mjnav.motion.published_crowds import ROBOT_RADIUS, PublishedCrowd
from mjnav.motion.unicycle import integrate, reachable
from mjnav.scene.people import REACHED

SIGHT, GOAL, LIMIT = 5.0, 0.3, 49.0  # [m] from surface to surface, [m], [s]
STEPS = 16  # of the crowd, that are predicted: 4 s
SAMPLES = 24  # of each person, where people may turn
TURNS = 0.3  # [1/s]
STEP = 0.2  # [s] between predicted positions in a scene of mjnav's
TOLD = {"robot": {"source": "direct", "particles": 50}, "obstacles": {"source": "direct", "particles": 50}}
TOWARDS = 1.0  # [m/s] at which people go to their goals at most, in CrowdNav++
STOPS = 0.2  # probability that who turns stops
MISSED, GAIN = 0.2, 0.1  # share of people beyond their conformal radius; [m] by which that follows at each step
AROUND = np.exp(2j * np.pi * np.arange(8) / 8).view(float).reshape(8, 2)

Futures = Array  # (P, M, STEPS, 2) [m]


def straight(crowd: PublishedCrowd, rng: np.random.Generator) -> Futures:
    """Everybody goes straight on."""
    time = crowd.rules.period * np.arange(1, STEPS + 1)[:, None]
    return (crowd.position[:, None] + crowd.velocity[:, None] * time)[:, None]


def turns(crowd: PublishedCrowd, rng: np.random.Generator) -> Futures:
    """x + v min(t, tau) + v' [t - tau]+, tau exponential, v' the velocity turned by any angle, or 0: they stop."""
    shape, time = (len(crowd.position), SAMPLES), crowd.rules.period * np.arange(1, STEPS + 1)
    tau = -np.log1p(-rng.random(shape)) / TURNS
    angle = rng.uniform(-np.pi, np.pi, shape)
    c, s = np.cos(angle), np.sin(angle)
    vx, vy = crowd.velocity.T[:, :, None]
    after = np.stack([c * vx - s * vy, s * vx + c * vy], axis=-1) * (rng.random(shape) >= STOPS)[..., None]
    until = np.minimum(time, tau[..., None])[..., None]
    behind = time[:, None] - until
    return crowd.position[:, None, None] + crowd.velocity[:, None, None] * until + after[:, :, None] * behind


def reactions(crowd: PublishedCrowd, rng: np.random.Generator) -> Futures:
    """People want to go on as they go, and avoid one another by their law."""
    ahead = deepcopy(crowd)
    ahead.goal = ahead.position + 100.0 * ahead.velocity
    ahead.max_speed = np.maximum(np.hypot(*ahead.velocity.T), 0.1)
    return _walked(ahead)


def waypoints(crowd: PublishedCrowd, rng: np.random.Generator) -> Futures:
    """Everybody goes from waypoint to waypoint at their preferred speed, and stays at the last one known."""
    found, time = [], crowd.rules.period * np.arange(1, STEPS + 1)
    speeds = np.minimum(crowd.max_speed, TOWARDS) if isinstance(crowd, PublishedCrowd) else crowd.max_speed
    for position, goal, speed in zip(crowd.position, crowd.goal, speeds, strict=True):
        points = np.vstack([position, goal])
        at = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
        found.append(np.stack([np.interp(speed * time, at, axis) for axis in points.T], axis=-1))
    return np.stack(found)[:, None]


def goals(crowd: PublishedCrowd, rng: np.random.Generator) -> Futures:
    """People go to the goals that they have now, avoid one another by their law, and stay there."""
    ahead = deepcopy(crowd)
    ahead.rules = replace(crowd.rules, at_goal="stays", change=0.0)
    return _walked(ahead)


def truth(crowd: PublishedCrowd, rng: np.random.Generator) -> Futures:
    """The future itself, with all goals and draws to come."""
    return _walked(deepcopy(crowd))


def _walked(crowd: PublishedCrowd) -> Futures:
    found = []
    for _ in range(STEPS):
        crowd.move(crowd.velocities(), crowd.robot)
        found.append(crowd.position)
    return np.stack(found, axis=1)[:, None]


class Conformal:
    """Straight on, and around each place samples on a circle whose radius holds all but the share MISSED of people.

    The radius of each person and step ahead is adapted on line: q += GAIN (1 - MISSED) after a miss, else q -= GAIN
    MISSED (Gibbs & Candes 2021, "Adaptive Conformal Inference Under Distribution Shift"; of pedestrians GenSafeNav).
    """

    def __init__(self):
        self._radius, self._made = np.zeros((0, STEPS)), []

    def __call__(self, crowd: PublishedCrowd, rng: np.random.Generator) -> Futures:
        """Samples (P, 9, STEPS, 2); the first is straight on."""
        if not len(self._radius):
            self._radius = np.zeros((len(crowd.position), STEPS))
        for ahead, made in enumerate(reversed(self._made)):
            missed = np.hypot(*(crowd.position - made[:, ahead]).T) > self._radius[:, ahead]
            self._radius[:, ahead] = np.maximum(self._radius[:, ahead] + GAIN * (missed - MISSED), 0.0)
        line = straight(crowd, rng)
        self._made = [*self._made, line[:, 0]][-STEPS:]
        return np.concatenate([line, line + self._radius[:, None, :, None] * AROUND[None, :, None]], axis=1)


PREDICTIONS: Mapping[str, Any] = MappingProxyType(
    {
        "straight": straight, "turns": turns, "reactions": reactions, "conformal": Conformal, "waypoints": waypoints,
        "goals": goals, "truth": truth,
    }
)  # fmt: skip


def predictor(name: str) -> Callable[[PublishedCrowd, np.random.Generator], Futures]:
    """A prediction for one run."""
    made = PREDICTIONS[name]
    return made() if isinstance(made, type) else made


def episode(prediction: str, method: str, limits: RobotLimits, case: int) -> tuple[str, float]:
    """How a case ends, and when [s]."""
    crowd, rng = PublishedCrowd("crowdnav-plus", case), np.random.default_rng(case)
    period, pose, twist, ahead = crowd.rules.period, crowd.robot_pose, np.zeros(2), predictor(prediction)
    controller = make_controller(method, limits, period, preferred_speed=1.0)
    while crowd.time < LIMIT:
        futures = ahead(crowd, rng)
        num = futures.shape[1]
        gaps = np.hypot(*(crowd.position - pose[:2]).T) - crowd.radius - ROBOT_RADIUS
        people = [
            ObstacleSamples(
                np.repeat(crowd.position[[i]], num, 0), np.repeat(crowd.velocity[[i]], num, 0), crowd.radius[i],
                futures[i], period,
            )
            for i in np.flatnonzero(gaps <= SIGHT)
        ]  # fmt: skip
        decision = controller.decide(
            Observation(
                np.repeat(pose[None], num, 0), np.zeros((num, 2)), twist, tuple(people), crowd.robot_goal,
                time=crowd.time,
            )
        )  # fmt: skip
        twist = np.clip((decision.v, decision.omega), *reachable(twist, limits, period))
        pose = integrate(pose, *twist, period)
        contacts, _ = crowd.move(crowd.velocities(), pose[:2])
        if contacts.any():
            return "collision", crowd.time
        if np.hypot(*(pose[:2] - crowd.robot_goal)) < GOAL:
            return "goal", crowd.time
    return "time-out", crowd.time


def scene_episode(prediction: str, scene: str, method: str, seed: int) -> tuple[str, float]:
    """The same in a scene on a training layout, without noise."""
    given = {"noise.profile": "none", "estimation": TOLD, "physics.engine": "kinematic", "layout.purpose": "training"}
    scenario = mjnav.load_scenario(scene, given, controller=method, seed=seed)
    rng, ahead = np.random.default_rng(seed), predictor(prediction)
    parameters = {**scenario.control.parameters, "preferred_speed": scenario.robot.preferred_speed}
    controller = make_controller(method, scenario.robot.limits, scenario.control.period, **parameters)
    crowd = SimpleNamespace(rules=SimpleNamespace(period=STEP), goal=[])
    if prediction == "waypoints":
        crowd.goal = [np.tile(person.behaviour.waypoints, (8, 1)) for person in scenario.people]
        crowd.max_speed = np.array([person.behaviour.speed for person in scenario.people])
    with mjnav.Simulation(scenario, log=False) as simulation:
        while not simulation.done:
            seen, now = simulation.observe(), simulation.truth
            there = np.flatnonzero(np.isfinite(now.people_position[:, 0]))
            crowd.position, crowd.velocity = now.people_position, now.people_velocity
            for i, goal in enumerate(crowd.goal):
                if np.hypot(*(goal[0] - crowd.position[i])) <= REACHED:
                    crowd.goal[i] = np.roll(goal, -1, axis=0)
            futures = simulated(simulation) if prediction == "truth" else ahead(crowd, rng)
            samples = len(seen.robot_pose) // futures.shape[1] * futures.shape[1]
            people = tuple(
                ObstacleSamples(
                    np.repeat(now.people_position[[i]], samples, 0), np.repeat(now.people_velocity[[i]], samples, 0),
                    scenario.people[i].radius, np.resize(futures[i], (samples, *futures[i].shape[1:])), STEP,
                )
                for i in there
            )  # fmt: skip
            assert simulation.beliefs is not None
            furniture = seen.obstacles[len(simulation.beliefs.people) :]
            decision = controller.decide(replace(seen, obstacles=(*people, *furniture)))
            simulation.step(decision.v, decision.omega)
    return str(simulation.outcome), simulation.time


def simulated(simulation: mjnav.Simulation) -> Futures:
    """Where the people are in STEPS times STEP if the robot goes on as it was told last."""
    twin, found = simulation.copy(), []
    control = twin.observe().twist.tolist()
    for tick in range(1, round(STEPS * STEP / twin.scenario.control.period) + 1):
        if not twin.done:
            twin.step(*control)
        if tick % round(STEP / twin.scenario.control.period) == 0:
            found.append(twin.truth.people_position)
    return np.stack(found, axis=1)[:, None]


def main(arguments: list[str] | None = None) -> None:
    """Prints a row for each prediction."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", help="of mjnav's, in place of CrowdNav++")
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--first", type=int, default=250)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--method", default="rkhs-plan")
    parser.add_argument("--acceleration", type=float, default=2.0)
    parser.add_argument("--min-speed", type=float, default=0.0)
    parser.add_argument("--prediction", choices=PREDICTIONS, action="append")
    given = parser.parse_args(arguments)
    limits = RobotLimits(
        min_speed=given.min_speed, max_acceleration=given.acceleration, max_turn_acceleration=12.0, radius=ROBOT_RADIUS
    )
    cases = range(given.first, given.first + given.cases)
    with ProcessPoolExecutor(given.workers, get_context("spawn")) as pool:
        for prediction in given.prediction or [
            name for name in PREDICTIONS if not (given.scene and name in ("reactions", "waypoints", "goals"))
        ]:
            run = partial(episode, prediction, given.method, limits)
            if given.scene:
                run = partial(scene_episode, prediction, given.scene, given.method)
            ends = list(pool.map(run, cases))
            count = {
                end: sum(found.replace("-", "") == end for found, _ in ends) for end in ("goal", "collision", "timeout")
            }
            low, high = wilson(count["goal"], len(ends))
            times = [time for end, time in ends if end == "goal"]
            print(
                f"{prediction:10} success {100 * count['goal'] / len(ends):5.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
                f"  collisions {count['collision']}  time-outs {count['timeout']}"
                f"  time {np.mean(times) if times else np.nan:.2f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
