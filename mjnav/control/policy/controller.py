"""Learned policies as controllers: scaling of their actions, encoding of observations as arrays, and their base class.

Actions are numbers from -1 to 1, or commands in SI units.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.control.base import status_of
from mjnav.control.parameters import LoopParameters
from mjnav.control.policy.blocks import KINDS, Features, Frame
from mjnav.messages import Array, Decision, Observation, RobotLimits
from mjnav.motion.unicycle import command_bounds

# -------------------------------------------------------------------------------------------- actions


class Actions:
    """Actions a in [-1, 1]² of a robot: v = low + (a + 1)/2 (high - low), and omega likewise.

    `low` and `high`, (2,), are the lowest and highest v [m/s] and omega [rad/s] that the base takes. An action beyond
    [-1, 1] is a command beyond the limits, which the loop clips and counts.
    """

    def __init__(self, limits: RobotLimits):
        self.low, self.high = command_bounds(limits)

    def command(self, action: ArrayLike) -> Array:
        """(v [m/s], omega [rad/s]) of a normalised action (2,)."""
        return self.low + 0.5 * (np.asarray(action, float) + 1.0) * (self.high - self.low)

    def action(self, command: ArrayLike) -> Array:
        """The normalised action (2,) of (v [m/s], omega [rad/s]): the inverse of `command`."""
        return 2.0 * (np.asarray(command, float) - self.low) / (self.high - self.low) - 1.0


# --------------------------------------------------------------------------------------- observations


Array32 = NDArray[np.float32]


class Encoder:
    """Turns observations of one robot into the blocks of `features`; it keeps nothing from one to the next."""

    def __init__(self, features: Features, limits: RobotLimits):
        self.features, self._limits = features, limits
        bounds = {name: KINDS[name].bounds(features, limits) for name in sorted(features.blocks)}
        self.bounds = {name: (low.astype(np.float32), high.astype(np.float32)) for name, (low, high) in bounds.items()}

    def encode(self, observation: Observation) -> dict[str, Array32]:
        """The blocks by name, in the order of their names, each clipped to its bounds and new.

        Raises ValueError where the scan is wanted and the observation has none.
        """
        frame, blocks = Frame.of(observation), {}
        for name, (low, high) in self.bounds.items():
            values = KINDS[name].values(self.features, self._limits, observation, frame)
            blocks[name] = np.clip(values.astype(np.float32), low, high)
        return blocks


def flatten(blocks: Mapping[str, Array32]) -> Array32:
    """All blocks as one vector, in the order of their names, as Gymnasium's FlattenObservation gives it."""
    return np.concatenate([blocks[name].ravel() for name in sorted(blocks)])


# ----------------------------------------------------------------------------------------- controller


class PolicyController(ABC):
    """A policy that sees the blocks of `features` and nothing else: a subclass gives `act`.

    `features` are those that the policy was trained with, and the blocks those that the environment gave it, bit for
    bit, where `control.samples` is the same. It runs as any controller does:

        class Policy(PolicyController):
            features = Features(blocks=("robot",))

            def act(self, blocks):
                distance, cos, sin = blocks["robot"][:3]
                return self.actions.command([2.0 * cos - 1.0, -sin])

        mjnav run hall --controller policy.py:Policy

    `self.actions` scales normalised actions; `limits`, `period` [s] and `parameters` are those of any controller.
    """

    parameters_type: ClassVar[type[LoopParameters]] = LoopParameters
    features: ClassVar[Features] = Features()

    def __init__(self, limits: RobotLimits, period: float, parameters: LoopParameters):
        self.limits, self.period, self.parameters = limits, period, parameters
        self.encoder = Encoder(self.features, limits)
        self.actions = Actions(limits)

    @abstractmethod
    def act(self, blocks: Mapping[str, Array32]) -> ArrayLike:
        """The command (v [m/s], omega [rad/s]) for what the policy sees."""

    def decide(self, observation: Observation) -> Decision:
        """The policy's command for the observation."""
        v, omega = map(float, self.act(self.encoder.encode(observation)))  # type: ignore[arg-type]
        return Decision(v, omega, status_of(observation, v, omega))

    def closest_cone(self, observation: Observation, decision: Decision) -> tuple[int, Array, Array] | None:
        """None: a policy has no samples of a constraint."""
        return None
