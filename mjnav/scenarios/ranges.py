"""The ranges that values of a run file may take."""

from collections.abc import Sized

from mjnav.errors import InvalidValue

Point = tuple[float, float]
MAX_LENGTH = 1e4  # [m], and [rad] for headings: far beyond any room, far within what physics computes with
MIN_SIZE = 1e-3  # [m]
MIN_RATE, MAX_RATE = 0.1, 1000.0  # [Hz]
MAX_TIME = 1e6  # [s], a week and a half
MAX_SEED = 2**63 - 1
MAX_BODIES = 500  # of people, and of walls, tables and pillars each: physics needs seconds a tick for as many people
MAX_POINTS = 1000  # of a route: every metric compares every tick with every leg of it
MAX_LATENCY = 1000.0  # [s], a hundred periods of the slowest loop, as `delay` has
MAX_SPREAD = 1e4  # of noise in the channel's unit: as far as coordinates go
MAX_SAMPLES = 10_000  # of recorded noise: a likelihood costs each of them at each of its thousands of cells


def check_range(key: str, value: float, low: float, high: float, *, open_low: bool = False) -> None:
    """Refuses a value outside [low, high], or outside (low, high] with `open_low`; both bounds are finite."""
    if not ((low < value if open_low else low <= value) and value <= high):
        raise InvalidValue(key, value, f"a number {'>' if open_low else '>='} {_digits(low)} and <= {_digits(high)}")


def check_coordinates(key: str, values: tuple[float, ...]) -> None:
    """Refuses a coordinate that is infinite, not a number or out of the world."""
    if not all(abs(value) <= MAX_LENGTH for value in values):
        raise InvalidValue(key, values, f"finite numbers between -{MAX_LENGTH:g} and {MAX_LENGTH:g}")


def check_size(key: str, value: float) -> None:
    """Refuses a body's size [m] that physics could not handle."""
    check_range(key, value, MIN_SIZE, MAX_LENGTH)


def check_count(key: str, values: Sized, most: int) -> None:
    """Refuses more than `most` values of an array."""
    if len(values) > most:
        raise InvalidValue(key, f"{len(values)} of them", f"at most {most}")


def _digits(value: float) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)
