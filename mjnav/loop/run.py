"""`mjnav.run`: a scenario in, a result out."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.log_path import log_path
from mjnav.loop.pacer import FreePacer, RealTimePacer
from mjnav.loop.prepare import as_scenario, check_functions
from mjnav.loop.result import Result
from mjnav.loop.scheduling import realtime_scheduling
from mjnav.loop.warm_up import warm_up
from mjnav.messages import Event, TickRecord
from mjnav.recording.live import LiveServer
from mjnav.scenarios.spec import Scenario
from mjnav.sealed import sealed_message


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
        scenario,
        log=path,
        live=live,
        pacer=pacer,
        stop=stop,
        progress=progress,
        profile=profile,
        detour=detour,
        watch=shown,
    )
    if not real_time:
        return episode.run()
    with realtime_scheduling() as got:  # after the episode's threads began, which would inherit it
        if got.privileged:
            tell(f"real time: until it ends, this run has {got}")
        return replace(episode.run((Event("info", "real_time", str(got)),)), real_time=got)
