"""The base class of learned policies that run as controllers."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from numpy.typing import ArrayLike

from mjnav.control.base import status_of
from mjnav.control.parameters import LoopParameters
from mjnav.control.policy.actions import Actions
from mjnav.control.policy.encoder import Array32, Encoder
from mjnav.control.policy.features import Features
from mjnav.messages import Array, Decision, Observation, RobotLimits


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
