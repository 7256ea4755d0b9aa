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
import stat
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, cached_property
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any
from uuid import uuid4

import llvmlite
import numba
import numpy as np
import platformdirs
from numba.core import config, sigutils, types
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.registry import cpu_target
from numba.core.serialize import dumps

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


def code_digest(function: Callable[..., Any], options: dict[str, Any]) -> str:
    """Of the machine code of `function`, compiled by numba with `options`, whatever its arguments: hexadecimal.

    Raises TypeError where it reads something of which is not known how it is compiled.
    """
    return _digest([environment(), _sorted(options.items()), *_describe(function, set())])


def types_digest(arguments: tuple[types.Type, ...]) -> str:
    """Of the types of a kernel's arguments."""
    return _digest(_describe(arguments, set()))


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
    """What the compiler makes of a value, followed by what that reads in turn; functions once."""
    match value:
        case _ if hasattr(value, "targetoptions"):  # a kernel, or numba's own dispatcher
            yield _sorted(value.targetoptions.items())
            yield from _describe(value.py_func, seen)
        case FunctionType():
            yield f"{value.__module__}.{value.__qualname__}"
            if id(value) not in seen:
                seen.add(id(value))
                code, names = _describe_code(value.__code__)
                yield code
                yield from _describe(value.__defaults__, seen)
                yield from _describe(tuple(cell.cell_contents for cell in value.__closure__ or ()), seen)
                for name in names:
                    if name in value.__globals__:  # else one of Python's own
                        yield name
                        yield from _describe(value.__globals__[name], seen)
        case types.NamedTuple() | types.NamedUniTuple():
            yield from _describe(value.instance_class, seen)
            yield from _describe(tuple(value), seen)
        case tuple():
            for part in value:
                yield from _describe(part, seen)
        case type():
            yield f"{value.__module__}.{value.__qualname__}{getattr(value, '_fields', '')}"
        case ModuleType() if value.__name__.partition(".")[0] in LIBRARIES:
            yield value.__name__
        case types.Type() | BuiltinFunctionType() | np.ufunc():
            yield repr(value)
        case None | bool() | int() | float() | complex() | str() | bytes() | np.generic():
            yield f"{type(value).__name__} {value!r}"
        case np.ndarray():
            yield f"{value.dtype} {value.shape} {value.strides} {value.tobytes().hex()}"
        case _:
            raise TypeError(f"a kernel reads a {type(value).__name__}: {value!r}")


@cache
def _describe_code(code: CodeType) -> tuple[object, list[str]]:
    """All of a code object but its place in its file; the globals that it and the functions inside it read."""
    inner = [_describe_code(constant) for constant in code.co_consts if isinstance(constant, CodeType)]
    constants = [_sorted(constant) for constant in code.co_consts if not isinstance(constant, CodeType)]
    names = (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
    text = (code.co_argcount, code.co_kwonlyargcount, code.co_flags, code.co_code, names, constants, inner)
    read = {instruction.argval for instruction in dis.get_instructions(code) if "GLOBAL" in instruction.opname}
    return text, sorted(read.union(*(names for _, names in inner)))


def _sorted(value: Any) -> object:
    """A set or a table's items in an order that is the same in every process."""
    if isinstance(value, set | frozenset | type({}.items())):
        return sorted(repr(_sorted(part)) for part in value)
    return tuple(map(_sorted, value)) if isinstance(value, tuple) else repr(value)


def _digest(parts: Any) -> str:
    return hashlib.sha256(repr(list(parts)).encode()).hexdigest()


# ---------------------------------------------------------------------------------------------- files


DAY = 86_400.0  # [s]
UNUSED = 30.0 * DAY  # [s] after which a file that no process read is deleted
UNFINISHED = DAY  # [s] after which a file that a killed process left half written is deleted
MAX_BYTES = 256_000_000  # of all files; the least recently used go first
_SUFFIX, _TEMPORARY = ".kernel", ".tmp"


class CacheFolder:
    """Files by name. Nothing raises: a file that cannot be read is None, and the first failure goes to stderr.

    Anyone who can write machine code here runs code as its reader. So the folder must belong to the user and be
    writable by nobody else. This is checked on the open folder, not on its path, and files are opened relative to it:
    neither a link nor a rename leads elsewhere.
    """

    def __init__(self, path: Path):
        """`path` is created with its parents."""
        self._path = path
        self._complained = self._swept = False
        self._folder: int | None = None
        try:
            self._folder = _open_private(path)
        except OSError as error:
            self._complain(f"kernels are compiled anew at every start: {path}: {error.strerror}")

    def has(self, name: str) -> bool:
        """Whether there is a file for `name`, whole or not."""
        try:
            return self._folder is not None and bool(os.stat(name + _SUFFIX, dir_fd=self._folder))
        except OSError:
            return False

    def read(self, name: str) -> bytes | None:
        """The data written for `name`; None where there is no such file, or it is damaged."""
        if self._folder is None:
            return None
        try:
            file = os.open(name + _SUFFIX, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=self._folder)
            with open(file, "rb") as opened:
                status = os.fstat(file)
                content = opened.read() if stat.S_ISREG(status.st_mode) and _is_private(status) else b""
        except OSError:
            return None
        checksum = _checksum(name, content[hashlib.sha256().digest_size :])
        if not content.startswith(checksum):
            self._complain(f"a damaged file is replaced, its kernel compiled anew: {self._path / (name + _SUFFIX)}")
            return None
        if time.time() - status.st_mtime > DAY:  # it is in use: the sweep of another process leaves it alone
            with suppress(OSError):
                os.utime(name + _SUFFIX, dir_fd=self._folder)
        return content[len(checksum) :]

    def write(self, name: str, data: bytes) -> None:
        """Writes a file, whole or not at all, in place of an older one; the first time, it deletes old ones."""
        if self._folder is None:
            return
        temporary = f"{name}.{uuid4().hex}{_TEMPORARY}"
        try:
            file = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600, dir_fd=self._folder)
            with open(file, "wb") as opened:
                opened.write(_checksum(name, data) + data)
            os.replace(temporary, name + _SUFFIX, src_dir_fd=self._folder, dst_dir_fd=self._folder)
        except OSError as error:
            with suppress(OSError):
                os.unlink(temporary, dir_fd=self._folder)
            self._complain(f"kernels are compiled anew at every start: {self._path}: {error.strerror}")
            return
        if not self._swept:
            self._swept = True
            with suppress(OSError):
                _sweep(self._folder)

    def _complain(self, text: str) -> None:
        """One line on stderr, the first time: later failures have the same cause."""
        if not self._complained and sys.stderr is not None:
            with suppress(OSError):
                print(f"mjnav: {text}", file=sys.stderr, flush=True)
        self._complained = True


def _checksum(name: str, data: bytes) -> bytes:
    """Of name and data: a renamed file does not match."""
    return hashlib.sha256(name.encode() + b"\0" + data).digest()


def _open_private(path: Path) -> int:
    """The folder's descriptor. Raises OSError where it cannot be had, or where others could write into it."""
    if not path.is_absolute():
        raise OSError(0, "not an absolute path")
    for folder in (*reversed(path.parents), path):
        if not folder.is_dir():
            folder.mkdir(0o700, exist_ok=True)
    folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    status = os.fstat(folder)
    if not _is_private(status):
        os.close(folder)
        mine = status.st_uid == os.geteuid()
        raise OSError(0, "others can write into it" if mine else "it belongs to another user")
    return folder


def _is_private(status: os.stat_result) -> bool:
    return status.st_uid == os.geteuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _sweep(folder: int) -> None:
    """Deletes files that no process used for long, then the least recently used beyond MAX_BYTES."""
    now, kept = time.time(), []
    with os.scandir(folder) as entries:
        for entry in entries:
            limit = {_SUFFIX: UNUSED, _TEMPORARY: UNFINISHED}.get(os.path.splitext(entry.name)[1])
            if limit is not None:
                status = entry.stat(follow_symlinks=False)
                kept.append((status.st_mtime, status.st_size, entry.name, now - status.st_mtime > limit))
    excess = sum(size for _, size, _, old in kept if not old) - MAX_BYTES
    for _, size, name, old in sorted(kept):
        if old or excess > 0:
            excess -= 0 if old else size
            with suppress(OSError):  # another process deletes, too
                os.unlink(name, dir_fd=folder)


@cache
def folder() -> CacheFolder:
    """Where this process has its machine code: kernels/ in the user's cache folder of mjnav.

    That is ~/.cache/mjnav, or where XDG_CACHE_HOME says; NUMBA_CACHE_DIR/mjnav where that is set.
    """
    # Not numba's config, which a file .numba_config.yaml in the working folder can set.
    if parent := os.environ.get("NUMBA_CACHE_DIR"):
        return CacheFolder(Path(os.path.abspath(parent)) / "mjnav" / "kernels")
    return CacheFolder(platformdirs.user_cache_path("mjnav") / "kernels")


def _forget_subroutines() -> None:
    """Lets each kernel compile the subroutines of its own operators, as of `x**2`, anew.

    Numba keeps them for the whole process, under a key without the options of the kernel that came first: `x**2` in an
    `exact` kernel would be rounded by the rules of another one, and differently where that one is loaded.
    """
    cpu_target.target_context.cached_internal_func.clear()


class KernelCache(NullCache):
    """The cache of one kernel, as numba's dispatchers ask for one."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]):
        """`options` are what numba was told about `function`."""
        self._function, self._options = function, options

    def lacks(self, signature: Any) -> bool:
        """Whether machine code for a signature could be kept, and is not."""
        name = self._name(signature)
        return name is not None and not folder().has(name)

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """The machine code for a signature, if it is kept."""
        target_context.refresh()
        name = self._name(sig)
        data = None if name is None else folder().read(name)
        if data is None:  # it is compiled now
            _forget_subroutines()
        return None if data is None else CompileResult._rebuild(target_context, *pickle.loads(data))

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Keeps the machine code for a signature, if another process can use it."""
        _forget_subroutines()
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
