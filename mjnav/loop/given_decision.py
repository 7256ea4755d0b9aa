"""What a caller gives to `Simulation.step`, and what a controller returns."""

from mjnav.errors import InvalidValue
from mjnav.messages import CandidateCosts, Decision, PlanShown, Status, number


def given_decision(v: float | Decision, omega: float | None) -> Decision:
    """A decision as it is, or one for the command v [m/s], omega [rad/s].

    Raises InvalidValue for what is not finite, is missing or is too much.
    """
    if not isinstance(v, Decision):
        return Decision(number("v", v, "m/s"), number("omega", omega, "rad/s"), Status.OK)
    if omega is not None:
        raise InvalidValue("omega", omega, "nothing beside a decision")
    return checked_decision(v)


def checked_decision(decision: Decision) -> Decision:
    """The decision. Raises InvalidValue where its command is not finite or another part is of another type."""
    number("v", decision.v, "m/s")
    number("omega", decision.omega, "rad/s")
    if not isinstance(decision.status, Status):
        raise InvalidValue("status", decision.status, f"a Status: {', '.join(Status.__members__)}")
    for key, kind in (("costs", CandidateCosts), ("plan", PlanShown)):
        if not isinstance(getattr(decision, key), kind | None):
            raise InvalidValue(key, getattr(decision, key), f"{kind.__name__} or None")
    return decision
