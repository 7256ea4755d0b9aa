"""Objects that never change: a copy of a simulation shares them with it."""

from typing import Any, Self


class Constant:
    """An object of a class below this one, of which nothing changes after it was made, is its own deep copy."""

    __slots__ = ()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self
