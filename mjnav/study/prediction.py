"""Measures models of human motion prediction over a log, a scene or a recording, and compares their figures.

A forecast is one prediction of one person at one moment, compared with where the person went.

The figures of several models are over the same predictions, with intervals. The unit is the person: predictions of one
person at neighbouring moments say nearly the same, so a person's predictions are averaged first, and the intervals are
those of a mean over people (bootstrap, the same people drawn for every figure).

Moments of a run hold what was believed of the people, or what was true of them, tick by tick.

Moments of a recording of people hold the recorded positions. They follow the protocol of Pellegrini et al. 2009 and of
those who followed: a person counts who was seen at 8 frames in a row, and is predicted over the next 12, all 0.4 s
apart; every such window counts. The velocity is that of the last step. What a tracker would believe of such people is
measured in a scene that `mjnav import crowd` makes of the recording.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from mjnav import scene
from mjnav.errors import InvalidValue
from mjnav.log.read.log import open_log
from mjnav.loop.simulation import Simulation
from mjnav.messages import Array, KnownMap, Track, Trajectory, symmetric
from mjnav.metrics.intervals import SharedBootstrap
from mjnav.metrics.prediction import LEVELS, PathScores, path_scores
from mjnav.rng import stream
from mjnav.robot.estimation.base import person_names, person_track
from mjnav.robot.prediction import Crowd, Predictor, make_predictor
from mjnav.robot.seen_space import FloorMap
from mjnav.scene import crowd as crowds
from mjnav.scene.overrides import Override
from mjnav.scene.spec import Scenario
from mjnav.settings import below

# ------------------------------------------------------------------------------------------ forecasts


@dataclass(frozen=True, slots=True)
class Moment:
    """What is known of the people at one time."""

    time: float  # [s]
    tracks: tuple[Track, ...]
    samples: Array  # (P, M, 4) of each track
    scored: tuple[str, ...]  # names of the people whose prediction counts; the others are there for them to meet


@dataclass(frozen=True, slots=True)
class Forecast:
    """One prediction of one person and how it turned out."""

    person: str
    time: float  # [s] from which on it was predicted
    scores: PathScores


def forecasts(
    moments: Iterable[Moment],
    predictor: Predictor,
    whereabouts: Callable[[str, Array], Array],
    step: float,
    num: int,
    floor: KnownMap | None = None,
) -> Iterator[Forecast]:
    """The predictions of all moments, in their order, at `num` times `step` [s] apart.

    `whereabouts(name, times)` says where a person was at times (n,) [s]: (n, 2) [m], NaN where nobody knows. A
    prediction for a time at which nobody knows is left out.
    """
    ahead = step * np.arange(num + 1, dtype=float)
    for moment in moments:
        paths = predictor.predict(Crowd(moment.tracks, moment.samples, moment.time, floor)).paths(step, num)
        for p, track in enumerate(moment.tracks):
            if track.name in moment.scored:
                observed = whereabouts(track.name, moment.time + ahead)
                if np.isfinite(observed).all():
                    person = track.name.partition(_PIECE)[0]
                    yield Forecast(person, moment.time, path_scores(paths[p, :, 1:], observed[1:]))


# ---------------------------------------------------------------------------------- figures of models


INSIDE = tuple(f"inside_{100 * level:g}" for level in LEVELS)
FIGURES = ("ade_m", "fde_m", "min_ade_m", "energy_m", *INSIDE)
BY_HORIZON = ("error_m", "energy_m", *INSIDE)


Document = dict[str, Any]  # as `--json` has it


def model_figures(forecasts: Mapping[str, Sequence[Forecast]], step: float) -> dict[str, Document]:
    """The figures of each model, by name. Every model has predicted the same people at the same moments.

    A figure is a mean over people with its interval at 95 %; one person's has none.
    """
    people = sorted({forecast.person for of_model in forecasts.values() for forecast in of_model})
    if not people:
        nothing = {"people": 0, "predictions": 0, "by_window": {"ade_m": None, "fde_m": None}}
        nothing |= {"energy_beyond_first": {"value": None, "interval": None}, "figures": {}, "by_horizon": []}
        return dict.fromkeys(forecasts, nothing)
    bootstrap = SharedBootstrap(len(people), stream(0, "prediction.bootstrap"), resamples=2000)
    first = next(iter(forecasts.values()))
    return {name: _figures(of_model, first, people, bootstrap, step) for name, of_model in forecasts.items()}


def _figures(
    forecasts: Sequence[Forecast],
    first: Sequence[Forecast],
    people: Sequence[str],
    bootstrap: SharedBootstrap,
    step: float,
) -> Document:
    place = {person: i for i, person in enumerate(people)}
    unit = np.array([place[forecast.person] for forecast in forecasts])
    scores = [forecast.scores for forecast in forecasts]
    inside = np.array([s.inside for s in scores])  # (n, H, L)
    series = {"error_m": np.array([s.error for s in scores]), "energy_m": np.array([s.energy for s in scores])}
    series |= {name: inside[:, :, i] for i, name in enumerate(INSIDE)}
    whole = {
        "ade_m": series["error_m"].mean(axis=1),
        "fde_m": series["error_m"][:, -1],
        "min_ade_m": np.array([s.min_ade for s in scores]),
        **{name: values.mean(axis=1) for name, values in series.items() if name != "error_m"},
    }
    count = np.bincount(unit, minlength=len(people))

    def means(values: Array) -> list[Document]:
        """Of values (n, F): a mean over people for each column."""
        sums = np.zeros((len(people), values.shape[1]))
        np.add.at(sums, unit, values)
        by_person = (sums / count[:, None]).T
        averages = by_person.mean(axis=1)
        intervals = bootstrap.intervals(by_person) if len(people) > 1 else [None] * len(averages)
        return [
            {"value": float(average) if np.isfinite(average) else None, "interval": interval}
            for average, interval in zip(averages, intervals, strict=True)
        ]

    energy_of_first = np.array([forecast.scores.energy.mean() for forecast in first])
    (beyond_first,) = means((whole["energy_m"] - energy_of_first)[:, None])
    by_horizon = zip(*(means(series[name]) for name in BY_HORIZON), strict=True)
    return {
        "people": len(people),
        "predictions": len(forecasts),
        "by_window": {name: float(whole[name].mean()) for name in ("ade_m", "fde_m")},  # over predictions, as published
        "energy_beyond_first": beyond_first,  # energy_m less that of the first model, person by person
        "figures": dict(zip(FIGURES, means(np.column_stack([whole[name] for name in FIGURES])), strict=True)),
        "by_horizon": [
            {"time_s": (h + 1) * step, **dict(zip(BY_HORIZON, of_time, strict=True))}
            for h, of_time in enumerate(by_horizon)
        ],
    }


# ----------------------------------------------------------------------------------- moments of a run


def moments(
    trajectory: Trajectory, scenario: Scenario, *, exact: bool, num: int, every: float, seed: int
) -> Iterator[Moment]:
    """One moment a tick; predictions count every `every` [s].

    Samples are drawn from the Gaussian that has the track's mean and covariance, which is what a trajectory keeps of a
    belief; with `exact` all of them are the truth.
    """
    names = person_names(trajectory.people_position.shape[1])
    streams = [stream(seed, "prediction.scores", name) for name in names]
    times, count = np.zeros(len(names)), 0
    for k in range(len(trajectory.tracks)):
        time = float(trajectory.time[k])
        counts = time >= count * every - 1e-9
        count += counts
        tracks, samples = [], []
        for p, name in enumerate(names):
            mean, root = _belief(trajectory, k, p, exact=exact)
            if not np.isfinite(mean).all():
                continue
            if k == 0 or exact or (trajectory.tracks[k, p] != trajectory.tracks[k - 1, p]).any():
                times[p] = time
            drawn = mean + streams[p].standard_normal((num, 4)) @ root.T
            tracks.append(person_track(name, float(times[p]), scenario.people[p].radius, drawn))
            samples.append(drawn)
        yield Moment(
            time,
            tuple(tracks),
            np.array(samples).reshape(-1, num, 4),
            tuple(track.name for track in tracks) if counts else (),
        )


def whereabouts(trajectory: Trajectory, name: str, times: Array) -> Array:
    """Where a person was at times (n,) [s], linear between ticks: (n, 2) [m]; NaN once they have left."""
    path = trajectory.people_position[:, person_names(trajectory.people_position.shape[1]).index(name)]
    known, missed = trajectory.time, np.isnan(path[:, 0]).cumsum()  # who comes again does so somewhere else
    stays = np.interp(times, known, missed) == np.interp(times[0], known, missed)
    places = np.stack([np.interp(times, known, axis, left=np.nan, right=np.nan) for axis in path.T], axis=1)
    return np.where(stays[:, None], places, np.nan)


def _belief(trajectory: Trajectory, k: int, p: int, *, exact: bool) -> tuple[Array, Array]:
    """Mean (4,) and a root (4, 4) of the covariance of what is known of a person at a tick."""
    if exact:
        state = np.concatenate([trajectory.people_position[k, p], trajectory.people_velocity[k, p]])
        return state, np.zeros((4, 4))
    mean = trajectory.tracks[k, p]
    if not np.isfinite(mean).all():
        return mean, np.zeros((4, 4))
    values, axes = np.linalg.eigh(symmetric(trajectory.track_triangle[k, p], 4))
    return mean, axes * np.sqrt(np.maximum(values, 0.0))


# ----------------------------------------------------------------------------- moments of a recording


SEEN = 8  # frames, the latest among them
RADIUS = 0.3  # [m] of a person
_PIECE = "\x1f"  # in a track's name, between the person's label and the number of the piece


@dataclass(frozen=True, slots=True)
class Frames:
    """Where everybody was, at whole steps of a recording."""

    step: float  # [s]
    places: Mapping[str, Mapping[int, Array]]  # by piece of a person's track and number of the step: (2,) [m]

    @classmethod
    def of(cls, recording: crowds.Recording, frame_rate: float) -> "Frames":
        """The rows whose time is a whole number of the recording's usual steps. Raises InvalidValue without any."""
        step = recording.usual_step / frame_rate
        if step == 0.0:
            raise InvalidValue("", f"{len(recording.labels)} people", "a recording with people in two rows or more")
        places: dict[str, dict[int, Array]] = {}
        for track in crowds.tracks_of(recording, crowds.Crowd("", frame_rate, max_gap=1.5 * step)).tracks:
            number = track.rows[:, 0] / step
            whole = np.abs(number - number.round()) < 1e-3
            steps = number[whole].round().astype(int).tolist()
            if steps:
                piece = f"{track.label}{_PIECE}{len(places)}"
                places[piece] = dict(zip(steps, track.rows[whole, 1:], strict=True))
        if not places:
            raise InvalidValue("", "nobody at the recording's own steps", "people who walk on [m] from step to step")
        return cls(step, places)

    def whereabouts(self, person: str, times: Array) -> Array:
        """Where a person was at times (n,) [s]: (n, 2) [m], linear between steps; NaN where they were not there."""
        places, nowhere = self.places[person], np.full(2, np.nan)
        before = np.floor(times / self.step + 1e-6).astype(int)
        share = (times / self.step - before).clip(min=0.0)[:, None]
        first = np.array([places.get(k, nowhere) for k in before.tolist()])
        then = np.array([places.get(k + 1, nowhere) for k in before.tolist()])
        return np.where(share < 1e-6, first, first + share * (then - first))

    def moments(self, num: int) -> Iterator[Moment]:
        """One moment a frame, with everybody who was there a step before too; `num` samples, all alike."""
        last = max(map(max, self.places.values()))
        seen = dict.fromkeys(self.places, 0)
        for k in range(last + 1):
            tracks, samples, scored = [], [], []
            for person, places in self.places.items():
                seen[person] = seen[person] + 1 if k in places else 0
                if seen[person] < 2:
                    continue
                state = np.concatenate([places[k], (places[k] - places[k - 1]) / self.step])
                tracks.append(person_track(person, k * self.step, RADIUS, state[None]))
                samples.append(np.tile(state, (num, 1)))
                if seen[person] >= SEEN:
                    scored.append(person)
            yield Moment(k * self.step, tuple(tracks), np.array(samples).reshape(-1, num, 4), tuple(scored))


# ------------------------------------------------------------------------------------------ measuring


# What a model of prediction may ask of a scenario, where a recording has none.
_NOWHERE = 'schema = 1\nname = "recording"\n[robot]\nstart = [0, 0, 0]\ngoal = [1, 0]\n'


@dataclass(frozen=True, slots=True)
class Plan:
    """What is asked for."""

    models: tuple[str, ...]
    exact: bool = False  # the truth in place of the tracker's beliefs; always so of a recording
    every: float = 0.4  # [s] between predictions that count, of a run
    seed: int | None = None  # of the run, and of what is drawn besides
    overrides: tuple[str | Override, ...] = ()
    frame_rate: float | None = None  # [Hz] of a recording's column of frames
    samples: int = 25  # of each person


def measure(source: str, plan: Plan) -> Document:
    """The figures of every model over `source`.

    That is a log (.mcap), a recording (any other file but .toml), or a scene, by name or run file: its people walk
    while the robot stands at its start. Raises InvalidValue, and what opening a log raises.
    """
    log = open_log(source) if source.endswith(".mcap") else None
    if log is not None:
        load = partial(scene.loads, scene.dumps(log.scenario()), file=source)
    elif not source.endswith(".toml") and os.path.isfile(source):
        return _recording(source, plan)
    else:
        load = partial(scene.load, source)
    of_models = [load(_with_model(plan, model)) for model in plan.models]
    if plan.frame_rate is not None:
        raise InvalidValue("--frame-rate", plan.frame_rate, "none but of a recording, whose column of frames it is of")
    if log is not None:
        trajectory, what = log.trajectory(), f"{source}, of {of_models[0].name}"
    else:
        overrides = (Override("stop_on_collision", False), *_with_model(plan, plan.models[0]))
        scenario = replace(load(overrides, seed=plan.seed), prediction=None)
        with Simulation(scenario, estimators=not plan.exact) as simulation:
            while not simulation.done:
                simulation.step(0.0, 0.0)
            trajectory = simulation.trajectory
        what = f"{scenario.name}, seed {scenario.seed}, the robot at its start"
    floor = FloorMap(of_models[0]).known
    seed = of_models[0].seed if plan.seed is None else plan.seed

    seen = partial(moments, trajectory, of_models[0], exact=plan.exact, num=plan.samples, every=plan.every, seed=seed)
    return _measured(what, plan, of_models, seen, partial(whereabouts, trajectory), floor, seed)


def _recording(source: str, plan: Plan) -> Document:
    recording = crowds.read_recording(source)
    if plan.frame_rate is None:
        allowed = "what the recording's column of frames counts a second, as 25 for most files of ETH and UCY"
        raise InvalidValue("--frame-rate", None, allowed)
    with below(file=source):
        frames = Frames.of(recording, plan.frame_rate)
    of_models = [scene.loads(_NOWHERE, _with_model(plan, model)) for model in plan.models]
    what = f"{source}, every window of 8 frames seen, {frames.step:g} s apart"
    seen = partial(frames.moments, plan.samples)
    return _measured(what, replace(plan, exact=True), of_models, seen, frames.whereabouts, None, plan.seed or 0)


def _measured(
    what: str,
    plan: Plan,
    of_models: Sequence[Scenario],
    moments: Callable[[], Iterable[Moment]],
    whereabouts: Callable[[str, Array], Array],
    floor: KnownMap | None,
    seed: int,
) -> Document:
    of_model: dict[str, list[Forecast]] = {}
    step, steps = 0.0, 0
    for model, scenario in zip(plan.models, of_models, strict=True):
        assert scenario.prediction is not None  # the plan names its model
        step, steps = scenario.prediction.step, scenario.prediction.num_steps
        predictor = make_predictor(scenario, seed)
        of_model[model] = list(forecasts(moments(), predictor, whereabouts, step, steps, floor))
    found = {"source": what, "step_s": step, "steps": steps, "exact": plan.exact}
    return {**found, "models": model_figures(of_model, step)}


def _with_model(plan: Plan, model: str) -> tuple[str | Override, ...]:
    return (Override("prediction.model", model, "--model"), *plan.overrides)
