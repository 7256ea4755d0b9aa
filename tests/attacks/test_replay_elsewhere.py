"""A replay on another code path of the same machine says so before it says that values differ."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

import mjnav


def test_a_replay_names_the_code_path_before_the_values(tmp_path):
    features = (np.show_config(mode="dicts") or {}).get("SIMD Extensions", {}).get("found", [])
    if not features:
        pytest.skip("NumPy uses no processor feature here that could be switched off")
    log = tmp_path / "a.mcap"
    mjnav.run(mjnav.load_scenario("crossing1", ["time_limit=0.5"]), log=log)
    done = subprocess.run(
        [sys.executable, "-m", "mjnav.cli.main", "replay", str(log), "--json"],
        env={**os.environ, "NPY_DISABLE_CPU_FEATURES": " ".join(features)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    found = json.loads(done.stdout)
    warning = f"the processor features that NumPy uses: without {' '.join(sorted(features))}"
    assert found["warnings"] == [warning]
    assert list(found).index("warnings") < list(found).index("identical") < list(found).index("first_difference")
    assert done.returncode == (0 if found["identical"] else 1)
