"""A plug-in as a scenario holds it: a name and the values of its parameters, of which nothing is imported yet."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from difflib import get_close_matches
from functools import partial
from inspect import isclass
from typing import Annotated, Any, ClassVar

from mjnav.config import Beside, settle
from mjnav.errors import InvalidValue
from mjnav.plugins.find import (
    BEHAVIOUR,
    DISTRIBUTION,
    LOCALIZER,
    METRIC,
    PREDICTOR,
    TRACKER,
    Given,
    Kind,
    construct,
    find,
    name_of,
    own_parameters,
    parameters_type,
    placed,
    refuse_clash,
    registered,
)

NUMBER = "count"  # key of a person in a run file that says how many are drawn


@dataclass(frozen=True, slots=True)
class Plugin:
    """A plug-in of one kind; its own parameters stand beside its name."""

    name: Annotated[str, "package.module:Class, file.py:Class, or a name that a package registers"]
    parameters: Annotated[Mapping[str, object], Beside()] = field(default_factory=dict)

    kind: ClassVar[Kind]

    def __post_init__(self):
        object.__setattr__(self, "name", self._place(name_of(self.name)))
        settle(self)

    @classmethod
    def of(cls, value: Any) -> Any:
        """The plug-in that a name, a class or an object stands for; any other value as it is."""
        if isinstance(value, str):
            return cls(value)
        return cls(Given(value)) if cls.serves(value) else value

    @classmethod
    def serves(cls, value: Any) -> bool:
        """Whether a value is a class or an object that may be of this kind, or its name."""
        if isinstance(value, str):
            return ":" in value or value in registered(cls.kind)
        return isclass(value) or cls.kind.is_one(value)

    def make(self, *arguments: Any) -> Any:
        """The object: of a class an instance that is made with `arguments` and its parameters.

        Raises InvalidValue, whose key is that of a parameter where it lies there.
        """
        found = find(self.kind, self.name, {})
        if not isclass(found):
            for key, value in self.parameters.items():
                raise InvalidValue(key, value, f"no parameters beside {self.name}, which is no class")
            return found
        return self._made(found, *arguments)

    def _made(self, found: Any, *arguments: Any) -> Any:
        kind = parameters_type(self.kind, self.name, found, object)
        if kind is object:
            for key in self.parameters:
                raise InvalidValue(key, key, f"no parameters beside {self.name}, which has none")
            return self._made_without(found, *arguments)
        own = construct(self.kind, self.name, partial(own_parameters, self.name, kind, self.parameters, {}))
        return construct(self.kind, self.name, found, *arguments, own)

    def _made_without(self, found: Any, *arguments: Any) -> Any:
        """An instance of a class that has no parameters."""
        return construct(self.kind, self.name, found, *arguments, None)

    def _place(self, name: str) -> str:
        """A name with its place: a file's absolute path, or a package's module; a log is then read without the package.

        Raises InvalidValue for a name that is none.
        """
        if ":" in name:
            return placed(name)
        refuse_clash(self.kind, name, ())
        entries = registered(self.kind)
        if name not in entries:
            known = f", or a registered name: {', '.join(sorted(entries))}" if entries else ""
            nearest = get_close_matches(name, entries, n=1)
            raise InvalidValue(self.kind.key, name, self.kind.allowed + known, nearest=nearest[0] if nearest else None)
        return entries[name][0].place


class LocalizerPlugin(Plugin):
    """A localizer of one's own: its name, and its parameters beside it."""

    __slots__ = ()
    kind = LOCALIZER


class TrackerPlugin(Plugin):
    """A tracker of one's own: its name, and its parameters beside it."""

    __slots__ = ()
    kind = TRACKER


class PredictorPlugin(Plugin):
    """A predictor of one's own: its name under `model`, and its parameters beside it."""

    __slots__ = ()
    kind = PREDICTOR


class BehaviourPlugin(Plugin):
    """A behaviour of one's own: its name under `behaviour`, and its parameters beside it.

    None of them may be called `count`, which says in a run file how many people an entry draws.
    """

    __slots__ = ()
    kind = BEHAVIOUR

    def _made(self, found: Any, *arguments: Any) -> Any:
        parameters = parameters_type(self.kind, self.name, found, object)
        if is_dataclass(parameters) and NUMBER in (field.name for field in fields(parameters)):
            allowed = f"parameters that are not called {NUMBER}, which says how many people are drawn"
            raise InvalidValue("behaviour", self.name, allowed)
        return super()._made(found, *arguments)


class MetricPlugin(Plugin):
    """A metric of one's own: its name, and its parameters beside it."""

    __slots__ = ()
    kind = METRIC

    def _made_without(self, found: Any, *arguments: Any) -> Any:
        return construct(self.kind, self.name, found)


class DistributionPlugin(Plugin):
    """A distribution of one's own: its name under `distribution`, and its parameters beside it.

    Its class is the dataclass of its parameters, as those of mjnav's distributions are.
    """

    __slots__ = ()
    kind = DISTRIBUTION

    def _made(self, found: Any, *arguments: Any) -> Any:
        return construct(self.kind, self.name, partial(own_parameters, self.name, found, self.parameters, {}))
