"""What is loaded before a run, so that no tick of it has to wait."""

from contextlib import suppress
from dataclasses import replace
from itertools import count

from mjnav.control import names
from mjnav.geometry.compiled import load_kernels
from mjnav.loop.episode import Episode
from mjnav.loop.faults.fault import RunFault
from mjnav.scenarios.plugged import without_plugins
from mjnav.scenarios.spec import Scenario

WARM_UP_TICKS = 3
METHOD = "rkhs"  # takes the place of a user's own controller: no object of a user's sees ticks of no run


def warm_up(scenario: Scenario) -> None:
    """Loads every kernel that a run of this scenario can call, and runs ticks that are thrown away.

    The kernels are those of all modules that a run has imported when it begins, for the types that each declares. Each
    of the ticks has a reading, so that nothing that a tick can do is left for the second reading of the run.
    """
    sensors = replace(scenario.sensors, rate=scenario.control.rate)
    scenario = without_plugins(replace(scenario, sensors=sensors))
    if scenario.control.method not in names():
        scenario = replace(scenario, control=replace(scenario.control, method=METHOD, parameters={}))
    with suppress(RunFault):  # the run itself will report, and log, what is wrong
        asked = count()
        episode = Episode(scenario, stop=lambda: next(asked) >= WARM_UP_TICKS, cones=True)
        load_kernels()
        episode.run()
