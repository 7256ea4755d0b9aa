"""How much memory a run takes, estimated before it starts."""

from mjnav.errors import InvalidValue
from mjnav.scenarios.spec import Scenario

MAX_BYTES = 8e9  # what a small machine has
_TICK = 256  # [bytes] of a tick's row in the trajectory: times, poses, controls, timing
_TICK_OF_PERSON = 192  # [bytes] of each person in a tick: truth, belief and its covariance
# [bytes] of a particle, measured with a log: state, weight, prediction, errors, likelihoods, logged data
_PARTICLE = 300


def check_memory(scenario: Scenario) -> None:
    """Raises InvalidValue for a scenario that takes more than MAX_BYTES, with the key that takes most of it."""
    num_people = len(scenario.people)
    robot, obstacles = scenario.estimation.robot.particles, scenario.estimation.obstacles.particles
    ticks = scenario.time_limit * scenario.control.rate
    parts: dict[str, tuple[float, object]] = {
        "time_limit": (
            ticks * (_TICK + _TICK_OF_PERSON * num_people),
            f"{scenario.time_limit:g} s: {ticks:.3g} ticks, {num_people} people",
        ),
        "estimation.robot.particles": (_PARTICLE * robot, robot),
        "estimation.obstacles.particles": (
            _PARTICLE * obstacles * num_people,
            f"{obstacles} for each of {num_people} people",
        ),
    }
    total = sum(size for size, _ in parts.values())
    if total > MAX_BYTES:
        key = max(parts, key=lambda part: parts[part][0])
        allowed = f"what takes at most {MAX_BYTES / 1e9:g} GB of memory in all; this takes {total / 1e9:.3g} GB"
        raise InvalidValue(key, parts[key][1], allowed)
