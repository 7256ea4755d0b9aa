"""`mjnav.run`: a scenario in, a result out."""

import hashlib
import os
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path

from mjnav import scenarios
from mjnav.errors import InputError, InvalidValue
from mjnav.loop.episode import Episode, Result, warm_up
from mjnav.loop.pacer import FreePacer, Pacer, RealTimePacer
from mjnav.loop.prepare import build_controller, load_scenario
from mjnav.loop.profile import profiled
from mjnav.loop.realtime.scheduling import realtime_scheduling
from mjnav.loop.sealed import sealed_message
from mjnav.messages import Event, TickRecord
from mjnav.recording.live import LiveServer
from mjnav.recording.log_format import check_path
from mjnav.scenarios.spec import Scenario

OUT_FOLDER = Path("runs/out")
MAX_STEM = 200  # [bytes]: file systems take names of 255, and others are made of this one by adding to it


def run(
    scenario: Scenario | str | os.PathLike[str],
    *,
    seed: int | None = None,
    controller: str | None = None,
    real_time: bool = False,
    overruns: str = "skip",
    log: bool | str | os.PathLike[str] | None = None,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda time: None,
    watch: Callable[[TickRecord], None] | None = None,
    live: LiveServer | None = None,
    profile: bool = False,
) -> Result:
    """Runs one episode and returns how it went.

    `scenario` may be a name or a path; `seed` and `controller` take the place of its own (another controller starts
    with its own default parameters); `real_time` paces the loop to the wall clock, and `overruns` says what a missed
    deadline does to it ("skip" catches up, or else skips periods, and "abort" ends the run); `log` is None for no log,
    True for the default path below the working directory, or a path; `stop` is asked before every tick whether to
    abort, and `progress` is told the simulated time [s]; `watch` sees every tick, in arrays that it cannot write to;
    the clients of `live` get what a log gets; `profile` adds to the summary, as "profile", where each tick's time went.
    Raises InputError before anything starts where something cannot be used.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario, controller=controller, seed=seed)
    else:
        scenario = _changed(scenario, seed, controller)
    build_controller(scenario)
    if not real_time and overruns != "skip":
        raise InvalidValue("overruns", overruns, "skip, unless the run is in real time")
    pacer = RealTimePacer(scenario.control.period, policy=overruns) if real_time else FreePacer()
    path = None
    if log is not None and log is not False:
        if log is True:
            make_out_folder()
        path = check_path(default_log_path(scenario) if log is True else log)
    warm_up(scenario)
    episode = partial(Episode, scenario, log=path, live=live, pacer=pacer, stop=stop, progress=progress)
    if watch is not None:
        episode = partial(episode, watch=lambda record: watch(sealed_message(record)))
    if profile:
        with profiled() as profiler:
            result = _run(episode, pacer)
        return replace(result, summary={**result.summary, "profile": profiler.summary()})
    return _run(episode, pacer)


def _run(make_episode: Callable[[], Episode], pacer: Pacer) -> Result:
    episode = make_episode()  # its threads begin before any real-time scheduling that they would inherit
    if not pacer.real_time:
        return episode.run()
    with realtime_scheduling() as got:
        note = Event("info", "real_time", ", ".join(f"{name} {value}" for name, value in got.items()))
        return replace(episode.run((note,)), real_time=got)


def default_log_path(scenario: Scenario) -> Path:
    """runs/out/<scene>-<controller>-<seed>-<time>.mcap below the working directory; the time goes to microseconds."""
    return OUT_FOLDER / f"{file_stem(scenario, datetime.now().strftime('%Y%m%dT%H%M%S.%f'))}.mcap"


def make_out_folder() -> None:
    """Makes OUT_FOLDER, the only one that is made without having been asked for. Raises InputError where it cannot."""
    try:
        OUT_FOLDER.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{OUT_FOLDER}: cannot be made: {error.strerror}") from None


def file_stem(scenario: Scenario, time: str) -> str:
    """<scene>-<controller>-<seed>-<time> of characters and of a length that any file system takes.

    What is too long loses the end of <scene>-<controller>; a digest of the whole of it takes its place.
    """
    name = f"{scenario.name}-{scenario.control.method}"
    rest = f"-{scenario.seed}-{time}"
    if len(name.encode()) + len(rest) > MAX_STEM:
        mark = f"-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
        name = name.encode()[: MAX_STEM - len(mark) - len(rest)].decode(errors="ignore") + mark
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name + rest)


def _changed(scenario: Scenario, seed: int | None, controller: str | None) -> Scenario:
    if controller is None and seed is None:
        return scenario
    return scenarios.loads(scenarios.dumps(scenario), file=scenario.source, seed=seed, controller=controller)
