"""`pytest --no-skips`: a test that skips, for whatever it misses, fails and says so."""

import os
import re
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parent
SKIPS = """
import pytest

@pytest.mark.skipif(True, reason="pdflatex is not installed")
def test_of_a_mark():
    pass

def test_within():
    pytest.importorskip("no_such_module", reason="the sweep extra is not installed")

def test_that_passes():
    pass
"""
WHOLE_FILE = """
import pytest
pytest.importorskip("no_such_module", reason="foxglove-sdk is not installed")
"""


def test_with_the_switch_every_skip_fails_and_says_what_is_missing(tmp_path):
    (tmp_path / "test_skips.py").write_text(SKIPS)
    (tmp_path / "test_whole_file.py").write_text(WHOLE_FILE)
    options = ["-p", "conftest", "-p", "no:cacheprovider", "-rfE", "--no-skips", "--continue-on-collection-errors"]
    command, environment = [sys.executable, "-m", "pytest", *options], {**os.environ, "PYTHONPATH": str(TESTS)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    out = done.stdout
    assert done.returncode == 1, out
    assert "1 failed, 1 passed, 2 errors" in out
    for reason in ("pdflatex is not installed", "the sweep extra is not installed", "foxglove-sdk is not installed"):
        assert re.search(rf"Skipped: {reason} \(--no-skips; \S+test_\w+\.py:\d+\)", out), out
