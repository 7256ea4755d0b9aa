"""Risk calibration: the predicted share of colliding samples at the chosen control, against the observed frequency.

Both are probabilities of one event (`collision_event`), taken at every k-th decision along runs of the method:

    direct     The method decides on N = M samples drawn around the true state (`true_draws`) at the moment when the
               run's decision took effect. The share of colliding pairs, against fresh draws from the same
               distributions. Errors come from few samples, and from choosing a control for which they look good.
    filtered   The run's own decision on the filters' samples, against the event from the true state at the moment of
               effect, with fresh draws of the actuation noise. Errors come from the beliefs as well.
    rollout    The same forecast, against rollouts from that state (`rollout`): the control kept as an arc, noise that
               changes every 0.1 s. Errors come from the candidates' model of motion as well.

The fresh draws are made once a run and shared by its decisions. A decision that never takes effect does not count.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjnav.errors import InvalidValue, unknown_name
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import build_controller, episode_label
from mjnav.messages import Array, Decision, TickRecord, WorldState
from mjnav.metrics.calibration import Calibration, calibration
from mjnav.rng import stream
from mjnav.scenarios.load import with_seed
from mjnav.scenarios.spec import Scenario
from mjnav.study.calibration.collision_event import share_of_draws, share_of_pairs
from mjnav.study.calibration.rollout import NUM_WINDOWS, share_of_rollouts
from mjnav.study.calibration.true_draws import ErrorDraws, Errors, around_truth
from mjnav.study.sweep.workers import TimeLimit, in_order

SETTINGS = ("direct", "filtered", "rollout")


@dataclass(frozen=True, slots=True)
class CalibrationPlan:
    """The settings, the number of fresh draws for each decision, and `every`: each k-th tick's decision counts."""

    settings: tuple[str, ...] = SETTINGS
    draws: int = 100_000
    every: int = 5

    def __post_init__(self):
        for setting in self.settings:
            if setting not in SETTINGS:
                raise unknown_name("setting", setting, SETTINGS)
        for key in ("draws", "every"):
            if getattr(self, key) < 1:
                raise InvalidValue(key, getattr(self, key), "a whole number >= 1")


class ForecastRecorder:
    """Watches a run, and compares every k-th decision with the truth when it takes effect."""

    def __init__(self, scenario: Scenario, plan: CalibrationPlan):
        self._scenario, self._plan = scenario, plan
        self._controller = build_controller(scenario)
        self._sample = ErrorDraws(scenario, scenario.seed, "sample")
        self._waiting: deque[TickRecord] = deque()
        self.forecasts: dict[str, list[tuple[float, float]]] = {setting: [] for setting in plan.settings}

    def __call__(self, record: TickRecord) -> None:
        """One more tick."""
        if record.tick % self._plan.every == 0:
            self._waiting.append(record)
        if self._waiting and self._waiting[0].tick + self._scenario.control.delay == record.tick:
            decided = self._waiting.popleft()
            for setting, forecasts in self.forecasts.items():
                forecasts.append(self._forecast(setting, decided, record.truth))

    def _forecast(self, setting: str, decided: TickRecord, truth: WorldState) -> tuple[float, float]:
        """Predicted share and frequency; `truth` is the state when the decision takes effect."""
        limits, num_people = self._scenario.robot.limits, len(truth.people_position)
        observation, control = decided.seen, _control(decided.decision)
        if setting == "direct":
            errors = self._sample(self._controller.parameters.samples)
            observation = around_truth(observation, truth, errors)
            control = _control(self._controller.decide(observation))
        predicted = share_of_pairs(observation, control, limits)
        if setting == "rollout":
            known = around_truth(observation, truth, Errors.of_control(np.zeros((1, 2)), num_people))
            return predicted, share_of_rollouts(known, control, limits, self._rollout_noise)
        fresh = self._fresh if setting == "direct" else Errors.of_control(self._fresh.control, num_people)
        return predicted, share_of_draws(around_truth(observation, truth, fresh), control, limits)

    @cached_property
    def _fresh(self) -> Errors:
        return ErrorDraws(self._scenario, self._scenario.seed, "fresh")(self._plan.draws)

    @cached_property
    def _rollout_noise(self) -> Array:
        """Actuation noise of every rollout and window, (n, S, 2)."""
        return ErrorDraws(self._scenario, self._scenario.seed, "rollout").control(self._plan.draws, NUM_WINDOWS)


def _control(decision: Decision) -> tuple[float, float]:
    return decision.v, decision.omega


def forecasts(
    scenario: Scenario,
    plan: CalibrationPlan,
    *,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda time: None,
) -> dict[str, Array]:
    """Predicted share and frequency of the decisions of one run, (n, 2) by setting.

    `stop` and `progress` are as in `Episode`.
    """
    recorder = ForecastRecorder(scenario, plan)
    Episode(scenario, watch=recorder, stop=stop, progress=progress).run()
    return {setting: np.array(pairs, float).reshape(-1, 2) for setting, pairs in recorder.forecasts.items()}


def calibrate(
    scenarios: Sequence[Scenario],
    seeds: Sequence[int],
    plan: CalibrationPlan,
    *,
    workers: int = 1,
    limit: TimeLimit | None = None,
    progress: Callable[[int], None] = lambda done: None,
) -> dict[str, dict[str, Calibration]]:
    """The calibration by method and setting, from a run of every scenario (one for each method) under every seed.

    With a `limit`, whose labels are `run_label`, every run is in a worker process. `progress` gets the number of runs
    that are done. Raises InputError before anything starts, and MjnavError where a run breaks or takes too long.
    """
    tasks = [(with_seed(scenario, seed), plan) for scenario in scenarios for seed in seeds]
    runs: list[dict[str, Array]] = []
    for run in in_order(_forecasts_of, tasks, workers, limit=limit):
        runs.append(run)
        progress(len(runs))
    found: dict[str, dict[str, Calibration]] = {}
    for i, scenario in enumerate(scenarios):
        of_method = runs[i * len(seeds) : (i + 1) * len(seeds)]
        found[scenario.control.method] = {
            setting: _calibration([run[setting] for run in of_method], seeds) for setting in plan.settings
        }
    return found


def run_label(task: tuple[Scenario, CalibrationPlan]) -> str:
    """The name of a run of `calibrate` in messages."""
    return episode_label(task[0])


def _forecasts_of(
    task: tuple[Scenario, CalibrationPlan], beat: Callable[[float], None] = lambda time: None
) -> dict[str, Array]:
    return forecasts(*task, progress=beat)


def _calibration(runs: Sequence[Array], seeds: Sequence[int]) -> Calibration:
    predicted, observed = np.concatenate(runs).T
    groups = np.repeat(seeds, [len(run) for run in runs])
    return calibration(predicted, observed, groups, stream(int(seeds[0]), "calibration.bootstrap"))
