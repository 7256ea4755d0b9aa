"""One episode: composes world, navigator, referee and recorder, and runs the loop to its end."""

import hashlib
from collections.abc import Callable, Mapping
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from mjnav.geometry.compiled import load_kernels
from mjnav.loop.faults.fault import RunFault, describe_fault, fault_events
from mjnav.loop.onboard.commands import describe_clipping
from mjnav.loop.onboard.latency import Computed, replayed
from mjnav.loop.onboard.navigator import Beliefs, Navigator
from mjnav.loop.pacer import FreePacer, Pacer, Start, Stopwatch
from mjnav.loop.prepare import build_controller
from mjnav.loop.provenance.run_info import run_info
from mjnav.loop.referee import ABORTED, GOAL, Referee, describe
from mjnav.loop.sealed import sealed
from mjnav.messages import (
    ConeDistribution,
    Decision,
    Event,
    Observation,
    Status,
    TickRecord,
    TickTiming,
    Trajectory,
    WorldState,
)
from mjnav.metrics.summary import summarise
from mjnav.metrics.timing import compute_ms
from mjnav.recording.live import LiveServer
from mjnav.recording.read.trajectory import TrajectoryBuilder
from mjnav.recording.write.writer import LogError, Recorder
from mjnav.scenarios.spec import Scenario
from mjnav.world.engine import DivergedError
from mjnav.world.simulator import Simulator

WARM_UP_TICKS = 3


@dataclass(frozen=True, slots=True)
class Result:
    """How a run went: `summary` is what `mjnav run --json` prints, `trajectory` the arrays it was computed from.

    `real_time` says of a paced run what it got of the machine: scheduler, memory, affinity. `replay` is the scenario
    that ends in the same state hash: the run's own, but where latency was measured. `log_dropped` counts what a paced
    run's log could not take in time.
    """

    summary: dict[str, Any]
    trajectory: Trajectory
    replay: Scenario
    real_time: Mapping[str, str] | None = None
    log_dropped: int = 0


class Episode:
    """One run of a scenario. `run` may be called once."""

    def __init__(
        self,
        scenario: Scenario,
        *,
        log: Path | None = None,
        live: LiveServer | None = None,
        pacer: Pacer | None = None,
        stop: Callable[[], bool] = lambda: False,
        progress: Callable[[float], None] = lambda time: None,
        watch: Callable[[TickRecord], None] = lambda record: None,
        cones: bool = False,
    ):
        """`stop` is asked before every tick whether to abort, and `progress` is told the simulated time [s].

        `watch` sees what every tick saw and did, before the world moves on. The clients of `live` get what a log gets,
        also where there is none.

        `cones` computes what only a log needs without one too.

        Raises InputError for a log that cannot be written.
        """
        self._scenario = scenario
        self._pacer = pacer or FreePacer()
        self._stop, self._progress, self._watch = stop, progress, watch
        self._period = scenario.control.period
        self._simulator = Simulator(scenario, scenario.seed)
        self._truth = self._simulator.state()  # when the tick began
        self._navigator = Navigator(scenario, scenario.seed, build_controller(scenario))
        self._referee = Referee(scenario)
        self._trajectory = TrajectoryBuilder()
        self._hash = hashlib.sha256()
        self._beliefs: Beliefs | None = None
        self._misses = 0  # of deadlines; that of the last tick's end, too, which no tick's timing tells
        self._status = Status.OK
        self._clipping_told = False
        self._events_before: tuple[Event, ...] = ()
        recorded = log is not None or live is not None
        self._cones = cones or recorded
        self._log = log
        self._recorder = None
        if recorded:
            info = run_info(scenario, scenario.seed, self._simulator.parts_hash())
            threaded = self._pacer.real_time
            self._recorder = Recorder(log, scenario, info, self._simulator.model_xml(), threaded=threaded, live=live)

    def run(self, events: tuple[Event, ...] = ()) -> Result:
        """Runs to the goal, a collision, the time limit or an abort.

        `events` are from before the first tick, and are logged with it. Whatever breaks in a tick, the log among it,
        ends the run: with the outcome aborted, a fault among the log's events, and RunFault, which holds the result.
        Raises InputError where the log cannot be made.
        """
        self._events_before = events
        with self._recorder or nullcontext():
            if self._recorder is not None:
                self._recorder.open()
            return self._run()

    def _run(self) -> Result:
        began = self._pacer.now()
        errors: list[BaseException] = []
        try:
            final, outcome = self._loop()
        except BaseException as error:
            errors.append(error)
            final, outcome = self._simulator.state(), ABORTED
            if isinstance(error, DivergedError):  # the last that is known
                final = replace(self._truth, contacts=())
            self._events_before = (*self._events_before, *fault_events(error))
        result = None
        try:
            result = self._result(final, outcome, began)
            self._end_log(final, result)
        except Exception as error:
            errors.append(error)
        if not errors and result is not None:
            return result
        first = errors[0]
        if not isinstance(first, Exception | SystemExit):  # an interrupt stays one
            raise first
        ticks = len(self._trajectory)
        what = "; ".join(dict.fromkeys(map(describe_fault, errors)))
        place = f"; the log is {self._log}" if self._log and not any(isinstance(e, LogError) for e in errors) else ""
        raise RunFault(f"{outcome} after {final.time:.1f} s, {ticks} ticks: {what}{place}", result) from first

    def _loop(self) -> tuple[WorldState, str]:
        """Tick after tick; the state in which the run ended, and how."""
        watch = Stopwatch(self._pacer.now)
        tick = 0
        while True:
            start = self._pacer.wait()
            watch.start()
            truth = self._truth = self._simulator.state()
            outcome = self._outcome(tick, truth, start)
            if outcome is not None:
                return truth, outcome
            self._tick(tick, truth, watch)
            timing = TickTiming(tick, tuple(watch.phases), start.lateness, start.missed)
            self._trajectory.add_timing(timing)
            if self._recorder is not None:
                self._recorder.write_timing(timing)
            tick += 1

    def _outcome(self, tick: int, truth: WorldState, start: Start) -> str | None:
        self._progress(truth.time)
        self._misses += start.missed
        if start.abort:
            late = f"{1e-6 * start.lateness:.1f} ms after the deadline of the next"
            text = f"tick {tick - 1} was still at work {late}, which ends the run on request"
            self._events_before = (*self._events_before, Event("error", "overrun", text))
        if start.abort or self._stop():
            return ABORTED
        return self._referee.outcome(truth, on_last_leg=self._navigator.on_last_leg)

    def _tick(self, tick: int, truth: WorldState, watch: Stopwatch) -> None:
        """Sense, estimate, decide, record, act: the world moves on by one period. A lap for each of PHASES."""
        navigator = self._navigator
        readings = self._simulator.sense()
        watch.lap()
        beliefs = self._beliefs = navigator.estimate(readings, self._beliefs)
        watch.lap()
        observation = navigator.observe(tick, beliefs)
        decision = navigator.decide(observation)
        watch.lap()
        command, switches = navigator.schedule(tick, 1e-9 * sum(watch.phases))
        self._hash.update(truth.robot_pose.tobytes() + beliefs.robot.mean.tobytes() + command.tobytes())
        record = TickRecord(
            tick=tick,
            truth=truth,
            reading=readings[-1] if readings else None,
            readings_before=readings[:-1],
            belief=beliefs.robot,
            tracks=beliefs.people,
            observation=observation,
            decision=decision,
            command=command,
            cone=self._cone(observation, decision) if self._cones else None,
            events=self._events(truth, beliefs if readings else None, decision),
        )
        self._trajectory.add(record)
        if self._recorder is not None:
            self._recorder.write(record)
        self._watch(record)
        watch.lap()
        self._simulator.advance(self._period, command, switches)
        watch.lap()

    def _cone(self, observation: Observation, decision: Decision) -> ConeDistribution | None:
        found = self._navigator.controller.closest_cone(observation, decision)
        if found is None:
            return None
        obstacle, samples, desired = found
        samples, desired = (sealed(np.asarray(values, float)) for values in (samples, desired))
        return ConeDistribution(self._navigator.names[obstacle], samples, desired, float((samples <= 0.0).mean()))

    def _events(self, truth: WorldState, news: Beliefs | None, decision: Decision) -> tuple[Event, ...]:
        events = [*self._events_before, *(Event("error", "contact", describe(contact)) for contact in truth.contacts)]
        self._events_before = ()
        if news is not None:
            recovered = [belief for belief in (news.robot, *news.people) if belief.recovered]
            events += [
                Event("warning", "recovery", f"the filter of {getattr(belief, 'name', 'robot')} was spread again")
                for belief in recovered
            ]
        if decision.status != self._status:
            level = "info" if decision.status == Status.OK else "warning"
            text = ": ".join(part for part in (decision.status.value, decision.status.advice) if part)
            events.append(Event(level, "decision", text))
            self._status = decision.status
        if decision.wish is not None and not self._clipping_told:
            events.append(Event("warning", "clipped", describe_clipping(decision, decision.wish)))
            self._clipping_told = True
        return tuple(events)

    def _result(self, final: WorldState, outcome: str, began: int) -> Result:
        seconds = (self._pacer.now() - began) * 1e-9
        trajectory = self._trajectory.finish(final)
        self._hash.update(self._simulator.state_hash().encode())
        summary = {
            "schema": 1,
            "scene": self._scenario.name,
            "controller": self._scenario.control.method,
            "seed": self._scenario.seed,
            **summarise(trajectory, self._scenario, outcome=outcome),
            "compute_ms": compute_ms(trajectory.timing),
            "real_time_factor": final.time / seconds if seconds > 0.0 else None,
            "deadline_misses": self._misses,
            "state_hash": self._hash.hexdigest(),
            "log": str(self._log) if self._log else None,
        }
        dropped = self._recorder.dropped if self._recorder else 0
        return Result(summary, trajectory, self._replay(), log_dropped=dropped)

    def _end_log(self, final: WorldState, result: Result) -> None:
        """The log's last state, its last events and the result."""
        if self._recorder is None:
            return
        outcome = result.summary["outcome"]
        events = [*self._events_before, *(Event("error", "contact", describe(contact)) for contact in final.contacts)]
        if result.log_dropped:
            text = f"{result.log_dropped} parts of ticks are missing: the disk could not keep up"
            events.append(Event("warning", "log", text))
        events.append(Event("info" if outcome == GOAL else "warning", "end", f"the run ended: {outcome}"))
        replay = None if result.replay is self._scenario else result.replay
        self._recorder.finish(final, result.summary, events, replay)

    def _replay(self) -> Scenario:
        """The scenario with measured latencies written down."""
        control, model = self._scenario.control, self._navigator.latency
        if control.latency is None or control.latency.model != "measured" or not isinstance(model, Computed):
            return self._scenario
        latency = replayed(control.latency, control.period, model.trace)
        return replace(self._scenario, control=replace(control, latency=latency))


def warm_up(scenario: Scenario) -> None:
    """Loads every kernel that a run of this scenario can call, and touches its memory in ticks that are thrown away.

    The kernels are those of all modules that a run has imported when it begins, for the types that each declares: what
    is called first in the middle of a run, too. Every one of the ticks has a reading, so that none of what a tick can
    do waits for the second.
    """
    asked = count()
    sensors = replace(scenario.sensors, rate=scenario.control.rate)
    with suppress(RunFault):  # the run itself will tell, and log, what is wrong
        episode = Episode(replace(scenario, sensors=sensors), stop=lambda: next(asked) >= WARM_UP_TICKS, cones=True)
        load_kernels()
        episode.run()
