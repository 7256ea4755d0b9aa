"""The plug-ins that a scenario names, beside its controller, and their places in a run file."""

from dataclasses import replace

from mjnav.scene.people import ConstantVelocity
from mjnav.scene.spec import Noise, Scenario
from mjnav.settings.plugins import BehaviourPlugin, DistributionPlugin, Plugin, PredictorPlugin


def plugins_of(scenario: Scenario) -> dict[str, Plugin]:
    """The plug-ins by their key."""
    estimation, prediction = scenario.estimation, scenario.prediction
    places = {
        **{f"people.{i}": person.behaviour for i, person in enumerate(scenario.people)},
        **{f"noise.{channel}": law for channel, law in scenario.noise.channels.items()},
        "estimation.robot.localizer": estimation.robot.localizer,
        "estimation.obstacles.tracker": estimation.obstacles.tracker,
        "prediction": None if prediction is None else prediction.model,
        **{f"metrics.{i}": metric for i, metric in enumerate(scenario.metrics or ())},
    }
    return {key: plugin for key, plugin in places.items() if isinstance(plugin, Plugin)}


def without_plugins(scenario: Scenario) -> Scenario:
    """The scenario with mjnav's own in place of every plug-in but the controller: for ticks that are thrown away."""
    noise, estimation, prediction = scenario.noise, scenario.estimation, scenario.prediction
    kept = {name: channel for name, channel in noise.channels.items() if not isinstance(channel, DistributionPlugin)}
    has_predictor = prediction is not None and isinstance(prediction.model, PredictorPlugin)
    return replace(
        scenario,
        metrics=None,
        prediction=None if has_predictor else prediction,
        people=tuple(
            replace(person, behaviour=ConstantVelocity((0.0, 0.0)))
            if isinstance(person.behaviour, BehaviourPlugin)
            else person
            for person in scenario.people
        ),
        noise=Noise(noise.profile, kept),
        estimation=replace(
            estimation,
            robot=replace(estimation.robot, localizer=None),
            obstacles=replace(estimation.obstacles, tracker=None),
        ),
    )
