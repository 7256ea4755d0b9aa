"""Digests of the source files that an episode runs: mjnav's own, and those of plug-ins."""

import ast
import hashlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from mjnav.plugins import Given, Kind, module_of
from mjnav.scenarios.library import data_folder

DIGITS = 16  # of a digest that is shown and stored: 64 bits
INSTALLED = ("site-packages", "dist-packages")  # folders of packages that have a version
IMPORTERS = ("import_module", "__import__")

NONE: Mapping[str, str] = MappingProxyType({})


@cache
def mjnav_sources() -> str:
    """One digest of every Python file of the package and of every model, their names among it."""
    package = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for folder, pattern in ((package, "*.py"), (data_folder("models"), "*")):
        for path in sorted(path for path in folder.rglob(pattern) if path.is_file()):
            content = path.read_bytes()
            digest.update(f"{path.relative_to(folder).as_posix()}\0{len(content)}\0".encode())
            digest.update(content)
    return digest.hexdigest()[:DIGITS]


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:DIGITS]


def plugin_sources(kind: Kind, name: str) -> Mapping[str, str]:
    """The digest of every file behind a plug-in, by the file's path from its import folder.

    These are its module and, over any number of steps, what that imports: at the top of a file, in a function, or by
    `import_module` with the name written out. Packages that are installed, Python's own and mjnav are left out. Nothing
    is imported to find them. Empty for what mjnav has under that name, and where the module is not loaded. Of a class
    of a notebook, the digest of its text.
    """
    module = module_of(kind, name)
    origin = getattr(module, "__file__", None)
    if module is not None and origin is not None:
        return _files(module.__name__, str(Path(origin).resolve()))
    if not isinstance(name, Given):
        return NONE
    return MappingProxyType({f"{name} as it was given": _digest(name.text().encode())})


@cache
def _files(name: str, origin: str) -> Mapping[str, str]:
    """`plugin_sources` of the module `name`, whose file is `origin`."""
    path = Path(origin)
    depth = name.count(".") + (path.name == "__init__.py")
    root = path.parents[depth]
    top = name.partition(".")[0]
    search = [str(root), *(entry for entry in sys.path if entry)]
    digests: dict[str, str] = {}
    seen: set[str] = set()
    waiting = list(_and_parents(name))
    while waiting:
        wanted = waiting.pop()
        if wanted in seen:
            continue
        seen.add(wanted)
        found = _find(wanted, search)
        if found is None or not _is_own(wanted, found.origin, top):
            continue
        file = Path(found.origin).resolve()
        content = _content(file)
        shown = file.relative_to(root).as_posix() if file.is_relative_to(root) else file.name
        digests[shown] = _digest(content)
        if file.suffix == ".py":
            package = wanted if found.is_package else wanted.rpartition(".")[0]
            waiting += (each for imported in _imports(content, package) for each in _and_parents(imported))
    return MappingProxyType(dict(sorted(digests.items())))


class _Found(NamedTuple):
    """A module's file."""

    origin: str
    is_package: bool


def _find(name: str, search: Sequence[str]) -> _Found | None:
    """Where the module was loaded from, or else where Python would find it; None where it is no file.

    Nothing is imported.
    """
    loaded = sys.modules.get(name)
    if loaded is not None:
        origin = getattr(loaded, "__file__", None)
        return _Found(origin, hasattr(loaded, "__path__")) if origin else None
    spec: ModuleSpec | None = None
    path: Sequence[str] | None = search
    for depth in range(name.count(".") + 1):
        if path is None:
            return None
        spec = PathFinder.find_spec(".".join(name.split(".")[: depth + 1]), path)
        if spec is None:
            return None
        path = spec.submodule_search_locations
    if spec is None or spec.origin is None:
        return None
    return _Found(spec.origin, spec.submodule_search_locations is not None)


def _is_own(name: str, origin: str, top: str) -> bool:
    """Whether a module is of the user's sources rather than of an installed package, Python or mjnav."""
    first = name.partition(".")[0]
    if first == "mjnav" or (first in sys.stdlib_module_names and first != top):
        return False
    return first == top or not any(part in INSTALLED for part in Path(origin).parts)


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError:
        return b""  # removed since: it counts as changed


def _imports(content: bytes, package: str) -> Iterator[str]:
    """The modules that a source file may import, by full name; `package` is where it stands."""
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError):
        return  # one that is never imported
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                yield from (alias.name for alias in names)
            case ast.ImportFrom(module=module, names=names, level=level):
                base = _absolute(module or "", level, package)
                yield base
                yield from (f"{base}.{alias.name}" for alias in names)
            case ast.Call(func=function, args=[ast.Constant(value=str(name)), *_]) if _called(function) in IMPORTERS:
                level = len(name) - len(name.lstrip("."))
                yield _absolute(name[level:], level, package)


def _called(function: ast.expr) -> str:
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def _absolute(name: str, level: int, package: str) -> str:
    """The full name of an import with `level` leading dots."""
    if not level:
        return name
    parts = package.split(".")
    return ".".join(part for part in (*parts[: len(parts) - level + 1], name) if part)


def _and_parents(name: str) -> Iterator[str]:
    """A module and the packages that are imported before it."""
    parts = name.split(".")
    return (".".join(parts[:end]) for end in range(1, len(parts) + 1) if all(parts[:end]))
