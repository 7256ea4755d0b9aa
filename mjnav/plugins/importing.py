"""Imports the module of a plug-in, by its name or by its file.

One folder more is searched while that one module is imported, and searched last, so that it hides no other module: the
working folder for "package.module", the file's own for "file.py". So a module imports its neighbours at its top, not
inside a function; a package may import its own parts anywhere.
"""

import hashlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

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
