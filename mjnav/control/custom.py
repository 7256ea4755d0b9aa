"""A user's own controller, by its place: "package.module:Class".

The working folder is searched last, and only while that one module is imported. So the module imports its neighbours at
its top, not inside a function; a package may import its own parts anywhere.
"""

import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import is_dataclass
from importlib import import_module
from typing import Any

from mjnav.control.parameters import LoopParameters
from mjnav.errors import InvalidValue, unknown_name
from mjnav.messages import RobotLimits

ALLOWED = "package.module:Class, a controller"
METHODS = ("decide", "closest_cone")


def custom_class(path: str) -> Any:
    """The class at "package.module:Class". Raises InvalidValue where it cannot be found or is no controller."""
    module_name, _, name = path.partition(":")
    if not all(part.isidentifier() for part in (*module_name.split("."), name)):
        raise InvalidValue("method", path, ALLOWED)
    try:
        with _working_folder_searched():
            module = import_module(module_name)
    except (Exception, SystemExit) as error:  # any failure of the user's module
        problem = f"{type(error).__name__}: {error}"
        raise InvalidValue("method", path, f"a module that can be imported ({problem})") from error
    kind = getattr(module, name, None)
    if kind is None:
        raise unknown_name("method", path, [f"{module_name}:{found}" for found in _controllers(module)])
    missing = [method for method in METHODS if not callable(getattr(kind, method, None))]
    if not inspect.isclass(kind) or missing or inspect.isabstract(kind):
        lacks = sorted({*missing, *getattr(kind, "__abstractmethods__", ())})
        raise InvalidValue("method", path, f"{ALLOWED}, which has {' and '.join(lacks or METHODS)}")
    parameters = getattr(kind, "parameters_type", None)
    if not (inspect.isclass(parameters) and is_dataclass(parameters) and issubclass(parameters, LoopParameters)):
        raise InvalidValue("method", path, f"{ALLOWED}, whose parameters_type is a dataclass below LoopParameters")
    return kind


def make_custom(path: str, kind: Any, limits: RobotLimits, period: float, parameters: LoopParameters) -> Any:
    """An instance of `kind`, the class at `path`. Raises InvalidValue where its constructor raises."""
    try:
        return kind(limits, period, parameters)
    except InvalidValue:
        raise
    except (Exception, SystemExit) as error:
        allowed = f"{ALLOWED}, made as Class(robot_limits, period, parameters) ({type(error).__name__}: {error})"
        raise InvalidValue("method", path, allowed) from error


@contextmanager
def _working_folder_searched() -> Iterator[None]:
    """Modules are also found in the working folder: last, so that it hides no other module."""
    if "" in sys.path:  # an interactive interpreter's own
        yield
        return
    sys.path.append("")
    try:
        yield
    finally:
        with suppress(ValueError):  # the module may have changed the path too
            sys.path.remove("")


def _controllers(module: Any) -> list[str]:
    """The controllers that a module defines."""
    found = inspect.getmembers(module, inspect.isclass)
    return [name for name, kind in found if kind.__module__ == module.__name__ and hasattr(kind, "decide")]
