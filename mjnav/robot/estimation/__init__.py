"""Estimators: readings in, beliefs out. They see the scenario and the readings, never the truth."""

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Any

from mjnav.robot.estimation.base import Localizer, Tracker, assumed_correlation_times, assumed_noise
from mjnav.robot.estimation.own import BY_SCANS, OwnLocalizer, OwnScanTracker, OwnTracker
from mjnav.scene.spec import Scenario
from mjnav.settings.plugins import LocalizerPlugin, TrackerPlugin

__all__ = ["LOCALIZERS", "TRACKERS", "Localizer", "Tracker", "assumed_noise", "make_localizer", "make_tracker"]

LIDAR = "lidar"  # the source whose estimators are made from a scenario, by their classmethod `of`
MAPPING = "mjnav.robot.estimation.lidar.local_map:MappingLocalizer"  # without a map, whatever the filter
SKIDDING = "mjnav.robot.estimation.particle:SkiddingLocalizer"  # for "pose.particle", of a robot that skids in turns
# "source.filter", or the source alone where it takes no filter -> module:Class
LOCALIZERS: Mapping[str, str] = MappingProxyType(
    {
        "pose.particle": "mjnav.robot.estimation.particle:ParticleLocalizer",
        "pose.ekf": "mjnav.robot.estimation.kalman:KalmanLocalizer",
        "lidar.particle": "mjnav.robot.estimation.lidar.localizer:LidarLocalizer",
        "lidar.ekf": "mjnav.robot.estimation.lidar.scan_matching:ScanMatchingLocalizer",
        "direct": "mjnav.robot.estimation.direct:DirectLocalizer",
    }
)
TRACKERS: Mapping[str, str] = MappingProxyType(
    {
        "detections.particle": "mjnav.robot.estimation.tracker:ParticleTracker",
        "detections.kalman": "mjnav.robot.estimation.tracker:KalmanTracker",
        "detections.rao-blackwell": "mjnav.robot.estimation.tracker:ParticleTracker",  # its particles are such
        "lidar.particle": "mjnav.robot.estimation.lidar.tracker:LidarTracker",
        "lidar.rao-blackwell": "mjnav.robot.estimation.lidar.tracker:LidarTracker",
        "lidar.kalman": "mjnav.robot.estimation.lidar.tracker:KalmanLidarTracker",
        "direct": "mjnav.robot.estimation.direct:DirectTracker",
    }
)


def make_localizer(scenario: Scenario, seed: int) -> Localizer:
    """The robot's estimator that the scenario names, under the run's seed."""
    choice = scenario.estimation.robot
    if isinstance(choice.localizer, LocalizerPlugin):
        return OwnLocalizer(choice.localizer.name, choice.localizer.make(scenario, seed), seed)
    maps = scenario.estimation.map is not None and scenario.estimation.map.source == choice.source == LIDAR
    skids = scenario.robot.base is not None and scenario.robot.base.turn_factor != 1.0
    particles = (choice.source, choice.filter) == ("pose", "particle")
    if maps:
        kind = estimator_class(MAPPING)
    elif skids and particles:
        kind = estimator_class(SKIDDING)
    else:
        kind = _load(LOCALIZERS, choice.source, choice.filter)
    if choice.source == LIDAR:
        return kind.of(scenario, seed)
    lasting = (assumed_correlation_times(scenario),) if particles else ()
    return kind(assumed_noise(scenario), choice.particles, seed, *lasting)


def make_tracker(scenario: Scenario, seed: int) -> Tracker:
    """The people's estimator that the scenario names, under the run's seed."""
    choice = scenario.estimation.obstacles
    radii = tuple(person.radius for person in scenario.people)
    if isinstance(choice.tracker, TrackerPlugin):
        own = choice.tracker.make(scenario, seed)
        if getattr(own, BY_SCANS, False):
            return OwnScanTracker(choice.tracker.name, own, seed)
        return OwnTracker(choice.tracker.name, own, radii, seed)
    kind = _load(TRACKERS, choice.source, choice.filter)
    if choice.source == LIDAR:
        return kind.of(scenario, seed)
    return kind(assumed_noise(scenario), choice.particles, radii, seed)


def estimator_class(place: str) -> Any:
    """The class at "module:Class"."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def _load(registry: Mapping[str, str], source: str, kind: str) -> Any:
    return estimator_class(registry[source if source in registry else f"{source}.{kind}"])
