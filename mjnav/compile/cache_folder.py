"""A private folder for files that can be made again: checked when read, written whole, deleted when old.

Anyone who can write machine code here runs code as its reader. So the folder must belong to the user and be writable by
nobody else. This is checked on the open folder, not on its path, and files are opened relative to it: neither a link
nor a rename leads elsewhere.
"""

import fcntl
import hashlib
import os
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

DAY = 86_400.0  # [s]
UNUSED = 30.0 * DAY  # [s] after which a file that no process read is deleted
UNFINISHED = DAY  # [s] after which a file that a killed process left half written is deleted
MAX_BYTES = 256_000_000  # of all files; the least recently used go first
POLL, PATIENCE = 0.02, 60.0  # [s] poll interval for a file that another process makes; the longest wait
_CHECKSUM = hashlib.sha256
_SUFFIX, _TEMPORARY, _LOCK = ".kernel", ".tmp", "lock"


class CacheFolder:
    """Files by name. Nothing raises: a file that cannot be read is None, and the first failure goes to stderr."""

    def __init__(self, path: Path):
        """`path` is created with its parents."""
        self._path = path
        self._told = self._swept = False
        self._folder: int | None = None
        try:
            self._folder = _open_private(path)
        except OSError as error:
            self._tell(f"kernels are compiled anew at every start: {path}: {error.strerror}")

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
        size = _CHECKSUM().digest_size
        if content[:size] != _checksum(name, content[size:]):
            with suppress(OSError):
                os.unlink(name + _SUFFIX, dir_fd=self._folder)
            self._tell(f"a damaged file was dropped and its kernel compiled anew: {self._path / (name + _SUFFIX)}")
            return None
        if time.time() - status.st_mtime > DAY:  # it is in use: the sweep of another process leaves it alone
            with suppress(OSError):
                os.utime(name + _SUFFIX, dir_fd=self._folder)
        return content[size:]

    def write(self, name: str, data: bytes) -> None:
        """Writes a file, whole or not at all, in place of an older one."""
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
            self._tell(f"kernels are compiled anew at every start: {self._path}: {error.strerror}")
            return
        if not self._swept:
            self._swept = True
            with suppress(OSError):
                _sweep(self._folder)

    @contextmanager
    def making(self, name: str) -> Iterator[None]:
        """Holds a lock while this process makes the file; waits, at most PATIENCE, while another makes it.

        The lock ends with the process that holds it, however that ends.
        """
        lock = self._locked(name)
        try:
            yield
        finally:
            if lock is not None:
                os.close(lock)

    def _locked(self, name: str) -> int | None:
        """The lock's descriptor; None where the file exists, or where no lock can be had."""
        if self._folder is None or self._exists(name):
            return None
        try:
            lock = os.open(_LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600, dir_fd=self._folder)
        except OSError:
            return None
        for _ in range(round(PATIENCE / POLL)):
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return lock
            except BlockingIOError:
                time.sleep(POLL)
            except OSError:  # a file system without locks
                break
            if self._exists(name):
                break
        os.close(lock)
        return None

    def _exists(self, name: str) -> bool:
        try:
            os.stat(name + _SUFFIX, dir_fd=self._folder)
        except OSError:
            return False
        return True

    def _tell(self, text: str) -> None:
        """One line on stderr, the first time: later failures have the same cause."""
        if not self._told and sys.stderr is not None:
            with suppress(OSError):
                print(f"mjnav: {text}", file=sys.stderr, flush=True)
        self._told = True


def _checksum(name: str, data: bytes) -> bytes:
    """Of name and data: a renamed file does not match."""
    return _CHECKSUM(name.encode() + b"\0" + data).digest()


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
        own = status.st_uid == os.geteuid()
        raise OSError(0, "others can write into it" if own else "it belongs to another user")
    return folder


def _is_private(status: os.stat_result) -> bool:
    return status.st_uid == os.geteuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _sweep(folder: int) -> None:
    """Deletes files that no process used for long, then the least recently used beyond MAX_BYTES."""
    now, kept = time.time(), []
    with os.scandir(folder) as entries:
        for entry in entries:
            status = entry.stat(follow_symlinks=False)
            limit = {_SUFFIX: UNUSED, _TEMPORARY: UNFINISHED}.get(os.path.splitext(entry.name)[1])
            if limit is not None and now - status.st_mtime > limit:
                _unlink(folder, entry.name)
            elif limit is not None:
                kept.append((status.st_mtime, status.st_size, entry.name))
    excess = sum(size for _, size, _ in kept) - MAX_BYTES
    for _, size, name in sorted(kept):
        if excess <= 0:
            break
        _unlink(folder, name)
        excess -= size


def _unlink(folder: int, name: str) -> None:
    with suppress(OSError):
        os.unlink(name, dir_fd=folder)
