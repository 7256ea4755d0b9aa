"""The plug-ins that a scenario names, beside its controller."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from mjnav.plugins import (
    BehaviourPlugin,
    DistributionPlugin,
    LocalizerPlugin,
    MetricPlugin,
    Plugin,
    PredictorPlugin,
    TrackerPlugin,
)
from mjnav.scenarios.people import ConstantVelocity
from mjnav.scenarios.spec import Noise, Person, Scenario


def plugins_of(scenario: Scenario) -> Mapping[str, Plugin]:
    """The plug-ins by their key."""
    return dict(_found(scenario))


def without_plugins(scenario: Scenario) -> Scenario:
    """The scenario with mjnav's own in place of every plug-in but the controller: for ticks that are thrown away."""
    noise, estimation = scenario.noise, scenario.estimation
    kept = {name: channel for name, channel in noise.channels.items() if not isinstance(channel, DistributionPlugin)}
    return replace(
        scenario,
        metrics=None,
        prediction=None if _predictor(scenario) else scenario.prediction,
        people=tuple(_standing(person) for person in scenario.people),
        noise=Noise(noise.profile, kept),
        estimation=replace(
            estimation,
            robot=replace(estimation.robot, localizer=None),
            obstacles=replace(estimation.obstacles, tracker=None),
        ),
    )


def metrics_of(scenario: Scenario) -> tuple[MetricPlugin, ...]:
    """The metrics, in the order of the scenario."""
    return tuple(metric for metric in scenario.metrics or () if isinstance(metric, MetricPlugin))


def _found(scenario: Scenario) -> Iterator[tuple[str, Plugin]]:
    robot, obstacles = scenario.estimation.robot.localizer, scenario.estimation.obstacles.tracker
    if isinstance(robot, LocalizerPlugin):
        yield "estimation.robot.localizer", robot
    if isinstance(obstacles, TrackerPlugin):
        yield "estimation.obstacles.tracker", obstacles
    if (predictor := _predictor(scenario)) is not None:
        yield "prediction", predictor
    for i, person in enumerate(scenario.people):
        if isinstance(person.behaviour, BehaviourPlugin):
            yield f"people.{i}", person.behaviour
    for channel, distribution in scenario.noise.channels.items():
        if isinstance(distribution, DistributionPlugin):
            yield f"noise.{channel}", distribution
    yield from ((f"metrics.{i}", metric) for i, metric in enumerate(metrics_of(scenario)))


def _predictor(scenario: Scenario) -> PredictorPlugin | None:
    model = None if scenario.prediction is None else scenario.prediction.model
    return model if isinstance(model, PredictorPlugin) else None


def _standing(person: Person) -> Person:
    if isinstance(person.behaviour, BehaviourPlugin):
        return replace(person, behaviour=ConstantVelocity((0.0, 0.0)))
    return person
