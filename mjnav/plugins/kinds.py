"""The kinds of plug-ins: what each has to offer, how it is made, and where packages register it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of plug-in. Errors carry `key`, the key of a run file that names one."""

    name: str  # in messages
    key: str
    group: str  # of entry points
    members: tuple[str, ...]  # that a class or an object of this kind has
    made: str  # how a class of it is called

    def is_one(self, thing: Any) -> bool:
        """Whether a class or an object has the members of this kind."""
        return not isinstance(thing, Mapping | set) and all(
            callable(getattr(thing, member, None)) for member in self.members
        )

    @property
    def allowed(self) -> str:
        """What may be named, as messages say it."""
        return f"package.module:Class or file.py:Class, a {self.name}"


CONTROLLER = Kind("controller", "method", "mjnav.controllers", ("decide",), "Class(robot_limits, period, parameters)")
LOCALIZER = Kind("localizer", "", "mjnav.localizers", ("update",), "Class(scenario, seed, parameters)")
TRACKER = Kind("tracker", "", "mjnav.trackers", ("update",), "Class(scenario, seed, parameters)")
BEHAVIOUR = Kind(
    "behaviour", "behaviour", "mjnav.behaviours", ("velocity",), "Class(scenario, person, rng, parameters)"
)
DISTRIBUTION = Kind("distribution", "distribution", "mjnav.distributions", ("sample", "logpdf"), "Class(**parameters)")
PREDICTOR = Kind("predictor", "model", "mjnav.predictors", ("predict",), "Class(scenario, seed, parameters)")
METRIC = Kind("metric", "", "mjnav.metrics", ("measure",), "Class(), or Class(parameters) with a parameters_type")
KINDS = (CONTROLLER, LOCALIZER, TRACKER, PREDICTOR, BEHAVIOUR, DISTRIBUTION, METRIC)
