"""The real-time rate test: runs a scene against the clock for a while and reports how well its schedule was kept."""

import os
import platform
from collections.abc import Callable, Sequence
from contextlib import closing, nullcontext
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from mjnav.log.log_format import check_path
from mjnav.loop.episode import Episode
from mjnav.loop.events import ABORTED
from mjnav.loop.pacer import MAX_CATCH_UP, Pacer, RealTimePacer, Start, realtime_scheduling
from mjnav.loop.realtime.machine import Usage, UsageMeter, first_time_work, gap_probe, stolen
from mjnav.loop.realtime.stress import stress
from mjnav.loop.result import Result
from mjnav.loop.run import warm_up
from mjnav.messages import PHASES, Event
from mjnav.metrics import timing
from mjnav.scene.spec import Scenario


@dataclass(frozen=True, slots=True)
class RateTest:
    """One test's outcome; `summary` is what `mjnav rate-test --json` prints."""

    schedule: timing.Schedule
    blame: timing.Blame
    summary: dict[str, Any]


class _Wait(NamedTuple):
    """The time between two ticks, by the pacer's clock [ns]."""

    ended: int  # the work of the tick before it
    usage_ended: Usage
    start: Start
    began: int  # the tick after it
    usage_began: Usage


class _Noting:
    """A pacer that notes when every tick began and ended."""

    def __init__(self, pacer: Pacer, usage: Callable[[], Usage]):
        self.now, self.real_time, self._pacer, self._usage = pacer.now, pacer.real_time, pacer, usage
        self.waits: list[_Wait] = []

    def wait(self) -> Start:
        ended, usage_ended, start = self.now(), self._usage(), self._pacer.wait()
        self.waits.append(_Wait(ended, usage_ended, start, self.now(), self._usage()))
        return start


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
            stolen_ticks, all_ticks = _processor_time() - before
    share = float(stolen_ticks / all_ticks) if all_ticks > 0 else 0.0
    schedule = _schedule(scenario, result, noting.waits, share)
    ticks = schedule.ticks
    began = np.array([wait.began for wait in noting.waits[:ticks]], np.int64)
    stolen_ns = stolen(
        [wait.usage_began for wait in noting.waits[:-1]], [wait.usage_ended for wait in noting.waits[1:]]
    )
    stood_still = timing.with_stolen(schedule, timing.overlap(schedule, began, gaps.everywhere), stolen_ns)
    blamed = timing.blame(schedule, stood_still, timing.overlap(schedule, began, work.intervals))
    overrun = timing.longest_overrun(schedule)
    summary = {
        "schema": 1,
        "scene": scenario.name,
        "controller": scenario.control.method,
        "requested_hz": scenario.control.rate,
        "achieved_hz": schedule.achieved_hz,
        "real_time_factor": ticks * schedule.period / schedule.wall if schedule.wall > 0.0 else None,
        "ticks": ticks,
        "timestep_ms": 1e3 * scenario.physics.timestep,
        "deadline_misses": schedule.misses,
        "misses_by_cause": blamed.counts,
        "missed": [asdict(miss) for miss in blamed.misses],
        "machine_gaps": gaps.summary,
        "skipped_periods": schedule.skipped,
        "longest_overrun_ms": overrun.milliseconds if overrun else 0.0,
        "longest_overrun": {"tick": overrun.tick, "phase": overrun.phase} if overrun else None,
        "lateness_us": timing.quantiles(schedule.lateness * 1e-3),
        "wakeup_us": timing.wakeup_us(schedule),
        "compute_ms": timing.compute_ms(result.trajectory.timing),
        "page_faults": timing.quantiles(np.diff([wait.usage_ended.page_faults for wait in noting.waits])),  # of a tick
        "log_dropped": schedule.log_dropped,
        "stolen": share,
        **asdict(got),
        "load": load,
        "load_average": round(os.getloadavg()[0], 2),
        "kernel": f"{platform.system()} {platform.release()}",
        "cpus": os.cpu_count() or 0,
        "state_hash": result.run.state_hash,
        "status": timing.verdict(blamed.own),
    }
    return RateTest(schedule, blamed, summary)


def _schedule(scenario: Scenario, result: Result, waits: Sequence[_Wait], stolen: float) -> timing.Schedule:
    """What the run did to its schedule; the last wait is for a tick that does not come: it says how the last ended."""
    period, figures = round(scenario.control.period * 1e9), result.run.figures
    after = [wait.start for wait in waits[1:]]
    return timing.Schedule(
        period=scenario.control.period,
        wall=1e-9 * (waits[-1].began - waits[0].began),
        lateness=np.array([wait.start.lateness for wait in waits[: figures["ticks"]]], np.int64),
        overrun=np.array([start.missed * (start.lateness + start.skipped * period) for start in after], np.int64),
        phases=result.trajectory.timing[:, 1 : 1 + len(PHASES)],
        busy=np.array([later.ended - wait.began for wait, later in pairwise(waits)], np.int64),
        skipped=sum(start.skipped for start in after),
        log_dropped=result.log_dropped,
        stolen=stolen,
        interrupted=figures["outcome"] == ABORTED,
        max_catch_up=MAX_CATCH_UP,
    )


def _processor_time() -> np.ndarray:
    """(stolen, all) in clock ticks, of all processors since boot; zeros where the system does not say."""
    try:
        with open("/proc/stat") as file:
            times = np.array([float(word) for word in file.readline().split()[1:9]])
    except (OSError, ValueError):
        return np.zeros(2)
    return np.array([times[7], times.sum()]) if times.size == 8 else np.zeros(2)
