"""What a caller gives to `Simulation.step`."""

from math import isfinite, nan
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.messages import Decision, Status


def given_decision(v: float | Decision, omega: float | None) -> Decision:
    """A decision as it is, or one for the command v [m/s], omega [rad/s].

    Raises InvalidValue for what is not finite, is missing or is too much.
    """
    if isinstance(v, Decision):
        if omega is not None:
            raise InvalidValue("omega", omega, "nothing beside a decision")
        _number("v", v.v, "m/s")
        _number("omega", v.omega, "rad/s")
        return v
    return Decision(_number("v", v, "m/s"), _number("omega", omega, "rad/s"), Status.OK)


def _number(name: str, value: Any, unit: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = nan
    if not isfinite(number):
        raise InvalidValue(name, value, f"a finite number [{unit}]")
    return number
