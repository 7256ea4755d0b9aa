"""A localizer: dead reckoning from a first fix, which shows what a run is like without a pose sensor.

    mjnav run crossing1 --set estimation.robot.localizer=dead_reckoning.py:DeadReckoning

Every particle drives on by the odometry, less a draw of the odometry's noise. Nothing corrects it, so that the belief
spreads: `localization_rmse_m` of the summary grows with `time_limit`.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.messages import Reading, RobotBelief
from mjnav.motion.unicycle import integrate_rows
from mjnav.rng import stream
from mjnav.robot.estimation import assumed_noise
from mjnav.robot.estimation.base import robot_belief
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, settle


@dataclass(frozen=True, slots=True, kw_only=True)
class DeadReckoningParameters:
    """Keys beside the localizer's name."""

    particles: Annotated[int, Range(2, 10_000)] = 300
    first_fix: Annotated[float, Range(0.001, 1.0, "m"), "standard deviation of the first position"] = 0.05

    def __post_init__(self):
        settle(self)


class DeadReckoning:
    """Drives particles on by what the wheels measured."""

    parameters_type = DeadReckoningParameters

    def __init__(self, scenario: Scenario, seed: int, parameters: DeadReckoningParameters):
        self._noise = assumed_noise(scenario)
        self._rng = stream(seed, "dead_reckoning")  # draws of its own: the same seed gives the same run
        self._num = parameters.particles
        spread = parameters.first_fix * self._rng.standard_normal((self._num, 3))
        self._particles = np.array(scenario.robot.start) + spread * [1.0, 1.0, 0.1]

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading; reading.pose is left alone."""
        v = reading.odometry[0] - self._noise["odometry.v"].sample(self._rng, self._num)
        omega = reading.odometry[1] - self._noise["odometry.omega"].sample(self._rng, self._num)
        self._particles = integrate_rows(self._particles, v, omega, reading.interval)
        return robot_belief(reading.time, self._particles)
