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
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, is_dataclass
from difflib import get_close_matches
from functools import cache, partial
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Annotated, Any, ClassVar, TypeVar

from mjnav.errors import InputError, InvalidValue, own_code, said, unknown_name
from mjnav.settings import Beside, keys, read, settle

T = TypeVar("T")

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


def placed(part: Any, folder: str | os.PathLike[str] = "") -> Any:
    """A name "file.py:Class" with the file's absolute path, where it lies in `folder`; others as they are.

    Of tables and lists, all names in them. A scenario holds such names: they mean the same file when a plug-in has
    changed the working folder.
    """
    if isinstance(part, dict):
        return {key: placed(item, folder) for key, item in part.items()}
    if isinstance(part, list):
        return [placed(item, folder) if isinstance(item, str | dict) else item for item in part]
    if not isinstance(part, str):
        return part
    file, colon, class_name = part.rpartition(":")
    path = os.path.join(folder, file)
    if not (colon and _is_file(file)) or os.path.isabs(file) or not os.path.isfile(path):
        return part
    return f"{os.path.abspath(path)}:{class_name}"


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


# ----------------------------------------------------------------------------------- kinds of plug-ins


@dataclass(frozen=True, slots=True)
class Plugin:
    """A plug-in as a scenario holds it: its name and its own parameters beside it, of which nothing is imported yet."""

    name: Annotated[str, "package.module:Class, file.py:Class, or a name that a package registers"]
    parameters: Annotated[Mapping[str, object], Beside()] = field(default_factory=dict)

    noun: ClassVar[str]  # of its kind, in messages; packages register those of a kind in the group "mjnav.<noun>s"
    key: ClassVar[str] = ""  # of a run file, under which a name stands
    methods: ClassVar[tuple[str, ...]]  # that a class or an object of this kind has
    made: ClassVar[str] = "Class(scenario, seed, parameters)"  # how a class of it is called

    def __post_init__(self):
        object.__setattr__(self, "name", self._with_place(name_of(self.name)))
        settle(self)

    @classmethod
    def allowed(cls) -> str:
        """What may be named, as messages say it."""
        return f"package.module:Class or file.py:Class, a {cls.noun}"

    @classmethod
    def has_methods(cls, thing: Any) -> bool:
        """Whether a class or an object may be a plug-in of this kind."""
        return not isinstance(thing, Mapping | set) and not _missing(cls, thing)

    @classmethod
    def of(cls, value: Any) -> Any:
        """The plug-in that a name, a class or an object stands for; any other value as it is."""
        return cls(value) if isinstance(value, str) else cls(Given(value)) if cls.serves(value) else value

    @classmethod
    def serves(cls, value: Any) -> bool:
        """Whether a value is a class or an object that may be of this kind, or its name."""
        if isinstance(value, str):
            return ":" in value or value in registered(cls)
        return inspect.isclass(value) or cls.has_methods(value)

    def make(self, *arguments: Any) -> Any:
        """The object: of a class an instance that is made with `arguments` and its parameters, or None without any.

        Raises InvalidValue, whose key is that of a parameter where it lies there.
        """
        made = partial(construct, type(self), self.name)
        thing = find(type(self), self.name)
        kind = parameters_type(type(self), self.name, thing) if inspect.isclass(thing) else None
        if kind is None:
            for key, value in self.parameters.items():
                raise InvalidValue(key, value, f"no parameters beside {self.name}, which has none")
            return made(thing, *arguments, *([None] if arguments else [])) if inspect.isclass(thing) else thing
        return made(thing, *arguments, made(own_parameters, self.name, kind, self.parameters))

    def _with_place(self, name: str) -> str:
        """A name with its place: a file's absolute path, or a package's module; a log is then read without the package.

        Raises InvalidValue for a name that is none.
        """
        if ":" in name:
            return placed(name)
        place = registered_place(type(self), name)
        if place is None:
            names = registered(type(self))
            allowed = self.allowed() + (f", or a registered name: {', '.join(names)}" if names else "")
            nearest = next(iter(get_close_matches(name, names, n=1)), None)
            raise InvalidValue(self.key, name, allowed, nearest=nearest)
        return place


class ControllerPlugin(Plugin):
    """A controller of one's own. A scenario holds its name and parameters in [control], as those of mjnav's methods."""

    __slots__ = ()
    noun, key, methods = "controller", "method", ("decide",)
    made = "Class(robot_limits, period, parameters)"


class LocalizerPlugin(Plugin):
    """A localizer of one's own: its name, and its parameters beside it."""

    __slots__ = ()
    noun, methods = "localizer", ("update",)


class TrackerPlugin(Plugin):
    """A tracker of one's own: its name, and its parameters beside it."""

    __slots__ = ()
    noun, methods = "tracker", ("update",)


class PredictorPlugin(Plugin):
    """A predictor of one's own: its name under `model`, and its parameters beside it."""

    __slots__ = ()
    noun, key, methods = "predictor", "model", ("predict",)


class BehaviourPlugin(Plugin):
    """A behaviour of one's own: its name under `behaviour`, and its parameters beside it.

    None of them may be called `count`, which says in a run file how many people an entry draws.

    One is made for each person who has it. `person` is the person's place in `scenario.people` and in the arrays of a
    WorldState, `rng` a generator of its own that follows from the run's seed: who draws from no other walks the same
    way under the same seed.

    `velocity(world)` is the desired velocity (vx, vy) [m/s], at most 5 m/s; asked every 0.02 s of simulated time.
    `world` is the truth, whose arrays cannot be written to. The robot's pose and twist are NaN for a person with
    `sees_robot = false`, and people who are not there have NaN; they are not asked. Walls and bodies stop who walks
    into them.
    """

    __slots__ = ()
    noun, key, methods = "behaviour", "behaviour", ("velocity",)
    made = "Class(scenario, person, rng, parameters)"
    walk, heeds_robot = "pedestrians:OwnWalk", True  # as of every behaviour, in `mjnav.scene.people`

    def make(self, *arguments: Any) -> Any:
        """See `Plugin`."""
        parameters = getattr(find(type(self), self.name), "parameters_type", None)
        if is_dataclass(parameters) and "count" in keys(parameters):
            allowed = "parameters that are not called count, which says how many people are drawn"
            raise InvalidValue(self.key, self.name, allowed)
        return super().make(*arguments)


class MetricPlugin(Plugin):
    """A metric of one's own: its name, and its parameters beside it."""

    __slots__ = ()
    noun, methods = "metric", ("measure",)
    made = "Class(), or Class(parameters) with a parameters_type"


class DistributionPlugin(Plugin):
    """A distribution of one's own: its name under `distribution`, and its parameters beside it.

    Its class is the dataclass of its parameters, as those of mjnav's distributions are.
    """

    __slots__ = ()
    noun, key, methods = "distribution", "distribution", ("sample", "logpdf")
    made = "Class(**parameters)"

    def make(self, *arguments: Any) -> Any:
        """See `Plugin`."""
        thing = find(type(self), self.name)
        if not inspect.isclass(thing):
            return super().make()
        return construct(type(self), self.name, own_parameters, self.name, thing, self.parameters)


KINDS: tuple[type[Plugin], ...] = (
    ControllerPlugin, LocalizerPlugin, TrackerPlugin, PredictorPlugin, BehaviourPlugin, DistributionPlugin, MetricPlugin
)  # fmt: skip


# --------------------------------------------------------------------------- what packages register


def registered(kind: type[Plugin]) -> Mapping[str, tuple[EntryPoint, ...]]:
    """All that is registered of a kind, by name; more than one under a name is a clash."""
    return _registered(f"mjnav.{kind.noun}s", tuple(sys.path))


@cache
def _registered(group: str, path: tuple[str, ...]) -> Mapping[str, tuple[EntryPoint, ...]]:
    points = entry_points(group=group)
    return MappingProxyType({name: tuple(sorted(points.select(name=name), key=owner)) for name in sorted(points.names)})


def owner(point: EntryPoint) -> str:
    """The package that registers a name, and its version."""
    return f"{point.dist.name} {point.dist.version}" if point.dist is not None else "an unknown package"


def registered_place(kind: type[Plugin], name: str, shipped: Collection[str] = ()) -> str | None:
    """The place that a package registers under `name`; None for names that no package, or only mjnav, has.

    Raises InvalidValue where more than one registers it, mjnav with its `shipped` names among them.
    """
    points = registered(kind).get(name, ())
    owners = ["mjnav"] * (name in shipped) + [owner(point) for point in points]
    if len(owners) > 1:
        names = " and ".join(owners)
        allowed = f"a {kind.noun} that one package registers, not {names}; package.module:Class names one"
        raise InvalidValue(kind.key, name, allowed)
    return points[0].value.replace(" ", "") if points else None


def module_of(kind: type[Plugin], name: str) -> ModuleType | None:
    """The module behind a plug-in, where it has been imported; None for names of mjnav's own."""
    points = registered(kind).get(name, ())
    module = name.rpartition(":")[0] if ":" in name else points[0].module if len(points) == 1 else ""
    return sys.modules.get(_file_module(module) if _is_file(module) else module)


# --------------------------------------------------------------------------- from a name to an object


def find(kind: type[Plugin], name: str, shipped: Collection[str] = ()) -> Any:
    """The class under `name`, or the object that Python code gave; not for `shipped` names, which errors list.

    Raises InputError where there is no such plug-in, where it cannot be imported, and where it is none of this kind.
    """
    if isinstance(name, Given):
        thing = name.thing
    else:
        place = name if ":" in name else registered_place(kind, name, shipped)
        if place is None:
            also = "file.py:Class, package.module:Class"
            raise unknown_name(kind.key, name, [*shipped, *registered(kind)], also=also)
        thing = _at(kind, name, place)
    missing = _missing(kind, thing)
    if inspect.ismodule(thing) or inspect.isroutine(thing) or missing or inspect.isabstract(thing):
        lacks = sorted({*missing, *getattr(thing, "__abstractmethods__", ())})
        raise InvalidValue(kind.key, name, f"{kind.allowed()}, which has {' and '.join(lacks or kind.methods)}")
    return thing


def _missing(kind: type[Plugin], thing: Any) -> list[str]:
    """The methods of a kind that a class or an object lacks."""
    return [method for method in kind.methods if not callable(getattr(thing, method, None))]


def _at(kind: type[Plugin], name: str, place: str) -> Any:
    """What stands at a place, "package.module:Class" or "file.py:Class", which messages call `name`."""
    module_name, _, class_name = place.rpartition(":")
    if module_name == "__main__" or class_name.endswith("()") or "<" in class_name or "." in class_name:
        allowed = f"the {kind.noun} itself, handed over in Python: this name does not lead to what was run"
        raise InvalidValue(kind.key, name, allowed)
    by_file = _is_file(module_name)
    if not class_name.isidentifier() or not (by_file or all(part.isidentifier() for part in module_name.split("."))):
        raise InvalidValue(kind.key, name, kind.allowed())
    if by_file and not Path(module_name).exists():
        raise InvalidValue(kind.key, name, "a Python file that exists")
    registered_by = "" if place == name else f"{owner(registered(kind)[name][0])}, {place}: "
    with own_code(lambda error: _failed(kind, name, error, f"a module that can be imported ({registered_by}")):
        module = imported(module_name)
    if not hasattr(module, class_name):
        classes = inspect.getmembers(module, inspect.isclass)
        offered = [other for other, cls in classes if cls.__module__ == module.__name__ and kind.has_methods(cls)]
        raise unknown_name(kind.key, name, [f"{module_name}:{other}" for other in offered])
    return getattr(module, class_name)


def construct(kind: type[Plugin], name: str, call: Callable[..., T], *arguments: Any) -> T:
    """What a call of the code of the plug-in `name` makes. Raises InputError where that raises."""
    with own_code(lambda error: _failed(kind, name, error, f"{kind.allowed()}, made as {kind.made} ("), InvalidValue):
        return call(*arguments)


def _failed(kind: type[Plugin], name: str, error: BaseException, allowed: str) -> InputError:
    """The error for a plug-in whose own code raised `error`; its name is not at fault where a file cannot be opened."""
    if isinstance(error, OSError) and error.filename is not None:
        return InputError(f"the {kind.noun} {name} cannot open {str(error.filename)!r}: {error.strerror}")
    return InvalidValue(kind.key, name, f"{allowed}{said(error)})")


def parameters_type(kind: type[Plugin], name: str, plugin_class: Any, base: type | None = None) -> Any:
    """The dataclass, below `base`, that a class says its parameters are; `base` where it says none.

    Raises InvalidValue for anything else.
    """
    parameters = getattr(plugin_class, "parameters_type", base)
    is_below_base = inspect.isclass(parameters) and issubclass(parameters, base or object)
    if parameters is not base and not (is_below_base and is_dataclass(parameters)):
        below_base = "" if base is None else f" below {base.__name__}"
        raise InvalidValue(kind.key, name, f"{kind.allowed()}, whose parameters_type is a dataclass{below_base}")
    return parameters


def own_parameters(
    what: str, kind: type[T], values: Mapping[str, Any], preset: Mapping[str, Any] = MappingProxyType({})
) -> T:
    """The parameters of `what` from a file's values over a preset's, of which it takes those that it has.

    `kind` is their dataclass. Raises InvalidValue for names that it does not have and for wrong types.
    """
    for key in values:
        if key not in keys(kind):
            raise unknown_name(key, key, keys(kind), what=f"parameters of {what}")
    return read(kind, {**{key: value for key, value in preset.items() if key in keys(kind)}, **values})
