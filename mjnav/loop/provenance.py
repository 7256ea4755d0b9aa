"""Provenance of a run: the programs, source files and processor features that decide its bits.

They do so beside the scenario, the controller's parameters and the seed. The source files are mjnav's own and those of
plug-ins, by their digests. One process has one answer for each controller. A log carries it in the metadata
`mjnav/run`, a sweep in the columns of its rows.
"""

import ast
import ctypes
import hashlib
import json
import os
import platform
import shlex
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from mjnav.compile.compiled import FAST
from mjnav.printable import printable
from mjnav.robot.controller import parameters_of
from mjnav.scene.library import data_folder
from mjnav.scene.plugged import plugins_of
from mjnav.scene.spec import Scenario
from mjnav.settings import tables
from mjnav.settings.plugins import ControllerPlugin, Given, Plugin, module_of

# ------------------------------------------------------------------------------------- source files


DIGITS = 16  # of a digest that is shown and stored: 64 bits
INSTALLED = ("site-packages", "dist-packages")  # folders of packages that have a version
IMPORTERS = ("import_module", "__import__")

NONE: Mapping[str, str] = MappingProxyType({})


@cache
def mjnav_sources() -> str:
    """One digest of every Python file of the package and of every model, their names among it."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for folder, pattern in ((package, "*.py"), (data_folder("models"), "*")):
        for path in sorted(path for path in folder.rglob(pattern) if path.is_file()):
            content = path.read_bytes()
            digest.update(f"{path.relative_to(folder).as_posix()}\0{len(content)}\0".encode())
            digest.update(content)
    return digest.hexdigest()[:DIGITS]


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:DIGITS]


def plugin_sources(kind: type[Plugin], name: str) -> Mapping[str, str]:
    """The digest of every file behind a plug-in, by the file's path from its import folder.

    These are its module and, over any number of steps, the Python files that it imports: at the top of a file, in a
    function, or by `import_module` with the name written out. Packages that are installed, Python's own and mjnav are
    left out. Nothing is imported to find them. Empty for what mjnav has under that name, and where the module is not
    loaded. Of a class of a notebook, the digest of its text.
    """
    module = module_of(kind, name)
    origin = getattr(module, "__file__", None)
    if module is not None and origin is not None:
        return _files(module.__name__, Path(origin).resolve())
    if not isinstance(name, Given):
        return NONE
    return MappingProxyType({f"{name} as it was given": _digest(name.text().encode())})


@cache
def _files(name: str, origin: Path) -> Mapping[str, str]:
    """`plugin_sources` of the module `name`, whose file is `origin`."""
    root = origin.parents[name.count(".") + (origin.name == "__init__.py")]
    top = name.partition(".")[0]
    folders = [Path(entry) for entry in (root, *sys.path) if entry and not _is_installed(Path(entry))]
    digests: dict[str, str] = {}
    seen = {""}
    waiting = [name]
    while waiting:
        module = waiting.pop()
        first = module.partition(".")[0]
        if module in seen or first == "mjnav" or (first in sys.stdlib_module_names and first != top):
            continue
        seen.add(module)
        waiting += filter(None, [module.rpartition(".")[0]])
        # a plug-in "file.py:Class" is a module whose name is not its file's
        file = origin if module == name else _module_file(module, [root] if first == top else folders)
        if file is not None:
            content = file.read_bytes()
            digests[file.relative_to(root).as_posix() if file.is_relative_to(root) else file.name] = _digest(content)
            waiting += _imports(content, module if file.name == "__init__.py" else module.rpartition(".")[0])
    return MappingProxyType(dict(sorted(digests.items())))


def _is_installed(folder: Path) -> bool:
    return any(part in INSTALLED for part in folder.parts)


def _module_file(name: str, folders: Iterable[Path]) -> Path | None:
    """The Python file of a module below the first of the folders that has it."""
    paths = [folder.joinpath(*name.split(".")) for folder in folders]
    files = [file for path in paths for file in (path / "__init__.py", path.parent / f"{path.name}.py")]
    return next((file.resolve() for file in files if file.is_file()), None)


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
                yield from filter(None, [base, *(f"{base}.{alias.name}" for alias in names)])
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


# -------------------------------------------------------------------------------------------- facts


PACKAGES = ("mjnav", "numpy", "numba", "llvmlite", "scipy", "filterpy", "mujoco")
OPENBLAS_NAMES = ("scipy_openblas_get_corename64_", "openblas_get_corename64_", "openblas_get_corename")
LIBM_SWITCHES = "GLIBC_TUNABLES"

PARAMETERS = "parameters"  # of a controller of mjnav's own, defaults included, as JSON
SOURCES, OWN_SOURCES = "sources.mjnav", "sources.controller"
# fact -> (how messages call it, what it holds)
FACTS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        SOURCES: ("the digest of mjnav's sources", "a digest of mjnav's Python files and models"),
        OWN_SOURCES: (
            "the sources of plug-ins",
            "of a user's own controller, behaviour, ...: their files' digests as JSON",
        ),
        **{f"version.{package}": (package, "its version") for package in PACKAGES},
        "python": ("Python", "its version"),
        "libc": ("the C library", "its version, and the processor features that its functions may use where limited"),
        "cpu": ("the processor's type", "architecture, and the name that LLVM has for it"),
        "cpu.features": ("the processor's features", "all that it has, as LLVM names them"),
        "cpu.numpy": ("the processor features that NumPy uses", "of those that it chooses code by"),
        "cpu.kernels": ("the processor that kernels are compiled for", "as LLVM has it; host where it is this one"),
        "kernels": ("the kernels' compiler setting", "fastmath flags and numba's switches"),
        "blas": ("BLAS", "NumPy's: its name, version and the processor type that it chose"),
    }
)
SETS = ("cpu.features", "cpu.numpy")  # facts that are lists of words
NOT_RECORDED = "written by an earlier version of mjnav, which did not record"


def provenance(method: str, plugins: Iterable[Plugin] = ()) -> Mapping[str, str]:
    """Every fact of this process, of the controller `method` and of the other plug-ins, which have been made before."""
    own = dict(plugin_sources(ControllerPlugin, method))
    for plugin in plugins:
        own |= plugin_sources(type(plugin), plugin.name)
    own = dict(sorted(own.items()))
    return MappingProxyType({**_facts(), OWN_SOURCES: json.dumps(dict(own)) if own else ""})


def digest(facts: Mapping[str, str]) -> str:
    """A hash of all facts."""
    return hashlib.sha256(json.dumps([facts.get(fact) for fact in FACTS]).encode()).hexdigest()


def changes(was: Mapping[str, str | None], now: Mapping[str, str | None]) -> tuple[str, ...]:
    """The facts that differ, each in words: "numpy was 2.4.5, is 2.4.6". An unknown fact is None or absent."""
    unknown = [fact for fact in FACTS if (was.get(fact) is None) != (now.get(fact) is None)]
    found = [
        text
        for fact in FACTS
        if fact not in unknown and was.get(fact) != now.get(fact)
        for text in _change(fact, was[fact] or "", now[fact] or "")
    ]
    if unknown:
        found.append(f"{NOT_RECORDED} {', '.join(FACTS[fact][0] for fact in unknown)}")
    return tuple(found)


def _change(fact: str, was: str, now: str) -> list[str]:
    name, _ = FACTS[fact]
    if fact == SOURCES:
        return ["mjnav's sources changed"]
    if fact == OWN_SOURCES:
        before, after = _own_files(was), _own_files(now)
        return [
            f"{file} {'changed' if file in before and file in after else 'was added' if file in after else 'is gone'}"
            for file in sorted({*before, *after})
            if before.get(file) != after.get(file)
        ]
    if fact in SETS:
        gone, came = (" ".join(sorted({*a.split()} - {*b.split()})) for a, b in ((was, now), (now, was)))
        return [f"{name}: " + ", ".join([f"without {gone}"] * bool(gone) + [f"with {came}"] * bool(came))]
    return [f"{name} was {was or 'unknown'}, is {now or 'unknown'}"]


def shown(fact: str, values: Iterable[str]) -> dict[str, str]:
    """Different values of a fact, each with what sets it apart from the others: of lists, what they do not share."""
    parts = {value: _parts(fact, value) for value in values}
    shared = set.intersection(*map(set, parts.values())) if parts else set()
    return {value: " ".join(part for part in found if part not in shared) or "none" for value, found in parts.items()}


def _parts(fact: str, value: str) -> list[str]:
    if fact == OWN_SOURCES:
        return [f"{file} {digest}" for file, digest in _own_files(value).items()]
    return value.split() if fact in SETS else [value]


def _own_files(text: str) -> Mapping[str, Any]:
    """The digests of plug-ins' files. A log may hold anything; what is no table of files counts as one."""
    try:
        found = json.loads(text) if text else {}
    except (ValueError, RecursionError):
        found = None
    return found if isinstance(found, dict) else {"the record of the plug-ins' sources": text}


@cache
def _facts() -> Mapping[str, str]:
    """The facts of this process that do not depend on the controller."""
    from llvmlite import binding
    from numba.core import config

    from mjnav.compile.kernel_cache import SETTINGS, processor

    host = [binding.get_host_cpu_name(), *sorted(f for f, has in binding.get_host_cpu_features().items() if has)]
    name, *features = processor().split()
    target = [name, *sorted(f[1:] for f in features if f.startswith("+"))]
    compiler_switches = (*SETTINGS, "DISABLE_JIT", "USING_SVML")
    switches = [f"{switch.lower()}={int(getattr(config, switch, None) or 0)}" for switch in compiler_switches]
    libc = [*platform.libc_ver(), *(part for part in os.environ.get(LIBM_SWITCHES, "").split(":") if ".cpu." in part)]
    return MappingProxyType(
        {
            SOURCES: mjnav_sources(),
            **{f"version.{package}": package_version(package) for package in PACKAGES},
            "python": platform.python_version(),
            "libc": " ".join(filter(None, libc)),
            "cpu": f"{platform.machine()} {host[0]}",
            "cpu.features": " ".join(host[1:]),
            "cpu.numpy": " ".join(_numpy_features()),
            "cpu.kernels": "host" if target == host else " ".join(target),
            "kernels": " ".join([*sorted(FAST), *switches]),
            "blas": _blas(),
        }
    )


def package_version(package: str) -> str:
    """The version of an installed package; "unknown" where it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def _config() -> Mapping[str, Any]:
    return np.show_config(mode="dicts") or {}


def _numpy_features() -> list[str]:
    """What NumPy was built for and what it found beyond; NPY_DISABLE_CPU_FEATURES takes some away."""
    found = _config().get("SIMD Extensions", {})
    return [*found.get("baseline", ()), *found.get("found", ())]


def _blas() -> str:
    """OpenBLAS chooses its code when it is loaded, by the processor or by OPENBLAS_CORETYPE."""
    from numpy.linalg import _umath_linalg  # type: ignore[attr-defined]

    blas = _config().get("Build Dependencies", {}).get("blas", {})
    library = ctypes.CDLL(_umath_linalg.__file__)  # its symbols, and those of the libraries that it needs
    core = ""
    for name in OPENBLAS_NAMES:
        if hasattr(library, name):
            function = getattr(library, name)
            function.restype = ctypes.c_char_p
            core = function().decode()
            break
    return " ".join(filter(None, (blas.get("name"), blas.get("version"), core)))


# -------------------------------------------------------------------------------- metadata of a log


def run_info(scenario: Scenario, seed: int, parts_hash: str) -> dict[str, str]:
    """The metadata `mjnav/run`: seed, scene, controller, git revision, command line, and all that decides the bits."""
    parameters = parameters_of(scenario)
    return {
        "scene": scenario.name,
        "controller": scenario.control.method,
        **({} if parameters is None else {PARAMETERS: json.dumps(tables(parameters))}),
        "seed": str(seed),
        "engine": scenario.physics.engine,
        **({} if scenario.prediction is None else {"prediction": scenario.prediction.name}),
        "parts_hash": parts_hash,
        "git_revision": _git_revision(),
        "argv": printable(shlex.join(sys.argv)),
        "machine": platform.machine(),
        "processor": _processor(),
        "version.mcap": package_version("mcap"),
        **provenance(scenario.control.method, plugins_of(scenario).values()),
    }


@cache
def revision() -> str:
    """The version of mjnav, and the git revision where it runs from a source tree."""
    return " ".join(part for part in (package_version("mjnav"), _git_revision()) if part)


@cache
def _processor() -> str:
    """The processor's product name."""
    with suppress(OSError), open("/proc/cpuinfo") as file:
        for line in file:
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor()


@cache
def _git_revision() -> str:
    """The source tree's commit, "+changes" where it has some; empty for an installed package."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", os.fspath(root), "describe", "--always", "--abbrev=40", "--dirty=+changes"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
