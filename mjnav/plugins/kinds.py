"""The kinds of plug-ins: what each has to offer, how it is made, and where packages register it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of plug-in. Errors carry `key`, the key of a run file that names one."""

    name: str  # in messages
    key: str
    group: str  # of entry points
    members: tuple[str, ...]  # that a class or an object of this kind has
    made: str  # how a class of it is called
    function: bool = False  # a function serves too

    @property
    def allowed(self) -> str:
        """What may be named, as messages say it."""
        return f"package.module:Class or file.py:Class, a {self.name}"


CONTROLLER = Kind("controller", "method", "mjnav.controllers", ("decide",), "Class(robot_limits, period, parameters)")
KINDS = (CONTROLLER,)
