"""What every test shares: a kernel cache that cannot be stale, hypothesis without a clock, and the default limits.

Numba caches machine code by the time stamp of the file that holds the kernel. A scalar function compiled into a kernel
of another file changes without that stamp, and the old code would pass the tests. So each state of the sources has a
cache folder of its own, and it is named before mjnav (and with it numba) is imported, here and in any subprocess.
"""

import hashlib
import os
import tempfile
from pathlib import Path

import pytest
from hypothesis import settings

PACKAGE = Path(__file__).parents[1] / "mjnav"


def _kernel_cache() -> Path:
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        source = path.read_bytes()
        if b"numba" in source or b"compiled import" in source:
            digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + source + b"\0")
    return Path(tempfile.gettempdir()) / f"mjnav-kernels-{os.getuid()}-{digest.hexdigest()[:16]}"


os.environ["NUMBA_CACHE_DIR"] = str(_kernel_cache())

settings.register_profile("mjnav", deadline=None, derandomize=True)
settings.load_profile("mjnav")


@pytest.fixture(scope="session")
def limits():
    from mjnav.messages import RobotLimits

    return RobotLimits()
