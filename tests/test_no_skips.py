"""`pytest --no-skips`: a test that skips, for whatever it misses, fails and says so."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
SKIPS = """
import pytest

@pytest.fixture
def display():
    pytest.skip("Xvfb is not installed")

def test_of_a_fixture(display):
    pass

@pytest.mark.skipif(True, reason="pdflatex is not installed")
def test_of_a_mark():
    pass

def test_within():
    pytest.importorskip("no_such_module", reason="the sweep extra is not installed")

@pytest.mark.xfail(reason="known", strict=True)
def test_known_to_fail():
    assert False

def test_that_passes():
    pass

def test_of_recordings(people_data):
    assert people_data.is_dir()
"""
WHOLE_FILE = """
import pytest
pytest.importorskip("no_such_module", reason="foxglove-sdk is not installed")
"""


@pytest.fixture
def suite(tmp_path):
    """A suite of six tests and a file that is skipped whole; calls pytest on it and returns exit code and output."""
    (tmp_path / "test_skips.py").write_text(SKIPS)
    (tmp_path / "test_whole_file.py").write_text(WHOLE_FILE)

    def call(*options: str, **variables: str) -> tuple[int, str]:
        command = [sys.executable, "-m", "pytest", "-p", "conftest", "-p", "no:cacheprovider", "-rfE", *options]
        environment = {**os.environ, "PYTHONPATH": str(TESTS), **variables}
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout

    return call


def test_with_the_switch_every_skip_fails_and_says_what_is_missing(suite):
    code, out = suite("--no-skips", "--continue-on-collection-errors", MJNAV_PEOPLE_DATA="")
    assert code == 1, out
    assert "1 failed, 1 passed, 1 deselected, 1 xfailed, 3 errors" in out
    for reason in (
        "Xvfb is not installed",
        "pdflatex is not installed",
        "the sweep extra is not installed",
        "foxglove-sdk is not installed",
    ):
        assert re.search(rf"Skipped: {reason} \(--no-skips; \S+test_\w+\.py:\d+\)", out), out


def test_tests_of_real_recordings_run_where_the_variable_names_their_folder(suite, tmp_path):
    code, out = suite("--no-skips", "-k", "recordings", "test_skips.py", MJNAV_PEOPLE_DATA=str(tmp_path))
    assert code == 0, out
    assert "1 passed" in out
