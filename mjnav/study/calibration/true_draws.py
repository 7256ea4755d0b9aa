"""Observations drawn around the true state, in place of a filter's belief.

State = truth - error, as a belief is a reading minus its noise; the errors are the world's noise channels:

    robot   x, y, theta   pose.x, pose.y, pose.theta
    control dv, domega    actuation.v, actuation.omega (added, not subtracted)
    person  x, y          detection.x, detection.y
    person  vx, vy        detection.x, detection.y over 1 s: a velocity is a slope of detections in a second, and its
                          error has about that size (0.95 of it for least squares at 10 Hz)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Observation, ObstacleSamples, WorldState
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.scenarios.spec import Scenario

VELOCITY_WINDOW = 1.0  # [s] of detections behind a velocity
_ROBOT = ("pose.x", "pose.y", "pose.theta")
_CONTROL = ("actuation.v", "actuation.omega")
_PERSON = ("detection.x", "detection.y")


@dataclass(frozen=True, slots=True)
class Errors:
    """n joint draws of all errors; a single row holds for all n."""

    pose: Array  # (n, 3) or (1, 3)
    control: Array  # (n, 2)
    people: Array  # (P, n, 4) or (P, 1, 4)

    @classmethod
    def of_control(cls, control: Array, num_people: int) -> "Errors":
        """A known state under actuation noise (n, 2)."""
        return cls(np.zeros((1, 3)), control, np.zeros((num_people, 1, 4)))


class ErrorDraws:
    """Draws errors from the random streams of a `use`: "sample" for a controller, "fresh" to compare it with."""

    def __init__(self, scenario: Scenario, seed: int, use: str):
        noise = scenario.noise.distributions()

        def channels(names: Sequence[str], body: str, what: str = "") -> list[tuple[Distribution, np.random.Generator]]:
            return [(noise[name], stream(seed, f"calibration.{use}.{name}{what}", body)) for name in names]

        people = [f"person{i}" for i in range(len(scenario.people))]
        self._pose, self._control = channels(_ROBOT, "robot"), channels(_CONTROL, "robot")
        self._position = [channels(_PERSON, person) for person in people]
        self._velocity = [channels(_PERSON, person, ".velocity") for person in people]

    def __call__(self, num: int) -> Errors:
        """`num` joint draws."""
        people = np.zeros((len(self._position), num, 4))
        for person, position, velocity in zip(people, self._position, self._velocity, strict=True):
            person[:, :2] = _columns(position, num)
            person[:, 2:] = _columns(velocity, num) / VELOCITY_WINDOW
        return Errors(_columns(self._pose, num), self.control(num), people)

    def control(self, *size: int) -> Array:
        """Draws of the actuation noise alone, (*size, 2)."""
        return _columns(self._control, *size)


def _columns(channels: Sequence[tuple[Distribution, np.random.Generator]], *size: int) -> Array:
    return np.stack([distribution.sample(rng, size) for distribution, rng in channels], axis=-1)


def around_truth(observation: Observation, truth: WorldState, errors: Errors) -> Observation:
    """The observation with robot and people at their true states minus the errors; the rest stays."""
    there = ~np.isnan(truth.people_position[:, 0])
    num_people = int(there.sum())
    num = len(errors.control)
    pose = np.broadcast_to(truth.robot_pose - errors.pose, (num, 3)).copy()
    pose[:, 2] = wrap(pose[:, 2])
    people = [
        ObstacleSamples(position - error[:, :2], velocity - error[:, 2:], person.radius)
        for position, velocity, error, person in zip(
            truth.people_position[there],
            truth.people_velocity[there],
            [error for error, present in zip(errors.people, there, strict=True) if present],
            observation.obstacles,
            strict=False,
        )
    ]
    return replace(
        observation,
        robot_pose=pose,
        control_noise=errors.control,
        obstacles=(*people, *observation.obstacles[num_people:]),
        time=truth.time,
    )
