"""The noise that estimators believe in."""

from collections.abc import Mapping

from mjnav.noise import Distribution, profile
from mjnav.scenarios.spec import Scenario


def assumed_noise(scenario: Scenario) -> Mapping[str, Distribution]:
    """The noise that the estimators assume: the world's, unless `assumed_profile` names another."""
    assumed = scenario.estimation.assumed_profile
    return scenario.noise.distributions() if assumed is None else profile(assumed)
