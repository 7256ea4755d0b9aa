"""Cache of kernels' machine code on disk, each identified by a digest of all that is compiled into it.

What is compiled into a kernel is its own byte code and whatever it reads when it is compiled: functions of this or any
other file, numbers, the fields of named tuples. The digest is taken from the functions as they were loaded, so that it
neither misses a change in another file nor depends on a later change of any file.

A kernel has one file for each combination of its arguments' types. Numba's own cache checks the kernel's own file
alone, and unpickles any file that it finds. This one reads only files that processes of this user wrote.
"""

# pyright: reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false
# numba's modules carry no types, and a cache that keeps nothing is typed as such.

import dis
import hashlib
import os
import pickle
import platform
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from functools import cache, cached_property
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
import platformdirs
from numba.core import config, sigutils, types
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target
from numba.core.serialize import dumps
from numba.np.ufunc.dufunc import DUFunc

from mjnav.compile.cache_folder import CacheFolder

# --------------------------------------------------------------------------------------------- digest


LIBRARIES = ("math", "cmath", "numpy")  # modules whose functions follow from the versions in `environment`
# numba's settings that change machine code beside the processor's name and features
SETTINGS = ("OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DISABLE_INTEL_SVML")


def processor() -> str:
    """Name and features of the processor that kernels are compiled for, as LLVM has them: "znver4 +avx512f ...".

    It counts NUMBA_CPU_NAME and NUMBA_CPU_FEATURES.
    """
    _, name, features = _target()
    return " ".join([name, *features.split(",")])


def code_digest(function: FunctionType, options: dict[str, Any]) -> str:
    """Of the machine code of `function`, compiled by numba with `options`, whatever its arguments: hexadecimal.

    Raises TypeError where it reads something of which is not known how it is compiled.
    """
    return _digest([environment(), _describe_options(options), *_describe_function(function, set())])


def types_digest(arguments: tuple[types.Type, ...]) -> str:
    """Of the types of a kernel's arguments."""
    return _digest([_describe_type(argument) for argument in arguments])


def _target() -> tuple[str, str, str]:
    """What LLVM compiles for: the platform, the processor's name and its features, separated by commas."""
    return cpu_target.target_context.codegen().magic_tuple()


@cache
def environment() -> tuple[str, ...]:
    """What the same source compiles to different machine code under: versions, processor, numba's settings."""
    versions = (platform.python_version(), numba.__version__, llvmlite.__version__, np.__version__)
    settings = (f"{name}={getattr(config, name)}" for name in SETTINGS)
    return (platform.python_implementation(), *versions, *map(str, _target()), *settings)


def _describe(value: Any, seen: set[int]) -> Iterator[object]:
    """What the compiler makes of a value, followed by what that reads in turn, once."""
    if isinstance(value, Dispatcher):
        yield _describe_options(value.targetoptions)
        yield from _describe_function(value.py_func, seen)
    elif isinstance(value, DUFunc):
        yield from _describe_function(value._dispatcher.py_func, seen)
    elif isinstance(value, tuple):
        for part in value:
            yield from _describe(part, seen)
    elif isinstance(value, type):
        yield f"{value.__module__}.{value.__qualname__}{getattr(value, '_fields', '')}"
    elif isinstance(value, ModuleType) and value.__name__.partition(".")[0] in LIBRARIES:
        yield value.__name__
    elif isinstance(value, BuiltinFunctionType | np.ufunc):
        yield repr(value)
    elif value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic):
        yield f"{type(value).__name__} {value!r}"
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.strides} {value.tobytes().hex()}"
    else:
        raise TypeError(f"a kernel reads a {type(value).__name__}: {value!r}")


def _describe_function(function: FunctionType, seen: set[int]) -> Iterator[object]:
    yield f"{function.__module__}.{function.__qualname__}"
    if id(function) in seen:
        return
    seen.add(id(function))
    yield _describe_code(function.__code__)
    for part in (function.__defaults__, *(cell.cell_contents for cell in function.__closure__ or ())):
        yield from _describe(part, seen)
    for name in sorted(_globals_read(function.__code__)):
        if name in function.__globals__:  # else one of Python's own
            yield name
            yield from _describe(function.__globals__[name], seen)


def _describe_options(options: dict[str, Any]) -> object:
    return sorted((key, _sorted(value)) for key, value in options.items())


@cache
def _describe_code(code: CodeType) -> object:
    """All of a code object but where it stands in its file."""
    constants = [
        _describe_code(c) if isinstance(c, CodeType) else (type(c).__name__, _sorted(c)) for c in code.co_consts
    ]
    names = (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
    return code.co_argcount, code.co_kwonlyargcount, code.co_flags, code.co_code, names, constants


@cache
def _globals_read(code: CodeType) -> set[str]:
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    own = {instruction.argval for instruction in dis.get_instructions(code) if "GLOBAL" in instruction.opname}
    return own.union(*map(_globals_read, inner))


def _describe_type(argument: types.Type) -> object:
    """A numba type; of a named tuple the class and its fields, too, by which the code reads it."""
    if isinstance(argument, types.NamedTuple | types.NamedUniTuple):
        kind = argument.instance_class
        return kind.__module__, kind.__qualname__, argument.fields, [_describe_type(part) for part in argument]
    return repr(argument)


def _sorted(value: Any) -> object:
    """A set in an order that is the same in every process."""
    return sorted(map(repr, value)) if isinstance(value, set | frozenset) else repr(value)


def _digest(parts: list[object]) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()


# ---------------------------------------------------------------------------------------------- files


@cache
def folder() -> CacheFolder:
    """Where this process has its machine code: kernels/ in the user's cache folder of mjnav.

    That is ~/.cache/mjnav, or where XDG_CACHE_HOME says; NUMBA_CACHE_DIR/mjnav where that is set.
    """
    # Not numba's config, which a file .numba_config.yaml in the working folder can set.
    if parent := os.environ.get("NUMBA_CACHE_DIR"):
        return CacheFolder(Path(os.path.abspath(parent)) / "mjnav" / "kernels")
    return CacheFolder(platformdirs.user_cache_path("mjnav") / "kernels")


class KernelCache(NullCache):
    """The cache of one kernel, as numba's dispatchers ask for one."""

    def __init__(self, function: FunctionType, options: dict[str, Any]):
        """`options` are what numba was told about `function`."""
        self._function, self._options = function, options

    def making(self, arguments: Any) -> AbstractContextManager[None]:
        """Held while the machine code for these types is loaded or compiled: one process compiles, others wait."""
        name = self._name(arguments)
        return nullcontext() if name is None else folder().making(name)

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """The machine code for a signature, if it is kept."""
        target_context.refresh()
        name = self._name(sig)
        data = None if name is None else folder().read(name)
        return None if data is None else CompileResult._rebuild(target_context, *pickle.loads(data))

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Keeps the machine code for a signature, if another process can use it."""
        name = self._name(sig)
        if name is not None and not data.lifted and not data.library.has_dynamic_globals:
            folder().write(name, dumps(data._reduce()))

    @cached_property
    def _code(self) -> str | None:
        """The digest of what is compiled, None where it is not known what that depends on; the first use decides.

        So does numba, which takes the values of what a kernel reads when it first compiles it.
        """
        try:
            return code_digest(self._function, self._options)
        except TypeError:
            return None

    def _name(self, signature: Any) -> str | None:
        """The file's; None where none is kept."""
        if self._code is None:
            return None
        arguments, _ = sigutils.normalize_signature(signature)
        return f"{self._function.__name__}-{self._code[:32]}-{types_digest(arguments)[:16]}"
