"""What the tests of sweeps share."""

import subprocess
from contextlib import contextmanager

import pytest


@pytest.fixture
def small_disk(tmp_path):
    """A context in which a folder is a disk of so many bytes of its own."""

    @contextmanager
    def mounted(size: int):
        disk = tmp_path / "disk"
        disk.mkdir()
        mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(disk)]
        if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
            pytest.skip("no right to mount a small disk")
        try:
            yield disk
        finally:
            subprocess.run(["umount", str(disk)], check=True)

    return mounted
