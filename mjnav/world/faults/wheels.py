"""The faults of the wheels: commands that do not come as they were sent, and wheels that slip."""

import numpy as np

from mjnav.messages import Array
from mjnav.motion.diff_drive import twist_of_wheels, wheel_speeds
from mjnav.scenarios.faults import Slip, WheelFaults
from mjnav.scenarios.spec import Scenario
from mjnav.world.faults.channel import FaultyChannel, Message
from mjnav.world.grid import NEVER, Grid

WATCHDOG = 0.5  # [s] without a command after which the base stops by itself, as bases do


class FaultyWheels:
    """Between the commands and the floor. Without faults of the wheels commands and set-points stay as they are."""

    def __init__(self, scenario: Scenario, seed: int):
        faults = WheelFaults() if scenario.faults is None else scenario.faults.wheels or WheelFaults()
        self._timestep = scenario.physics.timestep
        self._slip: Slip | None = faults.slip
        spoilt = any(kind != "slip" for channel, kind, _ in _each(scenario) if channel == "wheels")
        self._channel = FaultyChannel("wheels", faults, (1, 2), seed) if spoilt else None
        self._sending = Grid(scenario.control.period, self._timestep)
        self._command = (0.0, 0.0)
        self._heard = 0.0  # [s] when a command last came

    @property
    def next(self) -> int:
        """The step at which the base next hears a command; far away where it hears all at once."""
        return NEVER if self._channel is None else self._sending.next

    def command(self, sent: tuple[float, float], step: int) -> tuple[float, float]:
        """The command that the base obeys at a step, where one was sent."""
        if self._channel is None:
            return sent
        time = step * self._timestep
        if self._sending.due(step):
            message = self._channel.pass_on(time, Message(time, np.array([sent]), np.zeros(0)))
            if message is not None and np.isfinite(message.rows).all():  # no base obeys NaN
                v, omega = message.rows[0].tolist()
                self._command, self._heard = (v, omega), time
            elif time - self._heard >= WATCHDOG - 1e-9:
                self._command = (0.0, 0.0)
        return self._command

    def over_floor(self, twists: Array, step: int) -> tuple[Array, Array]:
        """Speeds over the floor (n, 2) for set-points `twists` (n, 2) from `step` on, and the angles that wheels slip.

        The angles (n, 2), left and right [rad], are what the encoders count beside the motion.
        """
        slip = self._slip
        if slip is None:
            return twists, np.zeros((0, 2))
        times = (step + np.arange(len(twists))) * self._timestep
        lasts = (times >= slip.start - 1e-9) & (times < slip.end - 1e-9)
        wheels = np.stack(wheel_speeds(twists[:, 0], twists[:, 1]), axis=1)
        lost = np.where(lasts[:, None] & np.array([slip.side != "right", slip.side != "left"]), 1.0 - slip.factor, 0.0)
        floor = np.stack(twist_of_wheels(*((1.0 - lost) * wheels).T), axis=1)
        return np.where(lasts[:, None], floor, twists), lost * wheels * self._timestep


def _each(scenario: Scenario):
    return () if scenario.faults is None else scenario.faults.each()
