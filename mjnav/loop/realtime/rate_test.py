"""The real-time rate test: runs a scene against the clock for a while and reports how well its schedule was kept."""

import os
import platform
from collections.abc import Callable
from contextlib import closing, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mjnav.log.log_format import check_path
from mjnav.loop.episode import Episode
from mjnav.loop.events import ABORTED
from mjnav.loop.pacer import MAX_CATCH_UP, Pacer, RealTimePacer, Scheduling, Start, realtime_scheduling
from mjnav.loop.realtime.machine import Gaps, Usage, UsageMeter, gap_probe, stolen
from mjnav.loop.realtime.stress import stress
from mjnav.loop.result import Result
from mjnav.loop.run import warm_up
from mjnav.messages import PHASES, Event
from mjnav.metrics.timing import (
    Blame,
    Overrun,
    Schedule,
    blame,
    compute_ms,
    longest_overrun,
    overlap,
    quantiles,
    verdict,
    wakeup_us,
    with_stolen,
)
from mjnav.scene.spec import Scenario


@dataclass(frozen=True, slots=True)
class Machine:
    """What a test ran on."""

    scheduling: Scheduling
    load: str  # beside the test, in words
    load_average: float  # of the last minute, the test's own work included
    kernel: str
    cpus: int


@dataclass(frozen=True, slots=True)
class RateTest:
    """One test's outcome."""

    scene: str
    controller: str
    requested_hz: float
    timestep: float  # [s] of the physics
    schedule: Schedule
    status: str
    wakeup_us: dict[str, float | None]
    compute_ms: dict[str, dict[str, float | None]]
    overrun: Overrun | None
    blame: Blame
    gaps: Gaps
    page_faults: dict[str, float | None]  # of a tick
    state_hash: str
    machine: Machine

    @property
    def summary(self) -> dict[str, object]:
        """What `mjnav rate-test --json` prints."""
        s = self.schedule
        return {
            "schema": 1,
            "scene": self.scene,
            "controller": self.controller,
            "requested_hz": self.requested_hz,
            "achieved_hz": s.achieved_hz,
            "real_time_factor": s.ticks * s.period / s.wall if s.wall > 0.0 else None,
            "ticks": s.ticks,
            "timestep_ms": 1e3 * self.timestep,
            "deadline_misses": s.misses,
            "misses_by_cause": self.blame.counts,
            "missed": [asdict(miss) for miss in self.blame.misses],
            "machine_gaps": self.gaps.summary,
            "skipped_periods": s.skipped,
            "longest_overrun_ms": self.overrun.milliseconds if self.overrun else 0.0,
            "longest_overrun": {"tick": self.overrun.tick, "phase": self.overrun.phase} if self.overrun else None,
            "lateness_us": quantiles(s.lateness * 1e-3),
            "wakeup_us": self.wakeup_us,
            "compute_ms": self.compute_ms,
            "page_faults": self.page_faults,
            "log_dropped": s.log_dropped,
            "stolen": s.stolen,
            **asdict(self.machine.scheduling),
            "load": self.machine.load,
            "load_average": self.machine.load_average,
            "kernel": self.machine.kernel,
            "cpus": self.machine.cpus,
            "state_hash": self.state_hash,
            "status": self.status,
        }


class _Noting:
    """A pacer that keeps how every tick began, and when work ended before it [ns]."""

    def __init__(self, pacer: Pacer, usage: Callable[[], Usage]):
        self.now, self.real_time, self._pacer, self._usage = pacer.now, pacer.real_time, pacer, usage
        self.starts: list[Start] = []
        self.ended: list[int] = []
        self.began: list[int] = []
        self.usage_ended: list[Usage] = []
        self.usage_began: list[Usage] = []

    def wait(self) -> Start:
        self.ended.append(self.now())
        self.usage_ended.append(self._usage())
        self.starts.append(self._pacer.wait())
        self.began.append(self.now())
        self.usage_began.append(self._usage())
        return self.starts[-1]


def rate_test(
    scenario: Scenario,
    *,
    stressed: bool = False,
    log: str | os.PathLike[str] | None = None,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda time: None,
    pacer: Pacer | None = None,
    warmed_up: bool = False,
) -> RateTest:
    """Runs a scenario, made by `shuttling`, against the clock, everything on and logged.

    The log goes to `log`, or to a temporary file. `stressed` loads the machine meanwhile; `warmed_up` is as in `run`.
    Raises InputError for what cannot be run.
    """
    from mjnav.loop.realtime.first_time import first_time_work

    log = None if log is None else check_path(log)
    if not warmed_up:
        warm_up(scenario)
    cpus = os.sched_getaffinity(0)
    with TemporaryDirectory(prefix="mjnav-rate-") as folder, closing(UsageMeter()) as meter:
        noting = _Noting(pacer or RealTimePacer(scenario.control.period), meter.read)
        path = log or Path(folder) / "rate-test.mcap"
        episode = Episode(scenario, log=path, pacer=noting, stop=stop, progress=progress)
        with (
            stress() if stressed else nullcontext("none") as load,
            realtime_scheduling() as got,
            gap_probe(cpus) as gaps,
        ):
            before = _processor_time()
            with first_time_work() as work:
                result = episode.run((Event("info", "real_time", str(got)),))
            taken = _processor_time() - before
    kernel = f"{platform.system()} {platform.release()}"
    machine = Machine(got, load, round(os.getloadavg()[0], 2), kernel, os.cpu_count() or 0)
    return _assess(scenario, result, noting, taken, gaps, work.intervals, machine)


def _assess(
    scenario: Scenario,
    result: Result,
    noting: _Noting,
    taken: np.ndarray,
    gaps: Gaps,
    first_time: np.ndarray,
    machine: Machine,
) -> RateTest:
    control, figures = scenario.control, result.run.figures
    period = round(control.period * 1e9)
    after = noting.starts[1:]  # the last wait is for a tick that does not come: it says how the last one ended
    schedule = Schedule(
        period=control.period,
        wall=1e-9 * (noting.began[-1] - noting.began[0]),
        lateness=np.array([start.lateness for start in noting.starts[: figures["ticks"]]], np.int64),
        overrun=np.array([start.missed * (start.lateness + start.skipped * period) for start in after], np.int64),
        phases=result.trajectory.timing[:, 1 : 1 + len(PHASES)],
        busy=np.array(noting.ended[1:], np.int64) - np.array(noting.began[:-1], np.int64),
        skipped=sum(start.skipped for start in after),
        log_dropped=result.log_dropped,
        stolen=float(taken[0] / taken[1]) if taken[1] > 0 else 0.0,
        interrupted=figures["outcome"] == ABORTED,
        max_catch_up=MAX_CATCH_UP,
    )
    began = np.array(noting.began[: figures["ticks"]], np.int64)
    stood_still = with_stolen(
        schedule, overlap(schedule, began, gaps.everywhere), stolen(noting.usage_began[:-1], noting.usage_ended[1:])
    )
    found = blame(schedule, stood_still, overlap(schedule, began, first_time))
    return RateTest(
        scene=scenario.name,
        controller=control.method,
        requested_hz=control.rate,
        timestep=scenario.physics.timestep,
        schedule=schedule,
        status=verdict(found.own),
        wakeup_us=wakeup_us(schedule),
        compute_ms=compute_ms(result.trajectory.timing),
        overrun=longest_overrun(schedule),
        blame=found,
        gaps=gaps,
        page_faults=quantiles(np.diff([usage.page_faults for usage in noting.usage_ended])),
        state_hash=result.run.state_hash,
        machine=machine,
    )


def _processor_time() -> np.ndarray:
    """(stolen, all) in clock ticks, of all processors since boot; zeros where the system does not say."""
    try:
        with open("/proc/stat") as file:
            times = np.array([float(word) for word in file.readline().split()[1:9]])
    except (OSError, ValueError):
        return np.zeros(2)
    return np.array([times[7], times.sum()]) if times.size == 8 else np.zeros(2)
