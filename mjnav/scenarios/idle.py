"""Values of a run file that have no effect, because another value replaces them.

They are refused before a run. The scenario in a log may have them, so that logs of earlier versions can be read.
"""

from mjnav.errors import InvalidValue
from mjnav.scenarios.latency import Latency
from mjnav.scenarios.spec import Control, Scenario


def refuse_idle(scenario: Scenario) -> None:
    """Raises InvalidValue for the first such value; a default may stand there, as `dumps` writes them all."""
    for key in ("robot", "obstacles"):
        choice = getattr(scenario.estimation, key)
        if choice.source == "direct" and choice.filter != type(choice)().filter:
            raise InvalidValue(f"estimation.{key}.filter", choice.filter, 'no filter where source is "direct"')
    lidar = scenario.sensors.lidar
    if lidar is not None and lidar.mixed and not scenario.sensors.scanner.beam_width:
        raise InvalidValue("sensors.lidar.mixed", lidar.mixed, "no mixed pixels where beam_width is 0")
    robot = scenario.estimation.robot
    if robot.start is not None and robot.source != "lidar" and robot.localizer is None:
        raise InvalidValue("estimation.robot.start", robot.start, 'no start where source is not "lidar"')
    delay, latency = scenario.control.delay, scenario.control.latency
    if latency is None:
        return
    if delay != Control().delay:
        raise InvalidValue("control.delay", delay, "delay or latency, not both")
    if latency.model == "measured" and latency.order != Latency("measured").order:
        raise InvalidValue("control.latency.order", latency.order, 'an order for model "sampled" only')
