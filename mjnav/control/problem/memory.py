"""The memory that one decision takes, checked before the first one."""

from typing import Any

from mjnav.errors import InvalidValue

MAX_BYTES = 2e9  # of one decision's arrays
_NUMBER = 8  # [bytes]
# Arrays of the size of the larger one that exist at once: samples of f or of rollouts, their sorted copies.
_COPIES = 2
_SIZES = ("samples", "num_v", "num_omega", "num_components", "rollouts", "steps", "knots")


def check_memory(parameters: Any, braking: int = 0) -> None:
    """Refuses parameters with which one decision takes more than MAX_BYTES of memory.

    Of candidates that is every constraint's samples at each of them, a pair for any two samples of the beliefs; of
    rollouts the samples at every step, `braking` steps after the others. A parameter that the method does not have
    counts once. Raises InvalidValue.
    """
    samples, num_v, num_omega, components, rollouts, steps, knots = (getattr(parameters, key, 1) for key in _SIZES)
    bytes_of = {
        "num_v": _COPIES * _NUMBER * num_v * num_omega * max(samples**2, components),
        "rollouts": _COPIES * _NUMBER * rollouts * max((steps + braking) * samples, knots),
    }
    for key, size in bytes_of.items():
        if size > MAX_BYTES:
            if key == "num_v":
                found = f"{num_v} x {num_omega} candidates, {samples} samples of each belief"
            else:
                tail = f" and {braking} of braking" if braking else ""
                found = f"{rollouts} rollouts of {steps} steps{tail}, {samples} samples of each belief"
            allowed = f"what takes at most {MAX_BYTES / 1e9:g} GB of memory a decision; this takes {size / 1e9:.3g} GB"
            raise InvalidValue(key, found, allowed)
