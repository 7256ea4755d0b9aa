"""One episode of a study: what it is, and the row that it gives."""

import hashlib
import json
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import nan, sqrt
from typing import Any

import numpy as np

from mjnav import scene
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.provenance import digest, provenance, revision
from mjnav.loop.result import Result
from mjnav.loop.run import warm_up
from mjnav.loop.supervision import RunFault, describe_fault
from mjnav.messages import Array, TickRecord
from mjnav.metrics.consistency import skew_and_kurtosis
from mjnav.metrics.summary import OF_EPISODES, measured
from mjnav.scene.load import with_seed
from mjnav.scene.plugged import plugins_of
from mjnav.scene.spec import Scenario
from mjnav.settings.plugins import Plugin
from mjnav.study.cells import DEFAULT_SETTING, Cell
from mjnav.study.keep import Keep, raise_log_fault
from mjnav.study.store import FIGURES, Row, Value
from mjnav.study.study_file import flat

OF_CELL = ("scene", "setting", "method", "controller", "parameters", "control")  # that its episodes' rows have from it
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
        """Where it stands in the study: the values of `store.PLACE_IN_STUDY`."""
        return (*self.cell_place, self.seed)

    @property
    def cell_place(self) -> tuple[str, str, str, str]:
        """Where its cell stands: the values of `store.CELL`."""
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
        shape, log = SampleShape(), None if trial.keep is None else trial.keep.new_log()
        episode = Episode(scenario, log=log, watch=shape, progress=beat, cones=True, scan=False, detour=trial.detour)
        result = episode.run()
        figures = {**_figures(result, scenario), **shape.figures()}
        if trial.keep is not None and not trial.keep.every and figures["success"]:
            trial.keep.remove()
        own = result.run.metrics
        return _row(trial, time.perf_counter() - began, figures, metrics=json.dumps(own) if own else None)
    except BaseException as error:  # whatever a plug-in raises: Ctrl-C does not reach workers
        raise_log_fault(error, trial.keep)
        return failed_row(trial, cause_of(error), time.perf_counter() - began)


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
        seed=trial.seed,
        scenario=cell.document,
        machine=platform.node(),
        revision=revision(),
        wall_s=seconds,
        made_with=dict(made_with(cell.controller, cell.document)),  # a mapping proxy cannot be sent to another process
        figures={column: value for column, value in figures.items() if column in FIGURES},
        error=error,
        log=trial.keep.kept if trial.keep is not None else None,
        metrics=metrics,
        **{name: getattr(cell, name) for name in OF_CELL},
    )


def _figures(result: Result, scenario: Scenario) -> dict[str, Value]:
    more = measured(OF_EPISODES, result.trajectory, scenario, outcome=result.summary["outcome"])
    return {**flatten(result.summary), **more}


def flatten(summary: Mapping[str, Any]) -> dict[str, Value]:
    """A run's summary with one key a figure: compute_ms_control_p50."""
    return flat(summary, dot="_", ends=lambda table: False)


def prepared(trial: Trial) -> Scenario:
    """The trial's scenario. Raises InputError."""
    return with_seed(_prepared(trial.cell.document), trial.seed)


@lru_cache(KEPT_SCENARIOS)
def _prepared(document: str) -> Scenario:
    """The scenario of a run file's text, all that its episodes use compiled: timings count from the first episode."""
    scenario = scene.loads(document)
    warm_up(scenario)
    return scenario


# ---------------------------------------------------------------------------------- shape of the samples


class SampleShape:
    """Watches a run: skew and kurtosis of the samples' x and y, means over ticks, axes and people.

    With the moments' g1 and g2 + 3 of n samples, these are the estimates that are unbiased for Gaussians of any n:

        G1 = sqrt(n (n - 1)) / (n - 2) g1,   G2 = (n - 1) / ((n - 2) (n - 3)) ((n + 1) g2 + 6),   kurtosis G2 + 3.

    Of few samples of a heavy tail both are too small. Source: Joanes & Gill, The Statistician 47 (1998) 183.

    Also the share of the closest obstacle's samples that the chosen control avoids, where the run computes `cones`.
    """

    def __init__(self):
        self._robot: list[Array] = []  # (N, 2) each
        self._people: list[Array] = []
        self._safe_shares: list[float] = []

    def __call__(self, record: TickRecord) -> None:
        """One more tick."""
        observation = record.seen
        self._robot.append(observation.robot_pose[:, :2])
        self._people += [person.position for person in observation.obstacles[: len(record.tracks)]]
        if record.cone is not None:
            self._safe_shares.append(record.cone.safe_share)

    def figures(self) -> dict[str, float | None]:
        """The figures by column of a row; None where all samples are equal, or too few."""
        shares = self._safe_shares
        figures: dict[str, float | None] = {
            "min_safe_share": min(shares, default=None),
            "mean_safe_share": sum(shares) / len(shares) if shares else None,
        }
        for name, samples in (("robot", self._robot), ("people", self._people)):
            skew, kurtosis = _unbiased(np.stack(samples, axis=1)) if samples else (nan, nan)
            figures[f"{name}_skew"] = skew if np.isfinite(skew) else None
            figures[f"{name}_kurtosis"] = kurtosis if np.isfinite(kurtosis) else None
        return figures


def _unbiased(samples: Array) -> tuple[float, float]:
    """Means of G1 and G2 + 3 over the columns of (n, ...) that are not constant; NaN where all are."""
    n = len(samples)
    g1, kurtosis = skew_and_kurtosis(samples)
    usable = np.isfinite(g1) & np.isfinite(kurtosis)
    if n < 4 or not usable.any():
        return nan, nan
    g2 = kurtosis[usable].mean() - 3.0
    skew = sqrt(n * (n - 1)) / (n - 2) * g1[usable].mean()
    return float(skew), float((n - 1) / ((n - 2) * (n - 3)) * ((n + 1) * g2 + 6.0) + 3.0)
