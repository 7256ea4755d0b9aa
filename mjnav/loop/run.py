"""`mjnav.run`: a scenario in, a result out.

Before a run all kernels are loaded, so that no tick has to wait for one. `record_at` gives one moment of a run that is
not logged: what the tick at a given time saw and did.
"""

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np

from mjnav.compile.compiled import helpers, load_kernels
from mjnav.control.registry import shipped
from mjnav.errors import InvalidValue
from mjnav.geometry.angles import mean_position
from mjnav.log.live import LiveServer
from mjnav.loop.episode import Episode
from mjnav.loop.pacer import FreePacer, RealTimePacer, realtime_scheduling
from mjnav.loop.prepare import as_scenario, check_functions, log_path
from mjnav.loop.result import Result
from mjnav.loop.supervision import RunFault
from mjnav.messages import Event, Observation, TickRecord
from mjnav.robot.estimation.base import person_names
from mjnav.robot.seen_space import FloorMap
from mjnav.scene.plugged import without_plugins
from mjnav.scene.spec import Scenario
from mjnav.sealed import sealed_message

# ------------------------------------------------------------------------------------------ warm-up


WARM_UP_TICKS = 3
METHOD = "rkhs"  # takes the place of a user's own controller: no object of a user's sees ticks of no run


def warm_up(scenario: Scenario) -> None:
    """Loads every kernel that a run of this scenario can call, and runs ticks that are thrown away.

    The kernels are those of all modules that a run has imported when it begins, for the types that each declares. Each
    of the ticks has a reading, so that nothing that a tick can do is left for the second reading of the run.
    """
    sensors = replace(scenario.sensors, rate=scenario.control.rate)
    scenario = without_plugins(replace(scenario, sensors=sensors))
    if shipped(scenario.control.method) is None:
        scenario = replace(scenario, control=replace(scenario.control, method=METHOD, parameters={}))
    with suppress(RunFault):  # the run itself will report, and log, what is wrong
        asked = count()
        with helpers():
            episode = Episode(scenario, stop=lambda: next(asked) >= WARM_UP_TICKS, cones=True)
            load_kernels()
            episode.run()


# ---------------------------------------------------------------------------------------------- run


def run(
    scenario: Scenario | str | os.PathLike[str],
    *,
    seed: int | None = None,
    controller: Any = None,
    localizer: Any = None,
    tracker: Any = None,
    metrics: Sequence[Any] | None = None,
    real_time: bool = False,
    overruns: str = "skip",
    log: bool | str | os.PathLike[str] | None = None,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda time: None,
    watch: Callable[[TickRecord], None] | None = None,
    live: LiveServer | None = None,
    profile: bool = False,
    detour: bool = False,
    warmed_up: bool = False,
    tell: Callable[[str], None] = lambda text: None,
) -> Result:
    """Runs one episode and returns how it went.

    `scenario` may be a name or a path; `seed`, `controller`, `localizer`, `tracker` and the list `metrics` take the
    place of its own (each a name, a class, or an object, which is used as it is; another controller starts with its own
    default parameters); `real_time` paces the loop to the wall clock, where the process may under SCHED_FIFO on one CPU
    with locked memory, and `overruns` says what a missed deadline does to it ("skip" catches up, or else skips periods,
    and "abort" ends the run); `log` is None for no log, True for the default path below the working directory, or a
    path; `stop` is asked before every tick whether to abort, and `progress` is told the simulated time [s]; `watch`
    sees every tick, in arrays that it cannot write to; the clients of `live` get what a log gets; `profile` adds to the
    summary, as "profile", where each tick's time went; `detour` also runs the people without the robot, and says in the
    summary what it cost them; `warmed_up` says that `warm_up` has been called with this scenario; `tell` gets a line on
    the privileges that a run in real time took, before its first tick. Raises InputError before anything starts where
    something cannot be used.
    """
    own = {"controller": controller, "localizer": localizer, "tracker": tracker, "metrics": metrics}
    scenario = as_scenario(scenario, **own, seed=seed)
    if not real_time and overruns != "skip":
        raise InvalidValue("overruns", overruns, "skip, unless the run is in real time")
    check_functions(stop=stop, progress=progress, **({} if watch is None else {"watch": watch}))
    if live is not None and not isinstance(live, LiveServer):
        raise InvalidValue("live", live, "a LiveServer")
    pacer = RealTimePacer(scenario.control.period, policy=overruns) if real_time else FreePacer()
    path = log_path(log, scenario)
    if not warmed_up:
        warm_up(scenario)

    def shown(record: TickRecord) -> None:
        if watch is not None:
            watch(sealed_message(record))

    episode = Episode(
        scenario, log=path, live=live, pacer=pacer, stop=stop, progress=progress, watch=shown, scan=watch is not None,
        profile=profile, detour=detour,
    )  # fmt: skip
    if not real_time:
        return episode.run()
    with realtime_scheduling() as got:  # after the episode's threads began, which would inherit it
        if got.privileged:
            tell(f"real time: until it ends, this run has {got}")
        return replace(episode.run((Event("info", "real_time", str(got)),)), real_time=got)


# ------------------------------------------------------------------------------- record of one tick


ROUNDING = 1e-9  # relative


def record_at(scenario: Scenario, time: float, *, progress: Callable[[float], None] = lambda time: None) -> TickRecord:
    """The tick at `time` [s], or else the last one before it; the run goes no further.

    Raises InvalidValue for a time that is negative, or after the end of the run.
    """
    if not 0.0 <= time <= scenario.time_limit:
        raise InvalidValue("time", time, f"0 to {scenario.time_limit:g} s, the run's time limit")
    index = int(np.floor(time / scenario.control.period * (1.0 + ROUNDING)))
    latest: list[TickRecord] = []

    def watch(record: TickRecord) -> None:
        latest[:] = [record]

    def stop() -> bool:
        return bool(latest) and latest[0].tick >= index

    result = Episode(scenario, stop=stop, watch=watch, progress=progress).run()
    figures = result.run.figures
    end = figures["time_s"]
    if not latest or (latest[0].tick < index and end * (1.0 + ROUNDING) < time):
        raise InvalidValue("time", time, f"0 to {end:g} s: there the run ended ({figures['outcome']})")
    return latest[0]


def column_names(scenario: Scenario, seen: Observation) -> tuple[str, ...]:
    """What the columns of `CandidateCosts.cone` belong to: people, legs, pillars, the walls that were seen."""
    floor, position = FloorMap(scenario), mean_position(seen.robot_pose)
    return (*person_names(len(scenario.people)), *floor.disc_names(position), *floor.wall_names(position))
