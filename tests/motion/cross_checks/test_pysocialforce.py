"""The social forces are those of PySocialForce (https://github.com/yuxiang-gao/PySocialForce).

It differs in one thing: it does not bring theta, the difference of two angles, back into (-pi, pi], and so misses
forces between people on either side of the negative x axis. Such pairs are left out. Its `ObstacleForce` samples walls
as points, which mjnav's have an exact distance from; it is not compared.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mjnav.motion.social_force import FORMS

HERE = Path(__file__).parent
ALONE = {"lookahead": 0.0, "obstacle_strength": 0.0, "cut": np.inf}


def angles_agree(position, velocity):
    """Whether no pair's theta leaves (-pi, pi] where it is not brought back."""
    way = position - position[:, None]
    to = 2.0 * (velocity[:, None] - velocity) + way / np.maximum(np.hypot(*way.T), 1e-9).T[..., None]
    theta = np.arctan2(to[..., 1], to[..., 0]) - np.arctan2(way[..., 1], way[..., 0])
    back = np.arctan2(-to[..., 1], -to[..., 0]) - np.arctan2(-way[..., 1], -way[..., 0])
    return (np.abs(theta) < np.pi).all() and (np.abs(back) < np.pi).all()


def small_cases():
    head_on = [[(-2.0, 0.1), (2.0, 0.0)], [(1.2, 0.0), (-1.2, 0.0)]]
    crossing = [[(-2.0, 0.2), (0.1, -2.0)], [(1.2, 0.0), (0.0, 1.2)]]
    four_way = [[(-2.0, 0.2), (0.1, -2.0), (2.0, 0.4), (0.5, 2.0)], [(1.2, 0.1), (0.0, 1.2), (-1.2, 0.0), (0.1, -1.0)]]
    cases = [tuple(np.array(part) for part in case) for case in (head_on, crossing, four_way)]
    rng = np.random.default_rng(0)
    return cases + [(rng.uniform(-2.0, 2.0, (n, 2)), rng.normal(0.0, 1.0, (n, 2))) for n in (2, 3) for _ in range(20)]


def test_both_forms_agree(tmp_path, people):
    cases = small_cases()
    done = subprocess.run(
        [sys.executable, HERE / "social_forces.py"],
        input=json.dumps([[part.tolist() for part in case] for case in cases]),
        cwd=tmp_path,  # where it writes its file.log
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},  # compiling takes longer than the forces
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    compared = 0
    for case, (moussaid, helbing) in zip(cases, json.loads(done.stdout), strict=True):
        some = people(*case)
        assert some.accelerations("helbing", **ALONE) == pytest.approx(np.array(helbing), rel=1e-4, abs=1e-6)
        if angles_agree(*case):
            found = some.accelerations("moussaid", **ALONE, drive=0.0)
            assert found / FORMS["moussaid"].strength == pytest.approx(np.array(moussaid), abs=1e-12)
            compared += 1
    assert compared > 15
