"""One episode: composes the world, the robot and their record, runs tick after tick, and ends the run in order."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from itertools import count
from pathlib import Path

from mjnav.loop.faults.fault import RunFault, describe_fault, fault_events
from mjnav.loop.onboard.latency import Computed, replayed
from mjnav.loop.onboard.navigator import Beliefs, Navigator
from mjnav.loop.pacer import FreePacer, Pacer, Start, Stopwatch
from mjnav.loop.prepare import build_controller
from mjnav.loop.profile import Profile
from mjnav.loop.provenance.run_info import run_info
from mjnav.loop.referee import ABORTED, Referee
from mjnav.loop.result import Result, RunSummary
from mjnav.loop.run_record import RunRecord
from mjnav.loop.tick import tick
from mjnav.messages import Event, TickRecord, WorldState
from mjnav.metrics.summary import summarise
from mjnav.metrics.timing import compute_ms
from mjnav.recording.live import LiveServer
from mjnav.recording.write.writer import LogError, Recorder
from mjnav.scenarios.spec import Scenario
from mjnav.world.engine import DivergedError
from mjnav.world.simulator import Simulator


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
        profile: bool = False,
    ):
        """`stop` is asked before every tick whether to abort, and `progress` is told the simulated time [s].

        `watch` sees every tick before the world moves on. The clients of `live` get what a log gets, also where there
        is none. `cones` also computes the samples that are logged when no log is written; `profile` keeps what every
        span of every tick took. Raises InputError for a log that cannot be written.
        """
        self._scenario, self._log = scenario, log
        self._pacer = pacer or FreePacer()
        self._stop, self._progress = stop, progress
        self._world = Simulator(scenario, scenario.seed)
        self._robot = Navigator(scenario, scenario.seed, build_controller(scenario))
        self._referee = Referee(scenario)
        self._truth = self._world.state()  # at the start of the present tick
        self._misses = 0  # of deadlines; the end of the last tick may miss one that no tick's timing tells
        self._profile: list[dict[str, int]] | None = [] if profile else None  # the spans of every tick
        self._recorder = None
        if log is not None or live is not None:
            info = run_info(scenario, scenario.seed, self._world.parts_hash())
            threaded = self._pacer.real_time
            self._recorder = Recorder(log, scenario, info, self._world.model_xml(), threaded=threaded, live=live)
        self._record = RunRecord(self._robot, self._recorder, watch=watch, cones=cones or self._recorder is not None)

    def run(self, events: tuple[Event, ...] = ()) -> Result:
        """Runs to the goal, a collision, the time limit or an abort.

        `events` happened before the first tick, and are logged with it. Whatever breaks in a tick or in the log ends
        the run: its outcome is aborted, a fault is among the log's events, and RunFault holds the result. Raises
        InputError where the log cannot be made.
        """
        self._record.note(*events)
        with self._recorder or nullcontext():
            if self._recorder is not None:
                self._recorder.open()
            return self._run()

    def _run(self) -> Result:
        began = self._pacer.now()
        errors: list[BaseException] = []
        try:
            final, outcome = self._ticks()
        except BaseException as error:
            errors.append(error)
            diverged = isinstance(error, DivergedError)  # then the last state that is known counts
            final = replace(self._truth, contacts=()) if diverged else self._world.state()
            outcome = ABORTED
            self._record.note(*fault_events(error))
        result = None
        try:
            result = self._result(final, outcome, began)
            self._record.end_log(final, result.run, None if result.replay is self._scenario else result.replay)
        except Exception as error:
            errors.append(error)
        if not errors and result is not None:
            return result
        first = errors[0]
        if not isinstance(first, Exception | SystemExit):  # an interrupt stays one
            raise first
        what = "; ".join(dict.fromkeys(map(describe_fault, errors)))
        place = f"; the log is {self._log}" if self._log and not any(isinstance(e, LogError) for e in errors) else ""
        text = f"{outcome} after {final.time:.1f} s, {len(self._record)} ticks: {what}{place}"
        raise RunFault(text, result) from first

    def _ticks(self) -> tuple[WorldState, str]:
        """Tick after tick; returns the state in which the run ended, and how."""
        watch = Stopwatch(self._pacer.now)
        beliefs: Beliefs | None = None
        for k in count():
            start = self._pacer.wait()
            watch.start()
            truth = self._truth = self._world.state()
            outcome = self._outcome(k, truth, start)
            if outcome is not None:
                return truth, outcome
            watch.lap("truth")
            beliefs = tick(k, truth, beliefs, world=self._world, robot=self._robot, record=self._record, watch=watch)
            self._record.add_timing(k, watch, start)
            if self._profile is not None:
                self._profile.append(watch.spans)
        raise AssertionError("count() does not end")

    def _outcome(self, k: int, truth: WorldState, start: Start) -> str | None:
        """How the run ends before tick `k`; None where it goes on."""
        self._progress(truth.time)
        self._misses += start.missed
        if start.abort:
            late = f"{1e-6 * start.lateness:.1f} ms after the deadline of the next"
            text = f"tick {k - 1} was still at work {late}, which ends the run on request"
            self._record.note(Event("error", "overrun", text))
        if start.abort or self._stop():
            return ABORTED
        return self._referee.outcome(truth, on_last_leg=self._robot.on_last_leg)

    def _result(self, final: WorldState, outcome: str, began: int) -> Result:
        seconds = (self._pacer.now() - began) * 1e-9
        trajectory, state_hash = self._record.finish(final, self._world.state_hash())
        summary = RunSummary(
            scene=self._scenario.name,
            controller=self._scenario.control.method,
            seed=self._scenario.seed,
            figures=summarise(trajectory, self._scenario, outcome=outcome),
            compute_ms=compute_ms(trajectory.timing),
            real_time_factor=final.time / seconds if seconds > 0.0 else None,
            deadline_misses=self._misses,
            state_hash=state_hash,
            log=str(self._log) if self._log else None,
        )
        profile = None if self._profile is None else Profile.of(self._profile)
        return Result(summary, trajectory, self._replay(), log_dropped=self._record.log_dropped, profile=profile)

    def _replay(self) -> Scenario:
        """The scenario with measured latencies written down."""
        control, model = self._scenario.control, self._robot.latency
        if control.latency is None or control.latency.model != "measured" or not isinstance(model, Computed):
            return self._scenario
        latency = replayed(control.latency, control.period, model.trace)
        return replace(self._scenario, control=replace(control, latency=latency))
