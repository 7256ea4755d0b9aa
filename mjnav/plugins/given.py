"""Classes and objects that Python code hands over in place of a name."""

import inspect
from contextlib import suppress
from typing import Any


class Given(str):
    """The name of a class or an object that Python code handed over, with the thing itself.

    To all that reads, writes and compares scenarios it is a name: "module:Class", with "()" behind it for an object.
    `find` takes `thing`. The name alone, as a log has it, does not lead back to an object, nor to a class of a script
    or a notebook: those have to be given again.
    """

    thing: Any

    def __new__(cls, thing: Any) -> "Given":
        """The name of `thing`; a Given stays as it is."""
        if isinstance(thing, Given):
            return thing
        kind = _kind(thing)
        name = super().__new__(cls, f"{kind.__module__}:{kind.__qualname__}{'' if kind is thing else '()'}")
        name.thing = thing
        return name

    def text(self) -> str:
        """The Python text of the class or function, as far as Python has kept it."""
        kind = _kind(self.thing)
        found = []
        for part in (kind, *vars(kind).values()):
            with suppress(OSError, TypeError):  # no file, no function
                found.append(inspect.getsource(part))
        return "\n".join(found)

    def __reduce__(self):
        return Given, (self.thing,)

    def __deepcopy__(self, memo: dict[int, Any]) -> "Given":
        return self  # a scenario that is copied names the same object


def name_of(thing: Any) -> str:
    """A name as it is; of a class or an object, a `Given`."""
    return thing if isinstance(thing, str) else Given(thing)


def _kind(thing: Any) -> Any:
    """The class or function itself; of an object its class."""
    return thing if inspect.isclass(thing) or inspect.isroutine(thing) else type(thing)
