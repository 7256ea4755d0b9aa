"""Measures models of prediction over a log, a scene or a recording."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from mjnav import scenarios
from mjnav.loop.onboard.floor_map import FloorMap
from mjnav.loop.simulation import Simulation
from mjnav.messages import Array, KnownMap, Trajectory
from mjnav.prediction import make_predictor
from mjnav.recording.read.log import open_log
from mjnav.scenarios.crowd.frame_rate import guess_frame_rate
from mjnav.scenarios.crowd.reader import read_recording
from mjnav.scenarios.overrides import Override
from mjnav.scenarios.spec import Scenario
from mjnav.study.prediction import of_run
from mjnav.study.prediction.forecast import Forecast, Moment, forecasts
from mjnav.study.prediction.of_recording import Frames
from mjnav.study.prediction.table import ModelFigures, model_figures

# What a model of prediction may ask of a scenario, where a recording has none.
_NOWHERE = 'schema = 1\nname = "recording"\n[robot]\nstart = [0, 0, 0]\ngoal = [1, 0]\n'


@dataclass(frozen=True, slots=True)
class Plan:
    """What is asked for."""

    models: tuple[str, ...]
    exact: bool = False  # the truth in place of the tracker's beliefs
    samples: int = 25
    every: float = 0.4  # [s] between predictions that count, of a run
    seed: int | None = None  # of the run, and of what is drawn besides
    overrides: tuple[str | Override, ...] = ()


@dataclass(frozen=True, slots=True)
class Measured:
    """The figures of each model, and what they were measured on."""

    what: str  # in a line
    step: float  # [s]
    steps: int
    exact: bool
    models: dict[str, ModelFigures]


def measure(source: str, plan: Plan, progress: Callable[[float], None] = lambda time: None) -> Measured:
    """The figures of every model over `source`.

    That is a log (.mcap), a recording (any other file but .toml), or a scene, by name or run file: its people walk
    while the robot stands at its start. Raises InvalidValue, and what opening a log raises.
    """
    if source.endswith(".mcap"):
        log = open_log(source)
        text = scenarios.dumps(log.scenario())
        load = partial(scenarios.loads, text, file=source)
        trajectory, what = log.trajectory(), f"{source}, of {log.scenario().name}"
    elif not source.endswith(".toml") and Path(source).is_file():
        return _recording(source, plan)
    else:
        load = partial(scenarios.load, source)
        overrides = (Override("stop_on_collision", False), *_with_model(plan, plan.models[0]))
        scenario = replace(load(overrides, seed=plan.seed), prediction=None)
        trajectory = _walked(scenario, plan, progress)
        what = f"{scenario.name}, seed {scenario.seed}, the robot at its start"
    of_models = [load(_with_model(plan, model)) for model in plan.models]
    floor = FloorMap(of_models[0]).known
    seed = of_models[0].seed if plan.seed is None else plan.seed

    def moments() -> Iterable[Moment]:
        return of_run.moments(trajectory, of_models[0], exact=plan.exact, num=plan.samples, every=plan.every, seed=seed)

    return _measured(what, plan, of_models, moments, partial(of_run.whereabouts, trajectory), floor, seed)


def _recording(source: str, plan: Plan) -> Measured:
    recording = read_recording(source)
    guess = guess_frame_rate(recording)
    frames = Frames.of(recording, 25.0 if guess is None else guess.frame_rate)
    of_models = [scenarios.loads(_NOWHERE, _with_model(plan, model)) for model in plan.models]
    seed, what = plan.seed or 0, f"{source}, every window of 8 frames seen, {frames.step:g} s apart"
    believed = partial(frames.believed, plan.samples, of_models[0], seed)
    moments = partial(frames.moments, plan.samples) if plan.exact else believed
    return _measured(what, plan, of_models, moments, frames.whereabouts, None, seed)


def _measured(
    what: str,
    plan: Plan,
    of_models: Sequence[Scenario],
    moments: Callable[[], Iterable[Moment]],
    whereabouts: Callable[[str, Array], Array],
    floor: KnownMap | None,
    seed: int,
) -> Measured:
    found: dict[str, list[Forecast]] = {}
    step, steps = 0.0, 0
    for model, scenario in zip(plan.models, of_models, strict=True):
        assert scenario.prediction is not None  # the plan names its model
        step, steps = scenario.prediction.step, scenario.prediction.num_steps
        predictor = make_predictor(scenario, seed)
        found[model] = list(forecasts(moments(), predictor, whereabouts, step, steps, floor))
    return Measured(what, step, steps, plan.exact, model_figures(found))


def _with_model(plan: Plan, model: str) -> tuple[str | Override, ...]:
    return (Override("prediction.model", model, "--model"), *plan.overrides)


def _walked(scenario: Scenario, plan: Plan, progress: Callable[[float], None]) -> Trajectory:
    """A run in which the robot stands."""
    with Simulation(scenario, estimators=not plan.exact) as simulation:
        while not simulation.done:
            simulation.step(0.0, 0.0)
            progress(simulation.time)
        return simulation.trajectory
