"""From the name of a plug-in to its class, and from that and its parameters to an object."""

import inspect
from collections.abc import Mapping
from dataclasses import is_dataclass
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from mjnav.config import below, keys, settled
from mjnav.errors import InputError, InvalidValue, own_code, said, unknown_name
from mjnav.plugins.given import Given
from mjnav.plugins.importing import imported, is_file, loaded
from mjnav.plugins.kinds import Kind
from mjnav.plugins.registered import refuse_clash, registered

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
