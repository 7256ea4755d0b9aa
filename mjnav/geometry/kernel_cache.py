"""Machine code of kernels on disk, one file for each kernel and the types of its arguments.

Numba's own cache checks the kernel's own file alone, and unpickles any file that it finds. This one identifies a kernel
by everything that is compiled into it (`kernel_code`), and reads only files that processes of this user wrote.
"""

# pyright: reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false
# numba's modules carry no types, and a cache that keeps nothing is typed as such.

import os
import pickle
from contextlib import AbstractContextManager, nullcontext
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import platformdirs
from numba.core import sigutils
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from mjnav.geometry.cache_folder import CacheFolder
from mjnav.geometry.kernel_code import code_digest, types_digest


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
