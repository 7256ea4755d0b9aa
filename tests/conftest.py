"""What every test shares: its packages, hypothesis without a clock, `--no-skips`, the distribution over processes."""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

from tests.forking import around

settings.register_profile("mjnav", deadline=None, derandomize=True)
settings.load_profile("mjnav")


MAX_WORKERS = 4
ANEW = "MJNAV_TESTS_WITH_ALL_GROUPS"


def pytest_configure(config):
    """Where the packages that the tests need are not installed, uv installs them, and pytest starts anew."""
    if find_spec("importlinter") is not None:  # of the group `dev` alone
        return
    if "UV" not in os.environ or ANEW in os.environ:
        raise pytest.UsageError("the tests need the packages of the dependency group dev: uv run --group dev pytest")
    config.pluginmanager.getplugin("capturemanager").suspend_global_capture(in_=True)
    os.environ[ANEW] = "1"
    os.execvp(os.environ["UV"], ["uv", "run", "--group", "dev", "pytest", *config.invocation_params.args])


def pytest_xdist_auto_num_workers(config):
    """How many processes run the tests: one a CPU for the whole suite, pytest's own for given files and benchmarks."""
    whole = config.args_source is config.ArgsSource.TESTPATHS and not config.getoption("benchmark_enable")
    return min(len(os.sched_getaffinity(0)), MAX_WORKERS) if whole else 0


class ByFile(LoadScopeScheduling):
    """Keeps the tests of a file in one process, so that module fixtures are made once.

    Files with `pytestmark = pytest.mark.xdist_group("real time")` share one process, so that they run one after the
    other: their loops run under SCHED_FIFO on the same CPU, or they measure a busy CPU. The long tests of files with
    the group "each alone" share nothing, and each runs where there is room. pytest-xdist's own `loadgroup` ignores
    every mark under pytest 9.2, which no longer lets it rename tests.
    """

    def _split_scope(self, nodeid):
        file = nodeid.partition("::")[0]
        text = (self.config.rootpath / file).read_text(encoding="utf-8")
        scopes = {"real time": "real time", "each alone": nodeid}
        groups = (
            scope for group, scope in scopes.items() if f'pytestmark = pytest.mark.xdist_group("{group}")' in text
        )
        return next(groups, file)


def pytest_xdist_make_scheduler(config, log):
    return ByFile(config, log)


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
    return ["setpriv", "--bounding-set=-dac_override,-dac_read_search"] if os.geteuid() == 0 else []


@pytest.fixture(scope="session")
def fork_server(tmp_path_factory):
    """The socket of a process that starts `mjnav` commands as processes of their own, at once (`tests/forking`)."""
    with around.fork_server(tmp_path_factory.mktemp("server") / "socket") as server:
        yield server


@pytest.fixture(scope="session")
def forked(fork_server):
    """The words of a program that is `mjnav`, whose commands the fork server starts as processes of their own."""
    return [sys.executable, "-S", str(Path(__file__).parent / "forking" / "command.py"), fork_server]


@pytest.fixture(scope="session")
def limits():
    from mjnav.messages import RobotLimits

    return RobotLimits()
