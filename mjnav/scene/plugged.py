"""The plug-ins that a scenario names, beside its controller, and their places in a run file."""

from collections.abc import Iterator
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any

from mjnav.scene.people import ConstantVelocity
from mjnav.scene.spec import Noise, Person, Scenario
from mjnav.settings import keys
from mjnav.settings.plugins import BehaviourPlugin, DistributionPlugin, MetricPlugin, Plugin, PredictorPlugin, placed


def plugins_of(scenario: Scenario) -> dict[str, Plugin]:
    """The plug-ins by their key."""
    return dict(_plugins_in("", scenario))


def _plugins_in(place: str, part: Any) -> Iterator[tuple[str, Plugin]]:
    inner: Any = ()
    if isinstance(part, Plugin):
        yield place, part
    elif isinstance(part, tuple):
        inner = ((str(i), item) for i, item in enumerate(part) if is_dataclass(item))
    elif isinstance(part, dict):
        inner = part.items()
    elif is_dataclass(part):
        inner = (("" if field.beside else key, getattr(part, field.name)) for key, field in keys(type(part)).items())
    for key, item in inner:
        yield from _plugins_in(".".join(filter(None, (place, key))), item)


def without_plugins(scenario: Scenario) -> Scenario:
    """The scenario with mjnav's own in place of every plug-in but the controller: for ticks that are thrown away."""
    noise, estimation, prediction = scenario.noise, scenario.estimation, scenario.prediction
    kept = {name: channel for name, channel in noise.channels.items() if not isinstance(channel, DistributionPlugin)}
    has_predictor = prediction is not None and isinstance(prediction.model, PredictorPlugin)
    return replace(
        scenario,
        metrics=None,
        prediction=None if has_predictor else prediction,
        people=tuple(map(_standing, scenario.people)),
        noise=Noise(noise.profile, kept),
        estimation=replace(
            estimation,
            robot=replace(estimation.robot, localizer=None),
            obstacles=replace(estimation.obstacles, tracker=None),
        ),
    )


def _standing(person: Person) -> Person:
    if isinstance(person.behaviour, BehaviourPlugin):
        return replace(person, behaviour=ConstantVelocity((0.0, 0.0)))
    return person


def metrics_of(scenario: Scenario) -> tuple[MetricPlugin, ...]:
    """The metrics, in the order of the scenario."""
    return tuple(metric for metric in scenario.metrics or () if isinstance(metric, MetricPlugin))


def with_places(part: Any, folder: Path) -> Any:
    """The tables of a run file in `folder`, in which every "file.py:Class" that lies there has its absolute path."""
    if isinstance(part, str):
        return placed(part, folder)
    if isinstance(part, dict):
        return {key: with_places(item, folder) for key, item in part.items()}
    if isinstance(part, list):
        return [with_places(item, folder) if isinstance(item, str | dict) else item for item in part]
    return part
