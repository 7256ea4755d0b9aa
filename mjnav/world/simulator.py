"""One world that runs: engine, people, actuation and sensors on one clock of whole steps."""

import hashlib
import struct
from collections.abc import Iterable
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue
from mjnav.messages import Array, Reading, WorldState
from mjnav.noise import NOISE_WINDOW
from mjnav.scene.spec import Scenario
from mjnav.world.actuation import Actuation
from mjnav.world.draws import Grid, whole_steps
from mjnav.world.engine import Engine
from mjnav.world.faults import FaultySensors, FaultyWheels, Kidnappings
from mjnav.world.people.pedestrians import Pedestrians
from mjnav.world.sensors import NoisySensors


class Simulator:
    """The world of a scenario under a seed.

    The same commands over the same time end in the same state, bit for bit, however calls of `advance` divide it and
    however often the state is read.
    """

    def __init__(self, scenario: Scenario, seed: int, *, lidar: bool = True):
        """Without `lidar` no rays are cast, and the readings' scans have no beams."""
        self._scenario = scenario
        self._timestep = scenario.physics.timestep
        self._step = 0
        self._pedestrians = make_people(scenario, seed)
        start = np.array([person.start for person in scenario.people], float).reshape(-1, 2)
        before = WorldState(0.0, np.array(scenario.robot.start), np.zeros(2), start, np.zeros_like(start))
        before, velocities = self._pedestrians.at_start(before)
        # People are already walking when the run begins.
        self._engine = _make_engine(scenario, velocities)
        for person in np.flatnonzero(np.isnan(before.people_position[:, 0])).tolist():
            self._engine.remove(person)
        self._actuation = Actuation(scenario, seed)
        self._sensors = NoisySensors(scenario, seed, lidar=lidar)
        self._hearing = FaultySensors(scenario, seed)
        self._wheels = FaultyWheels(scenario, seed)
        self._kidnappings = Kidnappings(scenario)
        self._readings: list[Reading] = []
        self._noise_windows = Grid(NOISE_WINDOW, self._timestep)
        self._decisions = Grid(self._pedestrians.period, self._timestep)
        self._sensing = Grid(1.0 / scenario.sensors.rate, self._timestep)
        self._pass_moment()

    @property
    def time(self) -> float:
        """[s] since the start."""
        return self._step * self._timestep

    @property
    def stranded(self) -> tuple[int, ...]:
        """Who were to come again and stay away for good, as none of the ways drawn for them can be walked."""
        return self._pedestrians.stranded

    def advance(self, duration: float, command: ArrayLike, switches: Iterable[tuple[float, ArrayLike]] = ()) -> None:
        """Moves on by `duration` [s], a whole number of steps, with `command` (v, omega) in force.

        Each (offset [s], command) of `switches`, in order of time, takes force at its offset. Raises InvalidValue for
        times that are no whole steps and commands that are not finite.
        """
        end = self._step + whole_steps("duration", duration, self._timestep)
        changes = [(self._step + whole_steps("switches", at, self._timestep), _finite(c)) for at, c in switches]
        current = _finite(command)
        self._engine.contacts.clear()
        for until, following in [*changes, (end, current)]:
            until = min(until, end)
            while self._step < until:
                obeyed = self._wheels.command(current, self._step)
                moment = min(
                    until, self._noise_windows.next, self._decisions.next, self._sensing.next,
                    self._sensors.next_packet, self._wheels.next, self._kidnappings.next,
                )  # fmt: skip
                set_points = self._actuation.twists(obeyed, moment - self._step)
                twists, slipped = self._wheels.over_floor(set_points, self._step)
                self._engine.advance(twists)
                self._engine.spin(slipped)
                self._step = moment
                self._pass_moment()
            current = following

    def _pass_moment(self) -> None:
        """Does what is due at the present step: it is done on reaching a moment, so that looking changes nothing."""
        engine, step = self._engine, self._step
        self._kidnappings.pass_moment(step, engine)
        self._sensors.take_packet(engine, step)
        people = self._pedestrians
        decides = self._decisions.due(step)
        if decides and people.first:
            people.decide(self.state(), engine)
        if self._sensing.due(step):
            self._readings.append(self._hearing.hear(self._sensors.read(engine, self.time, people.radius)))
        if decides and not people.first:
            people.decide(self.state(), engine)
        if self._noise_windows.due(step):
            self._actuation.open_window()

    def sense(self) -> tuple[Reading, ...]:
        """The readings since the last call, in order of time, the present moment's with them if one was due."""
        readings = tuple(self._readings)
        self._readings.clear()
        return readings

    def state(self) -> WorldState:
        """The truth now, with the contacts of the latest `advance`.

        A contact is seen by the step that starts in it, so one that begins with the last step belongs to the next call.
        """
        engine = self._engine
        return WorldState(
            time=self.time,
            robot_pose=engine.robot_pose(),
            robot_twist=engine.robot_twist(),
            people_position=engine.people_position(),
            people_velocity=engine.people_velocity(),
            contacts=engine.contacts.seen(),
            people_radius=self._pedestrians.radius,
        )

    def state_hash(self) -> str:
        """SHA-256 over time and everything in the engine on which the future depends, hexadecimal."""
        return hashlib.sha256(struct.pack("<qd", self._step, self._timestep) + self._engine.state_bytes()).hexdigest()


def make_people(scenario: Scenario, seed: int):
    """Those who move the people: `Pedestrians`, or the `PublishedPeople` of a published crowd."""
    if scenario.published is None:
        return Pedestrians(scenario, seed)
    from mjnav.world.published import PublishedPeople  # only then are the kernels of its engine loaded

    return PublishedPeople(scenario, scenario.published)


def _make_engine(scenario: Scenario, velocities: Array) -> Engine:
    """The engine that the scenario names; people start with `velocities` (P, 2)."""
    if scenario.published is not None or scenario.physics.engine == "kinematic":
        from mjnav.world.published import KinematicEngine, PublishedEngine

        return (KinematicEngine if scenario.published is None else PublishedEngine)(scenario, velocities)
    from mjnav.world.mujoco_engine import MujocoEngine

    return MujocoEngine(scenario, velocities)


def _finite(command: ArrayLike) -> tuple[float, float]:
    v, omega = (float(value) for value in np.asarray(command, float))
    if not (isfinite(v) and isfinite(omega)):
        raise InvalidValue("command", (v, omega), "finite v [m/s] and omega [rad/s]")
    return v, omega
