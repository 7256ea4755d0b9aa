"""`mjnav.run`: a scenario in, a result out."""

import hashlib
import os
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from operator import index
from pathlib import Path
from typing import Any

from mjnav.errors import InputError, InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.pacer import FreePacer, RealTimePacer
from mjnav.loop.prepare import build_controller, load_scenario
from mjnav.loop.result import Result
from mjnav.loop.scheduling import realtime_scheduling
from mjnav.loop.warm_up import warm_up
from mjnav.messages import Event, TickRecord
from mjnav.plugins import name_of
from mjnav.recording.live import LiveServer
from mjnav.recording.log_format import check_path
from mjnav.scenarios.spec import Scenario
from mjnav.sealed import sealed_message

OUT_FOLDER = Path("runs/out")
MAX_STEM = 200  # [bytes]: file systems take names of 255, and others are made of this one by adding to it


def run(
    scenario: Scenario | str | os.PathLike[str],
    *,
    seed: int | None = None,
    controller: Any = None,
    real_time: bool = False,
    overruns: str = "skip",
    log: bool | str | os.PathLike[str] | None = None,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda time: None,
    watch: Callable[[TickRecord], None] | None = None,
    live: LiveServer | None = None,
    profile: bool = False,
    warmed_up: bool = False,
) -> Result:
    """Runs one episode and returns how it went.

    `scenario` may be a name or a path; `seed` and `controller` take the place of its own (another controller starts
    with its own default parameters, and is a name, a class, or an object, which is used as it is); `real_time`
    paces the loop to the wall clock, and `overruns` says what a missed deadline does to it ("skip" catches up, or
    else skips periods, and "abort" ends the run); `log` is None for no log, True for the default path below the
    working directory, or a path; `stop` is asked before every tick whether to abort, and `progress` is told the
    simulated time [s]; `watch` sees every tick, in arrays that it cannot write to; the clients of `live` get what a
    log gets; `profile` adds to the summary, as "profile", where each tick's time went; `warmed_up` says that
    `warm_up` has been called with this scenario. Raises InputError before anything starts where something cannot be
    used.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario, controller=controller, seed=seed)
    else:
        if seed is not None:
            scenario = replace(scenario, seed=index(seed))
        if controller is not None:
            scenario = replace(scenario, control=replace(scenario.control, method=name_of(controller), parameters={}))
    build_controller(scenario)
    if not real_time and overruns != "skip":
        raise InvalidValue("overruns", overruns, "skip, unless the run is in real time")
    pacer = RealTimePacer(scenario.control.period, policy=overruns) if real_time else FreePacer()
    path = None
    if log is not None and log is not False:
        if log is True:
            make_out_folder()
        path = check_path(default_log_path(scenario) if log is True else log)
    if not warmed_up:
        warm_up(scenario)

    def shown(record: TickRecord) -> None:
        if watch is not None:
            watch(sealed_message(record))

    episode = Episode(
        scenario, log=path, live=live, pacer=pacer, stop=stop, progress=progress, profile=profile, watch=shown
    )
    if not real_time:
        return episode.run()
    with realtime_scheduling() as got:  # after the episode's threads began, which would inherit it
        return replace(episode.run((Event("info", "real_time", str(got)),)), real_time=got)


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
