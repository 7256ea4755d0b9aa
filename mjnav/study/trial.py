"""One episode of a study: what it is, and the row that it gives."""

import hashlib
import json
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from mjnav import scene
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.provenance import digest, provenance, revision
from mjnav.loop.result import Result
from mjnav.loop.run import warm_up
from mjnav.loop.supervision import RunFault, describe_fault
from mjnav.metrics.summary import OF_EPISODES, measured
from mjnav.scene.load import with_seed
from mjnav.scene.plugged import plugins_of
from mjnav.scene.spec import Scenario
from mjnav.settings.plugins import Plugin
from mjnav.study.cells import DEFAULT_SETTING, Cell
from mjnav.study.keep import Keep, raise_log_fault
from mjnav.study.sample_shape import SampleShape
from mjnav.study.store.row import FIGURES, Row, Value

ID_DIGITS = 32  # 128 bits: among a billion episodes, two have the same id with a probability of 1e-21
KEPT_SCENARIOS = 4096  # that a process keeps built and warm: a sweep goes through all its cells seed by seed


@dataclass(frozen=True, slots=True)
class Trial:
    """A cell under a seed."""

    study: str
    cell: Cell
    seed: int
    keep: Keep | None = None  # which log is kept, and where; no part of what the episode is
    detour: bool = False  # whether its people are run without the robot, too; no part either

    @property
    def place(self) -> tuple[str, str, str, str, int]:
        """Where it stands in the study: the values of `row.PLACE_IN_STUDY`."""
        return (*self.cell_place, self.seed)

    @property
    def cell_place(self) -> tuple[str, str, str, str]:
        """Where its cell stands: the values of `row.CELL`."""
        return self.study, self.cell.scene, self.cell.setting, self.cell.method

    @property
    def id(self) -> str:
        """A hash of place, scenario, parameters and all that decides the bits: equal where the episode is the same.

        With other programs or on another processor, the same trial has another id.
        """
        cell = self.cell
        facts = digest(made_with(cell.controller, cell.document))
        content = [*self.place, cell.parameters, cell.document, cell.control, facts]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:ID_DIGITS]

    @property
    def label(self) -> str:
        """The episode in a line."""
        cell = self.cell
        setting = "" if cell.setting == DEFAULT_SETTING else f"{cell.setting}, "
        return f"{cell.scene}, {setting}{cell.method}, seed {self.seed}"


def run_trial(trial: Trial, beat: Callable[[float], None] = lambda time: None) -> Row:
    """The episode's row; where the episode breaks, a row with the cause as its `error`.

    `beat` gets the simulated time [s] before every tick. Apart from wall times and the machine's name, the row is a
    function of the trial.
    """
    began = time.perf_counter()
    try:
        scenario = prepared(trial)
        began = time.perf_counter()
        shape = SampleShape()
        log = trial.keep.first_log() if trial.keep is not None else None
        result = Episode(scenario, log=log, watch=shape, progress=beat, cones=True, detour=trial.detour).run()
        figures = {**_figures(result, scenario), **shape.figures()}
        own = result.run.metrics
        return _row(trial, time.perf_counter() - began, figures, metrics=json.dumps(own) if own else None)
    except BaseException as error:  # whatever a plug-in raises: Ctrl-C does not reach workers
        raise_log_fault(error, trial.keep)
        return failed_row(trial, cause_of(error), time.perf_counter() - began)


def wants_log(trial: Trial, row: Row) -> bool:
    """Whether the episode has to be run again for its log."""
    return trial.keep is not None and not trial.keep.every and not row.figures.get("success")


def with_log(trial: Trial, row: Row, beat: Callable[[float], None] = lambda time: None) -> Row:
    """The row with the log of a second run of its episode; as it was where that did not end in the same state hash.

    Writing every log costs 1.4 to 1.9 times the time of an episode without one: so where only failures keep theirs,
    they are run twice. Everything else in the row, times included, is that of the first run. `beat` is as in
    `run_trial`. Raises LogFault where the log cannot be written.
    """
    keep = trial.keep
    if keep is None:
        return row
    try:
        ended = Episode(prepared(trial), log=keep.new_log(), progress=beat).run().run.state_hash
    except BaseException as error:  # as in `run_trial`
        raise_log_fault(error, keep)
        ended = cause_of(error)
    if ended != (row.error or row.figures["state_hash"]):
        keep.remove()
    return replace(row, log=keep.kept)


def made_with(controller: str, document: str) -> Mapping[str, str]:
    """What decides the bits of an episode beside its scenario, as far as this process knows: `provenance`."""
    return provenance(controller, _plugins(document))


@lru_cache(KEPT_SCENARIOS)
def _plugins(document: str) -> tuple[Plugin, ...]:
    """The plug-ins of a run file's text, of which nothing is imported; a text that is none names none."""
    try:
        return tuple(plugins_of(scene.loads(document)).values())
    except InvalidValue:
        return ()


def failed_row(trial: Trial, cause: str, seconds: float | None = None) -> Row:
    """The row of an episode without a result."""
    return _row(trial, seconds, {}, cause)


def cause_of(error: BaseException) -> str:
    """Why an episode broke, without the time at which it did: equal causes of different episodes are the same text."""
    return describe_fault(error.__cause__ if isinstance(error, RunFault) and error.__cause__ is not None else error)


def _row(
    trial: Trial,
    seconds: float | None,
    figures: Mapping[str, Value],
    error: str | None = None,
    *,
    metrics: str | None = None,
) -> Row:
    cell = trial.cell
    return Row(
        id=trial.id,
        study=trial.study,
        scene=cell.scene,
        setting=cell.setting,
        method=cell.method,
        seed=trial.seed,
        controller=cell.controller,
        parameters=cell.parameters,
        control=cell.control,
        scenario=cell.document,
        machine=platform.node(),
        revision=revision(),
        wall_s=seconds,
        made_with=dict(made_with(cell.controller, cell.document)),  # a mapping proxy cannot be sent to another process
        figures={column: value for column, value in figures.items() if column in FIGURES},
        error=error,
        log=trial.keep.kept if trial.keep is not None else None,
        metrics=metrics,
    )


def _figures(result: Result, scenario: Scenario) -> dict[str, Value]:
    more = measured(OF_EPISODES, result.trajectory, scenario, outcome=result.summary["outcome"])
    return {**flatten(result.summary), **more}


def flatten(summary: Mapping[str, Any], prefix: str = "") -> dict[str, Value]:
    """A run's summary with one key a figure: compute_ms_control_p50."""
    found: dict[str, Value] = {}
    for key, value in summary.items():
        found |= flatten(value, f"{prefix}{key}_") if isinstance(value, Mapping) else {f"{prefix}{key}": value}
    return found


def prepared(trial: Trial) -> Scenario:
    """The trial's scenario. Raises InputError."""
    return with_seed(_prepared(trial.cell.document), trial.seed)


@lru_cache(KEPT_SCENARIOS)
def _prepared(document: str) -> Scenario:
    """The scenario of a run file's text, all that its episodes use compiled: timings count from the first episode."""
    scenario = scene.loads(document)
    warm_up(scenario)
    return scenario
