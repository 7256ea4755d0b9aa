"""Physics that become nonsense end in an error, not in a robot that is back at its start."""

import pytest

from mjnav.world.engine import DivergedError
from mjnav.world.simulator import Simulator


@pytest.mark.parametrize("speed", [1e11, float("nan")])
def test_a_state_that_diverges_is_told_once_and_not_put_back(clutter, speed, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    simulator = Simulator(clutter(), 0)
    simulator.advance(0.5, (0.8, 0.0))
    simulator._engine.data.qvel[0] = speed
    with pytest.raises(DivergedError, match=r"^MuJoCo lost the physics before 0\.\d+ s: Nan, Inf or huge value in Q"):
        simulator.advance(0.1, (0.8, 0.0))
    assert not abs(simulator._engine.data.qpos).max() < 1e3
    with pytest.raises(DivergedError):
        simulator.advance(0.1, (0.8, 0.0))
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []  # MuJoCo's own MUJOCO_LOG.TXT
