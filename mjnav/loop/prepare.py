"""Preparation of a run: all that is checked before it starts, and the path of its log."""

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any

from mjnav import scene
from mjnav.errors import InputError, InvalidValue
from mjnav.log.log_format import check_path
from mjnav.metrics.own import OwnMetrics
from mjnav.noise import made
from mjnav.rng import stream
from mjnav.robot.controller import build_controller
from mjnav.scene.check import refuse_idle
from mjnav.scene.load import origin, with_seed
from mjnav.scene.overrides import Overrides, overrides_of
from mjnav.scene.plugged import plugins_of
from mjnav.scene.spec import Scenario
from mjnav.settings import below
from mjnav.settings.plugins import BehaviourPlugin, DistributionPlugin, MetricPlugin, name_of

# ------------------------------------------------------------------------------------------- checks


# argument -> the key of a run file whose place it takes
KEYS = MappingProxyType({"controller": "control.method", "localizer": "estimation.robot.localizer",
                         "tracker": "estimation.obstacles.tracker", "metrics": "metrics"})  # fmt: skip


def _changed(**arguments: Any) -> dict[str, str]:
    """The arguments that are given, by the key whose place each takes."""
    return {KEYS[name]: name for name, value in arguments.items() if value is not None}


def load_scenario(
    name_or_path: str | os.PathLike[str],
    overrides: Overrides = (),
    *,
    controller: Any = None,
    localizer: Any = None,
    tracker: Any = None,
    metrics: Sequence[Any] | None = None,
    seed: int | None = None,
) -> Scenario:
    """A shipped scene by name, or a run file by path, checked to the last key. Raises InvalidValue.

    `overrides` are values by dotted key, {"people.0.radius": 0.4}, or "KEY=VALUE" each; `controller`, `localizer`,
    `tracker` and the list `metrics` (each a name, a class or an object) and `seed` take the place of the file's.
    Where two set the same key, the later of these wins: `controller` and `seed`, `overrides`, the others.
    """
    given = tuple(overrides_of(overrides))
    method = None if controller is None else name_of(controller)
    scenario = scene.load(name_or_path, given, controller=method, seed=seed)
    changed = _changed(controller=controller) | {override.key: override.option for override in given}
    changed |= _changed(localizer=localizer, tracker=tracker, metrics=metrics)
    try:
        scenario = _with_metrics(with_estimators(scenario, localizer, tracker), metrics)
        refuse_idle(scenario)
        build_controller(scenario)
        check_plugins(scenario)
    except InvalidValue as error:
        raise error.within(file=origin(error.key, scenario.source, changed)) from None
    return scenario


def with_estimators(scenario: Scenario, localizer: Any, tracker: Any) -> Scenario:
    """The scenario with estimators of a user's own, each a name, a class or an object; None keeps its own."""
    estimation = scenario.estimation
    if localizer is not None:
        with below("estimation"), below("robot"):
            estimation = replace(estimation, robot=replace(estimation.robot, localizer=localizer))
    if tracker is not None:
        with below("estimation"), below("obstacles"):
            estimation = replace(estimation, obstacles=replace(estimation.obstacles, tracker=tracker))
    return scenario if estimation is scenario.estimation else replace(scenario, estimation=estimation)


def as_scenario(
    scenario: Scenario | str | os.PathLike[str],
    *,
    controller: Any = None,
    localizer: Any = None,
    tracker: Any = None,
    metrics: Sequence[Any] | None = None,
    seed: int | None = None,
) -> Scenario:
    """A scenario as it is, or by name or path, with what is given in place of its own, a name, a class or an object.

    Another controller starts with its own default parameters. Raises InvalidValue.
    """
    own = {"controller": controller, "localizer": localizer, "tracker": tracker, "metrics": metrics}
    if not isinstance(scenario, Scenario):
        return load_scenario(scenario, **own, seed=seed)
    if scenario.crowd is not None:
        raise InvalidValue("crowd", scenario.crowd.file, "people; a recording is read where a run file is loaded")
    if seed is not None:
        scenario = with_seed(scenario, seed)
    if controller is not None:
        scenario = replace(scenario, control=replace(scenario.control, method=name_of(controller), parameters={}))
    try:
        scenario = _with_metrics(with_estimators(scenario, localizer, tracker), metrics)
        build_controller(scenario)
        check_plugins(scenario)
    except InvalidValue as error:
        raise error.within(file=origin(error.key, scenario.source, _changed(**own))) from None
    return scenario


def _with_metrics(scenario: Scenario, metrics: Sequence[Any] | None) -> Scenario:
    return scenario if metrics is None else replace(scenario, metrics=metrics)


def check_plugins(scenario: Scenario) -> None:
    """Makes every plug-in of the scenario but the controller once. Raises InvalidValue with the run file's key."""
    for key, plugin in plugins_of(scenario).items():
        try:
            match plugin:
                case DistributionPlugin():
                    made(plugin)
                case BehaviourPlugin():
                    plugin.make(scenario, int(key.rpartition(".")[2]), stream(scenario.seed, "behaviour", "unused"))
                case MetricPlugin():
                    continue  # all of them together, below
                case _:
                    plugin.make(scenario, scenario.seed)
        except InvalidValue as error:
            raise error.within(key, file=scenario.source or None) from None
    OwnMetrics(scenario)


def check_functions(**given: object) -> None:
    """Raises InvalidValue for an argument that is no function."""
    for name, function in given.items():
        if not callable(function):
            raise InvalidValue(name, function, "a function")


def episode_label(scenario: Scenario) -> str:
    """The scenario's episode in a line."""
    return f"{scenario.name}, {scenario.control.method}, seed {scenario.seed}"


# ---------------------------------------------------------------------------------- path of the log


OUT_FOLDER = Path("runs/out")
MAX_NAME = 150  # characters of <scene>-<controller>; file systems take names of 255


def log_path(log: bool | str | os.PathLike[str] | None, scenario: Scenario) -> Path | None:
    """The path of a log: None for no log, True for the default path, or a path. Raises InputError, as `check_path`.

    The default is runs/out/<scene>-<controller>-<seed>-<time>.mcap below the working directory.
    """
    if log is None or log is False:
        return None
    if log is True:
        make_out_folder()
        log = OUT_FOLDER / f"{file_stem(scenario, datetime.now().strftime('%Y%m%dT%H%M%S.%f'))}.mcap"
    return check_path(log)


def make_out_folder() -> None:
    """Makes OUT_FOLDER, the only one that is made without having been asked for. Raises InputError where it cannot."""
    try:
        OUT_FOLDER.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{OUT_FOLDER}: cannot be made: {error.strerror}") from None


def file_stem(scenario: Scenario, time: str) -> str:
    """<scene>-<controller>-<seed>-<time> of characters, and of a length, that any file system takes."""
    name = f"{scenario.name}-{scenario.control.method}"[:MAX_NAME]
    return re.sub(r"[^\w.-]", "_", f"{name}-{scenario.seed}-{time}", flags=re.ASCII)
