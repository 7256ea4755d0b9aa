"""Classes of one's own in place of mjnav's: their kinds, how they are named and found, and their parameters.

A plug-in is named as "package.module:Class", as "file.py:Class", or by the name under which an installed package
registers it; Python code may hand over the class or an object itself. A run file and a log hold the name alone: reading
one imports nothing. What is imported is what is about to run.
"""

from mjnav.plugins.entry import (
    BehaviourPlugin,
    DistributionPlugin,
    LocalizerPlugin,
    MetricPlugin,
    Plugin,
    PredictorPlugin,
    TrackerPlugin,
)
from mjnav.plugins.find import (
    CONTROLLER,
    KINDS,
    Given,
    Kind,
    Registered,
    construct,
    find,
    module_of,
    name_of,
    own_parameters,
    parameters_type,
    refuse_clash,
    registered,
)

__all__ = [
    "CONTROLLER",
    "KINDS",
    "BehaviourPlugin",
    "DistributionPlugin",
    "Given",
    "Kind",
    "LocalizerPlugin",
    "MetricPlugin",
    "Plugin",
    "PredictorPlugin",
    "Registered",
    "TrackerPlugin",
    "construct",
    "find",
    "module_of",
    "name_of",
    "own_parameters",
    "parameters_type",
    "refuse_clash",
    "registered",
]
