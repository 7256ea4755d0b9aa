"""Plug-ins: classes of a user's own in place of mjnav's. Their kinds, how they are named, found and made.

A plug-in is named as "package.module:Class", as "file.py:Class", or by the name under which an installed package
registers it; Python code may hand over the class or an object itself. A run file and a log hold the name alone: reading
one imports nothing. Names of registered plug-ins are read from the packages' metadata. A plug-in is imported when it is
about to run.

While the module of a plug-in is imported, one more folder is searched, and searched last, so that it hides no other
module: the working folder for "package.module", the file's own for "file.py". So a module imports its neighbours at its
top, not inside a function; a package may import its own parts anywhere.
"""

import hashlib
import inspect
import os
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, is_dataclass
from difflib import get_close_matches
from functools import cache, partial
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Annotated, Any, ClassVar, TypeVar

from mjnav.errors import InputError, InvalidValue, own_code, said, unknown_name
from mjnav.settings import Beside, below, keys, settle

P = TypeVar("P")

# ---------------------------------------------------------------------------------------------- kinds


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of plug-in. Errors carry `key`, the key of a run file that names one."""

    name: str  # in messages
    key: str
    group: str  # of entry points
    members: tuple[str, ...]  # that a class or an object of this kind has
    made: str = "Class(scenario, seed, parameters)"  # how a class of it is called

    def is_one(self, thing: Any) -> bool:
        """Whether a class or an object has the members of this kind."""
        return not isinstance(thing, Mapping | set) and all(
            callable(getattr(thing, member, None)) for member in self.members
        )

    @property
    def allowed(self) -> str:
        """What may be named, as messages say it."""
        return f"package.module:Class or file.py:Class, a {self.name}"


CONTROLLER = Kind("controller", "method", "mjnav.controllers", ("decide",), "Class(robot_limits, period, parameters)")
LOCALIZER = Kind("localizer", "", "mjnav.localizers", ("update",))
TRACKER = Kind("tracker", "", "mjnav.trackers", ("update",))
PREDICTOR = Kind("predictor", "model", "mjnav.predictors", ("predict",))
BEHAVIOUR = Kind(
    "behaviour", "behaviour", "mjnav.behaviours", ("velocity",), "Class(scenario, person, rng, parameters)"
)
DISTRIBUTION = Kind("distribution", "distribution", "mjnav.distributions", ("sample", "logpdf"), "Class(**parameters)")
METRIC = Kind("metric", "", "mjnav.metrics", ("measure",), "Class(), or Class(parameters) with a parameters_type")
KINDS = (CONTROLLER, LOCALIZER, TRACKER, PREDICTOR, BEHAVIOUR, DISTRIBUTION, METRIC)


# ---------------------------------------------------------------------------------------------- names


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
        named = _class_of(thing)
        name = super().__new__(cls, f"{named.__module__}:{named.__qualname__}{'' if named is thing else '()'}")
        name.thing = thing
        return name

    def text(self) -> str:
        """The Python text of the class or function, as far as Python has kept it."""
        named = _class_of(self.thing)
        texts = []
        for part in (named, *vars(named).values()):
            with suppress(OSError, TypeError):  # no file, no function
                texts.append(inspect.getsource(part))
        return "\n".join(texts)

    def __reduce__(self):
        return Given, (self.thing,)

    def __deepcopy__(self, memo: dict[int, Any]) -> "Given":
        return self  # a scenario that is copied names the same object


def name_of(thing: Any) -> str:
    """A name as it is; of a class or an object, a `Given`."""
    return thing if isinstance(thing, str) else Given(thing)


def _class_of(thing: Any) -> Any:
    """The class or function itself; of an object its class."""
    return thing if inspect.isclass(thing) or inspect.isroutine(thing) else type(thing)


def placed(name: str, folder: str | os.PathLike[str] = "") -> str:
    """A name "file.py:Class" with the file's absolute path, where it lies in `folder`; others as they are.

    A scenario holds such names: they mean the same file when a plug-in has changed the working folder.
    """
    file, colon, own = name.rpartition(":")
    path = os.path.join(folder, file)
    if not (colon and _is_file(file)) or os.path.isabs(file) or not os.path.isfile(path):
        return name
    return f"{os.path.abspath(path)}:{own}"


@dataclass(frozen=True, slots=True)
class Registered:
    """What a package registers under a name: the place of the class, "package.module:Class", and the package."""

    place: str
    owner: str  # the package and its version


def registered(kind: Kind) -> Mapping[str, tuple[Registered, ...]]:
    """All that is registered of a kind, by name; more than one under a name is a clash."""
    return _registered(kind.group, tuple(sys.path))


@cache
def _registered(group: str, path: tuple[str, ...]) -> Mapping[str, tuple[Registered, ...]]:
    by_name: dict[str, tuple[Registered, ...]] = {}
    for point in entry_points(group=group):
        owner = f"{point.dist.name} {point.dist.version}" if point.dist is not None else "an unknown package"
        entry = Registered(point.value.replace(" ", ""), owner)
        by_name[point.name] = tuple(sorted((*by_name.get(point.name, ()), entry), key=lambda one: one.owner))
    return MappingProxyType(dict(sorted(by_name.items())))


def registered_place(kind: Kind, name: str, shipped: Collection[str]) -> str | None:
    """The place that a package registers under `name`; None for names that no package, or only mjnav, has.

    Raises InvalidValue where more than one registers it, mjnav with its `shipped` names among them.
    """
    entries = registered(kind).get(name, ())
    owners = ["mjnav"] * (name in shipped) + [entry.owner for entry in entries]
    if len(owners) > 1:
        names = " and ".join(owners)
        allowed = f"a {kind.name} that one package registers, not {names}; package.module:Class names one"
        raise InvalidValue(kind.key, name, allowed)
    return entries[0].place if entries else None


# -------------------------------------------------------------------------------------------- modules


def _is_file(module: str) -> bool:
    """Whether the part of a name before ":" is a file's."""
    return module.endswith(".py")


def imported(module: str) -> ModuleType:
    """The module "package.module" or "file.py", from its first import on the same. Raises what its code raises."""
    if not _is_file(module):
        with _also_searched(""):
            return import_module(module)
    name, path = _file_module(module), os.path.abspath(module)
    if name in sys.modules:
        return sys.modules[name]
    spec = spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{module} is no Python file")
    made = sys.modules[name] = module_from_spec(spec)  # where dataclasses look up the types of their fields
    try:
        with _also_searched(os.path.dirname(path)):
            spec.loader.exec_module(made)
    except BaseException:
        sys.modules.pop(name, None)
        raise
    return made


def module_of(kind: Kind, name: str) -> ModuleType | None:
    """The module behind a plug-in, where it has been imported; None for names of mjnav's own."""
    if ":" in name:
        module = name.rpartition(":")[0]
    else:
        entries = registered(kind).get(name, ())
        module = entries[0].place.partition(":")[0] if len(entries) == 1 else ""
    return sys.modules.get(_file_module(module) if _is_file(module) else module)


def _file_module(file: str) -> str:
    """The name in `sys.modules` of a file's module: two files of one name in two folders are two modules."""
    path = os.path.realpath(file)
    return f"{Path(path).stem.replace('.', '_')}@{hashlib.sha256(os.fsencode(path)).hexdigest()[:8]}"


@contextmanager
def _also_searched(folder: str) -> Iterator[None]:
    if folder in sys.path:  # "" is an interactive interpreter's own
        yield
        return
    sys.path.append(folder)
    try:
        yield
    finally:
        with suppress(ValueError):  # the module may have changed the path too
            sys.path.remove(folder)


# --------------------------------------------------------------------------- from a name to an object


def find(kind: Kind, name: str, shipped: Collection[str] = ()) -> Any:
    """The class under `name`, or the object that Python code gave; not for `shipped` names, which errors list.

    Raises InputError where there is no such plug-in, where it cannot be imported, and where it is none of this kind.
    """
    if isinstance(name, Given):
        thing = name.thing
    elif ":" in name:
        thing = _at(kind, name, name)
    else:
        place = registered_place(kind, name, shipped)
        if place is None:
            also = "file.py:Class, package.module:Class"
            raise unknown_name(kind.key, name, [*shipped, *registered(kind)], also=also)
        thing = _at(kind, name, place, f"{registered(kind)[name][0].owner}, {place}: ")
    missing = [member for member in kind.members if not callable(getattr(thing, member, None))]
    if inspect.ismodule(thing) or inspect.isroutine(thing) or missing or inspect.isabstract(thing):
        lacks = sorted({*missing, *getattr(thing, "__abstractmethods__", ())})
        raise InvalidValue(kind.key, name, f"{kind.allowed}, which has {' and '.join(lacks or kind.members)}")
    return thing


def _at(kind: Kind, name: str, place: str, owner: str = "") -> Any:
    """What stands at a place, "package.module:Class" or "file.py:Class", which messages call `name`."""
    module_name, _, own = place.rpartition(":")
    if module_name == "__main__" or own.endswith("()") or "<" in own or "." in own:
        allowed = f"the {kind.name} itself, handed over in Python: this name does not lead to what was run"
        raise InvalidValue(kind.key, name, allowed)
    by_file = _is_file(module_name)
    if not own.isidentifier() or not (by_file or all(part.isidentifier() for part in module_name.split("."))):
        raise InvalidValue(kind.key, name, kind.allowed)
    if by_file and not Path(module_name).exists():
        raise InvalidValue(kind.key, name, "a Python file that exists", nearest=_nearest_file(module_name, own))
    with own_code(lambda error: _failed(kind, name, error, f"a module that can be imported ({owner}")):
        module = imported(module_name)
    if not hasattr(module, own):
        classes = inspect.getmembers(module, inspect.isclass)
        offered = [other for other, cls in classes if cls.__module__ == module.__name__ and kind.is_one(cls)]
        raise unknown_name(kind.key, name, [f"{module_name}:{other}" for other in offered])
    return getattr(module, own)


def _nearest_file(file: str, own: str) -> str | None:
    """The plug-in of the file beside it whose name is most like that of one that does not exist."""
    try:
        siblings = [str(other) for other in Path(file).parent.glob("*.py")]
    except (OSError, ValueError):
        return None
    close = get_close_matches(str(Path(file)), siblings, n=1, cutoff=0.75)
    return f"{close[0]}:{own}" if close else None


def construct(kind: Kind, name: str, found: Any, *arguments: Any) -> Any:
    """An instance of the class `found` under `name`. Raises InputError where its constructor raises."""
    with own_code(lambda error: _failed(kind, name, error, f"{kind.allowed}, made as {kind.made} ("), InvalidValue):
        return found(*arguments)


def _failed(kind: Kind, name: str, error: BaseException, allowed: str) -> InputError:
    """The error for a plug-in whose own code raised `error`; its name is not at fault where a file cannot be opened."""
    if isinstance(error, OSError) and error.filename is not None:
        return InputError(f"the {kind.name} {name} cannot open {str(error.filename)!r}: {error.strerror}")
    return InvalidValue(kind.key, name, f"{allowed}{said(error)})")


def parameters_type(kind: Kind, name: str, found: Any, base: type[P]) -> type[P]:
    """The dataclass, below `base`, that the class `found` says its parameters are; `base` where it says none.

    Raises InvalidValue for anything else.
    """
    own = getattr(found, "parameters_type", base)
    if own is base is object:
        return own
    if not (inspect.isclass(own) and is_dataclass(own) and issubclass(own, base)):
        below_base = "" if base is object else f" below {base.__name__}"
        raise InvalidValue(kind.key, name, f"{kind.allowed}, whose parameters_type is a dataclass{below_base}")
    return own


def own_parameters(what: str, kind: type[P], values: Mapping[str, Any], preset: Mapping[str, Any]) -> P:
    """The parameters of `what` from a file's values over a preset's, of which it takes those that it has.

    `kind` is their dataclass. Raises InvalidValue for names that it does not have and for wrong types.
    """
    known, arguments = keys(kind), {key: value for key, value in preset.items() if key in keys(kind)}
    for key, value in values.items():
        if key not in known:
            raise unknown_name(key, key, known, what=f"parameters of {what}")
        with below(key):
            arguments[key] = known[key].type.read(value)
    return kind(**arguments)


# ------------------------------------------------------------------------------ plug-ins of a scenario


@dataclass(frozen=True, slots=True)
class Plugin:
    """A plug-in as a scenario holds it: its name and its own parameters beside it, of which nothing is imported yet."""

    name: Annotated[str, "package.module:Class, file.py:Class, or a name that a package registers"]
    parameters: Annotated[Mapping[str, object], Beside()] = field(default_factory=dict)

    kind: ClassVar[Kind]

    def __post_init__(self):
        object.__setattr__(self, "name", self._with_place(name_of(self.name)))
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
        return inspect.isclass(value) or cls.kind.is_one(value)

    def make(self, *arguments: Any) -> Any:
        """The object: of a class an instance that is made with `arguments` and its parameters, or None without any.

        Raises InvalidValue, whose key is that of a parameter where it lies there.
        """
        cls = find(self.kind, self.name)
        if not inspect.isclass(cls):
            self._refuse_parameters("which is no class")
            return cls
        kind = parameters_type(self.kind, self.name, cls, object)
        if kind is object:
            self._refuse_parameters("which has none")
            return construct(self.kind, self.name, cls, *arguments, *([None] if arguments else []))
        parameters = construct(self.kind, self.name, partial(own_parameters, self.name, kind, self.parameters, {}))
        return construct(self.kind, self.name, cls, *arguments, parameters)

    def _refuse_parameters(self, reason: str) -> None:
        for key, value in self.parameters.items():
            raise InvalidValue(key, value, f"no parameters beside {self.name}, {reason}")

    def _with_place(self, name: str) -> str:
        """A name with its place: a file's absolute path, or a package's module; a log is then read without the package.

        Raises InvalidValue for a name that is none.
        """
        if ":" in name:
            return placed(name)
        place = registered_place(self.kind, name, ())
        if place is None:
            names = registered(self.kind)
            known = f", or a registered name: {', '.join(names)}" if names else ""
            nearest = get_close_matches(name, names, n=1)
            raise InvalidValue(self.kind.key, name, self.kind.allowed + known, nearest=nearest[0] if nearest else None)
        return place


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
    walk, heeds_robot = "pedestrians:OwnWalk", True  # as of every behaviour, in `mjnav.scene.people`

    def make(self, *arguments: Any) -> Any:
        """See `Plugin`."""
        parameters = getattr(find(self.kind, self.name), "parameters_type", None)
        if is_dataclass(parameters) and "count" in keys(parameters):
            allowed = "parameters that are not called count, which says how many people are drawn"
            raise InvalidValue("behaviour", self.name, allowed)
        return super().make(*arguments)


class MetricPlugin(Plugin):
    """A metric of one's own: its name, and its parameters beside it."""

    __slots__ = ()
    kind = METRIC


class DistributionPlugin(Plugin):
    """A distribution of one's own: its name under `distribution`, and its parameters beside it.

    Its class is the dataclass of its parameters, as those of mjnav's distributions are.
    """

    __slots__ = ()
    kind = DISTRIBUTION

    def make(self, *arguments: Any) -> Any:
        """See `Plugin`."""
        cls = find(self.kind, self.name)
        if not inspect.isclass(cls):
            return super().make()
        return construct(self.kind, self.name, partial(own_parameters, self.name, cls, self.parameters, {}))
