"""What every test shares: a kernel cache that cannot be stale, hypothesis without a clock, `--no-skips`, the default
limits.

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


def pytest_addoption(parser):
    parser.addoption("--no-skips", action="store_true", help="a test that skips fails and says what it misses")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(item):
    report = yield
    return _refused(report) if item.config.getoption("no_skips") else report


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_make_collect_report(collector):
    report = yield
    return _refused(report) if collector.config.getoption("no_skips") else report


def _refused(report):
    """A report of a skip as that of a failure; any other as it is. A failure that was expected is no skip."""
    if report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        path, line, reason = report.longrepr
        report.longrepr = f"{reason} (--no-skips; {path}:{line})"
    return report


@pytest.fixture
def bound_by_permissions():
    """Words before a command under which files' permissions hold for it, whoever runs the tests."""
    return ["setpriv", "--bounding-set=-dac_override"] if os.geteuid() == 0 else []


@pytest.fixture(scope="session")
def limits():
    from mjnav.messages import RobotLimits

    return RobotLimits()
