"""Regular moments of simulated time, counted in steps: noise windows, sensor readings, people's decisions."""

from math import ceil

from mjnav.errors import InvalidValue

NEVER = 2**62  # a step that no run reaches
_ROUNDING = 1e-6  # of a step: below it two moments are the same


def whole_steps(key: str, duration: float, timestep: float) -> int:
    """How many steps `duration` [s] lasts; raises InvalidValue where that is no whole number."""
    steps = duration / timestep
    whole = round(steps)
    if whole < 0 or abs(steps - whole) > _ROUNDING * max(1.0, steps):
        raise InvalidValue(key, duration, f"a whole number of steps of {timestep:g} s")
    return whole


class Grid:
    """The moments 0, T, 2 T, ...; `next` is the step at which the next one falls, the first step not before it."""

    def __init__(self, period: float, timestep: float):
        self._steps_each = max(1.0, period / timestep)
        self._index = 0
        self.next = 0

    def due(self, step: int) -> bool:
        """Whether a moment falls on `step`; each is due once."""
        if step < self.next:
            return False
        self._index += 1
        self.next = self.step_of(self._index)
        return True

    def step_of(self, index: int) -> int:
        """The step at which the moment `index` T falls."""
        return ceil(index * self._steps_each - _ROUNDING)

    def first_from(self, step: int) -> int:
        """The step of the first moment that does not fall before `step`."""
        index = max(int(step / self._steps_each) - 1, 0)
        while self.step_of(index) < step:
            index += 1
        return self.step_of(index)
