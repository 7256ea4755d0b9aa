"""The real-time rate test: a scene run against the clock for a while, and what became of its schedule."""

import os
import platform
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, hypot
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode, Result, warm_up
from mjnav.loop.pacer import Pacer, RealTimePacer, Start
from mjnav.loop.realtime import real_time
from mjnav.loop.stress import stress
from mjnav.messages import PHASES, Event
from mjnav.metrics.realtime import Overrun, Schedule, longest_overrun, verdict, wakeup_us
from mjnav.metrics.timing import compute_ms
from mjnav.recording.writer import check_path
from mjnav.scenarios.spec import Scenario

TIMESTEP = 0.002  # [s], the longest
MAX_REFINEMENT = 100  # of the timestep, until the sensors' period is a whole number of steps too
MIN_LEG = 0.05  # [m] that a leg of the route is longer than the tolerances at its ends


@dataclass(frozen=True, slots=True)
class RateTest:
    """One test's outcome."""

    scene: str
    controller: str
    requested_hz: float
    schedule: Schedule
    status: str
    wakeup_us: dict[str, float | None]
    compute_ms: dict[str, dict[str, float | None]]
    overrun: Overrun | None
    busy: np.ndarray  # (n,) [ns] that each tick computed
    machine: dict[str, str]

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
            "deadline_misses": int(s.missed.sum()),
            "skipped_periods": s.skipped,
            "longest_overrun_ms": self.overrun.milliseconds if self.overrun else 0.0,
            "longest_overrun": {"tick": self.overrun.tick, "phase": self.overrun.phase} if self.overrun else None,
            "lateness_us": _quantiles(s.lateness * 1e-3),
            "wakeup_us": self.wakeup_us,
            "compute_ms": self.compute_ms,
            "log_dropped": s.log_dropped,
            "stolen": s.stolen,
            **self.machine,
            "status": self.status,
        }


def _quantiles(values: np.ndarray) -> dict[str, float | None]:
    if not values.size:
        return {"p50": None, "p99": None, "max": None}
    p50, p99 = np.quantile(values, [0.5, 0.99]).tolist()
    return {"p50": p50, "p99": p99, "max": float(values.max())}


class _Noting:
    """A pacer that keeps how every tick began, and when the first and the last did [ns]."""

    real_time = True

    def __init__(self, pacer: Pacer):
        self.now, self._pacer = pacer.now, pacer
        self.starts: list[Start] = []
        self.first = self.last = 0

    def wait(self) -> Start:
        start = self._pacer.wait()
        self.last = self.now()
        self.first = self.first or self.last
        self.starts.append(start)
        return start


def rate_test(
    scenario: Scenario,
    *,
    stressed: bool = False,
    log: str | os.PathLike[str] | None = None,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda time: None,
    pacer: Pacer | None = None,
) -> RateTest:
    """Runs a scenario, made by `shuttling`, against the clock, everything on and logged.

    The log goes to `log`, or to a temporary file. `stressed` loads the machine meanwhile. Raises InputError for what
    cannot be run.
    """
    warm_up(scenario)
    noting = _Noting(pacer or RealTimePacer(scenario.control.period))
    with TemporaryDirectory(prefix="mjnav-rate-") as folder:
        path = Path(folder) / "rate-test.mcap" if log is None else check_path(log)
        episode = Episode(scenario, log=path, pacer=noting, stop=stop, progress=progress)
        with stress() if stressed else nullcontext("none") as load, real_time() as got:
            note = Event("info", "real_time", ", ".join(f"{name} {value}" for name, value in got.items()))
            stolen = _processor_time()
            result = episode.run((note,))
            stolen = _processor_time() - stolen
    machine = {**got, "load": load, "kernel": f"{platform.system()} {platform.release()}", "cpus": str(os.cpu_count())}
    return _assess(scenario, result, noting, stolen, machine)


def _assess(
    scenario: Scenario, result: Result, noting: _Noting, stolen: np.ndarray, machine: dict[str, str]
) -> RateTest:
    ticks = result.summary["ticks"]
    begun = noting.starts[:ticks]  # the last wait was for a tick that did not come
    schedule = Schedule(
        ticks=ticks,
        period=scenario.control.period,
        wall=1e-9 * (noting.last - noting.first),
        lateness=np.array([start.lateness for start in begun], np.int64),
        missed=np.array([start.missed for start in begun], bool),
        skipped=sum(start.skipped for start in begun),
        log_dropped=result.log_dropped,
        stolen=float(stolen[0] / stolen[1]) if stolen[1] > 0 else 0.0,
        interrupted=result.summary["outcome"] == "aborted",
    )
    phases = result.trajectory.timing[:, 1 : 1 + len(PHASES)]
    return RateTest(
        scene=scenario.name,
        controller=scenario.control.method,
        requested_hz=scenario.control.rate,
        schedule=schedule,
        status=verdict(schedule),
        wakeup_us=wakeup_us(schedule),
        compute_ms=compute_ms(result.trajectory.timing),
        overrun=longest_overrun(schedule, phases, PHASES),
        busy=phases.sum(axis=1),
        machine=machine,
    )


def shuttling(scenario: Scenario, rate: float, duration: float) -> Scenario:
    """The scenario at `rate` [Hz], to and fro between start and goal for `duration` [s], whatever it hits.

    The time step is the longest up to 2 ms that divides the period and the sensors'. Raises InvalidValue.
    """
    robot = scenario.robot
    there = [robot.start[:2], *robot.route]
    round_trip = [*there[1:], *there[-2::-1]]
    longest = max(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(there))
    leg = longest - 2.0 * robot.goal_tolerance
    if leg < MIN_LEG:
        raise InvalidValue(
            "robot.goal", robot.route[-1], "a goal beyond twice its tolerance: there is nothing to drive"
        )
    num_trips = ceil(duration * robot.max_speed / (2.0 * leg)) + 1
    return replace(
        scenario,
        robot=replace(robot, goal=None, waypoints=tuple(round_trip * num_trips)),
        time_limit=duration,
        stop_on_collision=False,
        control=replace(scenario.control, rate=rate),
        physics=replace(scenario.physics, timestep=_timestep(rate, scenario.sensors.rate)),
    )


def _timestep(rate: float, sensor_rate: float) -> float:
    least = ceil(1.0 / (rate * TIMESTEP) - 1e-9)
    for steps in range(least, MAX_REFINEMENT * least):
        each = steps * rate / sensor_rate
        if abs(each - round(each)) < 1e-9 * each and round(each) >= 1:
            return 1.0 / (rate * steps)
    raise InvalidValue("--rate", rate, f"a rate with a time step in common with sensors.rate ({sensor_rate:g} Hz)")


def _processor_time() -> np.ndarray:
    """(stolen, all) in clock ticks, of all processors since boot; zeros where the system does not say."""
    try:
        with open("/proc/stat") as file:
            times = np.array([float(word) for word in file.readline().split()[1:9]])
    except (OSError, ValueError):
        return np.zeros(2)
    return np.array([times[7], times.sum()]) if times.size == 8 else np.zeros(2)
