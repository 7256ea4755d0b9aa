"""The file of a log while it is written: it holds whole records, also after a disk error."""

import errno
import io
import os
from contextlib import suppress
from pathlib import Path


class LogFile(io.BufferedIOBase):
    """A new file, to which each call of `write` appends all of its bytes, whole MCAP records, or none.

    Nothing is buffered in the process, so that what was written outlives it. Raises FileExistsError where the file
    exists. Every `write` raises OSError where the disk refuses the bytes or the file was deleted or truncated: Linux
    would go on to write to a file without a name, or behind a hole.
    """

    def __init__(self, path: Path):
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115 - closed in close
        self._identity = _identity(os.fstat(self._file.fileno()))
        self._size = 0

    def writable(self) -> bool:
        """Always true."""
        return True

    def write(self, data, /) -> int:
        """Appends all of `data`, or raises OSError and leaves the file as it was."""
        rest = memoryview(data)
        if not rest.nbytes:
            return 0
        self._check()
        try:
            while rest.nbytes:
                rest = rest[self._file.write(rest) :]
        except OSError:
            with suppress(OSError):
                self._file.seek(self._size)
                self._file.truncate()
            raise
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """The number of bytes written."""
        return self._size

    def close(self) -> None:
        """Closes the file. Raises OSError where the system reports only now what it could not write."""
        try:
            if hasattr(self, "_file"):  # false where opening it failed
                self._file.close()
        except OSError as error:
            if error.errno != errno.EBADF:  # the descriptor was closed before
                raise
        finally:
            super().close()

    @property
    def exists(self) -> bool:
        """Whether the file still has a name, as far as is known."""
        state = self._state()
        return state is None or state.st_nlink > 0

    @property
    def whole(self) -> bool:
        """Whether the file still has all the bytes that were written."""
        state = self._state()
        return state is not None and state.st_size >= self._size

    def _state(self) -> os.stat_result | None:
        """None where the descriptor was closed; its number may belong to another file by now."""
        try:
            state = os.fstat(self._file.fileno())
        except OSError:
            return None
        return state if _identity(state) == self._identity else None

    def _check(self) -> None:
        if self._state() is None:
            raise OSError(errno.EBADF, "its descriptor was closed")
        if not self.exists:
            raise OSError(errno.ENOENT, "it was deleted")
        if not self.whole:
            raise OSError(errno.EIO, "it was truncated")


def _identity(state: os.stat_result) -> tuple[int, int]:
    return state.st_dev, state.st_ino
