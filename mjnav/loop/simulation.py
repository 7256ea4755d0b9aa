"""`mjnav.Simulation`: the closed loop of a scenario, one control period at a time.

The file also has what a whole run attaches to its simulation, copies of a simulation's state, and the people of a scene
without the robot, under the same engine, behaviours and random streams.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Self

import numpy as np

from mjnav.errors import InputError, InvalidValue, MjnavError, own_code, said
from mjnav.log.live import LiveServer
from mjnav.log.write.writer import Recorder
from mjnav.loop.events import ABORTED, Events, Referee, warnings_of
from mjnav.loop.pacer import Start, Stopwatch
from mjnav.loop.prepare import as_scenario, log_path
from mjnav.loop.provenance import run_info
from mjnav.loop.result import Result, RunSummary, with_latencies
from mjnav.loop.run_record import RunRecord
from mjnav.loop.supervision import fault_events
from mjnav.loop.tick import Tick
from mjnav.messages import Array, Beliefs, Decision, Event, Observation, Reading, TickRecord, Trajectory, WorldState
from mjnav.metrics.own import OwnMetrics
from mjnav.metrics.progress import farthest_step
from mjnav.metrics.safety import sees_robot
from mjnav.metrics.social import detour
from mjnav.metrics.summary import summarise
from mjnav.metrics.timing import compute_ms
from mjnav.robot.estimation.own import checked_beliefs
from mjnav.robot.latency import given_decision
from mjnav.robot.navigator import Navigator
from mjnav.scene.ranges import MAX_LENGTH
from mjnav.scene.spec import Person, Scenario
from mjnav.sealed import sealed_message
from mjnav.settings.plugins import BehaviourPlugin
from mjnav.world.engine import DivergedError
from mjnav.world.simulator import Simulator

# -------------------------------------------------------------------------------------- attachments


@dataclass(frozen=True, slots=True)
class Attached:
    """A watcher, live clients, a thread for the log, a stopwatch of its own.

    `watch` sees every tick before the world moves on, and the clients of `live` get what a log gets. `cones` also
    computes the samples that are logged when no log is written; a log that is `threaded` is written on a thread.
    """

    watch: Callable[[TickRecord], None] = lambda record: None
    live: LiveServer | None = None
    cones: bool = False
    threaded: bool = False
    stopwatch: Stopwatch | None = None


# ------------------------------------------------------------------------------------------- copies


def branched(state: Mapping[str, Any], messages: Iterable[object]) -> dict[str, Any]:
    """A deep copy of a simulation's parts by name, which shares `messages`: they never change.

    Raises InputError where an object of the user's own cannot be copied.
    """
    advice = (
        "objects of your own in a simulation need to be ones that copy.deepcopy can copy, or have a method __deepcopy__"
    )
    with own_code(lambda error: InputError(f"copy(): {said(error)}; {advice}"), MjnavError):
        return deepcopy(dict(state), {id(message): message for message in messages})


# ------------------------------------------------------------------------- people without the robot


FAR = (-MAX_LENGTH, -MAX_LENGTH, 0.0)  # where the robot stands, at the end of all coordinates


def people_without_robot(scenario: Scenario, seed: int, ticks: int) -> Array:
    """Where the people are at the times of the ticks, (ticks + 1, P, 2) [m], if there is no robot.

    The robot stands where nobody meets it, and nobody sees it; for behaviours of a user's own, which may rely on
    knowing where it is, it is far away. Raises what a behaviour raises, and DivergedError.
    """
    alone = replace(
        scenario,
        robot=replace(scenario.robot, start=FAR),
        people=tuple(_unseeing(person) for person in scenario.people),
    )
    world = Simulator(alone, seed, lidar=False)
    places: list[Array] = [world.state().people_position]
    for _ in range(ticks):
        world.advance(scenario.control.period, (0.0, 0.0))
        places.append(world.state().people_position)
    return np.array(places)


def with_detour(result: Result, scenario: Scenario) -> Result:
    """The result of a run with what the robot cost the people; a fault where they cannot be run without it."""
    if not scenario.people:
        return result
    try:
        alone = people_without_robot(scenario, scenario.seed, len(result.trajectory.status))
    except MjnavError as error:
        faults = (*result.metrics.faults, f"detour: the people without the robot: {error}")
        return replace(result, metrics=replace(result.metrics, faults=faults))
    return replace(result, run=replace(result.run, detour=detour(result.trajectory, alone, scenario)))


def _unseeing(person: Person) -> Person:
    return person if isinstance(person.behaviour, BehaviourPlugin) else replace(person, sees_robot=False)


# --------------------------------------------------------------------------------------- simulation


class SimulationOver(MjnavError, RuntimeError):
    """A call that a simulation cannot answer any more: a step after its end, or anything after `close`."""


class Simulation:
    """A scenario under a seed, from tick to tick: observe, decide, step.

        with mjnav.Simulation("hall", seed=3) as simulation:
            while not simulation.done:
                simulation.step(simulation.decide())
        print(simulation.summary["outcome"])

    Looking changes nothing: the same steps end in the same state, whatever was read between them. `mjnav run` is this
    loop, and ends in the same state hash. It does not wait for the wall clock. What passes between calls is not timed:
    `compute_ms`, the real-time factor and the latency model "measured" count the time within calls alone.
    """

    def __init__(
        self,
        scenario: Scenario | str | os.PathLike[str],
        *,
        seed: int | None = None,
        controller: Any = None,
        localizer: Any = None,
        tracker: Any = None,
        metrics: Sequence[Any] | None = None,
        log: bool | str | os.PathLike[str] | None = None,
        estimators: bool = True,
        scan: bool | None = None,
        attached: Attached | None = None,
    ):
        """`scenario` to `log` are as in `mjnav.run`; the log begins with the first step.

        Without `estimators` no filter runs, and the only beliefs are those that `observe` is given. `scan` says whether
        lidar rays are cast; by default they are with estimators or a log. Raises InputError for what cannot be used.
        """
        own = {"controller": controller, "localizer": localizer, "tracker": tracker, "metrics": metrics}
        self.scenario = scenario = as_scenario(scenario, **own, seed=seed)
        attached = attached or Attached()
        path = log_path(log, scenario)
        recorded = path is not None or attached.live is not None
        self._log, self._estimators = path, estimators
        self._scan = estimators or recorded if scan is None else scan
        self._watch = attached.stopwatch or Stopwatch(pauses=True)
        self._world = Simulator(scenario, scenario.seed, lidar=self._scan)
        self._robot = Navigator(scenario, scenario.seed, estimators=estimators)
        self._referee = Referee(scenario)
        self._metrics = OwnMetrics(scenario)
        self._recorder: Recorder | None = None
        if recorded:
            self.prepare()  # the log names the controller's source files, which importing it finds
            from mjnav.world.scene import compose, parts_hash

            info, xml = run_info(scenario, scenario.seed, parts_hash()), compose(scenario).to_xml()
            self._recorder = Recorder(path, scenario, info, xml, threaded=attached.threaded, live=attached.live)
        self._record = RunRecord(
            self._robot, self._recorder, watch=attached.watch, cones=attached.cones or self._recorder is not None,
            events=Events(sees_robot(scenario), farthest_step(scenario)),
        )  # fmt: skip
        self._record.note(*warnings_of(scenario))
        self._tick: Tick | None = None  # the present one; None until it is asked for
        self._ticks = 0  # that are over
        self._estimated: Beliefs | None = None  # after the last of them
        self._outcome: str | None = None
        self._final: WorldState | None = None  # in which the simulation ended
        self._start = Start(0, False)
        self._closed = False
        self._shown: Mapping[str, tuple[object, Any]] = {}  # by property: a message, and what is shown of it
        self.result: Result | None = None  # once closed

    # ------------------------------------------------------------------------------------ how it stands

    @property
    def tick(self) -> int:
        """The number of the present tick: how many steps were made."""
        return self._ticks

    @property
    def time(self) -> float:
        """[s] since the start."""
        return self._world.time

    @property
    def outcome(self) -> str | None:
        """None while it goes on, then "goal", "believed", "collision", "timeout" or "aborted"."""
        if self._outcome is None:
            truth = self._present().truth
            belief = None if self._estimated is None else self._estimated.robot
            self._outcome = self._referee.outcome(truth, belief, on_last_leg=self._robot.on_last_leg)
            self._final = None if self._outcome is None else truth
        return self._outcome

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self.outcome is not None

    @property
    def truth(self) -> WorldState:
        """The true state of robot and people: for rewards and learners, never for a controller."""
        return self._sealed("truth", self.state)

    @property
    def goal(self) -> Array:
        """The point of the route that the robot is on its way to, (2,) [m]."""
        return self._robot.goal.copy()

    @property
    def readings(self) -> tuple[Reading, ...]:
        """What the sensors measured since the tick before, oldest first; empty where none was due."""
        return self._sealed("readings", self._perceived("readings").readings or ())

    @property
    def beliefs(self) -> Beliefs | None:
        """What is believed after the readings; None without estimators, unless `observe` was given beliefs."""
        return self._sealed("beliefs", self._perceived("beliefs").beliefs)

    @property
    def summary(self) -> dict[str, Any]:
        """The figures that `mjnav run --json` prints: so far, and final once done."""
        return self._so_far().summary

    @property
    def trajectory(self) -> Trajectory:
        """All ticks as arrays: so far, and final once done."""
        if self.result is not None:
            return self.result.trajectory
        return self._record.finish(self.state, self._world.state_hash(), go_on=True)[0]

    # -------------------------------------------------------------------------------------- what it does

    def observe(self, beliefs: Beliefs | None = None) -> Observation:
        """What a controller may know in the present tick; until the next step the same object.

        Own `beliefs` take the place of the estimators' in this tick, in the log and the trajectory, too. Raises
        InvalidValue where there are neither, and InputError for beliefs that cannot be used.
        """
        observation = self._predicted("observe()", beliefs).observation
        assert observation is not None, "the tick has predicted"
        return observation

    def decide(self) -> Decision:
        """The decision of the scenario's own controller on `observe()`; until the next step the same object.

        It lies within the robot's limits; what the controller chose beyond them is its `wish`. Raises what the
        controller raises, and PluginFault for what is no decision of finite numbers.
        """
        tick = self._predicted("decide()")
        return tick.decide() if tick.decision is None else tick.decision

    def step(self, v: float | Decision, omega: float | None = None) -> None:
        """Acts for one control period: on a decision, or on the command v [m/s], omega [rad/s].

        It is the controller's decision of this tick: clipped to the robot's limits, with the same latency, and the base
        ramps towards it. Raises InvalidValue for a command that is not finite, which changes nothing, and
        SimulationOver after the end. Where the step itself fails, the simulation has ended as aborted.
        """
        tick = self._usable("step()")
        if self.done:
            raise SimulationOver(f"step(): the simulation has ended: {self._outcome} after {self.time:g} s")
        decision = tick.decision
        if decision is None or v is not decision or omega is not None:
            decision = self._robot.limited(given_decision(v, omega))
        try:
            if self._perceived("step()").predicted is None:
                tick.predict()
            tick.act(decision, self._record)
            self._record.add_timing(tick.k, self._watch, self._start)
        except BaseException as error:
            self.abort(error)
            raise
        self._ticks, self._estimated, self._tick = self._ticks + 1, tick.estimated, None

    def close(self) -> None:
        """Ends the log in order; a simulation that has not ended is aborted. Does nothing when called again."""
        if not self._closed:
            self.conclude()

    def __enter__(self) -> Self:
        if self._recorder is not None:
            try:
                self._recorder.open()
            except BaseException:
                self._recorder.abort()
                raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if error is not None and not self._closed:
            self.abort(error)
        self.close()

    def __repr__(self) -> str:
        state = "closed" if self._closed else self.outcome or "running"
        return f"Simulation({self.scenario.name!r}, seed={self.scenario.seed}, t={self.time:.6g} s, {state})"

    # -------------------------------------------------------------------------------------- branches

    def copy(self) -> "Simulation":
        """A second simulation in the same state, which goes on by itself and never logs.

        With the same steps both end in the same state, bit for bit. All of the state is copied, the controller's and
        the random streams' with it; the scenario and the physics' model, which do not change, are shared. Raises
        InputError where an object of the user's own cannot be copied by `copy.deepcopy`.
        """
        self._usable("copy()")
        twin = object.__new__(type(self))
        vars(twin).update(vars(self))
        twin._log = twin._recorder = None
        twin._take(self)
        return twin

    def restore(self, other: "Simulation") -> None:
        """Goes to the state of `other`, which may have been copied from this simulation earlier, and stays as it is.

        Raises InvalidValue where `other` simulates something else or this simulation writes a log, which only goes
        forward, and InputError as `copy` does.
        """
        self._usable("restore()")
        if not isinstance(other, Simulation):
            raise InvalidValue("restore()", other, "a Simulation, such as copy() gives")
        other._usable("restore()")
        if self._recorder is not None:
            raise InvalidValue("restore()", self, "a simulation without a log: branch by copy() instead")
        if (other.scenario, other._estimators, other._scan) != (self.scenario, self._estimators, self._scan):
            raise InvalidValue("restore()", other, "a simulation of the same scenario, estimators and scan")
        self._take(other)

    def _take(self, other: "Simulation") -> None:
        """Takes over a deep copy of another simulation's state."""
        state = {name: getattr(other, name) for name in _STATE}
        messages = () if other._tick is None else other._tick.messages
        vars(self).update(branched(state, messages))

    # --------------------------------------------------------------------- what `loop.episode` does besides

    @property
    def state(self) -> WorldState:
        """The truth itself: `truth` is a copy that cannot be written to."""
        return self._present().truth if self._final is None else self._final

    def perceive(self) -> None:
        """Senses and estimates, where the present tick has not yet."""
        self._perceived("perceive()")

    def predict(self) -> Observation:
        """What `observe` gives, but itself: for those who write to nothing."""
        predicted = self._predicted("predict()").predicted
        assert predicted is not None, "the tick has predicted"
        return predicted

    def prepare(self) -> None:
        """Makes the controller, which is otherwise made when it is first asked. Raises InputError where it cannot."""
        _ = self._robot.controller

    def note(self, *events: Event) -> None:
        """Events for the log, with the present tick."""
        self._record.note(*events)

    def begin(self, start: Start) -> None:
        """How the present tick began on the wall clock."""
        self._start = start

    def abort(self, error: BaseException | None = None) -> None:
        """Ends the simulation where it stands, unless it has ended; what broke it goes to the log's events."""
        if self._outcome is not None:
            return
        if error is not None:
            self._record.note(*fault_events(error))
        if isinstance(error, DivergedError):  # then the last state that is known counts
            self._final = replace(self._present().truth, contacts=())
        else:
            self._final = self._world.state()
        self._outcome = ABORTED

    def conclude(self, seconds: float | None = None, *, deadline_misses: int = 0, detour: bool = False) -> Result:
        """Ends the simulation, and its log, after `seconds` on the wall; returns how it went.

        `detour` also runs the people without the robot.
        """
        if not self.done:
            self.abort()
        self._closed = True
        try:
            result = self._make_result(seconds, deadline_misses=deadline_misses)
            result = self.result = with_detour(result, self.scenario) if detour else result
            self._record.note(*(Event("error", "metric", fault) for fault in result.metrics.faults))
            self._record.end_log(self.state, result.run, None if result.replay is self.scenario else result.replay)
        finally:
            if self._recorder is not None:
                self._recorder.abort()
        return result

    def _sealed(self, name: str, message: Any) -> Any:
        """A message in arrays that cannot be written to; asked for the same one again, the same copy."""
        if name not in self._shown or self._shown[name][0] is not message:
            self._shown = {**self._shown, name: (message, sealed_message(message))}  # anew: branches share the old one
        return self._shown[name][1]

    def _present(self) -> Tick:
        if self._tick is None:
            self._tick = Tick(self._ticks, self._estimated, world=self._world, robot=self._robot, watch=self._watch)
        return self._tick

    def _perceived(self, what: str) -> Tick:
        """The present tick, after it has sensed and estimated."""
        tick = self._usable(what)
        if not tick.perceived:
            tick.perceive()
        return tick

    def _predicted(self, what: str, beliefs: Beliefs | None = None) -> Tick:
        """The present tick, after it has predicted by the estimators' beliefs or by those that are given."""
        tick = self._perceived(what)
        if beliefs is not None or tick.predicted is None:
            tick.predict(None if beliefs is None else checked_beliefs(beliefs))
        if tick.predicted is None:
            raise InvalidValue("beliefs", None, "observe(beliefs), or a Simulation with estimators=True")
        return tick

    def _usable(self, what: str) -> Tick:
        if self._closed:
            raise SimulationOver(f"{what}: the simulation is closed")
        return self._present()

    def _so_far(self) -> Result:
        return self._make_result(None, go_on=True) if self.result is None else self.result

    def _make_result(self, seconds: float | None, *, deadline_misses: int = 0, go_on: bool = False) -> Result:
        trajectory, state_hash = self._record.finish(self.state, self._world.state_hash(), go_on=go_on)
        if seconds is None:  # what the phases of its ticks took
            seconds = 1e-9 * float(trajectory.timing[:, 1:-1].sum())
        scenario, metrics = self.scenario, self._metrics.measured(trajectory)
        summary = RunSummary(
            scene=scenario.name,
            controller=scenario.control.method,
            seed=scenario.seed,
            figures=summarise(trajectory, scenario, outcome=self.outcome),
            compute_ms=compute_ms(trajectory.timing),
            real_time_factor=float(trajectory.time[-1]) / seconds if seconds > 0.0 else None,
            deadline_misses=deadline_misses,
            state_hash=state_hash,
            log=str(self._log) if self._log else None,
            metrics=metrics.values,
        )
        replay = with_latencies(scenario, self._robot.latency)
        return Result(summary, trajectory, replay, log_dropped=self._record.log_dropped, metrics=metrics)


# What a branch has of its own.
_STATE = ("_watch", "_world", "_robot", "_record", "_tick", "_ticks", "_estimated", "_outcome", "_final")
