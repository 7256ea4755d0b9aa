"""The file of a log while it is written: it holds whole records, whatever becomes of the disk."""

import errno
import io
import os
from contextlib import suppress
from pathlib import Path


class LogFile(io.BufferedIOBase):
    """A new file that takes bytes whole or not at all; each call's are whole MCAP records.

    Nothing waits in a buffer: what was written is the system's, and outlives the process. Raises FileExistsError where
    there is a file, and OSError from then on for what the disk refuses, and where somebody deletes the file or cuts it
    short: Linux itself would write on to a file that nobody can open any more, or behind a hole.
    """

    def __init__(self, path: Path):
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115 - closed in close
        self._identity = _identity(os.fstat(self._file.fileno()))
        self._size = 0

    def writable(self) -> bool:
        """It is."""
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
        """How much was written."""
        return self._size

    def close(self) -> None:
        """Closes the file. Raises OSError where the system only now says what it could not write."""
        try:
            if hasattr(self, "_file"):  # else it could not be opened, and this is the end of an object half made
                self._file.close()
        except OSError as error:
            if error.errno != errno.EBADF:  # somebody closed it before
                raise
        finally:
            super().close()

    @property
    def exists(self) -> bool:
        """Whether it can still be opened by some name, as far as is known."""
        state = self._state()
        return state is None or state.st_nlink > 0

    @property
    def whole(self) -> bool:
        """Whether all that was written is still there."""
        state = self._state()
        return state is not None and state.st_size >= self._size

    def _state(self) -> os.stat_result | None:
        """None where somebody closed the descriptor, whose number may by now be another file's."""
        try:
            state = os.fstat(self._file.fileno())
        except OSError:
            return None
        return state if _identity(state) == self._identity else None

    def _check(self) -> None:
        if self._state() is None:
            raise OSError(errno.EBADF, "somebody closed it")
        if not self.exists:
            raise OSError(errno.ENOENT, "somebody deleted it")
        if not self.whole:
            raise OSError(errno.EIO, "somebody cut it short")


def _identity(state: os.stat_result) -> tuple[int, int]:
    return state.st_dev, state.st_ino
