"""One episode: a simulation that runs to its end, at the pace of a clock; what breaks it ends it in order."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from mjnav.control.registry import shipped
from mjnav.log.live import LiveServer
from mjnav.log.write.writer import LogError
from mjnav.loop.pacer import FreePacer, Pacer, Start, Stopwatch, profile_of
from mjnav.loop.result import Result
from mjnav.loop.simulation import Attached, Simulation
from mjnav.loop.supervision import RunFault, describe_fault
from mjnav.messages import Event, TickRecord
from mjnav.scene.spec import Scenario


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
        scan: bool = True,
        profile: bool = False,
        detour: bool = False,
    ):
        """`stop` is asked before every tick whether to abort, and `progress` is told the simulated time [s].

        `watch`, `live` and `cones` are as in `Attached`; `scan` says whether `watch` looks at scans: where nobody does,
        no rays are cast. `profile` keeps what every span of every tick took; `detour` also runs the people without the
        robot, once the run has ended. Raises InputError for a controller that cannot be made and a log that cannot be
        written.
        """
        self._log, self._detour = log, detour
        self._pacer = pacer or FreePacer()
        self._stop, self._progress = stop, progress
        self._misses = 0  # of deadlines; the end of the last tick may miss one that no tick's timing tells
        self._profile: list[dict[str, int]] | None = [] if profile else None  # the spans of every tick
        self._watch = Stopwatch(self._pacer.now)
        attached = Attached(watch, live, cones, threaded=self._pacer.real_time, stopwatch=self._watch)
        scan = scan or log is not None or live is not None or _needs_scans(scenario)
        self._simulation = Simulation(scenario, log=log, scan=scan, attached=attached)
        self._simulation.prepare()

    def run(self, events: tuple[Event, ...] = ()) -> Result:
        """Runs to the goal, a collision, the time limit or an abort.

        `events` happened before the first tick, and are logged with it. Whatever breaks in a tick or in the log ends
        the run: its outcome is aborted, a fault is among the log's events, and RunFault holds the result. Raises
        InputError where the log cannot be made.
        """
        self._simulation.note(*events)
        with self._simulation:
            return self._run()

    def _run(self) -> Result:
        simulation, began = self._simulation, self._pacer.now()
        errors: list[BaseException] = []
        try:
            while self._goes_on(self._pacer.wait()):
                simulation.step(simulation.decide())
                if self._profile is not None:
                    self._profile.append(self._watch.spans)
        except BaseException as error:
            errors.append(error)
            simulation.abort(error)
        try:
            seconds = (self._pacer.now() - began) * 1e-9
            simulation.conclude(seconds, deadline_misses=self._misses, detour=self._detour)
        except BaseException as error:
            errors.append(error)
        result = simulation.result
        if result is not None and self._profile is not None:
            result = replace(result, profile=profile_of(self._profile))
        if not errors and result is not None:
            return result
        for error in errors:
            if isinstance(error, KeyboardInterrupt):  # which stays one; all else is a fault
                raise error
        what = "; ".join(dict.fromkeys(map(describe_fault, errors)))
        place = f"; the log is {self._log}" if self._log and not any(isinstance(e, LogError) for e in errors) else ""
        ticks = simulation.tick if result is None else result.run.figures["ticks"]
        text = f"{simulation.outcome} after {simulation.truth.time:.1f} s, {ticks} ticks: {what}{place}"
        raise RunFault(text, result) from errors[0]

    def _goes_on(self, start: Start) -> bool:
        """Whether there is another tick, which began so."""
        simulation = self._simulation
        simulation.begin(start)
        self._progress(simulation.state.time)
        self._misses += start.missed
        if start.abort:
            late = f"{1e-6 * start.lateness:.1f} ms after the deadline of the next"
            text = f"tick {simulation.tick - 1} was still at work {late}, which ends the run on request"
            simulation.note(Event("error", "overrun", text))
        if start.abort or self._stop():
            simulation.abort()
        return not simulation.done


def _needs_scans(scenario: Scenario) -> bool:
    """Whether an estimator goes by the lidar, or a plug-in may: no method of mjnav's looks at scans."""
    robot, people = scenario.estimation.robot, scenario.estimation.obstacles
    own = shipped(scenario.control.method) is None or robot.localizer is not None or people.tracker is not None
    return own or scenario.draws_map or "lidar" in (robot.source, people.source)
