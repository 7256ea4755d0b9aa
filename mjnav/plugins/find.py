"""Plug-ins: their kinds, where they come from, and how a name and parameters become a class and an object.

A kind says what its plug-ins have to offer, how one is made, and under which entry point packages register them. A
plug-in is named by its module or file, is registered by an installed package, or is a class or an object that Python
code hands over in place of a name.

While the module of a plug-in is imported, one more folder is searched, and searched last, so that it hides no other
module: the working folder for "package.module", the file's own for "file.py". So a module imports its neighbours at its
top, not inside a function; a package may import its own parts anywhere.

Names and owners of registered plug-ins are read from the packages' metadata, which imports nothing; a plug-in is
imported when it is used.
"""

import hashlib
import inspect
import os
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, is_dataclass
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, TypeVar

from mjnav.config import below, keys, settled
from mjnav.errors import InputError, InvalidValue, own_code, said, unknown_name

# ---------------------------------------------------------------------------------------------- kinds


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of plug-in. Errors carry `key`, the key of a run file that names one."""

    name: str  # in messages
    key: str
    group: str  # of entry points
    members: tuple[str, ...]  # that a class or an object of this kind has
    made: str  # how a class of it is called

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
LOCALIZER = Kind("localizer", "", "mjnav.localizers", ("update",), "Class(scenario, seed, parameters)")
TRACKER = Kind("tracker", "", "mjnav.trackers", ("update",), "Class(scenario, seed, parameters)")
BEHAVIOUR = Kind(
    "behaviour", "behaviour", "mjnav.behaviours", ("velocity",), "Class(scenario, person, rng, parameters)"
)
DISTRIBUTION = Kind("distribution", "distribution", "mjnav.distributions", ("sample", "logpdf"), "Class(**parameters)")
PREDICTOR = Kind("predictor", "model", "mjnav.predictors", ("predict",), "Class(scenario, seed, parameters)")
METRIC = Kind("metric", "", "mjnav.metrics", ("measure",), "Class(), or Class(parameters) with a parameters_type")
KINDS = (CONTROLLER, LOCALIZER, TRACKER, PREDICTOR, BEHAVIOUR, DISTRIBUTION, METRIC)


# --------------------------------------------------------------- classes and objects from Python code


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


# ------------------------------------------------------------------------ import of modules and files


SUFFIX = ".py"


def is_file(module: str) -> bool:
    """Whether the part of a name before ":" is a file's."""
    return module.endswith(SUFFIX)


def placed(name: str, folder: str | os.PathLike[str] = "") -> str:
    """A name "file.py:Class" with the file's absolute path, where it lies in `folder`; others as they are.

    A scenario holds such names: they mean the same file when a plug-in has changed the working folder.
    """
    file, colon, own = name.rpartition(":")
    path = os.path.join(folder, file)
    if not (colon and is_file(file)) or os.path.isabs(file) or not os.path.isfile(path):
        return name
    return f"{os.path.abspath(path)}:{own}"


def imported(module: str) -> ModuleType:
    """The module "package.module" or "file.py", from its first import on the same. Raises what its code raises."""
    if not is_file(module):
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


def loaded(module: str) -> ModuleType | None:
    """The module, where it has been imported."""
    return sys.modules.get(_file_module(module) if is_file(module) else module)


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


# --------------------------------------------------------------------- plug-ins of installed packages


@dataclass(frozen=True, slots=True)
class Registered:
    """A name that a package registers: the place of its class, "package.module:Class", and the package."""

    name: str
    place: str
    owner: str  # the package and its version


def registered(kind: Kind) -> Mapping[str, tuple[Registered, ...]]:
    """All that is registered of a kind, by name; more than one under a name is a clash."""
    return _registered(kind.group, tuple(sys.path))


@cache
def _registered(group: str, path: tuple[str, ...]) -> Mapping[str, tuple[Registered, ...]]:
    found: dict[str, tuple[Registered, ...]] = {}
    for point in sorted(entry_points(group=group), key=lambda point: (point.name, _owner(point))):
        entry = Registered(point.name, point.value.replace(" ", ""), _owner(point))
        found[point.name] = (*found.get(point.name, ()), entry)
    return MappingProxyType(found)


def _owner(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist is not None else "an unknown package"


def refuse_clash(kind: Kind, name: str, shipped: Collection[str]) -> None:
    """Raises InvalidValue where more than one registers `name`, mjnav with its `shipped` names among them."""
    owners = [entry.owner for entry in registered(kind).get(name, ())]
    owners = ["mjnav"] * (name in shipped) + owners
    if len(owners) > 1:
        allowed = (
            f"a {kind.name} that one package registers, not {' and '.join(owners)}; package.module:Class names one"
        )
        raise InvalidValue(kind.key, name, allowed)


# --------------------------------------------------------------------------- from a name to an object


P = TypeVar("P")


def find(kind: Kind, name: str, shipped: Mapping[str, Any]) -> Any:
    """The class under `name`, or the object that Python code gave; not for `shipped` names, which errors list.

    Raises InputError where there is no such plug-in, where it cannot be imported, and where it is none of this kind.
    """
    if isinstance(name, Given):
        return _checked(kind, name, name.thing)
    if ":" in name:  # else a name that is registered
        return _checked(kind, name, _at(kind, name, name))
    refuse_clash(kind, name, shipped)
    entries = registered(kind)
    if name not in entries:
        raise unknown_name(kind.key, name, [*shipped, *entries], also="file.py:Class, package.module:Class")
    (entry,) = entries[name]
    return _checked(kind, name, _at(kind, name, entry.place, f"{entry.owner}, {entry.place}: "))


def module_of(kind: Kind, name: str) -> ModuleType | None:
    """The module behind a plug-in, where it has been imported; None for names of mjnav's own."""
    if ":" in name:
        return loaded(name.rpartition(":")[0])
    entries = registered(kind).get(name, ())
    return loaded(entries[0].place.partition(":")[0]) if len(entries) == 1 else None


def construct(kind: Kind, name: str, found: Any, *arguments: Any) -> Any:
    """An instance of the class `found` under `name`. Raises InputError where its constructor raises."""
    with own_code(lambda error: _failed(kind, name, error, f"{kind.allowed}, made as {kind.made} ("), InvalidValue):
        return found(*arguments)


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
    known, own = keys(kind), {}
    for key, value in values.items():
        if key not in known:
            raise unknown_name(key, key, known, what=f"parameters of {what}")
        with below(key):
            own[key] = settled(known[key].hint, value)
    return kind(**{**{key: value for key, value in preset.items() if key in known}, **own})


def _at(kind: Kind, name: str, place: str, owner: str = "") -> Any:
    """What stands at a place, "package.module:Class" or "file.py:Class", which messages call `name`."""
    module_name, _, own = place.rpartition(":")
    by_file = is_file(module_name)
    if module_name == "__main__" or own.endswith("()") or "<" in own or "." in own:
        allowed = f"the {kind.name} itself, handed over in Python: this name does not lead to what was run"
        raise InvalidValue(kind.key, name, allowed)
    if not own.isidentifier() or not (by_file or all(part.isidentifier() for part in module_name.split("."))):
        raise InvalidValue(kind.key, name, kind.allowed)
    if by_file and not Path(module_name).exists():
        raise InvalidValue(kind.key, name, "a Python file that exists", nearest=_nearest(module_name, own))
    with own_code(lambda error: _failed(kind, name, error, f"a module that can be imported ({owner}")):
        module = imported(module_name)
    if not hasattr(module, own):
        raise unknown_name(kind.key, name, [f"{module_name}:{found}" for found in _offered(kind, module)])
    return getattr(module, own)


def _checked(kind: Kind, name: str, thing: Any) -> Any:
    """`thing`, where it is of this kind."""
    missing = [member for member in kind.members if not callable(getattr(thing, member, None))]
    if inspect.ismodule(thing) or inspect.isroutine(thing) or missing or inspect.isabstract(thing):
        lacks = sorted({*missing, *getattr(thing, "__abstractmethods__", ())})
        raise InvalidValue(kind.key, name, f"{kind.allowed}, which has {' and '.join(lacks or kind.members)}")
    return thing


def _offered(kind: Kind, module: ModuleType) -> list[str]:
    """The classes of a kind that a module defines."""
    found = inspect.getmembers(module, inspect.isclass)
    return [name for name, one in found if one.__module__ == module.__name__ and kind.is_one(one)]


def _nearest(file: str, own: str) -> str | None:
    """The file beside it whose name is most like that of one that does not exist."""
    try:
        siblings = [str(other) for other in Path(file).parent.glob("*.py")]
    except (OSError, ValueError):
        return None
    close = get_close_matches(str(Path(file)), siblings, n=1, cutoff=0.75)
    return f"{close[0]}:{own}" if close else None


def _failed(kind: Kind, name: str, error: BaseException, allowed: str) -> InputError:
    """The error for a plug-in whose own code raised `error`; its name is not at fault where a file cannot be opened."""
    if isinstance(error, OSError) and error.filename is not None:
        return InputError(f"the {kind.name} {name} cannot open {str(error.filename)!r}: {error.strerror}")
    return InvalidValue(kind.key, name, f"{allowed}{said(error)})")
